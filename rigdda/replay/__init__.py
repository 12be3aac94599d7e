"""Replays: runs and episodes as files of the rerun viewer."""
