"""The JSON Schema of files and the loader accept and refuse the same."""

from __future__ import annotations

import json
import tomllib

import jsonschema
import msgspec
import pytest

from rigdda import (
    BadInput,
    Ditch,
    Embankment,
    Fence,
    GravityWall,
    Mesh,
    Site,
    Wall,
    load_layout,
    save_layout,
    sites,
)
from rigdda.app import cli
from rigdda.barriers import KINDS
from rigdda.fields import checked, described, read
from rigdda.sites import document
from rigdda.sites.schema import schema

SITE, LAYOUT = (jsonschema.Draft7Validator(schema(name)) for name in ("site", "layout"))
EVERY_KIND = (
    Wall(12.0, 1.0, 0.5),
    GravityWall(17.0, 1.5, 1.0, 2300.0),
    Fence(22.0, 2.0, 1e4, elongation=0.3),
    Fence(23.0, 2.0, energy_class=500),
    Ditch(29.8, 0.8, 2.0, 0.3),
    Embankment(31.9, 0.6, 0.3, 0.4),
    Mesh(4.0, "face"),
)
TABLES = [
    (table, owner.schema | definition)
    for owner, tables in (
        (SITE, [table for _, table in document.TABLES if table is not document.SiteTables]),
        (LAYOUT, KINDS.values()),
    )
    for table in tables
    for definition in [owner.schema["definitions"][table.__name__]]
]
FIELDS = [
    pytest.param(table, whole, field, id=f"{table.__name__}.{field.name}")
    for table, whole in TABLES
    for field in described(table)
]


@pytest.mark.parametrize("name", sites.names())
def test_built_in_sites_pass(name, tmp_path):
    assert list(SITE.iter_errors(tomllib.loads(sites.text(name)))) == []
    site = Site.load(name)
    site.save(tmp_path / "saved.toml")
    assert list(SITE.iter_errors(tomllib.loads((tmp_path / "saved.toml").read_text()))) == []
    assert read(Site, msgspec.to_builtins(site)) == site


def test_layouts_of_every_kind_pass(tmp_path):
    save_layout(EVERY_KIND, tmp_path / "layout.toml")
    save_layout(EVERY_KIND, tmp_path / "layout.json")
    for tables in (
        tomllib.loads((tmp_path / "layout.toml").read_text()),
        json.loads((tmp_path / "layout.json").read_text()),
        {"barriers": [{"x": 3, "height": 2.0}]},  # a barrier without a kind is a wall
        {"barriers": []},
    ):
        assert list(LAYOUT.iter_errors(tables)) == []


@pytest.mark.parametrize(
    ("old", "new", "field", "mend"),
    [
        ("toe = 5.0", "", "slope.toe", "has no default"),
        ("toe = 5.0", "toe = 5.0\nsurfce = 'rock'", "slope.surfce", "did you mean surface?"),
        ("toe = 5.0", "toe = 5.0\nzzz = 1", "slope.zzz", "points, toe, surface, surfaces"),
        ("[road]", "[raod]", "raod", "did you mean road?"),
        ("toe = 5.0", "toe = true", "slope.toe", "give a number"),
        ("toe = 5.0", "toe = 2026-01-01", "slope.toe", "give a number"),
        ("toe = 5.0", "toe = 5.0\nsurface = 3", "slope.surface", "give a text"),
        ("[0.0, 20.0]", "[0.0, '20']", "slope.points[1][1]", "not a text"),
        ("[0.0, 20.0]", "[0.0]", "slope.points[1]", "list of 2"),
        ("[0.0, 20.0]", "7.0", "slope.points[1]", "give a list"),
        ("end = 12.0, surf", "end = 'x', surf", "slope.surfaces[0].end", "give a number"),
        ("band = [1.0, 2.8]", "band = [1.0]", "sources.face.band", "list of 2"),
        ('name = "face"', "name = 3", "sources[0].name", "give a text"),
        ("rate = 2.8", "rate = -1.0", "events.small, face.rate", "1000 [1/year per 100 m"),
        ("number = [4, 8]", "number = [0, 8]", "events.group.number[0]", "of at least 1"),
        ("number = [4, 8]", "number = [4.5, 8]", "events.group.number[0]", "a whole number"),
        ("design = true", 'design = "yes"', "events.block.design", "True or False"),
        ("max_height = 5.0", "max_height = 500.0", "barrier_zone.max_height", "at most 100 [m]"),
        ('ground = "hard_soil"', 'ground = "mud"', "surfaces.soil.ground", "meadow"),
        ("friction_deg = 28.0", "friction_deg = 95.0", "surfaces.soil.friction_deg", "89.9 [deg]"),
        ("block = 0.7", "block = 1.7", "meshes.face.factors.block", "at most 1"),
        ("[road]", "[prices.fence]\n750 = 300.0\n\n[road]", "prices.fence", "1000"),
        ("[road]", "[prices.upkeep]\nwall = 2.0\n\n[road]", "prices.upkeep.wall", "at most 0.5"),
        ("[road]", "[prices.ditch]\n\n[road]", "prices.ditch", "leave the table out"),
        ("duration = 20.0", 'damping_when = "never"', "motion.damping_when", "always, contact"),
        ("friction_deg = 28.0", "damping = 0.4", "surfaces.soil.damping", "give `rolling`"),
        ("friction_deg = 28.0", "rolling = 1.5", "surfaces.soil.rolling", "at most 1"),
        (
            "friction_deg = 28.0",
            "restitution_speed = 0",
            "surfaces.soil.restitution_speed",
            "above",
        ),
        ("[road]", "[lumped.soil]\nnormal = 3.0\n\n[road]", "lumped.soil.normal", "at most 1"),
        ("[road]", "[[road]]", "road", "give a table"),
    ],
)
def test_malformed_sites_are_refused_by_both(old, new, field, mend, tmp_path):
    text = sites.text("verge")
    assert old in text
    text = text.replace(old, new, 1)
    assert list(SITE.iter_errors(tomllib.loads(text)))
    with pytest.raises(BadInput) as caught:
        Site.parse(text, "site")
    assert caught.value.field == field
    assert mend in caught.value.hint


@pytest.mark.parametrize(
    ("table", "field"),
    [
        ({"kind": "moat", "x": 1.0, "height": 1.0}, "barriers[0].kind"),
        ({"x": 1.0}, "barriers[0].height"),
        ({"x": 1.0, "height": -1.0}, "barriers[0].height"),
        ({"x": "1", "height": 1.0}, "barriers[0].x"),
        ({"x": 1.0, "height": 1.0, "depth": 1.0}, "barriers[0].depth"),
        ({"kind": "fence", "x": 1.0, "height": 2.0, "energy_class": 7}, "barriers[0].energy_class"),
        ({"kind": "ditch", "x": 1.0, "depth": 1.0, "width": 0.0}, "barriers[0].width"),
        ({"kind": "gravity_wall", "x": 1, "height": 1, "density": 2.4}, "barriers[0].density"),
        ({"kind": "embankment", "x": 1, "height": 1, "density": 1.9}, "barriers[0].density"),
    ],
)
def test_malformed_layouts_are_refused_by_both(table, field, tmp_path):
    tables = {"barriers": [table]}
    assert list(LAYOUT.iter_errors(tables))
    (tmp_path / "layout.json").write_text(json.dumps(tables))
    with pytest.raises(BadInput) as caught:
        load_layout(tmp_path / "layout.json")
    assert caught.value.field == field


def test_a_layout_file_holds_a_table(tmp_path):
    (tmp_path / "layout.json").write_text("[]")
    assert list(LAYOUT.iter_errors([]))
    with pytest.raises(BadInput, match=r"layout\.json': give a table"):
        load_layout(tmp_path / "layout.json")


def beyond(part: dict) -> list:
    """Return values that a part of a schema refuses: of another type, and beyond its bounds."""
    if "items" in part:
        inner = [[value] * part.get("minItems", 1) for value in beyond(part["items"])]
        return [3.0, *inner]
    if "additionalProperties" in part and part["additionalProperties"] is not False:
        name = part.get("propertyNames", {"enum": ["any"]})["enum"][0]
        return [3.0, *({name: value} for value in beyond(part["additionalProperties"]))]
    found: list = [3.0] if "$ref" in part or "allOf" in part else [{}, []]
    if part.get("type") in ("number", "integer"):
        found += ["1", True]
    if "minimum" in part:
        found.append(part["minimum"] - 1)
    if "exclusiveMinimum" in part:
        found.append(part["exclusiveMinimum"])
    if "maximum" in part:
        found.append(part["maximum"] + 1)
    return [*found, "of no kind"] if "enum" in part else found


@pytest.mark.parametrize(("table", "whole", "field"), FIELDS)
def test_each_field_is_checked_alike_by_both(table, whole, field):
    whole = jsonschema.Draft7Validator({**whole, "required": []})
    needed = {one.name: None for one in described(table) if one.needed}
    wrong = beyond(whole.schema["properties"][field.name])
    assert wrong
    for value in wrong:
        assert list(whole.iter_errors({field.name: value})), value
        with pytest.raises(BadInput) as caught:
            checked(table, {field.name: value, **(needed | {field.name: value})}, "here")
        assert caught.value.field.startswith(f"here.{field.name}"), value


@pytest.mark.parametrize("name", ["site", "layout"])
def test_the_command_prints_a_sound_schema(name, capsys):
    assert cli.main(["schema", name]) == 0
    printed = json.loads(capsys.readouterr().out)
    jsonschema.Draft7Validator.check_schema(printed)
    assert printed == json.loads(json.dumps(schema(name)))
    assert "null" not in json.dumps(printed)
