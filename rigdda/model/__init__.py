"""Descriptions of mechanical problems: scenes of blocks and barriers, and sites with their data."""
