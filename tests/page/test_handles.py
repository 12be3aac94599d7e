"""What is dragged on the section, and what it changes in the site file."""

import types

import pytest

pytest.importorskip("panel", reason="the extra page is not installed")

from rigdda import Site, sites
from rigdda.app.page import edits
from rigdda.app.page.handles import handles
from rigdda.app.page.section import HandleSource


def test_stretches_that_touch_have_one_handle_that_moves_both():
    text, site = sites.text("verge"), Site.load("verge")
    found = {one.words: one for one in handles(site)}
    assert {"start of soil", "soil to asphalt", "asphalt to soil", "end of soil"} <= set(found)
    moved = found["soil to asphalt"].moved(12.504)
    assert moved == {("slope", "surfaces", 0, "end"): 12.5, ("slope", "surfaces", 1, "start"): 12.5}
    changed = Site.parse(edits.with_values(text, moved), "site.toml")
    assert [(s.start, s.end) for s in changed.slope.surfaces][:2] == [(5.0, 12.5), (12.5, 21.0)]


@pytest.mark.parametrize("name", ["quick", "verge", "cliff", "talus"])
def test_every_handle_is_at_its_chainage_and_none_covers_another(name):
    text, site = sites.text(name), Site.load(name)
    found = handles(site)
    for one in found:
        same = edits.with_values(text, dict.fromkeys(one.paths, one.x))
        assert Site.parse(same, "site.toml").slope == site.slope
    grounds = {(one.x, one.y) for one in found if one.paths[0][:2] == ("slope", "surfaces")}
    others = {(one.x, one.y) for one in found if one.paths[0][:2] != ("slope", "surfaces")}
    assert not grounds & others


class Plot:
    """A plot of which only the beginning of a pan is needed."""

    def on_event(self, _, do):
        self.begin = lambda x, y: do(types.SimpleNamespace(x=x, y=y))


def _source(*places):
    plot, seen = Plot(), []
    source = HandleSource(plot, lambda *moved: seen.append(moved))
    source.show({"x": [x for x, _ in places], "y": [y for _, y in places]})
    return plot, source, seen


def _returned(source, *places):
    """Let the browser return positions, based on those that it has."""
    given = source.source.data["given"]
    source._changed({"x": [p[0] for p in places], "y": [p[1] for p in places], "given": given})


def test_of_handles_that_overlap_the_one_where_the_pan_began_is_dragged():
    plot, source, seen = _source((10.0, 2.0), (10.4, 2.1), (30.0, 0.0))
    plot.begin(10.3, 2.1)
    _returned(source, (15.0, 2.0), (15.4, 2.1), (30.0, 0.0))
    assert seen == [(1, 15.4, 2.1)]


def test_what_the_browser_returns_without_a_drag_is_none():
    _, source, seen = _source((10.0, 2.0))
    _returned(source, (10.0, 2.0))
    before = source.source.data["given"]
    source.show({"x": [12.0], "y": [1.8]})
    source._changed({"x": [10.0], "y": [2.0], "given": before})  # it has not drawn the new one
    source.show({"x": [12.0, 20.0], "y": [1.8, 1.0]})
    source._changed({"x": [11.0], "y": [2.0], "given": before})  # of other handles
    assert seen == []


def test_a_drag_back_to_where_a_handle_was_before_counts():
    _, source, seen = _source((10.0, 2.0))
    source.show({"x": [11.0], "y": [2.0]})
    _returned(source, (10.0, 2.0))
    assert seen == [(0, 10.0, 2.0)]
