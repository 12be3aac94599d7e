"""What the page knows of a layout: its outcomes so far and the figures computed from them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from rigdda import Layout, Outcome

if TYPE_CHECKING:
    from rigdda.app.barrier_checks import LayoutChecks

NOTHING, CURRENT = "without it", "layout"
"""Names of the two layouts of a study of the page."""

MOST_BARRIERS = 8
"""Greatest number of barriers of a layout on the page."""

Outcomes = dict[str, list[Outcome]]
"""Outcomes of the releases with seeds 0, 1, 2, ... of each event."""


class LiveFigures(NamedTuple):
    """What is known of a layout."""

    layout: Layout
    releases: int
    """Releases of each event that the figures are of; 0 before the first round has ended."""
    costs: Mapping[str, Any] | None = None
    """Z and its parts, a row of layouts.csv of the study."""
    events: tuple[Mapping[str, Any], ...] = ()
    """The rows of events.csv of the study for this layout."""
    bare: Mapping[str, Any] | None = None
    """Z and its parts without the layout."""
    individual: tuple[float, float, float] | None = None
    """Individual risk with its interval [1/year]; None without traffic."""
    checks: LayoutChecks | None = None
    broken: tuple[str, ...] = ()
    """Siting rules that the layout breaks, with the reason."""
    fault: str = ""
    """Why the layout cannot stand or has no price; empty if nothing is wrong with it."""
    error: str = ""
    """Why the figures could not be computed, if the layout is not the reason; otherwise empty."""
    notes: tuple[str, ...] = ()
    """How the rates of events were converted from those of arrivals."""
    doing: str = ""
    """What is being computed; empty if nothing is."""
