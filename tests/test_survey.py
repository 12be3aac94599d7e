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
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rigdda import BadInput, Site
from rigdda.app import new_site
from rigdda.app.new_site import SiteRequest, compose
from rigdda.geometry import polygon_properties
from rigdda.ground.grounds import GROUNDS
from rigdda.model.survey import Survey, parse_table, profile_of, read_survey, spikes
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
        "x,y,remark\n0,92,top\n10,90,\n120,3\n160,0,end\n",  # rows without a remark
        "x,y\n0,92,\n10,90,\n120,3,\n160,0,\n",
        "0,92\n10,90,edge\n120,3,\n160,0\n",
        "0 92\n10 90 upper edge\n120 3\n160 0\n",
        "x;y;code\n0;92\n10;90;7\n120;3;\n160;0\n",
        "code\tx\ty\tdip\n\t0\t92\t\n2\t10\t90\t\n\t120\t3\t25\n4\t160\t0\t\n",
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
    (event,) = site.events  # its one block is as wide as the root of its area, not a strip of 10 m
    area = abs(polygon_properties(np.array(site.sources[0].blocks[0]))[0])
    assert event.width == pytest.approx(math.sqrt(area), abs=0.01)


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


def test_a_point_beside_an_outlier_is_not_doubtful():
    points = np.array([(0.0, 40.0), (10.0, 30.0), (18.0, 24.0), (22.0, 41.0), (26.0, 18.0),
                       (40.0, 10.0)])  # fmt: skip
    assert spikes(points) == [(3, pytest.approx(17.0))]  # and not point 2, below both neighbours
    points[4, 1] = 8.0
    points[5] = (40.0, 25.0)
    assert [k for k, _ in spikes(points)] == [3, 4]


def test_each_value_is_commented_with_its_unit_and_how_sure_it_is(tmp_path):
    text, _ = compose("made", survey_file(tmp_path, table(TALUS)), SiteRequest(road=ROAD))
    lines = text.splitlines()
    words = (new_site.SURVEYED, new_site.GIVEN, new_site.PLACEHOLDER, new_site.CHECK_DEFAULT)
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
    assert "add the point 151, 2.42105" in caught.value.hint
    text, _ = compose(
        "long", survey_file(tmp_path, table([*short, (151.0, 2.42105)])), SiteRequest(ROAD)
    )
    assert loaded(text).slope.points[-1] == (151.0, 2.421)


# --- spellings: the same points, or a refusal

FEET = ("ft", "ft.", "FT", "feet", "Feet", "foot", "US ft", "ft US", "ftUS", "US survey feet",
        "US survey foot", "sft", "us-ft", "intl ft", "international feet", "ft asl", "LF",
        "'")  # fmt: skip
OTHERS = (
    "in",
    "inches",
    "yd",
    "yards",
    "dm",
    "cm",
    "mm",
    "km",
    "miles",
    "furlong",
    "Fuss",
    "fathoms",
)
METRES = ("m", "M", "m.", "metres", "meters", "metre", "m a.s.l.", "m \xfc. M.", "m AHD", "mASL")


@pytest.mark.parametrize(
    "form", ["{name} ({unit})", "{name} [{unit}]", "{name}({unit})", "{name} {{{unit}}}"]
)
@pytest.mark.parametrize("at", [0, 1])
def test_a_unit_that_is_not_metres_is_never_read(form, at):
    rows = "\n0;92\n10;90\n161;0\n"
    for unit in (*FEET, *OTHERS):
        head = ["chainage", "elevation"]
        head[at] = form.format(name=head[at], unit=unit)
        with pytest.raises(BadInput, match="metres") as caught:
            parse_table("survey.csv", ";".join(head) + rows)
        assert caught.value.value == head[at]
    for unit in METRES:
        head = ";".join(form.format(name=name, unit=unit) for name in ("chainage", "elevation"))
        assert len(parse_table("survey.csv", head + rows).points) == 3


@pytest.mark.parametrize(
    "head", ["x_ft,y_ft", "x ft,y ft", "x/ft,y", "dist-ft,elev", "chainage feet,elevation", "x',y'",
             "chainage US survey feet,elevation", "x in feet,y", "x furlong,y", "sta_usft,elev"],
)  # fmt: skip
def test_units_without_brackets_are_not_taken_for_metres(head):
    with pytest.raises(BadInput, match="line 1"):
        parse_table("survey.csv", f"{head}\n0,92\n10,90\n161,0\n")


def test_units_in_a_row_of_their_own():
    rows = "0;92\n10;90\n161;0\n"
    assert len(parse_table("survey.csv", f"chainage;elevation\nm;m\n{rows}").points) == 3
    coded = "code;chainage;elevation\n-;m;m\n" + "".join(f"P;{row}\n" for row in rows.split())
    assert len(parse_table("survey.csv", coded).points) == 3
    for unit, words in (("ft", "feet"), ("Fuss", "not known"), ("dm", "decimetres")):
        with pytest.raises(BadInput, match=words):
            parse_table("survey.csv", f"chainage;elevation\nm;{unit}\n{rows}")
    with pytest.raises(BadInput, match="feet"):
        parse_table("survey.csv", "0 ft;92 ft\n10;90\n161;0\n")


@pytest.mark.parametrize(
    "first", ["P1,0,92", "0 m,92 m", "0m,92m", "\N{MINUS SIGN}0,92", "'0,92", "0,'92", "+0,92.",
              "0+000,92", "\N{EN DASH}0,92"],
)  # fmt: skip
def test_the_first_row_of_a_table_without_names_is_kept(first):
    code = first.count(",") == 2
    rows = [("P2," if code else "") + row for row in ("10,90", "22,60", "161,0")]
    points = parse_table("survey.csv", "\n".join([first, *rows])).points
    assert points.tolist() == [[0.0, 92.0], [10.0, 90.0], [22.0, 60.0], [161.0, 0.0]]


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("P1,0,high\nP2,10,90\nP3,161,0\n", "line 1: elevation = 'high'"),
        ("0,no data\n10,90\n22,60\n161,0\n", "line 1: elevation = 'no data'"),
        ("1,92\n2,90\n3,60\n4,0\n", "counts by ones"),
        ("point,elevation\n1,92\n2,90\n3,0\n", "numbers of points are no chainages"),
        ("slope distance (m),elevation\n0,92\n161,0\n", "distances along the slope"),
        ("chainage,elevation,level\n0,92,91\n161,0,1\n", "keep one column of elevations"),
        ("x,z,height\n0,92,91\n161,0,1\n", "keep one column of elevations"),
        ("chainage,x,elevation\n0,0,91\n161,96.6,1\n", "keep one column of chainages"),
        ('x,y\n0,"1,892"\n10,"1,870"\n161,"1,804"\n', "line 2: elevation = '1,892'"),
        ("x;y\n0;1.892\n10,5;1.870\n161;1.804\n", "use one decimal sign"),
        ("x;y\n0;1.892,5\n10;1.870\n161;1.804\n", "separators of thousands"),
        ("x;y\n0+00;92\n0+10;90\n1+61;0\n", "kilometres and metres"),
        ("x;y\n0+000;0+092\n0+010;0+090\n0+161;0+000\n", "elevation = '0+092'"),
        ("x;y\n1_20;92\n130;90\n161;0\n", "give a number"),
    ],
)  # fmt: skip
def test_what_could_be_read_in_two_ways_is_refused(text, part):
    with pytest.raises(BadInput) as caught:
        parse_table("survey.csv", text)
    assert part in str(caught.value)


@pytest.mark.parametrize(
    ("text", "line", "row"),
    [
        ("0,45\n9,35\n16,20,5\n35,-0,5\n", 3, "16,20,5"),
        ("0,45\n9,5,35\n16,20,5\n35,-0,5\n", 2, "9,5,35"),
        ("x,y,remark\n0,45,\n9,35,edge\n16,20,5,\n35,0,\n", 4, "16,20,5,"),
        ("x,y,remark\n0,45,1,\n9,35,2,\n16,20,5,\n35,0,5,\n", 2, "0,45,1,"),
        ("x,y,remark\n0,45\n9,35\n16,20,5\n35,0\n", 4, "16,20,5"),
        ("0,45,top\n9,35,edge\n16,20,5,gully\n35,0,end\n", 3, "16,20,5,gully"),
        ("0 1 245\n16 990\n35 975\n", 1, "0 1 245"),
        ("1;0;92\n2;10;90\n120;3\n160;0\n", 1, "1;0;92"),
    ],
)
def test_a_number_too_many_in_some_rows_is_refused(text, line, row):
    with pytest.raises(BadInput, match="same number of cells") as caught:
        parse_table("survey.csv", text)
    assert ("semicolons" in caught.value.hint) == ("," in text)
    assert caught.value.field == f"survey.csv line {line}"
    assert caught.value.value == row


@pytest.mark.parametrize(
    "text",
    [
        "0 92\n10 90 rock 5 m\n120 3\n160 0\n",
        "x,y,remark,code\n0,92\n10,90,,7\n120,3\n160,0\n",
        "x,y,code,remark\n0,92,7\n10,90,8,edge\n120,3,7\n160,0,7\n",
    ],
)
def test_numbers_of_remarks_are_no_part_of_the_profile(text):
    points = parse_table("survey.csv", text).points
    assert points.tolist() == [[0.0, 92.0], [10.0, 90.0], [120.0, 3.0], [160.0, 0.0]]


def test_tables_with_a_stated_separator_and_with_stations():
    text = "sep=;\r\nStation;Level\r\n0+000;92\r\n0+010,5;90\r\n1+161;0\r\n"
    points = parse_table("survey.csv", text).points
    assert points.tolist() == [[0.0, 92.0], [10.5, 90.0], [1161.0, 0.0]]


def test_both_columns_of_plan_coordinates_make_the_chainage():
    for head in ("X,Y,Elev", "x,y,h", "x,y,z", "E,N,RL", "easting,northing,level"):
        survey = parse_table("survey.csv", f"{head}\n0,0,92\n6,8,90\n60,80,40\n96.6,128.8,0\n")
        assert survey.points[:, 0] == pytest.approx([0.0, 10.0, 100.0, 161.0])
        assert survey.points[:, 1].tolist() == [92.0, 90.0, 40.0, 0.0]


def test_chainage_follows_a_line_that_bends_in_plan():
    survey = parse_table("survey.csv", "x,y,z\n0,0,92\n60,80,40\n60,180,0\n")
    assert survey.points[:, 0] == pytest.approx([0.0, 100.0, 200.0])
    assert "bends" in survey.notes[0] and "200.0 m long" in survey.notes[0]


@pytest.mark.parametrize("value", [-999.0, -9999.0, -32768.0, 9999.0, 1e38, 0.0])
@pytest.mark.parametrize("count", [1, 2])
def test_a_value_that_stands_for_a_missing_elevation_is_refused(value, count):
    points = np.add(TALUS, [0.0, 600.0])
    points[3 : 3 + count, 1] = value
    with pytest.raises(BadInput, match="missing value") as caught:
        profile_of("survey.csv", Survey(points))
    assert caught.value.field == "survey.csv point 4"


def test_ground_at_sea_level_is_ground():
    points = np.array([(0.0, 40.0), (30.0, 2.0), (60.0, 0.0), (70.0, 0.0), (120.0, 1.0)])
    assert len(profile_of("survey.csv", Survey(points)).points) == 5


@pytest.mark.parametrize(("wrong", "words"), [(604.2, "31.8 m below"), (655.2, "10.0 m above")])
def test_a_point_far_from_both_neighbours_is_told(wrong, words):
    points = np.array([(0.0, 692.0), (10.0, 645.2), (22.0, 640.2), (32.0, 636.0), (161.0, 600.0)])
    assert profile_of("survey.csv", Survey(points)).notes == ()
    points[2, 1] = wrong
    notes = profile_of("survey.csv", Survey(points)).notes
    assert any(f"chainage 22, elevation {wrong:g}" in note and words in note for note in notes)


def number(value: float, decimal: str, minus: str, plus: bool) -> str:
    text = f"{abs(value):.3f}".replace(".", decimal)
    return (minus if value < 0 else "+" if plus else "") + text


@settings(deadline=None, max_examples=200)
@given(
    slope=slopes(),
    form=st.sampled_from([form for form in FORMS if form[0] != " "]),
    chainage=st.sampled_from((0.0, -40.0, 12_345.0, 2_683_412.25)),
    elevation=st.sampled_from((0.0, 300.0, 1_832.5)),
    unit=st.sampled_from(("", *METRES, *FEET, *OTHERS)),
    brackets=st.sampled_from(("{} ({})", "{} [{}]", "{}_{}")),
    thousands=st.sampled_from(("", "", "'", ".", ",")),
    minus=st.sampled_from(("-", "\N{MINUS SIGN}")),
    plus=st.booleans(),
    quoted=st.booleans(),
    codes=st.booleans(),
    stated=st.booleans(),
    backward=st.booleans(),
    end=st.sampled_from(("\n", "\r\n")),
)
def test_any_spelling_is_read_as_the_same_points_or_refused(
    slope, form, chainage, elevation, unit, brackets, thousands, minus, plus, quoted, codes, stated,
    backward, end,
):  # fmt: skip
    points = slope[0][::-1] if backward else slope[0]
    points = np.add(points, [chainage, elevation])
    separator, decimal = form
    heads = [brackets.format(n, unit) if unit else n for n in ("chainage", "elevation")]
    rows = [["code", *heads] if codes else heads]
    for k, point in enumerate(points):
        cells = [number(value, decimal, minus, plus) for value in point]
        if thousands and abs(point[0]) >= 1000.0:
            whole, rest = cells[0].split(decimal)
            cells[0] = f"{whole[:-3]}{thousands}{whole[-3:]}{decimal}{rest}"
        if quoted:
            cells = [f'"{cell}"' for cell in cells]
        rows.append([f"P{k}", *cells] if codes else cells)
    lines = [f"sep={separator}"] if stated and separator != "\t" else []
    lines += [separator.join(row) for row in rows]
    try:
        found = parse_table("survey.csv", end.join(lines) + end).points
    except BadInput as refusal:
        foreign = unit in FEET or unit in OTHERS or (unit in METRES and brackets == "{}_{}")
        assert foreign or thousands, refusal
    else:
        assert not unit or unit in METRES
        assert np.abs(found - points).max() < 1e-9


def drawing(folder: Path, version: str = "R2010", **header: int):
    """Return a new drawing and what saves it."""
    ezdxf = pytest.importorskip("ezdxf")
    document = ezdxf.new(version)
    for key, value in header.items():
        document.header[f"${key}"] = value
    return document, lambda: document.saveas(folder / "survey.dxf")


@pytest.mark.parametrize(
    ("unit", "name"),
    [(1, "inches"), (2, "feet"), (4, "millimetres"), (5, "centimetres"), (10, "yards"),
     (14, "decimetres"), (21, "US survey feet"), (20, "unit 20")],
)  # fmt: skip
def test_a_drawing_in_other_units_is_refused(unit, name, tmp_path):
    document, save = drawing(tmp_path, INSUNITS=unit)
    document.modelspace().add_lwpolyline(TALUS)
    save()
    with pytest.raises(BadInput, match=name):
        read_survey(tmp_path / "survey.dxf")


def test_a_drawing_without_unit_is_read_with_a_note(tmp_path):
    for unit, count in ((0, 1), (6, 0)):
        document, save = drawing(tmp_path, INSUNITS=unit)
        document.modelspace().add_lwpolyline(TALUS)
        save()
        survey = read_survey(tmp_path / "survey.dxf")
        assert np.abs(survey.points - TALUS).max() < 1e-9
        assert len(survey.notes) == count


def test_a_level_line_is_no_profile(tmp_path):
    plan = [(0.6 * x, 0.8 * x, 512.0) for x, _ in TALUS]
    document, save = drawing(tmp_path, INSUNITS=6)
    document.modelspace().add_polyline3d(plan)
    save()
    with pytest.raises(BadInput, match="elevation of each vertex"):
        read_survey(tmp_path / "survey.dxf")
    document, save = drawing(tmp_path, INSUNITS=6)
    document.modelspace().add_polyline3d([(0.6 * x, 0.8 * x, y) for x, y in TALUS])
    save()
    assert np.abs(read_survey(tmp_path / "survey.dxf").points - TALUS).max() < 1e-6


def test_the_curve_of_a_spline_of_release_12_is_read_and_not_its_frame(tmp_path):
    document, save = drawing(tmp_path, "R12")
    line = document.modelspace().add_polyline2d([], dxfattribs={"flags": 4})
    frame = [(0.0, 92.0), (50.0, -40.0), (161.0, 0.0)]
    line.append_formatted_vertices(frame, format="xy", dxfattribs={"flags": 16})
    line.append_formatted_vertices(TALUS, format="xy", dxfattribs={"flags": 8})
    save()
    assert np.abs(read_survey(tmp_path / "survey.dxf").points - TALUS).max() < 1e-9


STEP = ((0.0, 50.0), (10.0, 40.0), (20.0, 35.0), (20.0, 10.0), (45.0, 0.0), (120.0, -2.0))
"""Ground with a vertical face at the lower end of a stretch from 10 m to 20 m."""

LEDGE = ((0.0, 50.0), (10.0, 48.0), (10.0, 40.0), (25.0, 10.0), (45.0, 0.0), (120.0, -2.0))
"""Ground with a vertical face at the upper end of a stretch from 10 m to 25 m."""


def ground(points) -> shapely.Polygon:
    """Return the ground below some corners, down to 50 m below zero."""
    return shapely.Polygon([*points, (points[-1][0], -50.0), (points[0][0], -50.0)])


def check_taken_out(site: Site, points) -> None:
    """Check that the ground and the masses of a site are together the surveyed ground."""
    left, surveyed = ground(site.slope.points), ground(points)
    rock = [shapely.Polygon(source.polygon) for source in site.sources]
    assert left.is_valid
    assert sum(part.area for part in rock) == pytest.approx(surveyed.area - left.area, abs=1e-6)
    assert shapely.union_all([left, *rock]).symmetric_difference(surveyed).area < 1e-6


def with_masses(folder: Path, points, *masses: str, road=(60.0, 67.0)) -> Site:
    """Return the site of a surveyed profile without the rock of some masses."""
    text = "\n".join(["chainage,elevation", *(f"{x!r},{y!r}" for x, y in points), ""])
    request = SiteRequest(road=road, masses=masses)
    return loaded(compose("made", survey_file(folder, text, "masses.csv"), request)[0])


@pytest.mark.parametrize(
    ("points", "mass", "corners", "ground_corners"),
    [
        (STEP, "m:10-20:30", [(10, 40), (20, 35), (20, 10), (10, 15.774)], STEP[:2]),
        (STEP, "m:12-20:30", [(12, 39), (20, 35), (20, 10), (12, 14.619)], [*STEP[:2], (12, 39)]),
        (LEDGE, "m:10-25:30", [(10, 40), (25, 10), (10, 18.66)], LEDGE[:2]),
    ],
)
def test_both_corners_of_a_vertical_face_belong_to_a_mass(
    points, mass, corners, ground_corners, tmp_path
):
    site = with_masses(tmp_path, points, mass)
    np.testing.assert_allclose(site.sources[0].polygon, corners, atol=1e-9)
    beyond = points.index(tuple(map(float, corners[-2])))
    np.testing.assert_allclose(
        site.slope.points, [*ground_corners, corners[-1], *points[beyond:]], atol=1e-9
    )
    check_taken_out(site, points)


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize(
    "points",
    [STEP, (*STEP[:3], (20.0, 34.0), *STEP[4:]), ((0.0, 50.0), (10.0, 40.0), (20.0, 32.0),
     (20.0, 34.0), *STEP[4:])],
)  # fmt: skip
def test_masses_may_meet_at_a_vertical_face(points, reverse, tmp_path):
    masses = ["above:10-20:5", "below:20-30:5"]
    site = with_masses(tmp_path, points, *(masses[::-1] if reverse else masses))
    check_taken_out(site, points)


@st.composite
def faces(draw):
    """Return corners of ground with a convex face, and the ends of a stretch of it [m].

    The ends may be at vertical faces, of which that at the upper end may rise downhill.
    """
    metres = st.integers(1, 9).map(float)
    slopes = sorted(draw(st.lists(st.integers(1, 30), min_size=1, max_size=4)))
    points = [(0.0, 0.0), (draw(metres), -1.0)]
    step = draw(st.sampled_from((0.0, -1.0, 0.5)))
    x, y = points[-1][0], points[-1][1] + step
    points += [(x, y)] if step else []
    for slope in slopes:
        run = draw(metres)
        x, y = x + run, y - 0.1 * slope * run
        points.append((x, y))
    if drop := draw(st.sampled_from((0.0, 1.0, 12.0))):
        y -= drop
        points.append((x, y))
    low = points[1][0] + draw(st.sampled_from((0.0, 0.3, 0.7)))
    points += [(x + 20.0, y - 3.0), (x + 90.0, y - 4.0)]
    lift = 60.0 - min(y for _, y in points)
    return [(round(x, 6), round(y + lift, 6)) for x, y in points], (low, x), x + 30.0


@settings(
    deadline=None, max_examples=80, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(case=faces(), share=st.floats(0.0, 0.95))
def test_a_mass_is_the_rock_that_the_ground_loses(case, share, tmp_path):
    points, (low, high), road = case
    upper = [y for x, y in points if x == low]  # the face begins at the last of these corners
    top = upper[-1] if upper else float(np.interp(low, *np.transpose(points)))
    bottom = min(y for x, y in points if x == high)
    dip = share * math.degrees(math.atan2(top - bottom, high - low))
    site = with_masses(tmp_path, points, f"m:{low}-{high}:{dip:.3f}", road=(road, road + 7.0))
    check_taken_out(site, points)
    corners = np.array(site.sources[0].polygon)
    assert corners[:, 0].min() == low and corners[:, 0].max() == high
    assert corners[:, 1].max() == pytest.approx(top) and corners[:, 1].min() == bottom


@pytest.mark.parametrize("dip", [-5, 0, 10])
@pytest.mark.parametrize(("rise", "words"), [(0.0, "35 m at the lower"), (1.5, "36.5 m at the")])
def test_a_mass_on_ground_that_does_not_fall_is_refused(rise, words, dip, tmp_path):
    points = (*STEP[:2], (15.0, 35.0), (20.0, 35.0 + rise), *STEP[4:])
    with pytest.raises(BadInput, match="name a stretch on which the ground falls") as caught:
        with_masses(tmp_path, points, f"m:15-20:{dip}")
    assert "it is at 35 m at the upper end" in caught.value.hint and words in caught.value.hint
    assert "dips" not in caught.value.hint


def test_the_greatest_dip_that_an_error_permits_is_accepted(tmp_path):
    points = ((0.0, 50.0), (10.0, 48.0), (50.0, 47.5), (70.0, 40.0), (160.0, 38.0))
    with pytest.raises(BadInput, match=r"0 to less than the 0\.716 deg of the face"):
        with_masses(tmp_path, points, "m:10-50:1", road=(80.0, 87.0))
    check_taken_out(with_masses(tmp_path, points, "m:10-50:0.715", road=(80.0, 87.0)), points)
