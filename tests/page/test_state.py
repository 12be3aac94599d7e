"""The project of a page: edits, history, files that others change."""

import tomllib
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rigdda import BadInput, Ditch, Fence, Site, load_layout, sites
from rigdda.app.page import edits
from rigdda.app.page.state import Conflict, Place, Project, place
from rigdda.app.value_origins import accepted, placeholders

QUICK = sites.text("quick")


def _project(folder: Path, text: str = QUICK) -> Project:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "site.toml").write_text(text, encoding="utf-8")
    return Project(Place(folder / "site.toml", folder))


NUMBER = st.floats(-50.0, 120.0) | st.sampled_from([float("nan"), 0.0, 34.8, 34.3])
EDIT = st.one_of(
    st.tuples(st.just("band"), st.tuples(NUMBER, NUMBER)),
    st.tuples(st.just("road"), st.tuples(NUMBER, NUMBER)),
    st.tuples(st.just("zone"), st.tuples(NUMBER, NUMBER)),
    st.tuples(st.just("point"), st.tuples(st.integers(0, 12), NUMBER)),
    st.tuples(st.just("fence"), st.tuples(NUMBER, st.floats(-1.0, 9.0))),
    st.tuples(st.just("ditch"), st.tuples(NUMBER, st.floats(-1.0, 9.0))),
    st.tuples(st.sampled_from(["undo", "redo", "clear", "reopen"]), st.none()),
)


def _apply(project: Project, kind: str, given: tuple) -> None:
    match kind:
        case "band":
            project.set_value(("sources", 0, "band"), list(given))
        case "road" | "zone":
            table = {"road": "road", "zone": "barrier_zone"}[kind]
            values = {(table, "start"): given[0], (table, "end"): given[1]}
            project.change_site(lambda text: edits.with_values(text, values), f"moved the {kind}")
        case "point":
            project.set_value(("slope", "points", given[0], 1), given[1])
        case "fence":
            fence = Fence(given[0], given[1], energy_class=1000)
            project.change_layout((*project.layout, fence), "added a fence")
        case "ditch":
            project.change_layout((*project.layout, Ditch(given[0], given[1], 3.0)), "a ditch")
        case "clear":
            project.change_layout((), "removed all barriers")
        case "undo":
            project.undo()
        case "redo":
            project.redo()


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(steps=st.lists(EDIT, max_size=12))
@pytest.mark.filterwarnings("ignore::rigdda.errors.DoubtfulInput")
def test_any_edits_leave_a_valid_project_on_disk_or_raise_a_clear_error(steps, tmp_path_factory):
    project = _project(tmp_path_factory.mktemp("project"))
    for kind, given_ in steps:
        if kind == "reopen":
            project = Project(project.where)
            continue
        before = project.current
        try:
            _apply(project, kind, given_)
        except BadInput as bad:
            assert bad.hint
            assert project.current == before
        assert Site.load(project.where.site) == project.site
        file = project.folder / "layout.toml"
        assert (load_layout(file) if file.is_file() else ()) == project.layout
    again = Project(project.where)
    assert (again.site, again.layout) == (project.site, project.layout)
    assert (again.undoes, again.redoes) == (project.undoes, project.redoes)


@settings(
    max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(heights=st.lists(st.floats(2.0, 5.0), min_size=1, max_size=8))
def test_undoing_everything_and_redoing_it_returns_every_state(heights, tmp_path_factory):
    project = _project(tmp_path_factory.mktemp("project"))
    seen = [project.current]
    for height in heights:
        project.change_layout((Fence(30.0, height, energy_class=3000),), f"height {height}")
        if project.current != seen[-1]:
            seen.append(project.current)
    for state in reversed(seen):
        assert project.current == state
        project.undo()
    for state in seen:
        assert project.current == state
        project.redo()


def test_an_edit_keeps_comments_and_changes_only_its_value(tmp_path):
    text = QUICK.replace("start = 34.8", "start = 34.8 # surveyed by A. B.")
    project = _project(tmp_path, text)
    project.set_value(("road", "end"), 45.0)
    new = (tmp_path / "site.toml").read_text(encoding="utf-8")
    assert "# surveyed by A. B." in new
    was, now = tomllib.loads(text), tomllib.loads(new)
    was["road"]["end"] = 45.0
    assert was == now


def test_a_value_that_is_set_is_no_placeholder_any_more():
    marked = QUICK.replace("[road]\n", "[road]\n# Uphill edge; placeholder: replace.\n", 1)
    marked = marked.replace("name =", "# Name; placeholder: replace.\nname =", 1)
    marked += "\n# [[forest]]\n# # Where it begins; placeholder: replace.\n# start = 4.0\n"
    assert placeholders(marked) == ["name", "road.start"]
    moved = edits.with_value(marked, ("road", "start"), 34.0)
    assert placeholders(moved) == ["name"]
    assert "# Uphill edge; given.\n" in moved
    assert placeholders(accepted(marked)) == []
    assert accepted(marked).count("placeholder") == 1  # of the table that is not used


def test_the_comment_of_a_band_follows_its_ends_and_goes_with_its_key():
    text = (
        "[[sources]]\n# Band; placeholder: replace.\nband = [1.0, 2.0]\n"
        "# Length; placeholder: replace.\nlength = 3.0\n"
    )
    moved = edits.with_value(text, ("sources", 0, "band", 1), 4.0)
    assert "# Band; given.\nband = [1.0, 4.0]" in moved
    assert placeholders(moved) == ["sources.length"]
    assert edits.with_value(text, ("sources", 0, "length"), None) == text[: text.index("# Length")]


def test_a_change_by_another_program_is_read_and_never_overwritten(tmp_path):
    project = _project(tmp_path)
    file = tmp_path / "site.toml"
    other = QUICK.replace("end = 44.8", "end = 45.5")
    file.write_text(other, encoding="utf-8")
    with pytest.raises(Conflict, match="another program"):
        project.set_value(("road", "end"), 46.0)
    assert file.read_text(encoding="utf-8") == other
    assert project.refresh()
    assert project.site.road.end == 45.5
    project.undo()
    assert project.site.road.end == 44.8
    assert Site.load(file).road.end == 44.8


def test_a_broken_file_is_told_and_the_page_may_keep_its_own(tmp_path):
    project = _project(tmp_path)
    (tmp_path / "site.toml").write_text("name = ", encoding="utf-8")
    with pytest.raises(BadInput, match="correct its TOML"):
        project.refresh()
    assert project.site.name == "quick"
    project.keep_mine()
    assert Site.load(tmp_path / "site.toml") == project.site


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ('[[barrier]]\nkind = "fence"\nx = 17.0\nheight = 3.0\n', "did you mean barriers"),
        ("barriers = []\nnote = 1\n", "note"),
        ("barriers = 3\n", "give a list"),
        ("# a comment only\n", "barriers"),
    ],
)
def test_a_layout_file_with_an_unknown_key_is_refused_and_kept(text, named, tmp_path):
    sites.load("quick").save(tmp_path / "site.toml")
    file = tmp_path / "layout.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(BadInput, match=named):
        Project.open(tmp_path)
    with pytest.raises(BadInput, match=named):
        load_layout(file)
    assert file.read_text(encoding="utf-8") == text


def test_alternatives_are_layout_files_with_plain_names(tmp_path):
    project = _project(tmp_path)
    project.change_layout((Fence(30.0, 3.0, energy_class=1000),), "a fence")
    file = project.keep("low fence")
    assert load_layout(file) == project.layout
    project.change_layout((), "none")
    project.take("low fence")
    assert project.layout == (Fence(30.0, 3.0, energy_class=1000),)
    for name in ("../out", "", "a/b", "x" * 70):
        with pytest.raises(BadInput, match="name of the alternative"):
            project.keep(name)
    project.drop("low fence")
    assert project.alternatives == {}


def test_a_built_in_site_is_copied_and_opened_again_as_it_was(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    project = Project.open("quick")
    assert project.folder == Path("runs/page-quick")
    project.set_value(("road", "end"), 45.0)
    assert Project.open("quick").site.road.end == 45.0


def test_what_cannot_be_opened_says_what_to_name(tmp_path):
    with pytest.raises(BadInput, match="existing site file"):
        place(tmp_path / "none.toml")
    with pytest.raises(BadInput, match="survey is imported"):
        place(tmp_path / "survey.csv")
    empty = Project.open(tmp_path)
    assert not empty.has_site
    with pytest.raises(BadInput, match="import a survey"):
        _ = empty.site


def test_a_site_file_of_another_name_has_a_folder_of_its_own(tmp_path):
    (tmp_path / "north.toml").write_text(QUICK, encoding="utf-8")
    project = Project.open(tmp_path / "north.toml")
    assert project.folder == tmp_path / "north.page"


@pytest.mark.parametrize(
    ("path", "value"),
    [(("sources", 9, "band"), [1.0, 2.0]), (("name", "x"), 1.0), (("road", 0), 1)],
)
def test_an_edit_of_what_is_not_there_names_it(path, value):
    with pytest.raises(BadInput, match=path[0]):
        edits.with_value(QUICK, path, value)


def test_tables_of_a_list_are_added_and_removed():
    event = {"name": "rare", "source": "face", "rate": 0.01, "area": [3.0, 4.0]}
    more = edits.with_table(QUICK, "events", event)
    assert Site.parse(more, "quick").event("rare").area == (3.0, 4.0)
    assert tomllib.loads(edits.without(more, ("events", 3))) == tomllib.loads(QUICK)
