"""Replays: runs and episodes as files for the Rerun viewer."""
