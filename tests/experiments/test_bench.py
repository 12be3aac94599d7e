"""The judge itself: closed forms, penetration by geometry, fronts and levels."""

from __future__ import annotations

import importlib
import math
import sys

import numpy as np
import pytest
from click.testing import CliRunner

from experiments.bench import cases, engines, levels, timing
from experiments.bench.__main__ import main
from experiments.bench.growth import heap, rubble
from experiments.bench.levels import Row
from experiments.bench.penetration import centroids, penetration
from rigdda import Scene, Terrain
from rigdda.geometry import is_convex, polygon_properties
from rigdda.validation import motion, single_block
from rigdda.validation.scenes import FLAT, box, rock


def poses_of(scene: Scene, *shifts: tuple[float, float, float]) -> np.ndarray:
    """Return one frame with blocks moved from the start."""
    start = np.column_stack([centroids(scene), np.zeros(len(scene.blocks))])
    return (start + np.array(shifts))[None]


@pytest.mark.parametrize(
    ("shifts", "depth"),
    [
        (((0, 0, 0), (0, 0, 0)), 0.0),
        (((0, 0, 0), (0, 0.1, 0)), 0.0),  # apart
        (((0, 0, 0), (0.3, -0.02, 0)), 0.02),  # the upper cube into the lower one
        (((0, -0.03, 0), (0, 0, 0)), 0.03),  # the lower one into the ground
        (((0, 0, 0), (0, math.sqrt(0.5) - 0.5 - 0.01, math.pi / 4)), 0.01),  # a corner into an edge
    ],
)
def test_penetration_of_cubes(shifts: tuple, depth: float) -> None:
    scene = Scene(Terrain(FLAT), (box(0.0, 0.5), box(0.0, 1.5)), rock())
    assert penetration(scene, poses_of(scene, *shifts)) == pytest.approx(depth, abs=1e-12)


def test_penetration_of_a_corner_of_the_terrain() -> None:
    ridge = Terrain(((-10.0, -10.0), (0.0, 0.0), (10.0, -10.0)))
    scene = Scene(ridge, (box(0.0, 0.5, width=4.0),), rock())
    assert penetration(scene, poses_of(scene, (0.0, -0.04, 0.0))) == pytest.approx(0.04)


def moved(way: np.ndarray) -> np.ndarray:
    """Return the poses of one block that moves by so much in y."""
    poses = np.zeros((len(way), 1, 3))
    poses[:, 0, 1] = way
    return poses


def test_exact_ways_have_no_error() -> None:
    times = np.linspace(0.0, 2.0, 5)
    fall = Scene(None, (box(),), rock(), damping=0.6)
    ways = np.array([motion.fall(0.6, t)[0] for t in times])
    assert cases.fall_error(fall, times, moved(-ways)) == pytest.approx(0.0, abs=1e-12)
    slid = np.array([single_block.slide(30.0, 20.0, t) for t in times])
    assert cases.slide_error(fall, times, moved(slid)) == pytest.approx(0.0, abs=1e-12)
    assert cases.slide_error(fall, times, moved(1.01 * slid)) == pytest.approx(0.01)


@pytest.mark.parametrize("dt", [0.02, 0.005])
def test_time_to_impact_follows_from_exact_poses(dt: float) -> None:
    """Integrate th'' = -p^2 sin(al - th) finely up to the impact, where the block stops."""
    tilt = single_block.INITIAL_TILTS[0]
    fine, angle, rate, angles = 1e-5, tilt, 0.0, [tilt]
    for _ in range(90_000):
        rate -= fine * single_block.PULL * math.sin(single_block.DIAGONAL_ANGLE - angle)
        angle, rate = (angle + fine * rate, rate) if angle + fine * rate > 0.0 else (0.0, 0.0)
        angles.append(angle)
    poses = np.zeros((round(0.9 / dt), 1, 3))
    poses[:, 0, 2] = np.array(angles[:: round(dt / fine)])[: len(poses)] - tilt
    times = np.arange(len(poses)) * dt
    assert cases.rocking_error(cases.tilted(tilt), times, poses) < 1.5e-4


def test_a_stack_that_falls_is_infinitely_wrong() -> None:
    scene = Scene(Terrain(FLAT), (box(0.0, 0.5),), rock())
    frames = np.concatenate([poses_of(scene, (0, 0, 0)), poses_of(scene, (0.3, 0, 0))])
    assert cases.sinking(scene, np.array([0.0, 1.0]), frames) == math.inf


def test_the_penetration_of_most_frames_is_judged_and_the_greatest_one_is_recorded() -> None:
    """One of 100 frames has a block 0.3 m inside the other, the others 0.01 m."""
    scene = Scene(None, (box(0.0, 0.5), box(0.0, 1.5)), rock())
    frame = np.array([[0.0, 0.5, 0.0], [0.0, 1.49, 0.0]])
    frames = np.repeat(frame[None], 100, axis=0)
    frames[40, 1, 1] = 1.2
    times = np.arange(100.0)
    assert cases.deep(scene, times, frames) == pytest.approx(0.01)
    assert cases.deepest(scene, times, frames) == pytest.approx(0.3)


def row(engine: str, error: float, cpu: float) -> Row:
    return Row("slide", engine, 0.01, "", error, math.nan, cpu, cpu, cpu, 1)


def test_front_keeps_what_nothing_beats() -> None:
    rows = [row("a", 1e-2, 1.0), row("a", 1e-3, 3.0), row("a", 1e-3, 2.0), row("a", 2e-3, 5.0)]
    assert levels.on_front([*rows, row("a", math.inf, 0.1)]) == [rows[0], rows[2]]


def test_levels_compare_the_cheapest_that_is_good_enough() -> None:
    case = next(c for c in cases.single() if c.name == "slide")
    rows = [row("rigdda", 1e-5, 6.0), row("pymunk", 5e-3, 4.0), row("box2d", 5e-4, 10.0)]
    coarse, middle, fine = levels.levels([case], rows)
    assert (coarse.ratio, coarse.must, coarse.aim) == (1.5, False, False)
    assert (middle.ratio, middle.must, middle.aim) == (0.6, True, False)
    assert math.isnan(fine.ratio) and fine.must and fine.aim  # no peer reaches it
    lost = levels.level(case, 1e-3, rows[1:])
    assert not lost.must and not lost.aim


@pytest.mark.parametrize("count", [20, 120, 480])
def test_rockfall_suits_every_engine(count: int) -> None:
    """Box2D takes convex polygons of at most eight corners."""
    blocks = cases.rockfall_scene(count, 1).blocks
    assert len(blocks) == pytest.approx(count, rel=0.1)
    assert all(is_convex(b.vertices) and len(b.vertices) <= 8 for b in blocks)


def test_heap_starts_loose() -> None:
    scene, _ = heap(60)
    assert len(scene.blocks) == 60
    assert penetration(scene, poses_of(scene, *[(0, 0, 0)] * 60)) == 0.0
    assert polygon_properties(rubble(np.random.default_rng(0)))[0] == pytest.approx(2.0)


def test_missing_peer_is_one_clear_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pymunk", None)
    monkeypatch.delitem(sys.modules, "experiments.bench.engines.chipmunk", raising=False)
    result = CliRunner().invoke(main, ["--quick"])
    assert result.exit_code == 1
    assert 'pip install -c constraints.txt -e ".[bench]"' in result.output
    assert len(result.output.splitlines()) == 1


@pytest.mark.parametrize("name", ["core", *engines.PEERS])
def test_every_engine_slides_falls_and_rests(name: str) -> None:
    if name in engines.PEERS:
        pytest.importorskip(engines.PEERS[name])
    engine = importlib.import_module(f"experiments.bench.engines.{name}")
    slide, hold, fall, rock_over = cases.single()
    for case, bar in ((slide, 0.05), (hold, 0.05), (fall, 0.01), (rock_over, 0.02)):
        setting = timing.Setting(engine, 0.005, engine.OPTIONS[0])
        timing.first_run(setting, case)
        assert setting.error < bar, case.name
        assert setting.row(case).cpu_us_per_simulated_s > 0.0


def test_every_engine_turns_anticlockwise() -> None:
    """A block tilted to the left falls back to the right in all of them."""
    turned = Scene(Terrain(FLAT), (box(0.0, 1.2, 2.0, 1.0, angle=0.4),), rock())
    for name in ("core", *engines.PEERS):
        try:
            engine = engines.adapter(name)
        except engines.PeerMissing:
            continue
        one = engine.Engine(turned, 0.005, False, **engine.OPTIONS[0])
        one.advance(400)
        assert one.poses()[0, 2] == pytest.approx(-0.4, abs=0.01), name
