"""Scenes that break contact mechanics, swept over the step: which hold, which refuse."""
