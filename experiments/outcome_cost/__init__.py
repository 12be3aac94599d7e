"""Processor time of a right outcome: this core, other engines and the lumped mass."""
