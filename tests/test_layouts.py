"""Layout files, prices, outcomes and replays of every kind of barrier."""

from __future__ import annotations

import math
from pathlib import Path

import msgspec
import numpy as np
import pytest
from rerun.chunk import RrdReader

import rigdda
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
)
from rigdda.barriers import KINDS, describe
from rigdda.measurement import stations
from rigdda.model.scene import scene_from_json, scene_to_json
from rigdda.replay.recording import Marks

QUICK = Site.load("quick")
LAYOUT = (
    Wall(12.0, 1.0, 0.5),
    GravityWall(17.0, 1.5, 1.0, 2300.0),
    Fence(22.0, 2.0, 1e4, elongation=0.3),
    Ditch(29.8, 0.8, 2.0, 0.3),
    Embankment(31.9, 0.6, 0.3, 0.4),
    Mesh(4.0, "face"),
)


@pytest.mark.parametrize("name", ["layout.toml", "layout.json"])
def test_layout_files_give_back_every_kind(name, tmp_path):
    save_layout(LAYOUT, tmp_path / name)
    assert load_layout(tmp_path / name) == LAYOUT


def test_a_table_without_kind_is_a_wall(tmp_path):
    (tmp_path / "layout.toml").write_text("[[barriers]]\nx = 1\nheight = 2.0")
    assert load_layout(tmp_path / "layout.toml") == (Wall(1.0, 2.0),)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('kind = "moat"\nx = 1.0\nheight = 1.0', ["barriers[0].kind", "moat", "gravity_wall"]),
        ("x = 1.0\nheight = 1.0\ncapacity = 3.0", ["barriers[0]", "capacity"]),
        ('kind = "fence"\nx = 1.0\nheight = 1.0', ["fence capacity", "energy_class"]),
        (
            'kind = "fence"\nx = 1.0\nheight = 1.0\ncapacity = -1.0',
            [".capacity", "at least"],
        ),
        ('kind = "ditch"\nx = 1.0\ndepth = "1.0"\nwidth = 3.0', ["barriers[0]", "depth"]),
        ('x = "1.0"\nheight = 1.0', ["barriers[0].x", "give a number"]),
        ('kind = "gravity_wall"\nx = 1.0\nheight = 1.0\ndensity = nan', ["barriers[0].density"]),
        (
            'kind = "gravity_wall"\nx = 1.0\nheight = 1.0\ndensity = 2.4',
            ["barriers[0].density = 2.4", "at least 500 and at most 100000 [kg/m3]"],
        ),
        (
            'kind = "embankment"\nx = 1.0\nheight = 1.0\ndensity = 1.9',
            ["barriers[0].density = 1.9", "at least 200 and at most 100000 [kg/m3]"],
        ),
        ('kind = "embankment"\nx = 1.0\nheight = 1.0\ndensity = 1e15', ["barriers[0].density"]),
        (
            'kind = "mesh"\nx = 1.0\noption = "face"\n[[barriers]]\nkind = "mesh"\nx = 2.0\n'
            'option = "face"',
            ["barriers[1].option = 'face'", "barriers[0] has it"],
        ),
        ('kind = "ditch"\nx = 1.0\ndepth = 1.0\nwidth = 3.0\nside_slope = 9.0', ["side_slope"]),
        ("x = 1.0\nheight = 1.0\nheigth = 1.0", ["heigth"]),
        ("x = 1.0\nheight = -1.0", ["barriers[0]", "height"]),
    ],
)
def test_bad_tables_are_named(text, words, tmp_path):
    (tmp_path / "layout.toml").write_text(f"[[barriers]]\n{text}\n")
    with pytest.raises(BadInput) as caught:
        load_layout(tmp_path / "layout.toml")
    line = str(caught.value)
    assert all(word in line for word in words), line
    assert "\n" not in line


@pytest.mark.parametrize("barrier", [GravityWall(17.0, 1.5), Embankment(31.0, 0.6)])
def test_a_barrier_for_a_narrow_event_is_recorded_with_its_density(barrier):
    """It is dense, as all of an element or of its load's spread resists the width of the event."""
    narrow = barrier.for_width(0.01)
    assert narrow.density > 1e5
    scene = QUICK.scene(QUICK.draw(0, "block"), (narrow,))
    assert scene_from_json(scene_to_json(scene)).barriers == (narrow,)


def test_numbers_are_not_read_from_text():
    with pytest.raises(BadInput, match="wall height = '2': give a number"):
        Wall(1.0, "2")  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def seed():
    """Return the first release in which the fence and the gravity wall fail."""
    for found in range(20):
        _, heavy, fence, *_ = rigdda.release_outcome(QUICK, LAYOUT, found, "mass").barriers
        if heavy.failed and fence.failed:
            return found
    pytest.fail("the fence and the gravity wall never fail in the same release")


@pytest.fixture(scope="module")
def released(seed):
    return rigdda.release(QUICK, LAYOUT, seed, "mass")


def test_every_kind_reports(released, seed):
    _, outcome = released
    wall, heavy, fence, ditch, dam = outcome.barriers
    assert wall.state == "stands" and wall.displacement == 0.0
    assert heavy.state in ("slid", "overturned") and heavy.displacement > 0.1
    assert fence.failed and fence.state == "failed" and fence.caught == 0.0
    # the force of its brakes over its elongation, and blows on the mass of its net
    assert 1.0 <= fence.absorbed_energy / LAYOUT[2].capacity < 20.0
    assert fence.max_energy > 0.0
    for earthwork in (ditch, dam):
        assert (earthwork.hits, earthwork.absorbed_energy) == (0, 0.0)
        assert math.isinf(earthwork.resistance) == (earthwork is ditch)
    assert (ditch.state, ditch.thrust, ditch.left_height) == ("stands", 0.0, 0.0)
    assert dam.failed == (dam.state == "pushed") == (dam.thrust > dam.resistance)
    assert fence.left_height == 0.0 < wall.left_height == LAYOUT[0].height
    assert heavy.failed and heavy.resistance > 0.0 < wall.thrust
    caught = [rigdda.release(QUICK, (LAYOUT[3],), seed, "mass")[1].barriers[0] for seed in range(4)]
    assert max(found.caught for found in caught) > 0.0
    shares = ("slope_fraction", "held_fraction", "road_fraction", "beyond_fraction")
    assert sum(getattr(outcome, name) for name in shares) == 1.0
    assert outcome.held_fraction >= ditch.caught
    released_mass = rigdda.release(QUICK, (), seed, "mass")[1].released_mass
    assert outcome.released_mass == pytest.approx(released_mass, rel=1e-12)


def test_what_passes_a_failed_fence_did_not_overtop_it(released):
    run, outcome = released
    line = stations(QUICK, LAYOUT[:5]).index(LAYOUT[2].end)
    passed = run.crossings(line)["time"]
    assert outcome.barriers[2].overtopped == (passed < run.failure(2)).sum() < len(passed)


def test_what_passes_a_wall_that_was_overturned_did_not_overtop_it():
    wall = GravityWall(25.6, 4.0, 0.6)
    run, outcome = rigdda.release(QUICK, (wall,), 0, "mass")
    (over,) = (time for time, state in run.states(0) if state == "overturned")
    passed = run.crossings(stations(QUICK, (wall,)).index(wall.end))["time"]
    assert outcome.barriers[0].overtopped == (passed < over).sum() < len(passed)


def test_a_wall_blocks_the_road_with_what_lies_on_it():
    wall = GravityWall(20.5, 4.0, 0.6)
    run, outcome = rigdda.release(QUICK, (wall,), 3, "mass")
    found = outcome.barriers[0]
    assert wall.end + found.displacement > QUICK.road.start > run.outline(0)[:, 0].max()
    assert (found.state, found.road_area) == ("overturned", 0.0)
    fallen = np.array([[9.0, 0.0], [13.0, 3.0], [12.4, 3.8], [8.4, 0.8]])
    assert wall.area_beyond(0.0, fallen) == pytest.approx(5.0)
    assert wall.area_beyond(12.4, fallen) == pytest.approx(0.5 * 0.6 * (0.8 + 0.45))
    assert wall.area_beyond(13.0, fallen) == 0.0


def test_a_wall_that_rocks_and_comes_back_stands():
    wall, times = GravityWall(0.0, 3.0, 1.2), np.arange(4.0)

    def changes(*poses):
        return wall.changes(times, np.array(poses), math.inf)

    here, tilted, away = (0.0, 0.0, 0.0), (0.18, 0.0, -0.1), (0.2, 0.0, 0.0)
    leaning = (0.02, 0.0, -0.1)  # its top by 0.15 m
    over = (2.0, -1.0, -1.5)
    assert changes(here, tilted, tilted, here) == []
    assert changes(here, tilted, here, away) == [(3.0, "slid")]
    assert changes(here, here, leaning, leaning) == [(2.0, "slid")]
    assert changes(here, away, away, away) == [(1.0, "slid")]
    assert changes(here, away, over, over) == [(1.0, "slid"), (2.0, "overturned")]
    assert changes(here, over, over, over) == [(1.0, "overturned")]


def test_every_kind_is_described_and_known():
    assert {barrier.kind for barrier in LAYOUT} == set(KINDS) - {"removal"}
    words = [describe(barrier) for barrier in LAYOUT]
    assert words[2] == "fence at 22.0 m, 2.0 m high, 10 kJ/m"
    assert len(set(words)) == 6


def test_replays_show_every_kind(released, tmp_path):
    run, _ = released
    path = tmp_path / "episode.rrd"
    run.to_rerun(path, Marks())
    chunks = list(RrdReader(path).stream().to_chunks())
    for i in range(5):
        assert any(chunk.entity_path == f"/world/barriers/{i}" for chunk in chunks)

    def moving(entity, component):
        stream = RrdReader(path).stream().filter(content=entity, is_static=False)
        batches = [chunk.to_record_batch() for chunk in stream.to_chunks()]
        (batch,) = [found for found in batches if component in found.schema.names]
        return batch.column("sim_time").cast("int64").to_numpy() * 1e-9, batch.column(
            component
        ).to_pylist()

    times, places = moving("/world/barriers/1", "Transform3D:translation")
    assert len(times) == len(run.times)
    assert places[-1][0][:2] == pytest.approx(run.barrier_poses[-1, 1, :2], rel=1e-5)
    times, colours = moving("/world/barriers/2", "Mesh3D:albedo_factor")
    assert times[1] == pytest.approx(run.failure(2), abs=1e-6)
    assert colours[0] != colours[1]


def test_pictures_show_every_kind(released, seed):
    from rigdda.envs.rendering import picture

    run, _ = released
    image = picture(run, QUICK, LAYOUT, "all")
    bare = picture(rigdda.release(QUICK, (), seed, "mass")[0], QUICK, (), "all")
    assert image.shape == bare.shape == (450, 800, 3)
    assert np.abs(image.astype(int) - bare).sum() > 0


def test_mesh_over_a_jointed_mass_is_drawn() -> None:
    from rigdda.envs.rendering import picture

    mass = QUICK.source(QUICK.event("mass").source)
    assert mass.band is None
    option = rigdda.MeshOption("net", 20.0, 50.0, {"mass": 0.5})
    site = msgspec.structs.replace(QUICK, meshes=(option,))
    ends = mass.outline[:, 0]
    assert site.mesh_span("net") == (ends.min(), ends.max())
    run, _ = rigdda.release(site, (), 0, "block")
    with_mesh = picture(run, site, (Mesh(float(ends.mean()), "net"),), "mesh")
    assert (with_mesh != picture(run, site, (), "mesh")).any()


def test_a_picture_names_the_state_of_a_wall_that_slid(monkeypatch: pytest.MonkeyPatch) -> None:
    from rigdda.envs import rendering

    run, _ = rigdda.release(QUICK, (GravityWall(17.0, 1.0, 1.0),), 3, "mass")
    assert run.state(0, 0) == "stands" and run.state(0) in ("slid", "overturned")
    written: list[str] = []
    monkeypatch.setattr(
        rendering,
        "write_labels",
        lambda figure, labels: written.extend(one.words for _, own in labels for one in own),
    )
    rendering.picture(run, QUICK, run.scene.barriers, "wall")
    assert written == [f"gravity wall 1.0 m high: {run.state(0)}"]


@pytest.mark.parametrize("size", [(6.0, 4.0), (12.0, 5.0)])
def test_labels_of_a_picture_do_not_overlap(size):
    from matplotlib.figure import Figure
    from matplotlib.text import Annotation

    from rigdda.envs.rendering import Label, write_labels

    figure = Figure(size, dpi=100, layout="constrained")
    axes = figure.subplots()
    axes.set(xlim=(0.0, 100.0), ylim=(0.0, 50.0))
    places = [(10.0, 40.0), (60.0, 8.0), (62.0, 5.0), (90.0, 3.0), (91.0, 3.0), (99.0, 3.0)]
    labels = [Label(f"fence 1,000 kJ, {x:.1f} m high", (x, y)) for x, y in places]
    write_labels(figure, [(axes, labels)])
    figure.draw_without_rendering()
    boxes = [
        Annotation.get_bbox_patch(text).get_window_extent()
        for text in axes.texts
        if isinstance(text, Annotation)
    ]
    frame = axes.get_window_extent()
    assert len(boxes) == len(places)
    assert not any(one.overlaps(other) for i, one in enumerate(boxes) for other in boxes[:i])
    assert all(box.x0 > frame.x0 - 3.0 and box.x1 < frame.x1 + 3.0 for box in boxes)


def test_a_fence_that_stands_holds_what_a_failed_one_does_not():
    passed = np.zeros(2)
    for seed in range(1, 7):  # in a single release what hits what is chance
        weak, strong = (
            rigdda.release(QUICK, (Fence(20.0, 4.0, capacity),), seed, "mass")[1]
            for capacity in (1e4, 1e9)
        )
        assert weak.barriers[0].failed and not strong.barriers[0].failed
        assert math.isclose(weak.held_fraction, 0.0) and strong.held_fraction > 0.05
        passed += weak.debris_fraction, strong.debris_fraction
    assert passed[1] < passed[0]


def test_classes_of_fences_are_whole_numbers_in_files(tmp_path: Path) -> None:
    for number in (1000.0, np.int64(1000), np.float64(1000.0)):
        layout = (Fence(17.0, 3.0, energy_class=number),)  # type: ignore[arg-type]
        for name in ("layout.toml", "layout.json"):
            save_layout(layout, tmp_path / name)
            assert load_layout(tmp_path / name) == (Fence(17.0, 3.0, energy_class=1000),)


def test_a_layout_takes_the_place_of_no_folder(tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError, match=tmp_path.name):
        save_layout((), tmp_path)
