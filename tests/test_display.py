"""Objects show themselves in a notebook: pictures are PNGs, tables hold the figures."""

from __future__ import annotations

import base64
import io
import math
import re

import numpy as np
import pytest
from PIL import Image

from rigdda import BadInput, Ditch, Embankment, Fence, Run, Site, display, release
from rigdda.agents import constant
from rigdda.envs import DesignProblem, Targets
from rigdda.envs.rendering import picture

LAYOUT = (Fence(17.0, 3.0, energy_class=1000), Ditch(30.3, 1.0, 3.0))


@pytest.fixture(scope="module")
def site() -> Site:
    return Site.load("quick")


@pytest.fixture(scope="module")
def run(site: Site) -> Run:
    return release(site, LAYOUT, seed=1, event="block")[0]


def pixels(png: bytes) -> np.ndarray:
    """Return a PNG as an (h, w, 3) array."""
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)


def amount(png: bytes, colour: str) -> int:
    """Return how many pixels of a picture have nearly a colour."""
    wanted = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
    return int((np.abs(pixels(png) - wanted).max(axis=2) < 12).sum())


def test_a_site_shows_its_road_zone_and_sources(site: Site) -> None:
    picture = site._repr_png_()
    assert pixels(picture).shape[1] == 800
    assert all(amount(picture, c) > 100 for c in (display.ROAD, display.ZONE, "#000000"))
    assert amount(picture, display.BARRIER) == 0


@pytest.mark.parametrize("name", ["toppling", "verge", "bench"])
def test_sources_of_every_kind_are_drawn(name: str) -> None:
    section = Site.load(name).section()
    assert section.sources
    assert all(corners.shape[1] == 2 and len(corners) >= 2 for corners in section.sources)


def test_a_name_with_signs_of_dollars_is_drawn_as_it_is(site: Site, run: Run) -> None:
    """Between two of them, matplotlib would read a formula, and \\frac alone is none."""
    name = r"cut $\frac$"
    assert display.png(site.section(), name)
    assert picture(run, site, LAYOUT, name).any()


def test_a_section_holds_the_barriers_of_a_layout(site: Site) -> None:
    fence, ditch = site.section(LAYOUT).barriers
    assert fence.filled and "1000 kJ" in fence.label
    assert np.isclose(fence.corners[:, 0].min(), 17.0)
    assert not ditch.filled
    assert np.isclose(np.ptp(ditch.corners[:, 0]), 3.0, atol=0.1)
    with pytest.raises(BadInput):
        site.section((Embankment(500.0, 2.0),))


def test_the_ground_between_two_chainages_has_both_ends(site: Site) -> None:
    (x0, y0), (x1, y1), *_ = site.slope.points[1:]
    found = site.ground_between(0.5 * (x0 + x1), x1 + 1e-9)
    assert np.allclose(found[:2], [[0.5 * (x0 + x1), 0.5 * (y0 + y1)], [x1, y1]])
    assert len(found) == 3


def test_a_run_shows_where_its_blocks_end(run: Run) -> None:
    picture = run._repr_png_()
    assert amount(picture, display.ROCK) > 10
    assert amount(picture, display.BARRIER) > 50


def test_corners_of_a_block_turn_with_its_pose(run: Run) -> None:
    assert np.allclose(run.corners(0, 0), run.scene.blocks[0].vertices)
    end = run.corners(0)
    assert np.allclose(end.mean(axis=0), run.poses[-1, 0, :2], atol=1.0)
    sides = [np.hypot(*(np.roll(c, 1, axis=0) - c).T) for c in (run.corners(0, 0), end)]
    assert np.allclose(*sides)


def test_an_evaluation_shows_its_figures(site: Site) -> None:
    problem = DesignProblem(site, targets=Targets(reach=0.9))
    found = problem.evaluate(LAYOUT[:1], range(12))
    page = found._repr_html_()
    assert f"{found.objective:,.1f}" in page
    low, high = math.floor(10.0 * found.ci[0]) / 10.0, math.ceil(10.0 * found.ci[1]) / 10.0
    assert f"{low:,.1f} to {high:,.1f}" in page  # rounded outward
    assert "fence at 17.0 m" in page and found.targets in page
    assert page.count("reaches the road") == len(site.events)


def test_the_result_of_a_design_shows_its_layout(site: Site) -> None:
    result = constant.design(DesignProblem(site), 60)
    page = result._repr_html_()
    (data,) = re.findall(r'src="data:image/png;base64,([^"]+)"', page)
    assert amount(base64.b64decode(data), display.BARRIER) > 20
    assert result.evaluation._repr_html_() in page


def test_a_table_escapes_its_words() -> None:
    page = display.table(("", "a<b"), [("x & y", "1")])
    assert "a&lt;b" in page and "<th>x &amp; y</th><td>1</td>" in page
