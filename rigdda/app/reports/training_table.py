"""Table of a training: the policy beside simple rules, with intervals over the sites."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rigdda.agents.training import Compared, relative
from rigdda.app.reports.tables import empty_table
from rigdda.envs.intervals import student_interval

if TYPE_CHECKING:
    from rich.table import Table

HEAD = "Z over Z without barriers on validation sites, on fresh releases (95 % over the sites)"


def table(rows: Sequence[Compared]) -> Table:
    """Return the table of the methods.

    "policy minus it" is the mean of the paired differences over the sites; it is negative if the
    policy is ahead.
    """
    out = empty_table(("method", "sites", "Z / Z without", "policy minus it"))
    policy = relative(rows, "policy")
    for method in dict.fromkeys(row.method for row in rows):
        own = relative(rows, method)
        apart = "-" if method == "policy" else _with_interval(policy - own)
        out.add_row(method, str(len(own)), _with_interval(own), apart)
    return out


def _with_interval(values: NDArray[np.float64]) -> str:
    """Return the mean over sites with its 95 % interval, which one site does not have."""
    low, high = student_interval(values)
    words = f" ({low:.3f} to {high:.3f})" if np.isfinite(low) else ""
    return f"{values.mean():.3f}{words}"
