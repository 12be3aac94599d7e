"""Replays: what is written is what was simulated, read back with rerun's own reader."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from rerun.chunk import RrdReader

from rigdda.barriers import Built, Embankment, Fence, GravityWall, Wall
from rigdda.dynamics.monitors import CROSSING, FAILED, HIT
from rigdda.dynamics.run import EVENT, Run
from rigdda.errors import BadInput, Error
from rigdda.ground.surface import Surface
from rigdda.ground.terrain import Terrain
from rigdda.model.block import Block
from rigdda.model.scene import Scene
from rigdda.replay import recording as replay
from rigdda.replay import viewer
from rigdda.replay.recording import PLOTS, Marks
from rigdda.replay.viewer import open_viewer

GRAVITY = 9.81
SIZES = np.array([[1.0, 2.0], [1.5, 1.0], [2.0, 2.0]])
STARTS = np.array([[5.0, 22.0], [8.0, 21.0], [11.0, 20.0]])
SPEEDS = np.array([[2.0, -1.0, -3.0], [4.0, -0.5, 0.5], [16.0, -0.2, 0.0]])
DENSITY = 2600.0
ROAD = (30.0, 36.0)
FRAMES = 40


def rectangle(centre: np.ndarray, size: np.ndarray) -> np.ndarray:
    return centre + 0.5 * size * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


@pytest.fixture
def run() -> Run:
    """Three rectangles in uniform motion; the third crosses the road's edge at 1.1875 s."""
    scene = Scene(
        terrain=Terrain([(0, 20), (10, 18), (25, 2), (28, 0), (50, 0)]),
        blocks=tuple(Block(rectangle(c, s), DENSITY) for c, s in zip(STARTS, SIZES, strict=True)),
        surfaces={"rock": Surface(35.0, 0.2), "concrete": Surface(40.0)},
        interfaces={("rock", "concrete"): Surface(30.0, 0.1)},
        barriers=(Wall(27.0, 3.0),),
        damping=0.6,
        gravity=GRAVITY,
    )
    times = np.arange(FRAMES) * 0.05
    velocities = np.broadcast_to(SPEEDS, (FRAMES, 3, 3)).copy()
    velocities[30:, 1] = 0.0
    start = np.column_stack([STARTS, np.zeros(3)])
    poses = start + times[:, None, None] * SPEEDS
    events = np.array(
        [
            (0.4, HIT, 2, 0, 27.0, 2.0, 1.0, 4.0, 5.0),
            (0.72, CROSSING, 0, 3, ROAD[0], 1.0, 1.0, 2.0, 3.0),
        ],
        EVENT,
    )
    at_wall = np.tile([27.5, 2.0, 0.0], (FRAMES, 1, 1))
    taken, energies = np.array([12.5]), np.array([0.0, 0.1, 7.0])
    extent = np.stack([poses[:, :, 0].min(axis=0), poses[:, :, 0].max(axis=0)], axis=1)
    thrust = np.zeros(1)
    return Run(scene, times, poses, velocities, events, taken, thrust, energies, extent, at_wall)


@pytest.fixture
def file(run: Run, tmp_path: Path) -> Path:
    path = tmp_path / "episode.rrd"
    run.to_rerun(path, Marks(road=ROAD, notes={"seed": "7"}, title="three blocks"))
    return path


def column(path: Path, entity: str, component: str, static: bool = False) -> list:
    """Return the values of a component, one a row in order of time."""
    stream = RrdReader(path).stream().filter(content=entity, is_static=static)
    (chunk,) = stream.to_chunks()
    return chunk.to_record_batch().column(component).to_pylist()


def entities(path: Path) -> set[str]:
    return {chunk.entity_path for chunk in RrdReader(path).stream().to_chunks()}


def filled_area(path: Path, entity: str) -> float:
    (corners,) = column(path, entity, "Mesh3D:vertex_positions", static=True)
    a, b, c = np.moveaxis(np.array(corners)[:, :2].reshape(-1, 3, 2), 1, 0)
    u, v = b - a, c - a
    return float(0.5 * np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]).sum())


def test_poses_and_times_read_back(run: Run, file: Path) -> None:
    for i in range(3):
        entity = f"/world/blocks/{i}"
        times = column(file, entity, "sim_time")
        places = column(file, entity, "Transform3D:translation")
        turns = column(file, entity, "Transform3D:quaternion")
        assert len(times) == FRAMES
        for frame in (0, 17, FRAMES - 1):
            x, y, theta = run.poses[frame, i]
            assert times[frame].total_seconds() == pytest.approx(run.times[frame], abs=1e-6)
            assert places[frame][0][:2] == pytest.approx([x, y], rel=1e-6)
            expected = [0.0, 0.0, np.sin(theta / 2), np.cos(theta / 2)]
            assert turns[frame][0] == pytest.approx(expected, abs=1e-6)


def test_blocks_are_drawn_about_their_centroid(file: Path) -> None:
    for i, size in enumerate(SIZES):
        entity = f"/world/blocks/{i}"
        ((outline,),) = column(file, entity, "LineStrips3D:strips", static=True)
        corners = np.array(outline)[:4, :2]
        assert np.abs(corners) == pytest.approx(np.tile(size / 2, (4, 1)), rel=1e-6)
        assert outline[0] == outline[-1]
        assert filled_area(file, entity) == pytest.approx(size.prod(), rel=1e-6)


def test_scalars_read_back(run: Run, file: Path) -> None:
    mass = DENSITY * SIZES.prod(axis=1)
    inertia = mass * (SIZES**2).sum(axis=1) / 12
    vx, vy, omega = np.moveaxis(run.velocities, -1, 0)
    read = {name: np.ravel(column(file, f"/plots/{name}", "Scalars:scalars")) for name in PLOTS}
    kinetic = 0.5 * ((vx**2 + vy**2) * mass + omega**2 * inertia).sum(axis=1)
    np.testing.assert_allclose(read["kinetic_energy"], kinetic, rtol=1e-12)
    potential = GRAVITY * (run.poses[:, :, 1] * mass).sum(axis=1)
    lost = read["potential_energy"] - read["potential_energy"][0]
    np.testing.assert_allclose(lost, potential - potential[0], rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(read["greatest_speed"], np.hypot(vx, vy).max(axis=1), rtol=1e-12)
    np.testing.assert_array_equal(read["moving"], np.where(np.arange(FRAMES) < 30, 3, 2))


def with_barriers(run: Run, *barriers: Built, failed: tuple[tuple[int, float], ...]) -> Run:
    """Return the run with other barriers, of which some fail at a time."""
    scene = Scene(run.scene.terrain, run.scene.blocks, barriers=barriers)
    n = len(barriers)
    poses = np.tile([27.5, 2.0, 0.0], (FRAMES, n, 1))
    events = [(when, FAILED, 2, i, 27.0, 2.0, 1.0, 4.0, 5.0) for i, when in failed]
    changed = {"scene": scene, "barrier_poses": poses, "events": np.array(events, EVENT)}
    for name in ("absorbed", "thrust"):
        if name in Run.__slots__:
            changed[name] = np.zeros(n)
    return replace(run, **changed)


def test_barriers_are_labelled_with_what_they_are_and_their_state_over_time(
    run: Run, tmp_path: Path
) -> None:
    standing = Fence(20.0, 2.0, 4e5), Embankment(25.5, 1.0, 0.5), Wall(29.0, 2.0)
    broken = with_barriers(run, *standing, failed=((0, 0.5), (1, 1.25)))
    labels = ("fence 1,000 kJ, 2.0 m high", "embankment 1.0 m high", "wall 2.0 m high")
    broken.to_rerun(tmp_path / "a.rrd", Marks(labels=labels))
    told = [
        [words for (words,) in column(tmp_path / "a.rrd", f"/world/labels/{i}", "Points3D:labels")]
        for i in range(3)
    ]
    assert told == [
        [f"{labels[0]}: stands", f"{labels[0]}: failed"],
        [f"{labels[1]}: stands", f"{labels[1]}: pushed"],
        [f"{labels[2]}: stands"],
    ]
    times = column(tmp_path / "a.rrd", "/world/labels/1", "sim_time")
    assert [t.total_seconds() for t in times] == pytest.approx([0.0, 1.25])
    colours = column(tmp_path / "a.rrd", "/world/barriers/1", "Mesh3D:albedo_factor")
    assert colours[0] != colours[1]


def test_a_fence_deflects_and_sinks(run: Run, tmp_path: Path) -> None:
    """It sinks by half its height over its elongation; frames without a change are not repeated."""
    fence = Fence(20.0, 2.0, 4e5, elongation=4.0)
    moved = with_barriers(run, fence, failed=())
    moved.barrier_poses[10:, 0, 0] += 1.0
    moved.barrier_poses[20:, 0, 0] += 1.0
    moved.to_rerun(tmp_path / "a.rrd")
    entity = "/world/barriers/0"
    times = column(tmp_path / "a.rrd", entity, "sim_time")
    assert [t.total_seconds() for t in times] == pytest.approx([0.0, 0.5, 1.0])
    shapes = np.array(column(tmp_path / "a.rrd", entity, "Mesh3D:vertex_positions"))
    strips = np.array(column(tmp_path / "a.rrd", entity, "LineStrips3D:strips"))[:, 0]
    for k, way in enumerate((0.0, 1.0, 2.0)):
        wanted = moved.scene.outline(0) + np.array([way, 0.0])
        wanted[2:, 1] -= 0.25 * way
        np.testing.assert_allclose(shapes[k, :, :2], wanted, rtol=1e-6)
        np.testing.assert_allclose(strips[k, :4, :2], wanted, rtol=1e-6)
        np.testing.assert_array_equal(strips[k, 4], strips[k, 0])


def test_a_fence_that_deflects_and_fails_turns_pale(run: Run, tmp_path: Path) -> None:
    moved = with_barriers(run, Fence(20.0, 2.0, 4e5), failed=((0, 0.5),))
    moved.barrier_poses[10:, 0, 0] += 1.0
    moved.to_rerun(tmp_path / "a.rrd")
    stream = RrdReader(tmp_path / "a.rrd").stream().filter(content="/world/barriers/0")
    names = [set(c.to_record_batch().schema.names) for c in stream.to_chunks() if not c.is_static]
    assert any("Mesh3D:albedo_factor" in found for found in names)
    assert any("Mesh3D:vertex_positions" in found for found in names)


def test_a_gravity_wall_slides_then_is_overturned(run: Run) -> None:
    moved = with_barriers(run, GravityWall(27.0, 2.0, 1.0), failed=())
    moved.barrier_poses[10:, 0, 0] += 0.2
    assert moved.states(0) == [(0.0, "stands"), (0.5, "slid")]
    moved.barrier_poses[20:, 0, 2] += 1.0
    assert moved.states(0) == [(0.0, "stands"), (0.5, "slid"), (1.0, "overturned")]


def test_debris_is_all_that_ever_passed_the_road(run: Run, file: Path) -> None:
    """Block 2 is past the edge in the frames, block 0 only in an event between two frames."""
    mass = DENSITY * SIZES.prod(axis=1)
    expected = (mass[2] * (run.times >= 1.1875) + mass[0] * (run.times >= 0.72)) / mass.sum()
    debris = np.ravel(column(file, "/plots/debris", "Scalars:scalars"))
    np.testing.assert_allclose(debris, expected, rtol=1e-12)


def test_terrain_barriers_road_and_notes_are_there(run: Run, file: Path) -> None:
    assert {"/world/terrain", "/world/barriers/0", "/world/road", "/notes"} <= entities(file)
    wall = shapely.Polygon(run.scene.barriers[0].outline(run.scene.terrain))
    assert filled_area(file, "/world/barriers/0") == pytest.approx(wall.area, rel=1e-6)
    ((road,),) = column(file, "/world/road", "LineStrips3D:strips", static=True)
    np.testing.assert_allclose(np.array(road)[:, :2], [(30.0, 0.0), (36.0, 0.0)])
    assert "**seed**: 7" in column(file, "/notes", "TextDocument:text", static=True)[0][0]
    assert RrdReader(file).blueprints()


@pytest.mark.parametrize(
    ("chain", "area"),
    [
        pytest.param([(0, 10), (5, 10), (3, 6), (8, 0), (20, 0)], 49.0 + 60.0, id="overhang"),
        pytest.param(
            [(0, 10), (-3, 5), (5, 0), (20, 0)], 20.0 + 7.5 + 69.0, id="overhang at the end"
        ),
        pytest.param([(0, 10), (0, 0), (10, 0), (10, 10)], 30.0, id="box"),
    ],
)
def test_ground_below_a_chain(chain: list[tuple[float, float]], area: float) -> None:
    ground = replay._ground(np.array(chain, dtype=float), -3.0)
    assert ground.area == pytest.approx(area)


def test_recordings_are_separate(run: Run, tmp_path: Path) -> None:
    for name in ("a.rrd", "b.rrd"):
        run.to_rerun(tmp_path / name)
    ids = {RrdReader(tmp_path / name).recordings()[0].recording_id for name in ("a.rrd", "b.rrd")}
    assert len(ids) == 2


def test_without_terrain_and_road(run: Run, tmp_path: Path) -> None:
    free = Run(Scene(None, run.scene.blocks), *(getattr(run, n) for n in list(Run.__slots__)[1:]))
    free.to_rerun(tmp_path / "free.rrd")
    there = entities(tmp_path / "free.rrd")
    assert "/world/blocks/2" in there
    assert not there & {"/world/terrain", "/world/road", "/plots/debris"}


def test_no_temporary_file_is_left(run: Run, file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = file.read_bytes()
    monkeypatch.setattr(replay, "_log_block", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        run.to_rerun(file)
    assert file.read_bytes() == before
    assert os.listdir(file.parent) == [file.name]


def test_bad_input_is_refused(run: Run, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"end in \.rrd"):
        run.to_rerun(tmp_path / "episode.txt")
    with pytest.raises(BadInput, match="existing"):
        open_viewer(tmp_path / "none.rrd")
    (tmp_path / "other.rrd").write_text("not a recording")
    with pytest.raises(BadInput, match="to_rerun wrote"):
        open_viewer(tmp_path / "other.rrd")
    with pytest.raises(BadInput, match="uphill"):
        Marks(road=(5.0, 5.0))
    with pytest.raises(BadInput, match="two numbers"):
        Marks(road=(1.0, 2.0, 3.0))
    with pytest.raises(BadInput, match="labels"):
        run.to_rerun(tmp_path / "episode.rrd", Marks(labels=("a", "b", "c")))
    assert os.listdir(tmp_path) == ["other.rrd"]


unix = pytest.mark.skipif(os.name == "nt", reason="the stand-in for the viewer is a shell script")


def fake_viewer(monkeypatch: pytest.MonkeyPatch, folder: Path, script: str) -> None:
    starter = folder / "starter"
    starter.write_text(f"#!/bin/sh\n{script}\n")
    starter.chmod(0o755)
    monkeypatch.setattr(viewer.sys, "executable", str(starter))
    monkeypatch.setenv("DISPLAY", ":0")


def interrupted(file: Path, folder: Path, monkeypatch: pytest.MonkeyPatch, script: str) -> int:
    """Press Ctrl-C while a script stands in for the viewer; return the process that it noted."""
    note = folder / "pid"
    fake_viewer(monkeypatch, folder, script.format(note=f"{note}.part; mv {note}.part {note}"))

    def press_ctrl_c() -> None:
        while not note.exists():
            time.sleep(0.01)
        time.sleep(0.2)
        os.kill(os.getpid(), signal.SIGINT)

    # a shell starts background jobs with the signal ignored
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    begun = time.monotonic()
    try:
        threading.Thread(target=press_ctrl_c).start()
        open_viewer(file)
    finally:
        signal.signal(signal.SIGINT, before)
    assert time.monotonic() - begun < 30.0  # otherwise the script ended by itself
    return int(note.read_text())


@unix
def test_interrupt_ends_the_viewer_behind_its_starter(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pid = interrupted(file, tmp_path, monkeypatch, "sleep 60 & echo $! > {note}; wait")
    deadline = time.monotonic() + 5
    while alive(pid) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not alive(pid)


@unix
def test_interrupt_ends_the_viewer_where_processes_have_no_groups(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on Windows, where `os` has no `killpg`."""
    monkeypatch.delattr(os, "killpg", raising=False)
    assert not alive(interrupted(file, tmp_path, monkeypatch, "echo $$ > {note}; exec sleep 60"))


def alive(pid: int) -> bool:
    """Return whether a process runs; one that only waits to be collected does not."""
    state = subprocess.run(["ps", "-o", "stat=", "-p", str(pid)], capture_output=True, text=True)
    return bool(state.stdout.strip()) and not state.stdout.startswith("Z")


@unix
def test_viewer_is_local_and_its_failure_is_told(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fake_viewer(monkeypatch, tmp_path, f'echo "$@" > {tmp_path}/command; exit 3')
    with pytest.raises(Error, match="code 3"):
        open_viewer(file)
    assert "--bind 127.0.0.1" in (tmp_path / "command").read_text()


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have no such variables")
def test_a_machine_without_a_screen_is_told(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(Error, match=r"no screen: open .*\.rrd on a machine"):
        open_viewer(file)


def test_save_and_load_is_exact(run: Run, tmp_path: Path) -> None:
    run.save(tmp_path / "run.npz")
    back = Run.load(tmp_path / "run.npz")
    for name in ("times", "poses", "velocities", "events", "absorbed", "watch_energy", "extent"):
        kept, read = getattr(run, name), getattr(back, name)
        assert kept.dtype == read.dtype
        assert kept.tobytes() == read.tobytes()
    for ours, theirs in zip(run.scene.blocks, back.scene.blocks, strict=True):
        np.testing.assert_array_equal(ours.vertices, theirs.vertices)
        assert (ours.density, ours.velocity) == (theirs.density, theirs.velocity)
    np.testing.assert_array_equal(run.scene.terrain.points, back.scene.terrain.points)
    for name in ("surfaces", "interfaces", "barriers", "gravity", "damping", "damping_when"):
        assert getattr(run.scene, name) == getattr(back.scene, name)


def test_the_core_does_not_import_rerun() -> None:
    code = "import sys, rigdda.dynamics.run; sys.exit('rerun' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0
