"""Processor time for a correct outcome: this core, other engines and the lumped-mass model."""
