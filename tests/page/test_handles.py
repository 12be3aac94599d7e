"""What is dragged on the section, and what it changes in the site file."""

import pytest

from rigdda import Site, sites
from rigdda.app.page import edits
from rigdda.app.page.handles import handles


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
