"""Benchmark of the core of `rigdda` and other rigid-body engines: error and processor time."""
