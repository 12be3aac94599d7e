"""Errors raised on purpose. Every message names the field, the value and the mend."""

from __future__ import annotations

from typing import Any


class Error(Exception):
    """Base of every error this package raises on purpose."""


class BadInput(Error, ValueError):
    """Something a user wrote is wrong; raised before any computing.

    Parameters
    ----------
    field : str
        Path of the offending field, for example ``block 3: vertices``.
    value : object
        What was found there.
    mend : str
        What to write instead.
    """

    def __init__(self, field: str, value: object, mend: str):
        super().__init__(field, value, mend)
        self.field, self.value, self.mend = field, value, mend

    def __str__(self) -> str:
        text = repr(self.value).replace("\n", " ")
        return f"{self.field} = {text if len(text) <= 120 else text[:117] + '...'}: {self.mend}"


class Diverged(Error, RuntimeError):
    """A simulation stopped because its numbers went bad.

    Attributes
    ----------
    run : Run or None
        What was recorded up to the last sound frame.
    """

    def __init__(self, message: str, run: Any = None):
        super().__init__(message)
        self.run = run


class SoftContacts(UserWarning):
    """A result leans on contacts whose penalty stiffness is too small for the load they carry."""


class DoubtfulInput(UserWarning):
    """Something a user wrote is allowed and hardly meant; the message names field and mend."""
