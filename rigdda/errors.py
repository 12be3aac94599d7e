"""Errors and warnings of the package. Error messages name the field, the value and the remedy."""

from __future__ import annotations

from typing import Any


class Error(Exception):
    """Base class of all errors that this package raises."""


class BadInput(Error, ValueError):
    """Invalid input, reported before any computation.

    Parameters
    ----------
    field : str
        Path of the invalid field, for example ``block 3: vertices``.
    value : object
        The value of the field.
    hint : str
        What to write instead.
    """

    def __init__(self, field: str, value: object, hint: str):
        super().__init__(field, value, hint)
        self.field, self.value, self.hint = field, value, hint

    def __str__(self) -> str:
        field, text = " ".join(self.field.split()), repr(self.value).replace("\n", " ")
        return f"{field} = {text if len(text) <= 120 else text[:117] + '...'}: {self.hint}"


class Diverged(Error, RuntimeError):
    """A simulation stopped because its velocities diverged.

    Attributes
    ----------
    run : Run or None
        The frames recorded before the divergence.
    """

    def __init__(self, message: str, run: Any = None):
        super().__init__(message)
        self.run = run


class SoftContacts(UserWarning):
    """A result depends on contacts whose penalty stiffness is too small for their load."""


class DoubtfulInput(UserWarning):
    """Input that is valid but probably unintended; the message names the field and the remedy."""
