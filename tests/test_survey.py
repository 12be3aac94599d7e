"""Profiles as surveys have them, and the site files that are made of them."""

from __future__ import annotations

import json
import math
import warnings
from pathlib import Path

import jsonschema
import msgspec
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rigdda import BadInput, Site
from rigdda.agents import new_site
from rigdda.agents.new_site import SiteRequest, compose
from rigdda.model.grounds import GROUNDS
from rigdda.model.survey import Survey, parse_table, profile_of
from rigdda.sites.schema import schema

TALUS = ((0.0, 92.0), (10.0, 90.0), (22.0, 60.0), (72.0, 20.0), (94.0, 6.0), (104.0, 4.5),
         (112.0, 4.0), (121.0, 4.0), (161.0, 0.0))  # fmt: skip
ROAD = (112.0, 121.0)


def table(points, head="chainage,elevation", separator=",", decimal=".") -> str:
    rows = [separator.join(f"{v:.3f}".replace(".", decimal) for v in point) for point in points]
    return "\n".join([*([head] if head else []), *rows, ""])


def survey_file(folder: Path, text: str, name: str = "survey.csv") -> Path:
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file


def loaded(text: str, name: str = "made") -> Site:
    """Return the site of a text, which neither the reader nor the schema finds doubtful."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        site = Site.parse(text, name)
    jsonschema.validate(msgspec.toml.decode(text), json.loads(json.dumps(schema("site"))))
    return site


HEADS = ("chainage,elevation", "x,y", "x,z", "Station [m],Level [m]", "Distance (m),Height (m)",
         "chainage_m,elev_m", "S,RL", "sta,alt")  # fmt: skip
FORMS = ((",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ","), (" ", "."), (" ", ","))


@st.composite
def slopes(draw):
    """Return corners from a crest downhill to far beyond a road, and the road [m]."""
    count = draw(st.integers(2, 12))
    step = st.floats(2.0, 20.0)
    runs = [draw(step) for _ in range(count)]
    drops = [draw(step) for _ in range(count)]
    x = np.concatenate([[0.0], np.cumsum(runs)])
    y = np.concatenate([[0.0], -np.cumsum(drops)])
    toe = x[-1]
    foot = draw(st.floats(5.0, 20.0))
    x = np.concatenate([x, toe + np.array([foot, foot + 8.0, foot + 40.0])])
    y = np.concatenate([y, y[-1] - np.array([0.1, 0.1, 1.0])])
    return np.column_stack([x, y]).round(3), (toe + foot, toe + foot + 8.0)


@settings(
    deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    slope=slopes(),
    form=st.sampled_from(FORMS),
    head=st.sampled_from(HEADS),
    chainage=st.sampled_from((0.0, -40.0, 12_345.0, 2_683_412.25)),
    elevation=st.sampled_from((0.0, 300.0, 1_832.5)),
    mirrored=st.booleans(),
    backward=st.booleans(),
    repeats=st.integers(0, 3),
)
def test_the_profile_of_a_site_is_that_of_its_survey(
    slope, form, head, chainage, elevation, mirrored, backward, repeats, tmp_path
):
    points, road = slope
    sign = -1.0 if mirrored else 1.0
    surveyed = points * [sign, 1.0] + [chainage, elevation]
    asked = tuple(sign * np.array(road) + chainage)
    listed = np.concatenate([np.repeat(surveyed[:1], repeats, axis=0), surveyed])
    listed = listed[::-1] if backward else listed
    separator, decimal = form
    columns = head.replace(",", separator)
    if separator == " ":  # names without units: a space ends a name
        columns = "x y"
    text = table(listed, columns, separator, decimal)
    file = survey_file(tmp_path, text, "round trip.txt")
    written, _ = compose("made", file, SiteRequest(road=asked))
    site = loaded(written)
    given_back = [
        (site.origin.chainage_of(x), y + site.origin.elevation) for x, y in site.slope.points
    ]
    assert np.abs(np.array(given_back) - surveyed).max() < 1e-3
    assert np.abs(np.array(site.slope.points)).max() < 1500.0
    ends = sorted(map(site.origin.chainage_of, (site.road.start, site.road.end)))
    assert ends == pytest.approx(sorted(asked), abs=1e-3)
    assert site.origin.reversed == mirrored
    site.save(tmp_path / "saved.toml")
    assert Site.load(tmp_path / "saved.toml") == site


@pytest.mark.parametrize(
    "text",
    [
        "92 90\n".replace("92 90", "0 92\n10 90\n120 3\n160 0"),
        "# surveyed in May\n\nx,y\n0,92\n\n10,90\n120,3\n160,0\n\n",
        "\ufeffChainage;Elevation\r\n0;92\r\n10;90\r\n120;3\r\n160;0\r\n".lstrip("\ufeff"),
        '"x","y"\n"0","92"\n"10","90"\n"120","3"\n"160","0"\n',
        "point,chainage,code,elevation\n1,0,top,92\n2,10,edge,90\n3,120,road,3\n4,160,end,0\n",
        "0,92,top\n10,90,edge\n120,3,road\n160,0,end\n",
        "z,x\n92,0\n90,10\n3,120\n0,160\n",
        "x;y\n0,0;9,2e1\n1e1;90\n+120;3,0\n160;0\n",
    ],
)
def test_tables_as_programs_write_them(text):
    points = parse_table("survey.csv", text).points
    assert points.tolist() == [[0.0, 92.0], [10.0, 90.0], [120.0, 3.0], [160.0, 0.0]]


def test_plan_coordinates_become_chainage_and_are_kept():
    turn, start = math.radians(30.0), np.array([2_600_000.0, 1_200_000.0])
    along = np.array([0.0, 20.0, 60.0, 120.0])
    east, north = start[:, None] + np.outer([math.sin(turn), math.cos(turn)], along)
    level = [1_500.0, 1_480.0, 1_410.0, 1_409.0]
    rows = [f"{e:.4f},{n:.4f},{z}" for e, n, z in zip(east, north, level, strict=True)]
    for head in ("easting,northing,elevation", "x,y,z", "E,N,H"):
        survey = parse_table("survey.csv", "\n".join([head, *rows]))
        profile = profile_of("survey.csv", survey)
        assert np.abs(profile.points[:, 0] - along).max() < 1e-3
        assert (profile.points[:, 1] + profile.origin.elevation).tolist() == level
        assert profile.origin.azimuth_deg == pytest.approx(30.0, abs=1e-3)
        assert profile.origin.easting == pytest.approx(start[0], abs=1e-3)
        assert profile.origin.northing == pytest.approx(start[1], abs=1e-3)
        uphill = parse_table("survey.csv", "\n".join([head, *rows[::-1]]))
        turned = profile_of("survey.csv", uphill)
        assert np.abs(turned.points - profile.points).max() < 1e-3
        assert turned.origin.azimuth_deg == pytest.approx(30.0, abs=1e-3)
        assert turned.origin.easting == pytest.approx(start[0], abs=1e-3)


def test_doubts_about_a_survey_are_told():
    points = np.array([(0.0, 50.0), (0.0, 50.0), (10.0, 48.0), (9.0, 30.0), (9.0004, 29.9996),
                       (40.0, 0.0), (90.0, -1.0)])  # fmt: skip
    notes = " ".join(profile_of("survey.csv", Survey(points)).notes)
    assert "repeated points were dropped: 1" in notes
    assert "overhangs at x = 10" in notes
    assert "nearer to each other than 1 mm at x = 9" in notes


def test_ground_that_overhangs_gives_a_site(tmp_path):
    points = [(0, 50), (10, 48), (9, 30), (30, 10), (40, 9), (47, 9), (90, 8)]
    text, profile = compose(
        "over", survey_file(tmp_path, table(points)), SiteRequest(road=(40, 47))
    )
    site = loaded(text)
    assert len(site.slope.points) == 7 and any("overhangs" in note for note in profile.notes)
    assert site.realise().blocks


def test_grounds_sources_and_zone_are_where_they_were_given(tmp_path):
    grid = np.add(TALUS, [2_683_400.0, 1_800.0])
    request = SiteRequest(
        road=(2_683_512.0, 2_683_521.0),
        toe=2_683_494.0,
        zone=(2_683_480.0, 2_683_511.0),
        grounds=("talus:2683422-2683490", "meadow:2683490-2683512", "weathered rock"),
        sources=("upper cliff:2683412-2683418", "talus:2683430-2683440"),
    )
    text, _ = compose("grid", survey_file(tmp_path, table(grid)), request)
    site = loaded(text)
    assert site.slope.toe == 94.0
    assert (site.barrier_zone.start, site.barrier_zone.end) == (80.0, 111.0)
    assert [source.band for source in site.sources] == [(12.0, 18.0), (30.0, 40.0)]
    assert [event.source for event in site.events] == ["upper cliff", "talus"]
    found = [(x, site.surface_at(x)) for x in (5.0, 30.0, 100.0, 115.0, 140.0)]
    assert found == [(5.0, "weathered_rock"), (30.0, "talus"), (100.0, "meadow"),
                     (115.0, "asphalt"), (140.0, "weathered_rock")]  # fmt: skip
    assert site.surfaces["talus"].friction_deg == GROUNDS["coarse_talus"].friction_deg.typical
    assert site.realise(seed=3).blocks


def test_each_value_is_commented_with_its_unit_and_how_sure_it_is(tmp_path):
    text, _ = compose("made", survey_file(tmp_path, table(TALUS)), SiteRequest(road=ROAD))
    lines = text.splitlines()
    words = (new_site.SURVEYED, new_site.GIVEN, new_site.PLACEHOLDER, new_site.DEFAULT)
    ends = tuple(f"{word}." for word in words)
    keys = [k for k, line in enumerate(lines) if " = " in line and line[0].islower()]
    assert len(keys) >= 60
    for k in keys:
        assert lines[k - 1].startswith("# ") and lines[k - 1].endswith(ends), lines[k - 1]
    before = {lines[k].partition(" = ")[0]: lines[k - 1] for k in reversed(keys)}  # the first
    assert "[m]" in before["toe"] and "[kg/m3]" in before["density"] and "[m3]" in before["volume"]
    assert before["points"].endswith(f"; {new_site.SURVEYED}.")
    assert before["volume"].endswith(f"; {new_site.PLACEHOLDER}.")
    tables = {line for line in lines if line.startswith("[")}
    assert {"[slope]", "[road]", "[barrier_zone]", "[[sources]]", "[[events]]", "[prices]"} < tables


def test_ground_that_ends_close_beyond_the_road_is_not_extended(tmp_path):
    short = [*TALUS[:-1], (140.0, 3.0)]
    with pytest.raises(BadInput) as caught:
        compose("short", survey_file(tmp_path, table(short)), SiteRequest(road=ROAD))
    assert caught.value.field == "--profile" and "140" in str(caught.value)
    assert "add the point 151, 2.42105" in caught.value.mend
    text, _ = compose(
        "long", survey_file(tmp_path, table([*short, (151.0, 2.42105)])), SiteRequest(ROAD)
    )
    assert loaded(text).slope.points[-1] == (151.0, 2.421)
