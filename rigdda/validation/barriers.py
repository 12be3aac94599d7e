"""Barriers under impact and load: thin walls, gravity walls and fences.

A thin wall stops fast blocks; no block tunnels through it.

A rock leans on a gravity wall, which slides or overturns at its static limit load.

A fence decelerates bodies with a constant force and fails at the end of its elongation. The plate
of the fence, with mass m_p, takes part in every impact, which is plastic. A block of mass m and
speed v that hits it squarely continues together with it at m v / (m + m_p). Both are stopped over
the distance K / F, where K is the kinetic energy of both after the impact and F the braking force.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rigdda.barriers import Fence, GravityWall
from rigdda.barriers.fence import MASS
from rigdda.dynamics.monitors import FAILED
from rigdda.dynamics.run import Run
from rigdda.geometry import polygon_properties
from rigdda.model.scene import Block, Scene, Surface, Terrain, Wall
from rigdda.validation.case import Case, Check, Lab, Measured
from rigdda.validation.scenes import (
    FLAT,
    GRAVITY,
    Floats,
    box,
    kinetic_energy,
    masses,
    polygon,
    rock,
    rough,
)

WALL = Wall(x=10.0, height=100.0, thickness=0.2)
"""The wall, too high for any of the blocks to fly over it."""

SHOTS = 200
SHOT_DURATION = 0.3
"""Longest flight time to the wall [s]."""


def shot(rng: np.random.Generator) -> Scene:
    """Return a random convex block that flies at the wall at 5 to 100 m/s."""
    radius = rng.uniform(0.3, 1.5)
    corners = rough(rng, int(rng.integers(3, 9)), radius)
    speed, climb = rng.uniform(5.0, 100.0), np.radians(rng.uniform(-45.0, 45.0))
    velocity = (speed * np.cos(climb), speed * np.sin(climb), rng.uniform(-20.0, 20.0))
    away = 1.5 * radius + rng.uniform(0.05, SHOT_DURATION) * velocity[0]
    corners = polygon(corners, (WALL.x - away, 50.0), rng.uniform(0.0, 2.0 * np.pi))
    surfaces = rock(30.0, rng.uniform(0.0, 0.9))
    return Scene(Terrain(FLAT), (Block(corners, velocity=velocity),), surfaces, barriers=(WALL,))


def fly_at_wall(lab: Lab, scene: Scene) -> tuple[bool, bool, float]:
    """Return whether a block arrives, whether its centroid passes, and its corner depth [m]."""
    sim = lab.simulate(scene)
    deepest, centre = 0.0, 0.0
    for _ in range(lab.steps(SHOT_DURATION + 0.5)):
        sim.step()
        deepest = max(deepest, float(sim.vertices(0)[:, 0].max()) - WALL.x)
        centre = max(centre, float(sim.poses[0, 0]))
    energy = sim.energy()
    arrived = energy.impact + energy.friction < 0.0  # an impact on the wall takes energy
    return arrived, centre > WALL.x, deepest


def measure_shots(lab: Lab) -> tuple[Measured, Measured, Measured]:
    """Simulate all shots."""
    arrived, passed, deepest = zip(
        *(fly_at_wall(lab, shot(lab.random(i))) for i in range(SHOTS)), strict=True
    )
    return Measured(sum(arrived), SHOTS), Measured(sum(passed)), Measured(deepest)


WALL_CHECKS = (
    Check("arrive", "all", "-", 0.0, "absolute"),
    Check("centroids pass", "none: rigid", "-", 0.0, "bound"),
    # a greater depth would put a corner on the far side
    Check("corner depth", "none: rigid", "m", WALL.thickness, "bound"),
)

THIN_WALLS = (
    Case("thin-wall", WALL_CHECKS, measure_shots),
    Case("thin-wall-10ms", WALL_CHECKS, measure_shots, dt=0.01),
)


RAMP = math.tan(math.radians(30.0))
"""Slope of the ramp on which the rock rests [-]."""

FACE = 0.5
"""Chainage of the face of the wall, beyond the foot of the ramp [m]."""

LOADING_TIME, MOVED, BISECTIONS = 2.0, 1e-3, 14
"""Duration of a push [s], displacement above which a wall counts as moved [m], and number of
bisections.

A load a thousandth above the limit moves each of the walls by at least 3 mm in that time.
"""


class Push(NamedTuple):
    """A wall on level ground, its friction angle [deg] and the height of the push on it [m]."""

    wall: GravityWall
    friction_deg: float
    height: float

    def limit(self) -> float:
        """Return the limit load [N]: the lesser of W tan phi (slides) and W b/(2 h) (overturns)."""
        weight = self.wall.density * GRAVITY * self.wall.thickness * self.wall.height
        sliding = math.tan(math.radians(self.friction_deg))
        return weight * min(sliding, 0.5 * self.wall.thickness / self.height)

    def scene(self, force: float) -> Scene:
        """Return the wall at the foot of a ramp of ice, pushed by a smooth rock with `force` [N].

        The rock touches the face of the wall with its nose. Without friction, it rests on the ramp
        under the horizontal force W tan(slope), which determines its density.
        """
        low, high = 0.6, 6.0
        corners = np.array(
            [
                *[(-high, high * RAMP), (-low, low * RAMP), (FACE, self.height)],
                *[(-low, low * RAMP + 3.0), (-high, high * RAMP + 3.0)],
            ]
        )
        density = force / (GRAVITY * RAMP * polygon_properties(corners)[0])
        terrain = Terrain([(-40.0, 40.0 * RAMP), (0.0, 0.0), (60.0, 0.0)], ["ice", "rock"])
        surfaces = {"rock": Surface(self.friction_deg), "ice": Surface(0.0)}
        block = Block(corners, density, surface="ice")
        return Scene(terrain, (block,), surfaces, barriers=(self.wall,))


def displacement(lab: Lab, scene: Scene) -> Floats:
    """Return the displacement and rotation of the first barrier, (3,) [m, m, rad]."""
    sim = lab.simulate(scene, sleeping=False)
    start = sim.barrier_poses
    sim.step(lab.steps(LOADING_TIME))
    moved: Floats = (sim.barrier_poses - start)[0]
    return moved


def limit_load(lab: Lab, push: Push) -> float:
    """Return the force above which the wall moves [N], bisected from 0.5 to 1.4 of the limit."""
    low, high = 0.5 * push.limit(), 1.4 * push.limit()
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if np.hypot(*displacement(lab, push.scene(middle))[:2]) < MOVED:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def limit_loads(lab: Lab, pushes: Sequence[Push]) -> Measured:
    """Compare limit loads with statics."""
    return Measured([limit_load(lab, push) for push in pushes], [push.limit() for push in pushes])


def turns(lab: Lab, pushes: Sequence[Push]) -> Floats:
    """Return the rotations of walls at 1.02 of their limit loads [rad], negative downhill."""
    return np.array([displacement(lab, push.scene(1.02 * push.limit()))[2] for push in pushes])


SLIDING_PUSHES = (
    Push(GravityWall(FACE, 2.0, 1.0), 20.0, 1.0),
    Push(GravityWall(FACE, 2.0, 2.0), 30.0, 1.2),
)
OVERTURNING_PUSHES = (
    Push(GravityWall(FACE, 2.0, 1.0), 60.0, 1.5),
    Push(GravityWall(FACE, 2.0, 1.0), 60.0, 1.9),
)

GRAVITY_WALLS = (
    Case(
        "wall-slides",
        (
            Check("limit load", "W tan phi", "N", 2e-2, "relative"),
            Check("turn at 1.02", "none: it slides", "rad", 1e-3, "bound"),
        ),
        lambda lab: (
            limit_loads(lab, SLIDING_PUSHES),
            Measured(np.abs(turns(lab, SLIDING_PUSHES))),
        ),
    ),
    Case(
        "wall-overturns",
        (
            Check("limit load", "W b/(2 h)", "N", 2e-2, "relative"),
            Check("overturns at 1.02", "yes: W b/(2 h)", "-", 0.0, "absolute"),
        ),
        lambda lab: (
            limit_loads(lab, OVERTURNING_PUSHES),
            Measured(turns(lab, OVERTURNING_PUSHES) < -0.05, True),
        ),
    ),
)


CAPACITY, ELONGATION = 1e5, 2.0
"""Energy capacity [J/m] and elongation [m] of the fence that volleys hit."""

FENCE = Fence(0.0, 20.0, CAPACITY, elongation=ELONGATION)

STRONG = Fence(0.0, 5.0, 1e6, elongation=8.0)
"""A fence that stops any train of unit squares in these cases."""

RIGID = Fence(0.0, 20.0, 1e9, elongation=1.0)
"""A fence that hardly yields to any block in these cases."""

CUBE_SIDE = 1.4
"""Side of the squares of a volley [m]."""

BRAKING_TIME = 4.0
"""Time in which three squares arrive and fly on [s]."""

FENCE_PHASES = (0.0, 0.2, 0.4, 0.6, 0.8)
"""Fractions of a step by which a volley is delayed, which shifts the impacts within a step."""


def plate_mass(fence: Fence) -> float:
    """Return the mass of the plate of a fence [kg/m]."""
    return MASS * fence.height


def braking_path(run: Run, barrier: int = 0) -> float:
    """Return the downhill displacement of a barrier in a run [m]."""
    return float(run.barrier_poses[-1, barrier, 0] - run.barrier_poses[0, barrier, 0])


class Stop(NamedTuple):
    """Energies of a plastic impact on a fence."""

    braked: float
    """Energy of block and plate after the impact, which the brake must absorb [J]."""
    lost: float
    """Energy dissipated by the impact itself: m m_p / (2 (m + m_p)) v^2 [J]."""


def blow(mass: float, speed: float, fence: Fence) -> Stop:
    """Return the energies of a square impact of a block of this mass [kg] and speed [m/s]."""
    plate = plate_mass(fence)
    energy = 0.5 * mass * speed**2
    return Stop(energy * mass / (mass + plate), energy * plate / (mass + plate))


def square_mass() -> float:
    """Return the mass of a square of a volley [kg]."""
    return float(masses(Scene(None, (box(width=CUBE_SIDE, height=CUBE_SIDE),)))[0][0])


def volley(
    shares: Sequence[float], late: float = 0.0, fence: Fence = FENCE, uphill: bool = False
) -> Scene:
    """Return squares that hit a fence flat, one after the other, without gravity.

    Parameters
    ----------
    shares : sequence of float
        Their kinetic energies over the capacity of `FENCE` [-].
    late : float
        Delay of all squares [s].
    fence : Fence
        The fence.
    uphill : bool
        Whether they come from the downhill side and fly uphill.
    """
    blocks = []
    for i, share in enumerate(shares):
        speed = math.sqrt(2.0 * share * CAPACITY / square_mass())
        away, y = 3.0 + 5.0 * i + speed * late, 2.0 + 3.0 * i
        x, way = (fence.end + away, -speed) if uphill else (fence.x - away, speed)
        blocks.append(box(x, y, CUBE_SIDE, CUBE_SIDE, velocity=(way, 0.0, 0.0)))
    return Scene(Terrain(FLAT), tuple(blocks), rock(30.0, 0.5), barriers=(fence,), gravity=0.0)


class FenceOutcome(NamedTuple):
    """Closed-form results of a volley."""

    breaking: int
    """Number of the hit that breaks the fence, 0 if none does."""
    kept: float
    """Energy that the blocks retain [J]."""
    path: float
    """Displacement of the fence [m]."""
    taken: float
    """Energy that the fence has absorbed from the blocks, including its plate [J]."""


def outcome(shares: Sequence[float], fence: Fence = FENCE) -> FenceOutcome:
    """Return the closed-form results of a volley: braked energies add up to the capacity.

    The block that breaks the fence continues at the speed of the plate at that time.
    """
    mass, plate = square_mass(), plate_mass(fence)
    capacity = fence.capacity or 0.0
    spent = kept = 0.0
    breaking = 0
    for hit, share in enumerate(shares, 1):
        energy = share * CAPACITY
        if breaking:
            kept += energy
            continue
        braked = blow(mass, math.sqrt(2.0 * energy / mass), fence).braked
        if spent + braked > capacity:
            breaking = hit
            kept = (spent + braked - capacity) * mass / (mass + plate)
        spent = min(spent + braked, capacity)
    return FenceOutcome(breaking, kept, spent / fence.braking_force, sum(shares) * CAPACITY - kept)


def fly_at_fence(lab: Lab, scene: Scene) -> tuple[int, float, float]:
    """Return the computed number of the breaking hit, the retained energy [J] and the path [m]."""
    sim = lab.simulate(scene)
    run = sim.run(BRAKING_TIME)
    broken = run.events[run.events["kind"] == FAILED]
    kept = kinetic_energy(sim.velocities, *masses(scene))
    return int(broken["block"][0]) + 1 if len(broken) else 0, kept, braking_path(run)


def measure_volley(lab: Lab, shares: Sequence[float]) -> tuple[Measured, ...]:
    """Simulate one volley at all phases."""
    found = (fly_at_fence(lab, volley(shares, phase * lab.dt)) for phase in FENCE_PHASES)
    breaking, kept, paths = zip(*found, strict=True)
    exact = outcome(shares)
    return (
        Measured(breaking, exact.breaking),
        Measured([energy / CAPACITY for energy in kept], exact.kept / CAPACITY),
        Measured(paths, exact.path),
    )


def volley_case(name: str, *shares: float) -> Case:
    """Return the case of one volley."""
    checks = (
        Check("hit that breaks it", "the first beyond the capacity", "-", 0.0, "absolute"),
        Check("energy kept", "sum of hits - capacity E - plastic blow", "E", 0.01, "absolute"),
        Check("path", "kinetic energy after the plastic blows / F", "m", 0.03, "absolute"),
    )
    return Case(name, checks, lambda lab: measure_volley(lab, shares))


def together(fence: Fence, blocks: Sequence[Block], momentum: float) -> float:
    """Return the stopping distance of a fence, its plate and blocks that move together [m].

    `momentum` is their total downhill momentum before the impact [N s].
    """
    mass = float(masses(Scene(None, tuple(blocks)))[0].sum()) + plate_mass(fence)
    return 0.5 * momentum**2 / mass / fence.braking_force


def push_together(
    lab: Lab, row: int, shots: Sequence[float], speeds: Sequence[float]
) -> tuple[Measured]:
    """Compare the path of a fence loaded by a row of unit squares and hit by others.

    The row leans on the fence. `shots` are the chainages of the other squares [m], and `speeds`
    their speeds [m/s]. All bodies move on together.
    """
    moving = [box(x, 0.5, velocity=(v, 0.0, 0.0)) for x, v in zip(shots, speeds, strict=True)]
    blocks = [*(box(-0.5 - i, 0.5) for i in range(row)), *moving]
    scene = Scene(Terrain(FLAT), tuple(blocks), rock(0.0), barriers=(STRONG,))
    momentum = float(masses(scene)[0][0]) * sum(speeds)
    exact = together(STRONG, blocks, momentum)
    return (Measured(braking_path(lab.simulate(scene).run(3.0)), exact),)


def in_one_step(lab: Lab, ahead: float, fast: float = 20.0) -> tuple[Measured]:
    """Compare the path if a fast block hits a slower one in the step of the fence impact."""
    shots = (-0.5 - 0.3 * ahead * lab.dt, -1.5 - 0.3 * fast * lab.dt)
    return push_together(lab, 0, shots, (ahead, fast))


def joint_push(name: str, row: int, *shots: float) -> Case:
    """Return the case of unit squares that arrive at 10 m/s, one behind the other."""
    check = Check("path", "momentum of all, then energy / F", "m", 0.01, "relative")
    speeds = (10.0,) * len(shots)
    return Case(name, (check,), lambda lab: push_together(lab, row, shots, speeds))


class Lean(NamedTuple):
    """Smooth unit squares in a row on a slope that lean on a fence.

    Parameters
    ----------
    slope_deg : float
        Slope [deg].
    share : float
        Braking force of the fence over the horizontal thrust W tan(slope) of the row [-].
    blocks : int
        Number of squares in the row.
    elongation : float
        Elongation of the fence [m].
    """

    slope_deg: float
    share: float
    blocks: int = 4
    elongation: float = 4.0

    @property
    def thrust(self) -> float:
        """Horizontal force of the row on a rigid barrier [N/m]."""
        return self.blocks * 2600.0 * GRAVITY * math.tan(math.radians(self.slope_deg))

    @property
    def fence(self) -> Fence:
        """The fence."""
        capacity = self.share * self.thrust * self.elongation
        return Fence(0.0, 4.0, capacity, elongation=self.elongation)

    @property
    def scene(self) -> Scene:
        """The row, in contact with the fence, on a ramp of ice."""
        slope = math.radians(self.slope_deg)
        cos, sin = math.cos(slope), math.sin(slope)
        terrain = Terrain([(-60.0 * cos, 60.0 * sin), (60.0 * cos, -60.0 * sin)], ["ice"])
        first = 0.5 + math.tan(slope)
        places = [first + 1e-6 + i for i in range(self.blocks)]
        blocks = tuple(
            box(0.5 * sin - at * cos, 0.5 * cos + at * sin, angle=-slope, surface="ice")
            for at in places
        )
        surfaces = rock(0.0) | {"ice": Surface(0.0)}
        return Scene(terrain, blocks, surfaces, barriers=(self.fence,))

    def path(self, time: float) -> float:
        """Return the displacement of the fence in a time [m], 0 if it holds the row.

        m a = m g sin(slope) - N cos(slope), N = F + m_p a cos(slope), both from rest.
        """
        slope = math.radians(self.slope_deg)
        mass, cos = self.blocks * 2600.0, math.cos(slope)
        driving = mass * GRAVITY * math.sin(slope) - self.share * self.thrust * cos
        along = max(driving, 0.0) / (mass + plate_mass(self.fence) * cos**2)
        return 0.5 * along * cos * time**2


def lean(lab: Lab, leans: Sequence[Lean], time: float = 1.0) -> tuple[Measured]:
    """Compare the displacements of fences under rows on slopes in a time [s]."""
    found = [braking_path(lab.simulate(one.scene).run(time)) for one in leans]
    return (Measured(found, [one.path(time) for one in leans]),)


class Bar(NamedTuple):
    """A thin tilted bar that hits a fence with a corner, without friction."""

    tilt_deg: float
    speed: float = 10.0
    long: float = 3.0
    thick: float = 0.6

    @property
    def block(self) -> Block:
        """The bar, with its rightmost corner 10 cm in front of the fence."""
        corners = 0.5 * polygon(
            [(-self.thick, -self.long), (self.thick, -self.long)], (0.0, 0.0), 0.0
        )
        outline = polygon([*corners, *(-corners)], (0.0, 0.0), math.radians(self.tilt_deg))
        right = outline[:, 0].max()
        return Block(outline + np.array([-0.1 - right, 6.0]), velocity=(self.speed, 0.0, 0.0))

    @property
    def scene(self) -> Scene:
        """The bar in front of a fence that hardly yields."""
        return Scene(Terrain(FLAT), (self.block,), rock(40.0, 0.5), barriers=(RIGID,), gravity=0.0)

    def after(self) -> tuple[float, float, float, float]:
        """Return vx, vy, omega after the impact [m/s, m/s, rad/s] and the work on the bar [J].

        The corner stops: v - p / m - omega r = 0, omega = p r / I, with the lever arm r of the
        impulse.
        """
        (mass,), (inertia,) = masses(self.scene)
        corners = self.block.vertices
        corner = corners[corners[:, 0].argmax()]
        arm = float(corner[1] - corners[:, 1].mean())
        impulse = self.speed / (1.0 / mass + arm**2 / inertia)
        vx, omega = self.speed - impulse / mass, impulse * arm / inertia
        work = 0.5 * impulse * self.speed
        return vx, 0.0, omega, work


def strike(lab: Lab, bars: Sequence[Bar]) -> tuple[Measured, Measured, Measured]:
    """Compare work, rotation and velocity along the face for tilted bars that hit a fence."""
    works, turns, slips = [], [], []
    for bar in bars:
        sim = lab.simulate(bar.scene)
        run = sim.run(0.1 / bar.speed + 2.0 * lab.dt)
        _, slip, turn, work = bar.after()
        works.append((run.absorbed[0], work))
        turns.append((sim.velocities[0, 2], turn))
        slips.append((sim.velocities[0, 1], slip))
    return _measured(works), _measured(turns), _measured(slips)


def _measured(pairs: Sequence[tuple[float, float]]) -> Measured:
    computed, exact = zip(*pairs, strict=True)
    return Measured(computed, exact)


FENCES = (
    joint_push("fence-train", 0, -3.0, -4.0, -5.0),
    joint_push("fence-row", 3, -6.0),
    Case(
        "fence-struck",
        (Check("path", "momentum of blow and hit, then energy / F", "m", 0.01, "relative"),),
        lambda lab: in_one_step(lab, 0.5),
    ),
    volley_case("fence-0.9", 0.9),
    volley_case("fence-1.1", 1.1),
    volley_case("fence-3x0.45", 0.45, 0.45, 0.45),
    Case(
        "fence-eccentric",
        (
            Check("work", "plastic blow, arm r: p v / 2", "J", 0.02, "relative"),
            Check("turn", "p r / I", "rad/s", 0.02, "relative"),
            Check("velocity along the face", "no friction: 0", "m/s", 1e-6, "absolute"),
        ),
        lambda lab: strike(lab, [Bar(20.0), Bar(-35.0), Bar(50.0)]),
    ),
    Case(
        "fence-thrust",
        (Check("path", "statics below F, m a = thrust - F beyond", "m", 0.02, "absolute"),),
        lambda lab: lean(lab, [Lean(a, s) for a in (20.0, 40.0) for s in (0.8, 1.05, 2.0, 10.0)]),
    ),
)
