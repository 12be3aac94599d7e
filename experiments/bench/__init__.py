"""The core of `rigdda` and other rigid-body engines side by side: error against processor time."""
