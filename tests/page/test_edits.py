"""Edits of site files in every style in which TOML can be written."""

import copy
import tomllib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigdda.app.page import edits

pytest.importorskip("tomlkit", reason="the extra page is not installed")

DATA = {
    "name": "a",
    "slope": {
        "points": [[0.0, 1.0], [2.0, 3.0]],
        "toe": 5.0,
        "surfaces": [
            {"start": 1.0, "end": 2.0, "surface": "soil"},
            {"start": 3.0, "end": 4.0, "surface": "soil"},
        ],
    },
    "sources": [{"name": "r", "band": [1.0, 2.0]}, {"name": "s", "band": [3.0, 4.0]}],
    "events": [{"name": "b", "rate": 1.0, "volume": [0.1, 0.2]}, {"name": "c", "rate": 2.0}],
    "meshes": [{"name": "m", "factors": {"b": 0.5, "c": 0.2}}],
    "road": {"start": 1.0, "end": 2.0},
    "surfaces": {"rock": {"ground": "hard_rock"}, "soil": {"ground": "clay", "rolling": 0.1}},
}
"""Tables like those of a site file."""

ROWS = [{"start": 1.0, "end": 1.5, "surface": "rock"}]

EDITS = {
    "a value": (
        lambda text: edits.with_value(text, ("road", "start"), 0.5),
        lambda data: data["road"].update(start=0.5),
    ),
    "an item of a list in a table of a list": (
        lambda text: edits.with_value(text, ("sources", 1, "band", 0), 2.5),
        lambda data: data["sources"][1].update(band=[2.5, 4.0]),
    ),
    "a key in a table of a list": (
        lambda text: edits.with_value(text, ("sources", 0, "aspect"), [1.0, 2.0]),
        lambda data: data["sources"][0].update(aspect=[1.0, 2.0]),
    ),
    "other keys": (
        lambda text: edits.with_values(
            text, {("events", 0, "rate"): None, ("events", 0, "return_period"): 3.0}
        ),
        lambda data: data["events"].__setitem__(
            0, {"name": "b", "volume": [0.1, 0.2], "return_period": 3.0}
        ),
    ),
    "a new table in a table": (
        lambda text: edits.with_value(text, ("surfaces", "meadow", "ground"), "meadow"),
        lambda data: data["surfaces"].update(meadow={"ground": "meadow"}),
    ),
    "two new tables in a table": (
        lambda text: edits.with_values(
            text, {("surfaces", "a", "ground"): "peat", ("surfaces", "b", "ground"): "clay"}
        ),
        lambda data: data["surfaces"].update(a={"ground": "peat"}, b={"ground": "clay"}),
    ),
    "a table in a new table": (
        lambda text: edits.with_value(text, ("prices", "lives", "fence"), 20.0),
        lambda data: data.update(prices={"lives": {"fence": 20.0}}),
    ),
    "the only key of a table": (
        lambda text: edits.with_value(text, ("surfaces", "rock", "ground"), None),
        lambda data: data["surfaces"].update(rock={}),
    ),
    "the only key of a table and another": (
        lambda text: edits.with_values(
            text, {("surfaces", "rock", "ground"): None, ("surfaces", "rock", "rolling"): 0.2}
        ),
        lambda data: data["surfaces"].update(rock={"rolling": 0.2}),
    ),
    "rows": (
        lambda text: edits.with_rows(text, ("slope", "surfaces"), ROWS),
        lambda data: data["slope"].update(surfaces=ROWS),
    ),
    "no rows": (
        lambda text: edits.with_rows(text, ("slope", "surfaces"), []),
        lambda data: data["slope"].update(surfaces=[]),
    ),
    "a table of keys": (
        lambda text: edits.with_value(text, ("meshes", 0, "factors"), {"z": 0.5}),
        lambda data: data["meshes"][0].update(factors={"z": 0.5}),
    ),
    "all keys of a table of a list": (
        lambda text: edits.without(
            edits.without(text, ("meshes", 0, "factors", "b")), ("meshes", 0, "factors", "c")
        ),
        lambda data: data["meshes"][0].update(factors={}),
    ),
    "tables at the end of a list": (
        lambda text: edits.with_table(
            edits.with_table(text, "events", {"name": "d", "rate": 0.1}), "events", {"name": "e"}
        ),
        lambda data: data["events"].extend([{"name": "d", "rate": 0.1}, {"name": "e"}]),
    ),
    "a table with a table at the end of a list": (
        lambda text: edits.with_table(text, "meshes", {"name": "n", "factors": {"c": 1.0}}),
        lambda data: data["meshes"].append({"name": "n", "factors": {"c": 1.0}}),
    ),
    "a table of a new list": (
        lambda text: edits.with_table(text, "existing", {"kind": "fence", "x": 1.0}),
        lambda data: data.update(existing=[{"kind": "fence", "x": 1.0}]),
    ),
    "one table less": (
        lambda text: edits.without(text, ("events", 0)),
        lambda data: data["events"].pop(0),
    ),
    "another table in the place of all": (
        lambda text: edits.with_table(
            edits.without(edits.without(text, ("events", 1)), ("events", 0)),
            "events", {"name": "d"},
        ),
        lambda data: data.update(events=[{"name": "d"}]),
    ),
}  # fmt: skip
"""Edits of a text, each with what it does to the data."""


def _inline(value):
    """Return a value in one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {_inline(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_inline, value)) + "]"
    return f'"{value}"' if isinstance(value, str) else repr(value)


def _is_tables(value):
    return isinstance(value, list) and all(isinstance(one, dict) for one in value)


def _table(path, table, pick):
    """Return the lines of the keys of a table, and those of the tables in it under headers."""
    lines, below = [], []
    for key, value in table.items():
        style = pick(["inline", "split", "header"])
        if _is_tables(value) and style == "split":
            rows = [f"    {_inline(one)},{pick(['', ' # a note'])}" for one in value]
            lines += [f"{key} = [", *rows, "]"]
        elif isinstance(value, dict) and style == "split":
            lines += [f"{key}.{inner} = {_inline(one)}" for inner, one in value.items()]
        elif (_is_tables(value) or isinstance(value, dict)) and style == "header":
            here, many = [*path, key], isinstance(value, list)
            for one in value if many else [value]:
                own, inner = _table(here, one, pick)
                head = "[[{}]]" if many else "[{}]"
                if many or own or not inner or pick([True, False]):
                    own = [*pick([[], [""]]), head.format(".".join(here)), *own]
                below += [*own, *inner]
        else:
            lines += [*pick([[], ["# A note."]]), f"{key} = {_inline(value)}"]
    return lines, below


@st.composite
def _files(draw):
    """Draw a text of the tables in any style and order."""
    data = dict(draw(st.permutations(list(DATA.items()))))
    lines, below = _table([], data, lambda options: draw(st.sampled_from(options)))
    text = "\n".join([*lines, *below]) + "\n"
    assert tomllib.loads(text) == DATA
    return text


@pytest.mark.parametrize("what", EDITS)
@settings(max_examples=40, deadline=None)
@given(text=_files())
def test_an_edit_changes_only_its_value_in_every_style(what, text):
    edit, change = EDITS[what]
    wanted = copy.deepcopy(DATA)
    change(wanted)
    assert tomllib.loads(edit(text)) == wanted


@pytest.mark.parametrize("what", EDITS)
def test_tables_of_a_part_that_are_apart_are_edited_like_others(what):
    text = """
name = "a"
[[slope.surfaces]]
start = 1.0
end = 2.0
surface = "soil"
[surfaces.rock]
ground = "hard_rock"
[slope]
points = [[0.0, 1.0], [2.0, 3.0]]
toe = 5.0
[[sources]]
name = "r"
band = [1.0, 2.0]
[[slope.surfaces]]
start = 3.0
end = 4.0
surface = "soil"
[[sources]]
name = "s"
band = [3.0, 4.0]
[road]
start = 1.0
end = 2.0
[surfaces.soil]
ground = "clay"
rolling = 0.1
[[events]]
name = "b"
rate = 1.0
volume = [0.1, 0.2]
[[meshes]]
name = "m"
factors.b = 0.5
factors.c = 0.2
[[events]]
name = "c"
rate = 2.0
"""
    assert tomllib.loads(text) == DATA
    edit, change = EDITS[what]
    wanted = copy.deepcopy(DATA)
    change(wanted)
    assert tomllib.loads(edit(text)) == wanted


def test_a_new_table_is_written_as_its_neighbours_are():
    array = 'events = [\n    {name = "b", rate = 1.0}, # a note\n]\n'
    more = edits.with_table(array, "events", {"name": "c", "rate": 2.0})
    assert more == array.replace("]\n", '    {name = "c", rate = 2.0},\n]\n')
    dotted = 'surfaces.rock.ground = "hard_rock"\nroad.start = 1.0\n'
    new = edits.with_value(dotted, ("surfaces", "soil", "ground"), "clay")
    assert 'surfaces.soil = {ground = "clay"}\n' in new
    headed = '[surfaces.rock]\nground = "hard_rock"\n'
    assert "[surfaces.soil]\n" in edits.with_value(headed, ("surfaces", "soil", "ground"), "clay")
