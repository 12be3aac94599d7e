"""Malformed `[traffic]` and `[[existing]]`: one line each that names field, value and mend."""

from __future__ import annotations

import pytest

import rigdda
from rigdda import BadInput, Site
from rigdda.barriers import from_table
from rigdda.envs import DesignProblem

TEXT = rigdda.sites.text("quick")
SOUND = {"vehicles_per_day": 5000, "speed": 80, "section_length": 250}
FENCE = {"kind": '"fence"', "x": 20.0, "height": 2.0, "energy_class": 250}
DITCH = {"kind": '"ditch"', "x": 30.5, "depth": 1.0, "width": 2.0}


def table(head: str, values: dict[str, object]) -> str:
    return "\n".join(["", head, *(f"{k} = {v}" for k, v in values.items() if v is not None)])


TRAFFIC = [
    ({"vehicles_per_day": None}, "traffic.vehicles_per_day = None", "add this key"),
    ({"vehicles_per_day": 0}, "traffic.vehicles_per_day = 0", "above 0"),
    ({"vehicles_per_day": -5}, "traffic.vehicles_per_day = -5", "above 0"),
    ({"vehicles_per_day": "nan"}, "traffic.vehicles_per_day = nan", "finite number"),
    ({"vehicles_per_day": '"many"'}, "traffic.vehicles_per_day = 'many'", "number"),
    ({"vehicles_per_day": "true"}, "traffic.vehicles_per_day = True", "number"),
    ({"vehicles_per_day": 2e6}, "traffic.vehicles_per_day = 2000000", "at most 1e+06"),
    ({"speed": None}, "traffic.speed = None", "add this key"),
    ({"speed": 0}, "traffic.speed = 0", "at least 1"),
    ({"speed": 900}, "traffic.speed = 900", "at most 300"),
    ({"speed": "[80, 100]"}, "traffic.speed = [80, 100]", "number"),
    ({"section_length": None}, "traffic.section_length = None", "add this key"),
    ({"section_length": "inf"}, "traffic.section_length = inf", "finite number"),
    ({"vehicle_length": 0}, "traffic.vehicle_length = 0", "above 0"),
    ({"occupancy": -1}, "traffic.occupancy = -1", "above 0"),
    ({"vulnerability": "0.3"}, "traffic.vulnerability = 0.3", "give a list"),
    ({"vulnerability": "[]"}, "traffic.vulnerability = []", "at least 1"),
    ({"vulnerability": "[[1.0]]"}, "traffic.vulnerability[0] = [1.0]", "list of 2"),
    ({"vulnerability": "[[1.0, 1.5]]"}, "traffic.vulnerability[0] = [1.0, 1.5]", "0 to 1"),
    ({"vulnerability": "[[1, -0.1]]"}, "traffic.vulnerability[0][1] = -0.1", "at least 0"),
    ({"vulnerability": "[[2, 0.1], [1, 0.3]]"}, "traffic.vulnerability[1]", "increasing"),
    ({"vulnerability": "[[2, 0.1], [2, 0.3]]"}, "traffic.vulnerability[1]", "increasing"),
    ({"vulnerability_by": '"mass"'}, "traffic.vulnerability_by = 'mass'", "volume, energy"),
    ({"vulnerability_by": '"energy"'}, "traffic.vulnerability_by", "also give traffic.vuln"),
    ({"vulnerability_run_into": 30}, "traffic.vulnerability_run_into = 30", "at most 1"),
    ({"decision_sight_distance": -1}, "traffic.decision_sight_distance = -1", "at least 0"),
    ({"decision_sight_distance": 9, "run_into": 0.5}, "traffic.run_into = 0.5", "leave it out"),
    ({"run_into": 2}, "traffic.run_into = 2", "at most 1"),
    ({"commuter_trips": -1}, "traffic.commuter_trips = -1", "at least 0"),
    ({"vehicles_per_day": 1, "commuter_trips": 1e5}, "traffic.commuter_trips = 1", "at most 365,"),
    ({"vehicles_per_day": 2, "commuter_trips": 731}, "traffic.commuter_trips", "at most 730,"),
    ({"vehicles_per_day": 0.5}, "traffic.commuter_trips = 500", "vehicles_per_day is 0.5"),
    ({"vehicles_per_day": 2, "occupancy": 0.5}, "traffic.commuter_trips = 500", "at most 365,"),
    ({"fatality_value": -1}, "traffic.fatality_value = -1", "at least 0"),
    ({"fatality_value": '"high"'}, "traffic.fatality_value = 'high'", "number"),
    ({"vehicles": 5000}, "traffic.vehicles = 5000", "did you mean"),
    ({"source": 3}, "traffic.source = 3", "give a text"),
]

EXISTING = [
    ({"kind": None}, "existing[0].kind = None", "add this key"),
    ({"kind": '"mesh"'}, "existing[0].kind = 'mesh'", "fence, ditch"),
    ({"kind": '"fense"'}, "existing[0].kind = 'fense'", "fence, ditch"),
    ({"x": None}, "existing[0].x = None", "add this key"),
    ({"x": '"20"'}, "existing[0].x = '20'", "number"),
    ({"x": 2683420.0}, "existing[0].x = 2683420.0", "put it on the slope"),
    ({"x": -50.0}, "existing[0].x = -50", "put it on the slope"),
    ({"x": 40.0}, "existing[0].x = 40", "uphill of the road"),
    ({"x": 5.0}, "existing[0].x = 5", "outside the loose rock"),
    ({"height": None}, "existing[0].height = None", "add this key"),
    ({"height": 0}, "existing[0].height = 0", "at least"),
    ({"height": 9.0}, "existing[0]: fence height = 9", "at most 3 m"),
    ({"energy_class": None}, "existing[0].energy_class = None", "add the energy class"),
    ({"energy_class": 300}, "existing[0].energy_class = 300", "give one of 100, 250"),
    ({"energy_class": 250.5}, "existing[0].energy_class = 250.5", "whole number"),
    ({"depth": 1.0}, "existing[0].depth = 1", "a fence are height, thickness, energy_class"),
    ({"condition": 0}, "existing[0].condition = 0", "at least 0.05"),
    ({"condition": 50}, "existing[0].condition = 50", "at most 1"),
    ({"condition": '"good"'}, "existing[0].condition = 'good'", "number"),
    ({"removable": 1}, "existing[0].removable = 1", "give True or False"),
    ({"removal": 60}, "existing[0].removal = 60", "removable = true"),
    ({"removable": "true", "removal": -1}, "existing[0].removal = -1", "at least 0"),
    ({"capacity": 1e5}, "existing[0].capacity = 100000", "no such key"),
    ({"elongation": 2.0}, "existing[0].elongation = 2", "no such key"),
    ({"cost": 2.0}, "existing[0].cost = 2", "no such key"),
]


def refused(text: str) -> str:
    with pytest.raises(BadInput) as caught:
        Site.parse(text, "site.toml")
    return str(caught.value)


def says(words: str, field: str, mend: str) -> None:
    assert "\n" not in words
    assert words.startswith(field), words
    assert mend in words, words


@pytest.mark.parametrize(("change", "field", "mend"), TRAFFIC)
def test_traffic(change: dict[str, object], field: str, mend: str) -> None:
    says(refused(TEXT + table("[traffic]", SOUND | change)), field, mend)


@pytest.mark.parametrize(("change", "field", "mend"), EXISTING)
def test_existing(change: dict[str, object], field: str, mend: str) -> None:
    says(refused(TEXT + table("[[existing]]", FENCE | change)), field, mend)


@pytest.mark.parametrize(
    ("values", "field", "mend"),
    [
        (DITCH | {"condition": 0.5}, "existing[1].condition = 0.5", "sizes that the ditch has"),
        (DITCH | {"side_slope": -1.0}, "existing[1].side_slope = -1", "at least 0.02"),
        (DITCH | {"side_slope": 9.0}, "existing[1].side_slope = 9", "at most"),
        (DITCH | {"width": None}, "existing[1].width = None", "add this key"),
        (DITCH | {"height": 1.0}, "existing[1].height = 1", "ditch are depth, width, side_slope"),
        (
            {"kind": '"gravity_wall"', "x": 31.0, "height": 2.0, "width": 1.0},
            "existing[1].width = 1",
            "gravity wall are height, thickness",
        ),
        (FENCE | {"x": 20.1}, "existing[1].x = 20.1", "overlaps the existing fence at 20"),
        (DITCH | {"x": 19.0}, "existing[1].x = 19", "overlaps the existing fence"),
        (DITCH | {"depth": 5.0}, "existing[1]", "depth"),
        (
            {"kind": '"gravity_wall"', "x": 31.0, "height": 2.0, "density": 1.0},
            "existing[1].density = 1",
            "no such key",
        ),
    ],
)
def test_a_second_one(values: dict[str, object], field: str, mend: str) -> None:
    text = TEXT + table("[[existing]]", FENCE) + table("[[existing]]", values)
    says(refused(text), field, mend)


@pytest.mark.parametrize(
    ("text", "field", "mend"),
    [
        ("\ntraffic = 3\n", "traffic = 3", "give a table"),
        ("\nexisting = 3\n", "existing = 3", "give a list"),
        ("\nexisting = [3]\n", "existing[0] = 3", "give a table"),
    ],
)
def test_not_a_table(text: str, field: str, mend: str) -> None:
    says(refused(text + TEXT), field, mend)


@pytest.mark.parametrize("value", [0.0, -1e-6, 2.0, "low", float("nan"), True])
def test_a_target_that_is_no_probability(value: object) -> None:
    site = Site.parse(TEXT + table("[traffic]", SOUND), "site.toml")
    with pytest.raises(BadInput, match=r"^targets.individual = .*: give a (finite )?number"):
        DesignProblem(site, targets={"individual": value})  # type: ignore[dict-item]


def test_kinds_without_removable_barriers() -> None:
    with pytest.raises(BadInput, match=r"kinds = .*: leave removal out: quick has no existing"):
        DesignProblem("quick", kinds=("fence", "removal"))


def test_a_layout_file_has_no_condition() -> None:
    with pytest.raises(BadInput, match=r"^barriers\[0\].condition = 0.5: there is no such key"):
        from_table("barriers[0]", {"kind": "fence", "x": 3.0, "height": 2.0, "condition": 0.5})
