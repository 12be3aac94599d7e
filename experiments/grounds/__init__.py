"""Grounds of the library against three field cases."""
