"""Repeated rockfall tests at Tschamut: a fit on some runs, and what it predicts of others."""
