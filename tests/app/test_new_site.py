"""`rigdda new` and `rigdda check` as users meet them: real processes, real files."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import msgspec
import numpy as np
import pytest
from processes import png_size, refused, rig, run

import rigdda
from rigdda import Event, Site
from rigdda.app import site_check, site_oddities, value_origins
from rigdda.app.site_check import Trial
from rigdda.app.site_oddities import oddities
from rigdda.ground.grounds import GROUNDS
from rigdda.ground.surface import Interface
from rigdda.model.existing import Existing
from rigdda.model.forest import Forest
from rigdda.model.site_tables import Motion, Rebound
from rigdda.model.traffic import Traffic

GRID = """chainage,elevation
2683400.0,1892.0
2683410.0,1890.0
2683422.0,1860.0
2683472.0,1820.0
2683494.0,1806.0
2683504.0,1804.5
2683512.0,1804.0
2683521.0,1804.0
2683561.0,1800.0
"""
SOUND = "x,y\n0,92\n10,90\n22,60\n72,20\n94,6\n104,4.5\n112,4\n121,4\n161,0\n"
ASKED = ("--road", 112, 121)

replace = msgspec.structs.replace


def test_from_a_survey_to_a_checked_site(tmp_path):
    (tmp_path / "survey.csv").write_text(GRID)
    out = run("new", "slope", "--profile", "survey.csv", "--road", 2683512, 2683521, "--ground",
              "talus:2683422-2683512", "--source", "cliff:2683412-2683418",
              folder=tmp_path)  # fmt: skip
    assert "x = 0 is chainage 2,683,400" in out and "9 points; slope.toml is written" in out
    text = (tmp_path / "slope.toml").read_text()
    marked = [line for line in text.splitlines() if line.endswith("placeholder: replace.")]
    count = sum(not line.startswith("# #") for line in marked)
    assert f"with {count} placeholders" in out and count < len(marked)
    site = Site.load(tmp_path / "slope.toml")
    assert site.origin.chainage_of(site.road.start) == 2683512.0
    assert site.surface_at(30.0) == "talus"
    told = run("check", "slope.toml", "--out", "checked", folder=tmp_path)
    assert "the road is at chainage 2,683,512 to 2,683,521" in told
    assert "talus (coarse_talus) x = 22 to 112 m" in told
    assert "0.2 events a year on 100 m of slope, one in 5 years" in told
    assert f"the site file marks {count} values as placeholders" in told
    assert "nothing looks odd; site.png is in checked" in told
    width, height = png_size(tmp_path / "checked" / "site.png")
    assert width >= 1200 and height >= 600


def test_a_jointed_mass_is_taken_out_of_the_ground(tmp_path):
    (tmp_path / "survey.csv").write_text(GRID)
    asked = ("--profile", "survey.csv", "--road", 2683512, 2683521)
    run("new", "slope", *asked, "--mass", "pillar:2683412-2683418:30", folder=tmp_path)
    site = Site.load(tmp_path / "slope.toml")
    (pillar,) = site.sources
    # Face at 10 m in 4, so 15 m high over 6 m; the plane rises by 6 tan 30 deg from its lower end.
    foot = 85.0 - 15.0 + 6.0 * np.tan(np.radians(30.0))
    np.testing.assert_allclose(pillar.polygon, [(12, 85), (18, 70), (12, foot)], atol=1e-3)
    assert pillar.area == pytest.approx(0.5 * 6.0 * (85.0 - foot), abs=0.01)
    assert site.profile.height(17.0) == pytest.approx(70.0 + np.tan(np.radians(30.0)), abs=1e-3)
    told = run("check", "slope.toml", folder=tmp_path)
    assert "source pillar: a jointed mass" in told and "odd: sources" not in told


@pytest.mark.parametrize(
    ("zone", "rooms", "band"),
    [
        ((60, 112), [(60, 112)], (10, 38)),  # wider than the zone by default at both ends
        ((20, 111), [(20, 111)], None),  # into the placeholder of the band, which gives way
        ((15, 20), [(15, 20)], None),  # within it
        ((10, 20), [(10, 20)], None),  # from its upper end on, so that it lies below the zone
        ((0, 112), None, (10, 38)),  # the whole slope: no place is left for the band
    ],
)
def test_a_zone_may_be_wider_than_the_one_by_default(tmp_path, zone, rooms, band):
    (tmp_path / "survey.csv").write_text(SOUND)
    run("new", "usual", "--profile", "survey.csv", *ASKED, folder=tmp_path)
    assert Site.load(tmp_path / "usual.toml").rooms == ((79.0, 111.5),)
    run("new", "slope", "--profile", "survey.csv", *ASKED, "--zone", *zone, folder=tmp_path)
    site = Site.load(tmp_path / "slope.toml")
    assert (site.barrier_zone.start, site.barrier_zone.end) == zone
    if rooms is not None:
        np.testing.assert_allclose(site.rooms, rooms)
    if band is not None:
        assert site.sources[0].band == band


def test_the_placeholder_of_the_road_lies_below_a_zone_that_is_given(tmp_path):
    (tmp_path / "survey.csv").write_text(SOUND)
    run("new", "usual", "--profile", "survey.csv", folder=tmp_path)
    assert Site.load(tmp_path / "usual.toml").road.start == 96.0
    run("new", "slope", "--profile", "survey.csv", "--zone", 110, 60, folder=tmp_path)
    site = Site.load(tmp_path / "slope.toml")
    assert site.rooms == ((60.0, 110.0),) and (site.road.start, site.road.end) == (110.0, 117.0)


def test_the_time_step_is_that_of_the_format(tmp_path):
    (tmp_path / "survey.csv").write_text(SOUND)
    run("new", "slope", "--profile", "survey.csv", *ASKED, folder=tmp_path)
    assert Site.load(tmp_path / "slope.toml").motion.dt == Motion().dt == 0.005


@pytest.mark.parametrize(
    "asked",
    [
        (*ASKED,),
        (*ASKED, "--zone", 15, 20),
        (*ASKED, "--zone", 60, 112, "--source", "low:100-108"),
        (*ASKED, "--zone", 60, 112, "--source", "low:60-111"),
        (*ASKED, "--mass", "pillar:12-18:30"),
        (),
    ],
)
def test_traffic_and_existing_barriers_are_templates(tmp_path, asked):
    (tmp_path / "survey.csv").write_text(SOUND)
    run("new", "slope", "--profile", "survey.csv", *asked, folder=tmp_path)
    text = (tmp_path / "slope.toml").read_text()
    site = Site.parse(text, "slope")
    assert site.traffic is None and site.existing == site.forest == ()
    head, *templates = re.split(r"\n\n(?=# # )", text)
    assert len(templates) == 3
    uncommented = [re.sub(r"(?m)^# ", "", template) for template in templates]
    (wood,) = Site.parse(f"{head}\n{uncommented[1]}", "slope").forest
    assert (wood.stems, wood.dbh, wood.dbh_sd) == (400.0, 0.3, 0.1)
    (fence,) = Site.parse(f"{head}\n{uncommented[2]}", "slope").existing
    assert (fence.kind, fence.height, fence.energy_class) == ("fence", 2.0, 250)
    whole = Site.parse("\n\n".join([head, *uncommented]), "slope")
    assert whole.existing == (fence,) and whole.forest == (wood,)
    assert whole.traffic == Traffic(2000.0, 60.0, 100.0)
    for unit in ("[1/day]", "[km/h]", "[m]", "[kJ]", "[EUR/m]"):
        assert any(unit in template for template in templates)


BACK = "it lies uphill of slope.points[{}] at x = {}: correct one of the two"


@pytest.mark.parametrize(
    ("old", "new", "part"),
    [
        ("[22.0, 60.0]", "[2.0, 60.0]", "slope.points[2] = [2.0, 60.0]: " + BACK.format(1, 10)),
        ("[72.0, 20.0]", "[7.2, 20.0]", "slope.points[3] = [7.2, 20.0]: " + BACK.format(2, 22)),
        ("[104.0, 4.5]", "[114.0, 4.5]", "slope.points[6] = [112.0, 4.0]: " + BACK.format(5, 114)),
        ("[22.0, 60.0]", "[-22.0, 60.0]", "slope.points[2] = [-22.0, 60.0]: give an x between 0"),
        ("[22.0, 60.0]", "[2200, 60.0]", "slope.points[2] = [2200.0, 60.0]: give an x between 0"),
        ("[22.0, 60.0]", "[10.0, 90.0]", "slope.points[2] = [10.0, 90.0]: remove it"),
        ("[22.0, 60.0]", "[20.0, 60.0], [5.0, 95.0], [22.0, 60.0]", "crosses itself"),
        ("[161.0, 0.0]", "[161.0, 95.0]", "to [161.0, 95.0]': list them downhill"),
    ],
)
def test_points_that_go_back_are_blamed_themselves(tmp_path, old, new, part):
    (tmp_path / "survey.csv").write_text(SOUND)
    run("new", "slope", "--profile", "survey.csv", *ASKED, folder=tmp_path)
    text = (tmp_path / "slope.toml").read_text()
    assert old in text
    (tmp_path / "slope.toml").write_text(text.replace(old, new))
    line = refused("check", "slope.toml", folder=tmp_path)
    assert line.startswith("rigdda: slope.points") and part in line


def test_ground_may_overhang_below_a_mass(slope):
    points = [*slope.slope.points]
    points[2:2] = [(13.0, 84.0), (12.0, 80.0)]
    ground = replace(slope.slope, points=tuple(points))
    square = ((80.0, 40.0), (82.0, 40.0), (82.0, 42.0), (80.0, 42.0))
    source = rigdda.Source("face", blocks=(square,))
    event = Event("block", 0.2, "face")
    zone = replace(slope.barrier_zone, start=90.0)
    rock = replace(slope, slope=ground, sources=(source,), events=(event,), barrier_zone=zone)
    assert len(rock.profile.points) == len(slope.profile.points) + 2
    with pytest.raises(rigdda.BadInput, match=r"slope.points\[3\] = \[12.0, 80.0\]: it lies"):
        replace(slope, slope=ground)


@pytest.mark.parametrize(
    ("mass", "mend"),
    [
        ("pillar:2683412-2683418", "NAME:START-END:DIP"),
        ("pillar:2683412:30", "NAME:START-END:DIP"),
        ("pillar:2683412-2683418:1.2.3", "NAME:START-END:DIP"),
        ("pillar:2683412-2683418:75", "less than the 68.1 deg"),
        ("pillar:2683412-2683418:-5", "0 to less than"),
        ("pillar:2683412-2683470:20", "hollow"),
        ("pillar:2683300-2683418:20", "between chainage 2683400 and 2683512"),
    ],
)
def test_a_mass_that_cannot_lie_there_is_refused(tmp_path, mass, mend):
    (tmp_path / "survey.csv").write_text(GRID)
    asked = ("--profile", "survey.csv", "--road", 2683512, 2683521, "--mass", mass)
    assert mend in refused("new", "slope", *asked, folder=tmp_path)


def test_two_masses_in_one_place_are_refused(tmp_path):
    (tmp_path / "survey.csv").write_text(GRID)
    asked = ("--profile", "survey.csv", "--road", 2683512, 2683521)
    two = ("--mass", "a:2683412-2683418:30", "--mass", "b:2683417-2683420:30")
    assert "where a ends" in refused("new", "slope", *asked, *two, folder=tmp_path)


def test_names_of_sites_and_sources_may_have_any_letters(tmp_path):
    (tmp_path / "survey.csv").write_text(SOUND)
    strange = 'G\N{LATIN SMALL LETTER O WITH DIAERESIS}sgen "east"\n[slope]\x07'
    run("new", strange, "--profile", "survey.csv", *ASKED, "--out", "a.toml", "--source",
        'face "1": 12-18', folder=tmp_path)  # fmt: skip
    site = Site.load(tmp_path / "a.toml")
    assert site.name == strange and site.sources[0].name == 'face "1"'
    assert "/" in refused("new", "a/b", "--profile", "survey.csv", folder=tmp_path)


@pytest.mark.parametrize(
    ("name", "options", "said"),
    [
        ("a", ("--out", "/proc/a.toml"), "--out = '/proc/a.toml': name a file that can be written"),
        ("a", ("--out", "survey.csv/a.toml"), "--out = 'survey.csv/a.toml': name a file that"),
        ("a", ("--out", 300 * "a" + ".toml"), "name a file that can be written (File name too"),
        (300 * "a", (), "use a name of at most 200 bytes, or give the file with --out"),
        (101 * "ö", (), "use a name of at most 200 bytes, or give the file with --out"),
    ],
)
def test_a_file_that_cannot_be_written_is_named(tmp_path, name, options, said):
    (tmp_path / "survey.csv").write_text(SOUND)
    line = refused("new", name, "--profile", "survey.csv", *ASKED, *options, folder=tmp_path)
    assert said in line and "Errno" not in line
    assert [file.name for file in tmp_path.iterdir()] == ["survey.csv"]


def test_a_drawing_becomes_a_site(tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    points = [tuple(map(float, row.split(","))) for row in GRID.splitlines()[1:]]
    flat = ezdxf.new()
    flat.modelspace().add_lwpolyline(points, dxfattribs={"layer": "ground"})
    flat.modelspace().add_lwpolyline([(0, 0), (1, 1)], dxfattribs={"layer": "frame"})
    flat.modelspace().add_line((0, 0), (5, 5))
    flat.saveas(tmp_path / "flat.dxf")
    space = ezdxf.new()
    turned = [(2600000.0 + 0.6 * (x - 2683400.0), 1200000.0 + 0.8 * (x - 2683400.0), y)
              for x, y in points]  # fmt: skip
    space.modelspace().add_polyline3d(turned)
    space.saveas(tmp_path / "space.dxf")
    line = refused("new", "several", "--profile", "flat.dxf", folder=tmp_path)
    assert "--layer" in line and "frame, ground" in line
    run("new", "flat", "--profile", "flat.dxf", "--layer", "ground", "--road", 2683512, 2683521,
        folder=tmp_path)  # fmt: skip
    run("new", "space", "--profile", "space.dxf", "--road", 112, 121, folder=tmp_path)
    one, other = (Site.load(tmp_path / f"{name}.toml") for name in ("flat", "space"))
    assert np.abs(np.subtract(one.slope.points, other.slope.points)).max() < 1e-3
    assert one.road == other.road
    assert other.origin.azimuth_deg == pytest.approx(36.869898, abs=1e-3)
    (tmp_path / "broken.dxf").write_text("  0\nSECTION\n  2\nENTITIES\n  x\n")
    (tmp_path / "text.dxf").write_text("chainage,elevation\n0,1\n")
    (tmp_path / "begun.dxf").write_text("0\nSECTION\n")
    whole = (tmp_path / "flat.dxf").read_text().splitlines(keepends=True)
    (tmp_path / "half.dxf").write_text("".join(whole[: len(whole) // 2]))
    ezdxf.new().saveas(tmp_path / "empty.dxf")
    for name, mend in (("broken", "save it as DXF again"), ("text", "save it as DXF again"),
                       ("begun", "save it as DXF again"), ("half", "save it as DXF again"),
                       ("empty", "one polyline"), ("missing", "name a file")):  # fmt: skip
        assert mend in refused("new", "a", "--profile", f"{name}.dxf", folder=tmp_path)


def test_a_drawing_without_the_extra_is_one_clear_error(tmp_path):
    (tmp_path / "flat.dxf").write_text("0\nEOF\n")
    code = (
        "import sys; sys.modules['ezdxf'] = None; from rigdda.app import cli; "
        "sys.exit(cli.main(['new', 'a', '--profile', 'flat.dxf']))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=300,
        env={"PYTHONPATH": str(Path(rigdda.__file__).parents[1])},
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == 1 and 'pip install "rigdda[dxf]"' in done.stderr


SURVEYS = {
    "nothing": ("", "empty"),
    "only a header": ("x,y\n", "at least two rows"),
    "one point": ("x,y\n0,1\n", "at least two points"),
    "one place": ("x,y\n0,1\n0,1\n", "different points"),
    "one column": ("x\n0\n1\n", "name its columns"),
    "columns without names": ("0,1,2\n1,2,3\n", "name its columns"),
    "unknown columns": ("a,b,c\n0,1,2\n1,2,3\n", "chainage and elevation"),
    "no elevation": ("easting,northing\n0,1\n1,2\n", "elevation"),
    "text": (SOUND.replace("22,60", "22,high"), "line 4: elevation = 'high': give a number"),
    "gap": (SOUND.replace("22,60", "22,"), "line 4: elevation = '': give a number"),
    "short line": (SOUND.replace("22,60", "22"), "line 4"),
    "nan": (SOUND.replace("22,60", "nan,60"), "line 4: chainage = 'nan'"),
    "infinite": (SOUND.replace("22,60", "1e999,60"), "finite"),
    "hexadecimal": (SOUND.replace("22,60", "0x16,60"), "0x16"),
    "thousands": ("x;y\n2.683.412,5;92\n2.683.500,5;3\n", "separators of thousands"),
    "apostrophes": ("x;y\n2'683'412.5;92\n2'683'500.5;3\n", "separators of thousands"),
    "decimal commas": ("x,y\n0,0,92,0\n10,5,90,5\n", "semicolons"),
    "degrees": (SOUND.replace("22,60", "22\N{DEGREE SIGN},60"), "give a number"),
    "millimetres": ("x [mm],y [mm]\n0,92000\n161000,0\n", "give metres"),
    "feet": ("x (ft),y (ft)\n0,92\n161,0\n", "feet"),
    "kilometres": ("chainage_km,elevation\n0,92\n0.161,0\n", "kilometres"),
    "too long": ("x,y\n0,92000\n161000,0\n", "161000 m long"),
    "too high": ("x,y\n0,9000\n161,0\n", "9000 m high"),
    "level": ("x,y\n0,5\n100,5\n161,5\n", "with a slope"),
    "ends level": ("x,y\n0,5\n100,1\n161,5\n", "below"),
    "unsorted": ("x,y\n0,92\n90,6\n20,60\n110,4\n30,50\n161,0\n", "sort the points"),
    "before the crest": (SOUND.replace("10,90", "-10,90"), "begin and end"),
    "crossing": (
        "x,y\n0,92\n20,80\n30,70\n50,40\n40,70\n60,10\n45,50\n112,4\n161,0\n",
        "crosses itself",
    ),
    "vertical": ("x,y\n5,92\n5,0\n", "same chainage"),
}
"""Tables that are refused, and a part of the line that says why."""

OPTIONS = {
    "no file": (("--profile", "none.csv"), "none.csv"),
    "a folder": (("--profile", "."), "'.'"),
    "a picture": (("--profile", "survey.png"), "CSV"),
    "a workbook": (("--profile", "survey.xlsx"), "CSV"),
    "no profile": ((), "--profile"),
    "road beyond": (("--road", 170, 180), "--road"),
    "road of no width": (("--road", 112, 112), "--road"),
    "road at the end": (("--road", 150, 158), "30 m beyond the road"),
    "road on the crest": (("--road", 2, 8), "--source"),
    "half a road": (("--road", 112), "--road"),
    "road of text": (("--road", "a", "b"), "'a'"),
    "road with an underscore": (("--road", "1_12", 121), "--road = '1_12': give a number"),
    "toe with an underscore": ((*ASKED, "--toe", "9_4"), "--toe = '9_4': give a number"),
    "toe beyond the road": ((*ASKED, "--toe", 130), "--toe = 130.0"),
    "zone on the road": ((*ASKED, "--zone", 100, 115), "--zone = [100.0, 115.0]: let it lie "),
    "zone above the crest": ((*ASKED, "--zone", -5, 110), "the crest at 0 and the uphill edge"),
    "zone beyond the ground": (("--zone", 100, 170), "the end of the ground at 161"),
    "zone of no length": ((*ASKED, "--zone", 100, 100), "--zone"),
    "unknown ground": ((*ASKED, "--ground", "lava:10-20"), "'lava'"),
    "several grounds": ((*ASKED, "--ground", "hard:10-20"), "hard_rock, hard_soil"),
    "ground without end": ((*ASKED, "--ground", "talus:10"), "talus:10"),
    "ground of no length": ((*ASKED, "--ground", "talus:10-10"), "--ground"),
    "ground of bad number": ((*ASKED, "--ground", "talus:1.2.3-20"), "1.2.3"),
    "grounds that overlap": (
        (*ASKED, "--ground", "talus:10-30", "--ground", "meadow:20-40"), "talus ends",
    ),
    "ground beyond the profile": ((*ASKED, "--ground", "talus:200-300"), "chainage 0 to 161"),
    "ground before the crest": ((*ASKED, "--ground", "talus:-5-30"), "'talus:-5-30'"),
    "two grounds without range": (
        (*ASKED, "--ground", "talus", "--ground", "talus:0-10", "--ground", "soil"),
        "--ground = 'soil': give it a range, such as soil:12-30: talus is that of all other ground",
    ),
    "source without range": ((*ASKED, "--source", "cliff"), "cliff:2-8"),
    "source on the road": ((*ASKED, "--source", "cliff:100-115"), "uphill of the road"),
    "source beyond": ((*ASKED, "--source", "cliff:-50--40"), "uphill of the road"),
    "source at the end of the profile": (
        (*ASKED, "--source", "cliff:0.2-8"),
        "--source = 'cliff:0.2-8': keep it between chainage 1 and 111, so that its blocks lie on",
    ),
    "source everywhere": (
        (*ASKED, "--source", "cliff:1-110.9", "--zone", 20, 111), "cover the whole zone",
    ),
    "layer of a table": ((*ASKED, "--layer", "0"), "--layer"),
    "out of other kind": ((*ASKED, "--out", "site.csv"), "--out"),
    "out that is there": ((*ASKED, "--out", "there.toml"), "there.toml"),
}  # fmt: skip
"""Options that are refused, and a part of the line that says why."""


@pytest.mark.parametrize("case", SURVEYS)
def test_a_malformed_survey_is_refused_in_one_line(case, tmp_path):
    text, part = SURVEYS[case]
    (tmp_path / "survey.csv").write_text(text, encoding="utf-8")
    line = refused("new", "slope", "--profile", "survey.csv", folder=tmp_path)
    assert "survey.csv" in line and part in line, line
    assert re.fullmatch(r"rigdda: .+ = .+: .+\n", line)
    assert not (tmp_path / "slope.toml").exists()


@pytest.mark.parametrize("case", OPTIONS)
def test_a_wrong_option_is_refused_in_one_line(case, tmp_path):
    options, part = OPTIONS[case]
    (tmp_path / "survey.csv").write_text(SOUND)
    (tmp_path / "there.toml").write_text("edited = true\n")
    usual = () if "--profile" in options or not options else ("--profile", "survey.csv")
    line = refused("new", "slope", *usual, *options, folder=tmp_path)
    assert part in line, line
    assert (tmp_path / "there.toml").read_text() == "edited = true\n"
    assert not (tmp_path / "slope.toml").exists()


def test_bytes_that_are_no_text_are_refused(tmp_path):
    (tmp_path / "survey.csv").write_bytes(b"x;H\xf6he\n0;1\n")
    line = refused("new", "slope", "--profile", "survey.csv", folder=tmp_path)
    assert "UTF-8" in line and "survey.csv" in line
    (tmp_path / "survey.csv").write_bytes(b"x,y\n0,1\x00\n")
    assert "line 2" in refused("new", "slope", "--profile", "survey.csv", folder=tmp_path)


@pytest.mark.parametrize("name", ["survey.csv", "survey.dxf", "SURVEY.XLSX"])
def test_a_survey_in_place_of_a_site_says_how_to_import_it(name, tmp_path):
    (tmp_path / name).write_text(SOUND)
    for command in ("check", "simulate", "design"):
        line = refused(command, name, folder=tmp_path)
        assert f"rigdda new NAME --profile {name}" in line


@pytest.fixture(scope="module")
def slope(tmp_path_factory) -> Site:
    folder = tmp_path_factory.mktemp("slope")
    (folder / "survey.csv").write_text(SOUND)
    run("new", "slope", "--profile", "survey.csv", *map(str, ASKED), folder=folder)
    return Site.load(folder / "slope.toml")


def changed(site: Site, table: str, **values: object) -> Site:
    """Return a site with other values in a table, of lists in the first."""
    old = getattr(site, table)
    many = isinstance(old, tuple)
    new = replace(old[0] if many else old, **values)
    return replace(site, **{table: (new, *old[1:]) if many else new})


def test_the_new_site_is_not_odd(slope):
    assert oddities(slope) == []


@pytest.mark.parametrize(
    ("table", "values", "part"),
    [
        ("sources", {"density": 900.0}, "density = 900 kg/m3"),
        (
            "sources",
            {"band": (95.0, 100.0)},
            "at x = 95 to 100 m, 100 % of it, the ground is 8.5 deg steep, less than its "
            "friction angle of 32 deg",
        ),
        ("sources", {"band": (5.0, 25.0)}, "at x = 5 to 10 m, 25 % of it, the ground is 11.3 deg"),
        (
            "sources",
            {"band": (5.0, 99.0)},
            "at x = 5 to 10 and 72 to 99 m, 34 % of it, the ground is 8.5 to 32.5 deg steep, less "
            "than its friction angle of 32 to 35 deg",
        ),
        ("events", {"rate": 30.0}, "events.block, face.rate = 30: this makes 30 events a year"),
        ("events", {"rate": 30.0}, "return_period = 30"),
        ("events", {"area": (5e-4 ** (2 / 3), 0.1)}, "blocks of 0.5 litres, 1.3 kg"),
        ("events", {"number": (1, 900), "width": 20.0}, "number = [1, 900]: releases of so many"),
        ("events", {"design": False}, "none has design = true, so that no target can be set"),
        ("consequences", {"closure": 500.0}, "consequences.closure = 500 EUR/day: a day of"),
        ("consequences", {"closure": 5e7}, "consequences.closure = 5e+07 EUR/day"),
        ("consequences", {"clearing": 0.3}, "consequences.clearing = 0.3 EUR/m3: a usual value"),
        ("consequences", {"days_base": 24.0}, "consequences.days_base = 24 days: is it in hours?"),
        ("consequences", {"days_factor": 48.0}, "consequences.days_factor = 48 days"),
        ("prices", {"fence": {"500": 0.25}}, "prices.fence.500 = 0.25 EUR/m2: a usual value"),
        ("prices", {"ditch": {"rock": 40_000.0}}, "prices.ditch.rock = 40000 EUR/m3: a usual"),
        ("prices", {"concrete": 0.35}, "prices.concrete = 0.35 EUR/m3"),
        ("prices", {"concrete": 0.0}, "prices.concrete = 0 EUR/m3: it would cost nothing"),
        ("prices", {"interest": 0.3}, "prices.interest = 0.3: this is 30 % a year"),
        ("prices", {"upkeep": {"fence": 0.5}}, "prices.upkeep.fence = 0.5: this is 50 % a year"),
        ("prices", {"life": 1.0}, "prices.life = 1 years: barriers last"),
        ("prices", {"lives": {"fence": 500.0}}, "prices.lives.fence = 500 years"),
        ("events", {"area": (1.0, 15.0)}, "if the numbers are volumes"),
        ("road", {"end": 113.0}, "it is 1 m wide"),
        ("road", {"end": 130.5}, "30.5 m beyond the road"),
        ("slope", {"toe": 11.0}, "of its foot, not of its crest"),
        ("barrier_zone", {"start": 109.0}, "a fence of 500 kJ gives way by 3.5 m"),
        ("barrier_zone", {"start": 109.0}, "the best place will lie on an end"),
        ("barrier_zone", {"max_height": 1.0}, "the best barrier will lie on this bound"),
        ("barrier_zone", {"max_depth": 0.6}, "barrier_zone.max_depth = 0.6"),
    ],
)  # fmt: skip
def test_what_looks_odd_is_told(slope, table, values, part):
    assert [line for line in oddities(changed(slope, table, **values)) if part in line]


@pytest.mark.parametrize(
    ("values", "part"),
    [
        ({"restitution": 0.85}, "surfaces.soil.restitution = 0.85: 0.05 to 0.38 is plausible for"),
        ({"rolling": 0.014}, "surfaces.soil.rolling = 0.014: 0.05 to 0.4 is plausible for"),
        ({"rolling": 0.9}, "surfaces.soil.rolling = 0.9: 0.05 to 0.4 is plausible for the ground"),
        ({"friction_deg": 12.0}, "surfaces.soil.friction_deg = 12: 30 to 50 is plausible for"),
        ({"roughness": 1.5}, "surfaces.soil.roughness = 1.5: 0 to 0.3 is plausible for the ground"),
    ],
)
def test_values_outside_the_range_of_their_ground_look_odd(slope, values, part):
    talus = rigdda.Surface(ground="coarse_talus")
    usual = replace(slope, surfaces={**slope.surfaces, "soil": talus})
    assert oddities(usual) == []
    odd = replace(usual, surfaces={**usual.surfaces, "soil": replace(talus, **values)})
    (line,) = oddities(odd)
    assert line.startswith(part) and "coarse_talus" in line


@pytest.mark.parametrize("ground", GROUNDS)
def test_both_ends_of_the_range_of_a_ground_are_plausible(slope, ground):
    spans = {law: getattr(GROUNDS[ground], law) for law in site_oddities.LAWS}
    for end in ("typical", "low", "high"):
        values = {law: getattr(span, end) for law, span in spans.items()}
        surfaces = {**slope.surfaces, "other": rigdda.Surface(ground=ground, **values)}
        assert oddities(replace(slope, surfaces=surfaces)) == []


def test_a_surface_without_a_ground_is_compared_with_all_grounds(slope):
    def lines(surface: rigdda.Surface) -> list[str]:
        return oddities(replace(slope, surfaces={**slope.surfaces, "other": surface}))

    assert lines(rigdda.Surface()) == []
    assert lines(rigdda.Surface(friction_deg=55.0, restitution=0.7, rolling=0.45)) == []
    (line,) = lines(rigdda.Surface(restitution=0.85))
    assert "surfaces.other.restitution = 0.85: 0.02 to 0.75 is plausible for the grounds" in line
    pair = Interface("rock", "soil", restitution=0.85, rolling=0.9)
    found = oddities(replace(slope, interfaces=(pair,)))
    assert [line.partition(":")[0] for line in found] == [
        "interfaces[0].restitution = 0.85", "interfaces[0].rolling = 0.9",
    ]  # fmt: skip


def test_an_unusual_friction_of_the_lumped_mass_model_looks_odd(slope):
    for angle in (0.0, 30.0):
        usual = replace(slope, lumped={"rock": Rebound(friction_deg=angle)})
        assert oddities(usual) == []
    (line,) = oddities(replace(slope, lumped={"rock": Rebound(friction_deg=1.2)}))
    assert line.startswith("lumped.rock.friction_deg = 1.2: ") and "correct it" in line


def test_rolling_above_one_is_refused(tmp_path):
    (tmp_path / "survey.csv").write_text(SOUND)
    run("new", "slope", "--profile", "survey.csv", *ASKED, folder=tmp_path)
    text = (tmp_path / "slope.toml").read_text()
    wrong = text.replace("[surfaces.soil]\n", "[surfaces.soil]\nrolling = 1.4\n")
    (tmp_path / "slope.toml").write_text(wrong)
    line = refused("check", "slope.toml", folder=tmp_path)
    assert "surfaces.soil.rolling = 1.4: give a number of at least 0 and at most 1" in line


def test_a_band_that_slides_by_an_interface_is_not_flat(slope):
    site = changed(slope, "sources", band=(5.0, 25.0))
    assert len(oddities(site)) == 1
    smooth = Interface("rock", "rock", friction_deg=8.0, restitution=0.2)
    assert oddities(replace(site, interfaces=(smooth,))) == []


@pytest.mark.parametrize(
    ("old", "new", "part"),
    [
        (
            "return_period = 5.0",
            "return_period = 0.12",
            "return_period = 0.12 years on section_length = 100 m: this makes 8.33 events a "
            "year on 100 m of slope; if it happens 0.12 times a year, write rate = 0.12",
        ),
        (
            "section_length = 100.0",
            "section_length = 0.1",
            "return_period = 5 years on section_length = 0.1 m: this makes 200 events a year",
        ),
        ("volume = [0.1, 1.0]", "volume = [0.0005, 0.0005]",
         "volume = [0.0005, 0.0005] m3: blocks of 0.5 litres, 1.3 kg; is it in m3?"),
        ("volume = [0.1, 1.0]", "volume = [10, 500]", "volume = [10, 500] m3: blocks of up to 500"),
        ("[road]", "[traffic]\nvehicles_per_day = 2e3\nspeed = 60\nsection_length = 2000\n[road]",
         "traffic.section_length = 2000 m: events.block, face was counted on section_length = 100"),
    ],
)  # fmt: skip
def test_odd_values_are_called_as_they_are_written(tmp_path, old, new, part):
    (tmp_path / "survey.csv").write_text(SOUND)
    run("new", "slope", "--profile", "survey.csv", *ASKED, folder=tmp_path)
    text = (tmp_path / "slope.toml").read_text()
    assert text.count(f"\n{old}\n") == 1
    file = tmp_path / "slope.toml"
    file.write_text(text.replace(f"\n{old}\n", f"\n{new}\n"))
    site = Site.load(file)
    found = oddities(site, (), site_oddities.written_events(str(file)))
    assert len([line for line in found if part in line]) == 1, found


def test_events_of_built_in_sites_are_known_as_they_are_written():
    assert site_oddities.written_events("quick")["block"]["area"] == [0.3, 2.0]
    assert site_oddities.written_events("verge-301") == {}


def test_measured_blocks_that_are_tiny_look_odd(slope):
    source = replace(slope.sources[0], edges=(0.1, 0.08, 0.06))
    site = replace(slope, sources=(source,), events=(replace(slope.events[0], area=None),))
    (line,) = [line for line in oddities(site) if "litres" in line]
    assert "sources.face.edges = [0.1, 0.08, 0.06] m: blocks of 0.13 litres, 0.35 kg" in line


@pytest.mark.parametrize(
    ("one", "part"),
    [
        (Existing("wall", 100.0, 10.0, thickness=1.0),
         "existing[0].height = 10 m: barrier_zone.max_height = 5 allows no new wall of this size"),
        (Existing("ditch", 100.0, depth=4.0, width=5.0), "existing[0].depth = 4 m"),
        (Existing("ditch", 95.0, depth=1.0, width=12.0), "existing[0].width = 12 m"),
        (Existing("wall", 100.0, 3.0, thickness=2.5), "existing[0].thickness = 2.5 m"),
        (Existing("fence", 100.0, 2.0, energy_class=250, removable=True, removal=8e3),
         "existing[0].removal = 8000 EUR/m"),
    ],
)  # fmt: skip
def test_unusual_barriers_that_stand_look_odd(slope, one, part):
    assert any(part in line for line in oddities(replace(slope, existing=(one,))))
    usual = Existing("wall", 100.0, 3.0, thickness=1.0)
    assert oddities(replace(slope, existing=(usual,))) == []


@pytest.mark.parametrize(
    ("one", "part"),
    [
        (Forest(30.0, 90.0, stems=8000.0, dbh=0.3), "8000 stems of 0.3 m are a basal area of 565"),
        (Forest(30.0, 90.0, stems=400.0, dbh=0.03), "400 stems of 0.03 m are a basal area of 0.28"),
        (
            Forest(30.0, 90.0, stems=200.0, dbh=0.3, dbh_sd=0.4),
            "forest[0].dbh_sd = 0.4: it is more",
        ),
        (
            Forest(30.0, 90.0, stems=400.0, dbh=0.3, height=25.0),
            "forest[0].height = 25: the energy",
        ),
        (Forest(0.0, 4.0, stems=400.0, dbh=0.3), "forest[0].end = 4: all rock starts farther"),
        (Forest(30.0, 115.0, stems=400.0, dbh=0.3), "forest[0]: it reaches onto the road, x = 112"),
    ],
)
def test_an_unusual_forest_looks_odd(slope, one, part):
    (line,) = oddities(replace(slope, forest=(one,)))
    assert part in line
    usual = Forest(30.0, 90.0, stems=400.0, dbh=0.3, dbh_sd=0.1)
    assert oddities(replace(slope, forest=(usual,))) == []


def test_a_forest_is_told_with_what_it_does(slope):
    wood = Forest(30.0, 90.0, stems=400.0, dbh=0.3)
    (line,) = [
        line for line in site_check.facts(replace(slope, forest=(wood,))) if "forest" in line
    ]
    assert "forest at x = 30 to 90 m: 400 stems a hectare of 0.3 m, a basal area of 28.3 m2" in line
    assert "a block 0.68 m wide strikes one in every 25.5 m, which takes at most 93 kJ" in line


def test_a_closure_for_fifty_euros_looks_odd(slope):
    with pytest.warns(rigdda.errors.DoubtfulInput, match="consequences.closure"):
        site = changed(slope, "consequences", closure=50.0)
    (line,) = oddities(site)
    assert line.startswith("consequences.closure = 50 EUR/day: a day of closure usually costs")


def test_a_height_that_is_unusual_for_its_kind_looks_odd_in_a_zone_of_high_barriers(slope):
    site = changed(slope, "barrier_zone", max_height=20.0)
    wall = Existing("wall", 100.0, 10.0, thickness=1.0)
    (line,) = oddities(replace(site, existing=(wall,)))
    assert line.startswith("existing[0].height = 10 m: few barriers of the kind wall are higher")


def test_coordinates_in_other_units_look_odd(slope):
    feet = 3.28084
    points = tuple((x, y * 20.0) for x, y in slope.slope.points)
    high = replace(slope, slope=replace(slope.slope, points=points))
    assert any("not in millimetres or feet" in line for line in oddities(high))
    grown = tuple((feet * x, feet * y) for x, y in slope.slope.points)
    road = replace(slope.road, start=feet * 112.0, end=feet * 121.0)
    wide = replace(slope, slope=replace(slope.slope, points=grown), road=road)
    assert any("not in feet" in line for line in oddities(wide))


def test_a_point_far_from_both_neighbours_looks_odd(slope):
    points = list(slope.slope.points)
    x, y = points[3]
    points[3] = (x, y - 36.0)
    pit = replace(slope, slope=replace(slope.slope, points=tuple(points)))
    told = [line for line in oddities(pit) if "typing error" in line]
    assert len(told) == 1 and told[0].startswith(f"slope.points[3] = [{x:g}, {y - 36.0:g}]")
    assert "below both of its neighbours" in told[0]


def test_rock_in_mid_air_looks_odd(slope):
    square = np.array([[14.0, 0.0], [16.0, 0.0], [16.0, 2.0], [14.0, 2.0]])
    for lift, odd in ((0.001, False), (3.0, True)):
        bottom = slope.profile.height(14.0) + lift
        block = tuple(map(tuple, np.add(square, [0.0, bottom]).tolist()))
        source = rigdda.Source("face", blocks=(block,))
        event = Event("block", 0.2, "face")
        rock = replace(slope, sources=(source,), events=(event,))
        assert any("hangs" in line for line in oddities(rock)) == odd


def test_ground_of_the_zone_has_a_price_and_walls_have_the_surface_of_concrete(tmp_path):
    (tmp_path / "survey.csv").write_text(SOUND)
    grounds = ("--ground", "meadow:72-112", "--ground", "weathered_rock:22-72")
    run("new", "survey", "--profile", "survey.csv", *ASKED, *grounds, folder=tmp_path)
    site = Site.load(tmp_path / "survey.toml")
    own = {"rock": 40.0, "soil": 15.0, "meadow": 15.0, "weathered_rock": 40.0, "asphalt": 40.0}
    assert site.prices.ditch == own
    scene = site.realise([rigdda.GravityWall(site.barrier_zone.end - 3.0, 2.0, 1.0)], 0)
    assert scene.barrier_surface == "concrete"
    weight = 9.81 * scene.barriers[0].density * abs(rigdda.geometry.moments_of(scene.outline(0))[0])
    for name in ("meadow", "concrete"):
        angle = scene.surfaces[name].friction_deg
        assert scene.resistance(0) <= weight * np.tan(np.radians(angle)) * (1.0 + 1e-9)
    told = [line for line in oddities(site) if "concrete" in line or "prices.ditch" in line]
    assert told == []
    bare = {name: one for name, one in site.surfaces.items() if name != "concrete"}
    prices = replace(site.prices, ditch={"rock": 40.0, "soil": 15.0})
    told = oddities(replace(site, surfaces=bare, prices=prices))
    assert any("[surfaces.concrete]" in line and "'meadow'" in line for line in told)
    assert any(line.startswith("prices.ditch has no price for 'meadow'") for line in told)


@pytest.mark.parametrize("name", ["verge", "shu-hwa", "quick"])
def test_the_volume_of_a_release_is_in_the_range_that_the_check_tells(name):
    site = Site.load(name)
    for event in site.events:
        (narrow, wide), (least, most) = site_check.size_of_release(event, site.source(event.source))
        for seed in range(3):
            (outcome,) = rigdda.release_many([(site, (), seed, event.name)])
            slack = 0.3 if event.area is None else 1e-9  # blocks of a mass are cut anew each time
            assert narrow * (1 - 1e-9) <= outcome.width <= wide * (1 + 1e-9)
            assert least * (1 - slack) <= outcome.released_volume <= most * (1 + slack)


def test_a_site_without_a_surface_of_rock_is_checked(slope):
    names = {"rock": "granite"}
    surfaces = {names.get(name, name): one for name, one in slope.surfaces.items()}
    ground = replace(
        slope.slope,
        surface=names.get(slope.slope.surface, slope.slope.surface),
        surfaces=tuple(
            replace(part, surface=names.get(part.surface, part.surface))
            for part in slope.slope.surfaces
        ),
    )
    sources = tuple(replace(source, surface="granite") for source in slope.sources)
    other = replace(slope, surfaces=surfaces, slope=ground, sources=sources)
    told = oddities(other)
    assert any(line.startswith("prices.ditch has no price for 'granite'") for line in told)


def test_releases_that_are_cut_off_look_odd(slope):
    name = slope.event_names[0]
    line = oddities(slope, [Trial(name, 0.1, True)])
    assert len(line) == 1 and "motion.duration" in line[0]


def test_the_blocks_of_a_jointed_mass_are_told(slope):
    top = slope.profile.height(12.0)
    corners = ((12.0, top), (18.0, slope.profile.height(18.0)), (18.0, top), (15.0, top + 4.0))
    sets = tuple(rigdda.model.joints.JointSet(dip, spacing, 0.1)
                 for dip, spacing in ((45.0, 0.8), (-50.0, 1.1)))  # fmt: skip
    source = rigdda.Source("mass", polygon=corners, joints=sets)
    site = replace(slope, sources=(source,), events=(Event("mass", 0.01, "mass", width=10.0),))
    told = next(line for line in site_check.facts(site) if line.startswith("source mass"))
    low, high = map(int, re.search(r"given: (\d+) to (\d+) blocks", told).groups())
    counts = [len(site.realise(seed=seed).blocks) for seed in range(10)]
    assert 0.8 * low <= min(counts) and max(counts) <= 1.2 * high
    assert not [line for line in oddities(site) if "block_area" in line]
    scaled = replace(site, sources=(replace(source, block_area=2.0),))
    assert [line for line in oddities(scaled) if "leave block_area out to keep them" in line]
    assert len(scaled.realise().blocks) < min(counts)


def test_progress_of_a_check_needs_no_terminal(tmp_path):
    process = rig("check", "quick", "--out", "a", folder=tmp_path)
    out, err = process.communicate(timeout=300)
    assert (process.returncode, err) == (0, "")
    assert "source mass: a jointed mass" in out and "1 thing looks odd" in out


def test_placeholders_stay_marked_in_files_that_commands_write(tmp_path: Path) -> None:
    text = "\n".join(
        (
            'name = "a"', "# Density; placeholder: replace.", "level = 3", "[[sources]]",
            "# Band; placeholder: replace.", "# Second line.", "band = [1, 2]", "[[sources]]",
            "band = [3, 4]", "# density; given.", "density = 2", "[surfaces.rock]",
            "# Rolling; placeholder: replace.", "rolling = 0.1", "# # template = 3",
        )
    )  # fmt: skip
    found = value_origins.marks(text)
    assert [mark.path for mark in found] == ["level", "sources.band", "surfaces.rock.rolling"]
    assert [mark.place for mark in found] == [0, 0, 0]
    bare = "\n".join(line for line in text.splitlines() if not line.startswith("#"))
    again = value_origins.with_marks(bare, found)
    assert value_origins.marks(again) == found
    site = Site.load("quick")
    mark = value_origins.Mark
    kept = [
        mark("slope", 0, "toe"),
        mark("events", 1, "return_period"),
        mark("events", 0, "volume"),
    ]
    value_origins.save(site, tmp_path / "site.toml", kept)
    length = mark("traffic", 0, "section_length")
    assert length.stored == length
    found = set(value_origins.marks_of(tmp_path / "site.toml"))
    assert found == {mark("slope", 0, "toe"), mark("events", 1, "rate"), mark("events", 0, "area")}
    assert Site.load(tmp_path / "site.toml") == site
