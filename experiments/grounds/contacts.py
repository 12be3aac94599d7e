"""Chant Sura: share of the translational energy that a block keeps in a contact with alpine soil.

EOTA concrete blocks, wheels of 210 and 780 kg and an equant block of 250 kg, fell onto a slope of
about 45 degrees of alpine meadow and scree (Caviezel et al. 2020, Induced Rockfall Dataset #2,
EnviDat, doi 10.16904/envidat.174; derived contacts in `chant_sura_contacts.csv`). Six contacts of a
block of 780 kg in mid-slope were also measured (Caviezel et al. 2019, Earth Surface Dynamics 7,
199-210, doi 10.5194/esurf-7-199-2019).

The share kept in a contact is the translational kinetic energy just after it over that just before
it, each from the parabola of the flight, as in the data.
"""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np

from rigdda import Block, Scene, Settings, Simulation, Surface, Terrain
from rigdda.app.uncertainty.fit import Floats
from rigdda.ground.terrain import Roughness
from rigdda.model.site import FARTHEST

SEEN = Path(__file__).parent / "chant_sura_contacts.csv"

SLOPE = math.radians(45.0)
"""Mean slope at the contacts [rad]."""

DENSITY = 2670.0
"""Density of the concrete [kg/m3]."""

MASSES = {"W200": (210.0, 0.5), "W800": (780.0, 0.5), "e200": (250.0, 1.0)}
"""Mass [kg] and thickness over diameter [-] of each block."""

FILL = 17.0 / 27.0
"""Volume over bounding box volume of an EOTA block, whose edges are cut off at a third."""

SPEEDS = (4.0, 10.0)
"""Range of speeds of the counted contacts [m/s]."""

MID_SPEEDS = (16.0, 29.0)
"""Range of speeds of the contacts in mid-slope [m/s]."""

MID_SLOPE = np.array([0.22, 1.11, 0.55, 0.42, 0.50, 0.47])
"""Shares kept in the six contacts in mid-slope [-]."""

SPIN = 2.0
"""Assumed greatest rate of rotation of a block that tips off its platform, either way [rad/s]."""

DT = 5e-3
"""Step [s]."""

APART = 0.1
"""Least duration of a flight that separates two contacts [s]."""

LONGEST = 2.0
"""Time without another flight after which a block is rolling or at rest [s]."""


class Contact(NamedTuple):
    """A contact between two flights."""

    speed: float
    """Speed just before [m/s]."""
    kept: float
    """Share of the translational energy just after [-]."""


def observed() -> Floats:
    """Return speed before [m/s], vertical speed before [m/s] and share kept, (11, 3)."""
    with SEEN.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    names = ("speed_in_m_s", "vertical_in_m_s", "kinetic_in_J", "kinetic_out_J")
    speed, vertical, before, after = np.array([[float(r[n]) for n in names] for r in rows]).T
    return np.column_stack([speed, vertical, after / before])


def section(name: str, rng: np.random.Generator) -> tuple[Floats, float]:
    """Return the corners of a random face of a block [m], and the size of the block [m].

    One of the three faces of a wheel is round and two are flat. Corners are cut off at a third of
    the edges.
    """
    mass, flatness = MASSES[name]
    size = (mass / DENSITY / (FILL * flatness)) ** (1.0 / 3.0)
    width = size if rng.integers(3) == 0 else flatness * size
    sixth = np.array([(-1, -3), (1, -3), (3, -1), (3, 1), (1, 3), (-1, 3), (-3, 1), (-3, -1)]) / 6.0
    return sixth * (size, width), size


def drawn(surface: Surface, rng: np.random.Generator) -> Surface:
    """Return a surface with random friction, restitution and rolling resistance as in a release."""
    normal = np.clip(rng.standard_normal(3), -FARTHEST, FARTHEST)
    spread = (surface.friction_sd_deg, surface.restitution_sd, surface.rolling_sd)
    friction, restitution, rolling = normal * spread
    return msgspec.structs.replace(
        surface,
        friction_deg=float(np.clip(surface.friction_deg + friction, 0.0, 85.0)),
        restitution=float(np.clip((surface.restitution or 0.0) + restitution, 0.0, 1.0)),
        rolling=float(np.clip(surface.rolling + rolling, 0.0, 1.0)),
    )


def scene(
    surface: Surface, name: str, velocity: Floats, slope: float, rng: np.random.Generator
) -> Scene:
    """Return a block about to touch a slope [rad] with this velocity [m/s, m/s, rad/s]."""
    corners, size = section(name, rng)
    angle = rng.uniform(0.0, 2.0 * math.pi)
    cos, sin = math.cos(angle), math.sin(angle)
    turned = corners @ np.array([[cos, sin], [-sin, cos]])
    down = np.array([math.cos(slope), -math.sin(slope)])
    out = np.array([math.sin(slope), math.cos(slope)])
    turned += (1e-3 - (turned @ out).min()) * out
    seed = (int(rng.integers(2**31)),)
    pits = Roughness(size, {"ground": surface.roughness}, seed) if surface.roughness else None
    return Scene(
        Terrain([-30.0 * down, 300.0 * down], ["ground"]),
        (Block(turned, DENSITY, velocity=tuple(velocity.tolist())),),
        {"rock": surface, "ground": surface},
        roughness=pits,
    )


def contacts(
    scene: Scene, duration: float, most: int = 10**6, lowest: float = -math.inf
) -> list[Contact]:
    """Return up to `most` contacts of a block, separated by flights of at least `APART`.

    If no flight follows a contact within `LONGEST`, it counts as well: the block rolls or stops.
    """
    sim = Simulation(scene, Settings(dt=DT))
    body, gravity = sim.loop.arrays.bodies, scene.gravity_vector[1]
    found: list[Contact] = []
    before = velocity = sim.velocities[0, :2].copy()
    began = touched = -1
    for step in range(round(duration / DT)):
        sim.step()
        last, velocity = velocity, sim.velocities[0, :2].copy()
        if body["touching"][0]:
            if began < 0:
                began, before = step, last
            touched = step
        elif began >= 0 and (step - touched) * DT > APART + DT:
            after = velocity - (0.0, gravity * DT * (step - touched))  # when it left the ground
            found.append(_contact(before, after))
            began = -1
        if began >= 0 and (step - began) * DT > LONGEST:
            found.append(_contact(before, velocity))
            break
        if len(found) >= most or sim.poses[0, 1] < lowest:
            break
    return found


def _contact(before: Floats, after: Floats) -> Contact:
    return Contact(float(np.hypot(*before)), float((after @ after) / (before @ before)))


def early_contacts(
    surface: Surface, name: str, count: int, seed: int, number: int = 1
) -> list[Contact]:
    """Return the first contacts at `SPEEDS` in releases of a block, or later ones.

    Speeds at the first contact are uniform in this range, directions are those observed.

    Parameters
    ----------
    surface : Surface
        The ground.
    name : str
        The block.
    count, seed : int
        Number of releases, and seed of their random numbers.
    number : int
        Number of the contact that counts in each release, from 1.
    """
    seen, found = observed(), []
    for k in range(count):
        rng = np.random.default_rng([seed, k])
        speed, row = rng.uniform(*SPEEDS), seen[rng.integers(len(seen))]
        steep = row[1] / row[0]
        velocity = speed * np.array([math.sqrt(1.0 - steep**2), steep, 0.0])
        velocity[2] = rng.uniform(-SPIN, SPIN)
        release = scene(drawn(surface, rng), name, velocity, SLOPE, rng)
        every = contacts(release, 4.0, number)[number - 1 :]
        found += [c for c in every if SPEEDS[0] <= c.speed <= SPEEDS[1]]
    return found


def mid_slope(surface: Surface, count: int, seed: int) -> list[Contact]:
    """Return the contacts at `MID_SPEEDS` in `count` releases of the block of 780 kg.

    The blocks travel down 200 m of the slope.
    """
    found = []
    for k in range(count):
        rng = np.random.default_rng([seed, k, 1])
        velocity = np.array([8.0, -6.0, rng.uniform(-SPIN, SPIN)])
        release = scene(drawn(surface, rng), "W800", velocity, SLOPE, rng)
        every = contacts(release, 20.0, lowest=-200.0 * math.sin(SLOPE))
        found += [c for c in every if MID_SPEEDS[0] <= c.speed <= MID_SPEEDS[1]]
    return found


def lumped_share(normal: float, tangential: float) -> Floats:
    """Return the shares that a point mass would keep in the observed first contacts, (11,) [-].

    Parameters
    ----------
    normal, tangential : float
        Coefficients of restitution [-].
    """
    speed, vertical, _ = observed().T
    steep = np.arcsin(-vertical / speed) - SLOPE  # angle from the slope; 90 degrees is normal
    return (tangential * np.cos(steep)) ** 2 + (normal * np.sin(steep)) ** 2
