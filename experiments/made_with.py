"""Mechanics and networks with which the rows of studies of designers were made."""

from __future__ import annotations

import csv
import hashlib
from pathlib import Path

from rigdda import MECHANICS
from rigdda.agents.designers import policy
from rigdda.agents.designers.forecast import NETWORK_FILE


def hash_of(path: Path) -> str:
    """Return a hash of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


VALUE_NETWORK = hash_of(NETWORK_FILE)
"""Hash of the value network that ships."""

MADE_WITH = {
    "mechanics": MECHANICS,
    "value_network": VALUE_NETWORK,
    "policy": hash_of(policy.SHIPPED),
}
"""Columns by name."""


def resumed(path: Path) -> list[dict[str, str]]:
    """Return the rows of an earlier run that were made with the present mechanics and networks."""
    if not path.is_file():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return [row for row in csv.DictReader(file) if MADE_WITH.items() <= row.items()]
