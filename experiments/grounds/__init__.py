"""Grounds of the library compared with three field cases."""
