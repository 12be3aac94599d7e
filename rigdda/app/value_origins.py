"""Origins of the values of a site file, as the comments in front of the values give them."""

from __future__ import annotations

import re

SURVEYED = "surveyed"
GIVEN = "given"
PLACEHOLDER = "placeholder: replace"
CHECK_DEFAULT = "default: check"
"""Origins of values."""


def placeholders(text: str) -> list[str]:
    """Return the values of a site file that are marked as placeholders, such as "slope.toe".

    Templates of tables that are not used do not count.
    """
    found, table, marked = [], "", False
    for line in text.splitlines():
        if re.match(r"#\s*#", line):
            continue
        if head := re.fullmatch(r"\[+([^\[\]]+)\]+", line.strip()):
            table, marked = head[1], False
        elif line.startswith("#"):
            marked = marked or line.endswith(f"{PLACEHOLDER}.")
        elif marked and (key := re.match(r"([\w-]+)\s*=", line)):
            found.append(f"{table}.{key[1]}" if table else key[1])
            marked = False
    return found


def accepted(text: str) -> str:
    """Return the text of a site file in which the placeholders are marked as given values."""
    lines = text.split("\n")
    return "\n".join(given(line) if re.match(r"#(?!\s*#)", line) else line for line in lines)


def given(comment: str) -> str:
    """Return the comment of a placeholder as that of a given value."""
    end = f"{PLACEHOLDER}."
    return comment.removesuffix(end) + f"{GIVEN}." if comment.endswith(end) else comment
