"""Blunders of a tired engineer, from the survey to the site file: each is refused or told."""

from __future__ import annotations

from pathlib import Path

import pytest

from rigdda import BadInput, Site
from rigdda.app.new_site import SiteRequest, compose
from rigdda.app.site_oddities import oddities

SURVEY = """chainage,elevation
3100,588.2
3104,587.1
3109,575.0
3113,574.6
3118,561.3
3126,554.0
3133,551.2
3139,550.4
3148,550.3
3195,547.0
"""
"""A cut above a road at chainage 3139 to 3148."""

REQUEST = SiteRequest(road=(3139.0, 3148.0), sources=("face:3104.5-3109", "berm:3113.5-3118"))


def told(folder: Path, survey: str = SURVEY, request: SiteRequest = REQUEST, **edits: str) -> str:
    """Return all that is said of a survey and a site file in which texts are replaced."""
    file = folder / "survey.csv"
    file.write_text(survey, encoding="utf-8")
    try:
        text, profile = compose("cut", file, request)
        for old, new in edits.items():
            line = next(line for line in text.splitlines() if line.startswith(f"{old} = "))
            text = text.replace(line, f"{old} = {new}", 1)
        return "\n".join([*profile.notes, *oddities(Site.parse(text, "cut"))])
    except BadInput as refusal:
        return str(refusal)


def test_the_file_without_a_blunder_is_not_odd(tmp_path):
    assert "odd" not in told(tmp_path)
    assert [line for line in told(tmp_path).splitlines() if "x = 0 is chainage" not in line] == []


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("chainage,elevation", "chainage (ft),elevation (ft)", "in feet"),
        ("chainage,elevation", "chainage,elevation (mm)", "in millimetres"),
        ("chainage,elevation", "slope distance,elevation", "no chainages"),
        ("chainage,elevation", "point,elevation", "no chainages"),
        ("3118,561.3", "3118,-999", "missing value"),
        ("3118,561.3", "3118,0", "missing value"),
        ("3118,561.3", "3118,516.3", "typing error"),
        ("3113,574.6", "3113,594.6", "typing error"),
        ("3118,561.3", '3118,"561,3"', "decimal sign"),
        ("3118,561.3", "3118;561.3", "line 6"),
        ("3195,547.0", "3155,549.0", "survey the ground to 30 m beyond"),
        ("3126,554.0", "3106,554.0", "overhangs"),
    ],
)
def test_a_blunder_in_a_survey_is_told(old, new, words, tmp_path):
    assert words in told(tmp_path, SURVEY.replace(old, new))


@pytest.mark.parametrize(
    ("request_", "words"),
    [
        (REQUEST._replace(road=(39.0, 48.0)), "on the profile"),
        (REQUEST._replace(road=(3100.0, 3109.0)), "road"),
        (REQUEST._replace(sources=("face:3140-3145",)), "uphill of the road"),
        (REQUEST._replace(toe=3104.0), "of its foot, not of its crest"),
        (REQUEST._replace(grounds=("lava",)), "one of the grounds"),
    ],
)
def test_a_blunder_on_the_command_line_is_told(request_, words, tmp_path):
    assert words in told(tmp_path, request=request_)


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("volume", "[0.0001, 0.0005]", "litres"),
        ("volume", "[100.0, 900.0]", "clear the road"),
        ("return_period", "0.12", "return_period"),
        ("density", "2.6", "density"),
        ("density", "900.0", "density"),
        ("number", "[900, 900]", "width along the road"),
        ("design", "false", "design"),
        ("max_height", "0.5", "max_height"),
        ("band", "[1.0, 4.0]", "friction"),
    ],
)
def test_a_blunder_in_the_site_file_is_told(field, value, words, tmp_path):
    said = told(tmp_path, request=REQUEST._replace(sources=("face:3104.5-3109",)), **{field: value})
    assert words in said, said
