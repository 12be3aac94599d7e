"""Repeated rockfall tests at Tschamut: fit to some runs and prediction of the others."""
