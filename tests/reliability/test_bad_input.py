"""What a user gets wrong is told at once: field, value and mend, in one line."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from physics.helpers import FLAT, box, rock

import rigdda
from rigdda import (
    BadInput,
    Block,
    Embankment,
    Error,
    Run,
    Scene,
    Settings,
    Simulation,
    Site,
    Surface,
    Terrain,
    Wall,
    load_layout,
    save_layout,
    simulate_many,
    sites,
)

NAN = math.nan
UNIT = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
GROUND = Terrain(FLAT)


def scene(**change) -> Scene:
    parts = {"terrain": GROUND, "blocks": (box(0.0, 0.5),), "surfaces": rock()} | change
    return Scene(**parts)


def site(old: str, new: str) -> Callable[[], Site]:
    """Return what loads the site "quick" with one line of its TOML changed."""

    def load(folder) -> Site:
        text = sites.text("quick")
        assert old in text
        path = folder / "site.toml"
        path.write_text(text.replace(old, new, 1))
        return Site.load(path)

    return load


def pebble(_) -> Simulation:
    """Return a simulation of a block of 0.1 m in steps of 0.1 s."""
    return Simulation(scene(blocks=(box(0.0, 0.05, 0.1, 0.1),)), Settings(dt=0.1))


def layout(text: str) -> Callable[[], tuple[Wall, ...]]:
    """Return what loads a layout of this TOML."""

    def load(folder) -> tuple[Wall, ...]:
        (folder / "layout.toml").write_text(text)
        return load_layout(folder / "layout.toml")

    return load


def empty(path):
    """Make an empty file."""
    path.touch()
    return path


def latin(path):
    """Write a text that is not UTF-8."""
    path.write_bytes("name = 'Fürth'".encode("latin-1"))
    return path


def nested(path):
    """Write brackets in brackets, far deeper than any file needs."""
    path.write_text("a = " + "[" * 100_000)
    return path


CASES = {
    "crossing polygon": (lambda _: Block([(0, 0), (1, 1), (1, 0), (0, 1)]), "block vertices"),
    "no area": (lambda _: Block([(0, 0), (1, 0), (2, 0)]), "block vertices"),
    "repeated corner": (lambda _: Block([(0, 0), (2, 0), (2, 0), (1, 1)]), "block vertices[1]"),
    "two corners": (lambda _: Block([(0, 0), (1, 0)]), "block vertices"),
    "NaN corner": (lambda _: Block([(0, 0), (1, 0), (NAN, 1)]), "block vertices[2]"),
    "words": (lambda _: Block("words"), "block vertices"),
    "negative density": (lambda _: Block(UNIT, density=-1.0), "block density"),
    "NaN density": (lambda _: Block(UNIT, density=NAN), "block density"),
    "NaN velocity": (lambda _: Block(UNIT, velocity=(0.0, NAN, 0.0)), "block velocity"),
    "two velocities": (lambda _: Block(UNIT, velocity=(0.0, 1.0)), "block velocity"),
    "unknown surface": (lambda _: scene(blocks=(box(surface="ice"),)), "block 0: surface"),
    "unknown ground": (lambda _: scene(terrain=Terrain(FLAT, ["ice"])), "terrain surfaces[0]"),
    "no blocks": (lambda _: scene(blocks=()), "blocks"),
    "coincident": (lambda _: scene(blocks=(box(0.0, 0.5), box(0.0, 0.5))), "blocks[1]"),
    "deep in another": (lambda _: scene(blocks=(box(0.0, 0.5), box(0.8, 0.6))), "blocks[1]"),
    "only fixed": (lambda _: scene(blocks=(box(fixed=True),)), "blocks"),
    "negative gravity": (lambda _: scene(gravity=-9.81), "gravity"),
    "negative damping": (lambda _: scene(damping=-0.1), "damping"),
    "damping when": (lambda _: scene(damping_when="never"), "damping_when"),
    "damping in contact": (lambda _: scene(damping=0.1, damping_when="contact"), "damping_when"),
    "friction 95": (lambda _: Surface(friction_deg=95.0), "friction_deg"),
    "restitution 1.5": (lambda _: Surface(restitution=1.5), "restitution"),
    "NaN friction": (lambda _: Surface(friction_deg=NAN), "friction_deg"),
    "array for a flag": (lambda _: Settings(sleeping=np.array([True, False])), "sleeping"),
    "array for a choice": (lambda _: Settings(solver=np.array(["pcg", "sor"])), "solver"),
    "array for fixed": (lambda _: Block(UNIT, fixed=np.array([True, False])), "block fixed"),
    "number for progress": (lambda _: Simulation(scene()).run(0.1, progress=2), "progress"),
    "name for a site": (lambda _: rigdda.release("quick"), "site"),
    "array for an event": (
        lambda _: rigdda.release(rigdda.Site.load("quick"), event=np.array(["a", "b"])),
        "event",
    ),
    "dt 0": (lambda _: Settings(dt=0.0), "dt"),
    "dt too long": (lambda _: Settings(dt=0.11), "dt"),
    "dt too long for a pebble": (pebble, "dt"),
    "NaN dt": (lambda _: Settings(dt=NAN), "dt"),
    "no iterations": (lambda _: Settings(open_close_iterations=0), "open_close_iterations"),
    "no sweep tolerance": (lambda _: Settings(sweep_tolerance=0.0), "sweep_tolerance"),
    "wall off the terrain": (lambda _: scene(barriers=(Wall(500.0, 2.0),)), "wall x"),
    "wall in a wall": (
        lambda _: scene(barriers=(Wall(0.0, 2.0), Wall(0.5, 2.0))),
        "barriers[1].x",
    ),
    "wall in free space": (lambda _: scene(terrain=None, barriers=(Wall(0.0, 2.0),)), "barriers"),
    "negative height": (lambda _: Wall(0.0, -2.0), "wall height"),
    "NaN wall": (lambda _: Wall(NAN, 2.0), "wall x"),
    "no thickness": (lambda _: Wall(0.0, 2.0, 0.0), "wall thickness"),
    "repeated point": (lambda _: Terrain([(0, 0), (1, 0), (1, 0), (2, 0)]), "terrain points[2]"),
    "crossing terrain": (lambda _: Terrain([(0, 0), (2, 0), (2, 1), (1, -1)]), "terrain points"),
    "one point": (lambda _: Terrain([(0, 0)]), "terrain points"),
    "too few surfaces": (lambda _: Terrain([(0, 0), (1, 0), (2, 0)], ["rock"]), "terrain surfaces"),
    "stations": (lambda _: Simulation(scene(), stations=(2.0, 1.0)), "stations"),
    "watch": (lambda _: Simulation(scene(), watch=(2.0, 1.0)), "watch"),
    "steps": (lambda _: Simulation(scene()).step(-1), "n"),
    "duration": (lambda _: Simulation(scene()).run(0.0), "duration"),
    "NaN duration": (lambda _: Simulation(scene()).run(NAN), "duration"),
    "unknown site": (lambda _: Site.load("nowhere"), "site"),
    "missing site file": (lambda _: Site.load("nowhere.toml"), "site"),
    "seed -1": (lambda _: Site.load("quick").realise((), -1), "seed"),
    "seed 1.5": (lambda _: Site.load("quick").realise((), 1.5), "seed"),
    "wall off the slope": (lambda _: Site.load("quick").realise((Wall(-99.0, 1.0),)), "wall x"),
    "missing run": (lambda folder: Run.load(folder / "none.npz"), "run file"),
    "empty run": (lambda folder: Run.load(empty(folder / "empty.npz")), "run file"),
    "missing layout": (lambda folder: load_layout(folder / "none.toml"), "layout"),
    "layout height": (layout("[[barriers]]\nx = 1.0\nheight = -1.0"), "barriers[0].height"),
    "layout TOML": (layout("[[barriers]"), "layout"),
    "road off the profile": (site("end = 44.8", "end = 999.0"), "road.end"),
    "road turned round": (site("end = 44.8", "end = 30.0"), "road.end"),
    "unknown field": (site("toe = 29.8", "toe = 29.8\nheigth = 3.0"), "slope.heigth"),
    "wrong type": (site("toe = 29.8", 'toe = "there"'), "slope.toe"),
    "wrong type of a surface": (
        site("friction_deg = 28.0", 'friction_deg = "28"'),
        "surfaces.rock.friction_deg",
    ),
    "layout without barriers": (layout(""), "barriers"),
    "layout of a list": (layout("barriers = 3"), "barriers"),
    "threads": (lambda _: rigdda.release_many([], 0), "threads"),
    "no jobs": (lambda _: rigdda.release_many(None), "jobs"),  # type: ignore[arg-type]
    "steps without end": (lambda _: Simulation(scene()).step(10**12), "n"),
    "bad TOML": (site("toe = 29.8", "toe = "), "site file"),
    "NaN in a site": (site("toe = 29.8", "toe = nan"), "slope.toe"),
    "site friction 95": (
        site("friction_deg = 28.0", "friction_deg = 95.0"),
        "surfaces.rock.friction_deg",
    ),
    "site duration": (site("duration = 20.0", "duration = 0.01"), "motion.duration"),
    "endless site": (site("duration = 20.0", "duration = 1e9"), "motion.duration"),
    "in the ground": (lambda _: scene(blocks=(box(0.0, -3.0),)), "blocks[0]"),
    "half in the ground": (lambda _: scene(blocks=(box(0.0, 0.3),)), "blocks[0]"),
    "ground turned over": (lambda _: scene(terrain=Terrain([(9, 0), (-9, 0)])), "blocks[0]"),
    "block in a wall": (lambda _: scene(barriers=(Wall(0.2, 3.0),)), "barriers[0].x"),
    "block in an embankment": (
        lambda _: scene(barriers=(Embankment(-4.0, 2.0, 9.0),)),
        "blocks[0]",
    ),
    "no sequence": (lambda _: scene(blocks=None), "blocks"),
    "no block": (lambda _: scene(blocks=(5,)), "blocks[0]"),
    "one barrier": (lambda _: scene(barriers=Wall(5.0, 3.0)), "barriers"),
    "no mapping": (lambda _: scene(surfaces=None), "surfaces"),
    "no surface": (lambda _: scene(surfaces={"rock": {}}), "surfaces['rock']"),
    "no pair": (lambda _: scene(interfaces={"rock": Surface()}), "interfaces"),
    "no terrain": (lambda _: scene(terrain=[(0, 0), (1, 0)]), "terrain"),
    "no velocity": (lambda _: Block(UNIT, velocity=None), "block velocity"),
    "surface of a block": (lambda _: Block(UNIT, surface=["rock"]), "block surface"),
    "10^400": (lambda _: Wall(10**400, 2.0), "wall x"),
    "1e300": (lambda _: Surface(cohesion=1e300), "cohesion"),
    "tower": (lambda _: Wall(0.0, 1e4), "wall height"),
    "film": (lambda _: Wall(0.0, 2.0, 1e-9), "wall thickness"),
    "dt of 1 ns": (lambda _: Settings(dt=1e-9), "dt"),
    "word for a switch": (lambda _: Settings(post_correction="no"), "post_correction"),
    "scene": (lambda _: Simulation(None), "scene"),
    "settings": (lambda _: Simulation(scene(), {}), "settings"),
    "one station": (lambda _: Simulation(scene(), stations=5.0), "stations"),
    "half an interval": (lambda _: Simulation(scene(), watch=(1.0,)), "watch"),
    "scenes": (lambda _: simulate_many([None]), "scenes[0]"),
    "for ever": (lambda _: Simulation(scene()).run(1e14), "duration"),
    "no site": (lambda _: Site.load(None), "site"),
    "price of numbers": (lambda _: Site.load("quick").capital([5]), "layout[0]"),
    "layout of numbers": (lambda folder: save_layout([5], folder / "l.toml"), "layout[0]"),
    "dust": (site("block_area = ", "block_area = 1e-9 # "), "sources.mass.block_area"),
    "one block": (site("block_area = ", "block_area = 1e9 # "), "sources.mass.block_area"),
    "spacing": (site("spacing = 1.4", "spacing = 1e-300"), "sources.mass.joints[0].spacing"),
    "rock in the zone": (site("start = 11.3", "start = 2.0"), "barrier_zone.start"),
    "latin-1": (lambda folder: Site.load(latin(folder / "site.toml")), "site file"),
    "latin-1 layout": (lambda folder: load_layout(latin(folder / "layout.toml")), "layout"),
    "deep nesting": (lambda folder: Site.load(nested(folder / "site.toml")), "site file"),
    "one joint set": (
        site("{ dip_deg = -45.0, spacing = 1.4, scatter = 0.15 },", ""),
        "sources.mass.joints",
    ),
    "source in the ground": (site("[7.5, 36.67]", "[7.5, 36.5]"), "sources.mass.polygon[1]"),
    "zone on the road": (site("end = 34.3", "end = 40.0"), "barrier_zone.end"),
}


@pytest.mark.parametrize("case", CASES)
def test_bad_input(case, tmp_path):
    wrong, field = CASES[case]
    with pytest.raises(BadInput) as caught:
        wrong(tmp_path)
    error, text = caught.value, str(caught.value)
    assert isinstance(error, Error)
    assert isinstance(error, ValueError)
    assert error.field == field
    assert text.startswith(f"{field} = ")
    assert text.endswith(f": {error.hint}")
    assert len(error.hint) > 5
    assert "\n" not in text
