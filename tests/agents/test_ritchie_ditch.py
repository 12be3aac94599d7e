"""Ritchie's chart for the slopes of sites."""

from __future__ import annotations

import pytest

from rigdda import Ditch, Site
from rigdda.envs.ritchie_ditch import CHART, RitchieDitch


def test_the_ditch_widens_with_the_height(site: Site) -> None:
    found = RitchieDitch.of(site)
    assert (found.width, found.depth) in ((4.6, 1.8), (6.1, 1.8))


def test_the_inclination_is_that_of_the_cut_not_of_the_plateau_above_it() -> None:
    """`bench` falls at 59 degrees from its crest, 48 from the far end of its plateau."""
    found = RitchieDitch.of(Site.load("bench"))
    assert found.inclination == pytest.approx(59.0, abs=1.0)
    assert (found.width, found.depth) == (7.6, 2.7)


def test_slopes_beyond_the_chart_are_marked() -> None:
    talus = RitchieDitch.of(Site.load("talus"))
    assert "outside the range of the chart" in talus.caveat
    assert RitchieDitch(15.0, 63.0, 4.6, 1.8).caveat == ""
    assert "height 60 m" in RitchieDitch(60.0, 63.0, 7.6, 2.7).caveat
    assert "inclination 30 deg" in RitchieDitch(15.0, 30.0, 3.7, 1.5).caveat


def test_only_a_ditch_as_large_bears_the_name() -> None:
    one = RitchieDitch(15.0, 63.0, 4.6, 1.8)
    assert one.name_of(Ditch(0.0, 1.8, 4.6)) == "Ritchie ditch"
    assert one.name_of(Ditch(0.0, 1.5, 4.6)) == "ditch"


def test_the_chart_never_asks_less_for_a_higher_cut() -> None:
    for row in CHART.values():
        assert [*row] == sorted(row)
