"""A fence brakes what pushes it with a constant force, and goes when its elongation is spent.

Its plate, of mass m_p, takes part in every blow, which is plastic. A block of mass m and speed v
that hits it squarely goes on with it at m v / (m + m_p), and both are stopped over the path
K / F: K is the kinetic energy of both after the blow, F the braking force.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rigdda.barriers import Fence
from rigdda.barriers.fence import MASS
from rigdda.dynamics.monitors import FAILED
from rigdda.dynamics.run import Run
from rigdda.model.scene import Block, Scene, Surface, Terrain
from rigdda.validation.case import Case, Check, Lab, Measured
from rigdda.validation.scenes import FLAT, GRAVITY, box, kinetic_energy, masses, polygon, rock

CAPACITY, ELONGATION = 1e5, 2.0
"""Of the fence that volleys hit: energy [J/m] and path over which it takes it [m]."""

FENCE = Fence(0.0, 20.0, CAPACITY, elongation=ELONGATION)

STRONG = Fence(0.0, 5.0, 1e6, elongation=8.0)
"""A fence that stops any train of unit squares of these cases."""

RIGID = Fence(0.0, 20.0, 1e9, elongation=1.0)
"""A fence that hardly gives way to any block of these cases."""

SIDE = 1.4
"""Side of the squares of a volley [m]."""

DURATION = 4.0
"""Time in which three squares arrive and fly on [s]."""

PHASES = (0.0, 0.2, 0.4, 0.6, 0.8)
"""Parts of a step by which a volley is late: it hits elsewhere in a step."""


def plate_mass(fence: Fence) -> float:
    """Return the mass of the plate of a fence [kg/m]."""
    return MASS * fence.height


def path(run: Run, barrier: int = 0) -> float:
    """Return how far a barrier has moved downhill in a run [m]."""
    return float(run.barrier_poses[-1, barrier, 0] - run.barrier_poses[0, barrier, 0])


class Stop(NamedTuple):
    """What comes of a plastic blow on a fence."""

    braked: float
    """Energy of block and plate after the blow, which the brake has to take [J]."""
    lost: float
    """Energy that the blow itself takes: m m_p / (2 (m + m_p)) v^2 [J]."""


def blow(mass: float, speed: float, fence: Fence) -> Stop:
    """Return what comes of a block of this mass [kg] and speed [m/s] that hits a fence squarely."""
    plate = plate_mass(fence)
    energy = 0.5 * mass * speed**2
    return Stop(energy * mass / (mass + plate), energy * plate / (mass + plate))


def square_mass() -> float:
    """Return the mass of a square of a volley [kg]."""
    return float(masses(Scene(None, (box(width=SIDE, height=SIDE),)))[0][0])


def volley(
    shares: Sequence[float], late: float = 0.0, fence: Fence = FENCE, uphill: bool = False
) -> Scene:
    """Return squares that hit a fence flat, one after the other, without gravity.

    Parameters
    ----------
    shares : sequence of float
        Their kinetic energies over the capacity of `FENCE` [-].
    late : float
        Time by which all of them are late [s].
    fence : Fence
        What they hit.
    uphill : bool
        Whether they come from the downhill side.
    """
    blocks = []
    for i, share in enumerate(shares):
        speed = math.sqrt(2.0 * share * CAPACITY / square_mass())
        away, y = 3.0 + 5.0 * i + speed * late, 2.0 + 3.0 * i
        x, way = (fence.end + away, -speed) if uphill else (fence.x - away, speed)
        blocks.append(box(x, y, SIDE, SIDE, velocity=(way, 0.0, 0.0)))
    return Scene(Terrain(FLAT), tuple(blocks), rock(30.0, 0.5), barriers=(fence,), gravity=0.0)


class FenceOutcome(NamedTuple):
    """What comes of a volley by closed forms."""

    breaking: int
    """Which hit breaks the fence, 0: none."""
    kept: float
    """Energy that the blocks keep [J]."""
    path: float
    """How far the fence has given way [m]."""
    taken: float
    """Energy that the fence has taken from the blocks, its plate included [J]."""


def outcome(shares: Sequence[float], fence: Fence = FENCE) -> FenceOutcome:
    """Return what comes of a volley: braked energies add up until the capacity is spent.

    The block that breaks the fence goes on as fast as the plate at that time.
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


def fly(lab: Lab, scene: Scene) -> tuple[int, float, float]:
    """Return which hit breaks the fence, the energy kept [J], and the path, as computed."""
    sim = lab.simulate(scene)
    run = sim.run(DURATION)
    broken = run.events[run.events["kind"] == FAILED]
    kept = kinetic_energy(sim.velocities, *masses(scene))
    return int(broken["block"][0]) + 1 if len(broken) else 0, kept, path(run)


def measure(lab: Lab, shares: Sequence[float]) -> tuple[Measured, ...]:
    """Throw one volley, at all phases."""
    found = (fly(lab, volley(shares, phase * lab.dt)) for phase in PHASES)
    breaking, kept, paths = zip(*found, strict=True)
    exact = outcome(shares)
    return (
        Measured(breaking, exact.breaking),
        Measured([energy / CAPACITY for energy in kept], exact.kept / CAPACITY),
        Measured(paths, exact.path),
    )


def case(name: str, *shares: float) -> Case:
    """Return the case of one volley."""
    checks = (
        Check("hit that breaks it", "the first beyond the capacity", "-", 0.0, "absolute"),
        Check("energy kept", "sum of hits - capacity E - plastic blow", "E", 0.01, "absolute"),
        Check("path", "kinetic energy after the plastic blows / F", "m", 0.03, "absolute"),
    )
    return Case(name, checks, lambda lab: measure(lab, shares))


def together(fence: Fence, blocks: Sequence[Block], momentum: float) -> float:
    """Return the path of a fence over which blocks and plate are stopped that go on together [m].

    `momentum` is what they have downhill before the blow [N s].
    """
    mass = float(masses(Scene(None, tuple(blocks)))[0].sum()) + plate_mass(fence)
    return 0.5 * momentum**2 / mass / fence.braking_force


def push_together(
    lab: Lab, row: int, shots: Sequence[float], speeds: Sequence[float]
) -> tuple[Measured]:
    """Return the path of a fence on which a row of unit squares leans and which others strike.

    `shots` are the chainages of what comes [m], with `speeds` [m/s]. All go on together.
    """
    moving = [box(x, 0.5, velocity=(v, 0.0, 0.0)) for x, v in zip(shots, speeds, strict=True)]
    blocks = [*(box(-0.5 - i, 0.5) for i in range(row)), *moving]
    scene = Scene(Terrain(FLAT), tuple(blocks), rock(0.0), barriers=(STRONG,))
    momentum = float(masses(scene)[0][0]) * sum(speeds)
    exact = together(STRONG, blocks, momentum)
    return (Measured(path(lab.simulate(scene).run(3.0)), exact),)


def in_one_step(lab: Lab, ahead: float, fast: float = 20.0) -> tuple[Measured]:
    """Return the path where a fast block strikes a slower one in the step in which that hits."""
    shots = (-0.5 - 0.3 * ahead * lab.dt, -1.5 - 0.3 * fast * lab.dt)
    return push_together(lab, 0, shots, (ahead, fast))


def joint_push(name: str, row: int, *shots: float) -> Case:
    """Return the case of unit squares that come with 10 m/s, one behind the other."""
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
        Squares of the row.
    elongation : float
        Of the fence [m].
    """

    slope_deg: float
    share: float
    blocks: int = 4
    elongation: float = 4.0

    @property
    def thrust(self) -> float:
        """Horizontal force with which the row leans on what does not give way [N/m]."""
        return self.blocks * 2600.0 * GRAVITY * math.tan(math.radians(self.slope_deg))

    @property
    def fence(self) -> Fence:
        """The fence."""
        capacity = self.share * self.thrust * self.elongation
        return Fence(0.0, 4.0, capacity, elongation=self.elongation)

    @property
    def scene(self) -> Scene:
        """The row, which touches the fence, on a ramp of ice."""
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
        """Return how far the row has pushed the fence in a time [m]; nothing if it is held.

        m a = m g sin(slope) - N cos(slope), N = F + m_p a cos(slope), both from rest.
        """
        slope = math.radians(self.slope_deg)
        mass, cos = self.blocks * 2600.0, math.cos(slope)
        driving = mass * GRAVITY * math.sin(slope) - self.share * self.thrust * cos
        along = max(driving, 0.0) / (mass + plate_mass(self.fence) * cos**2)
        return 0.5 * along * cos * time**2


def lean(lab: Lab, leans: Sequence[Lean], time: float = 1.0) -> tuple[Measured]:
    """Return how far rows on slopes have pushed their fences in a time [s]."""
    found = [path(lab.simulate(one.scene).run(time)) for one in leans]
    return (Measured(found, [one.path(time) for one in leans]),)


class Bar(NamedTuple):
    """A thin bar, tilted, that flies at a fence and strikes it with a corner, without friction."""

    tilt_deg: float
    speed: float = 10.0
    long: float = 3.0
    thick: float = 0.6

    @property
    def block(self) -> Block:
        """The bar, its right-most corner 10 cm before the fence."""
        corners = 0.5 * polygon(
            [(-self.thick, -self.long), (self.thick, -self.long)], (0.0, 0.0), 0.0
        )
        outline = polygon([*corners, *(-corners)], (0.0, 0.0), math.radians(self.tilt_deg))
        right = outline[:, 0].max()
        return Block(outline + np.array([-0.1 - right, 6.0]), velocity=(self.speed, 0.0, 0.0))

    @property
    def scene(self) -> Scene:
        """The bar before a fence that hardly gives way."""
        return Scene(Terrain(FLAT), (self.block,), rock(40.0, 0.5), barriers=(RIGID,), gravity=0.0)

    def after(self) -> tuple[float, float, float, float]:
        """Return vx, vy, omega after the blow [m/s, m/s, rad/s] and the work on the bar [J].

        The corner stops: v - p / m - omega r = 0, omega = p r / I, for the arm r of the blow.
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
    """Return work, turn and velocity along the face after tilted bars have struck a fence."""
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


CASES = (
    joint_push("fence-train", 0, -3.0, -4.0, -5.0),
    joint_push("fence-row", 3, -6.0),
    Case(
        "fence-struck",
        (Check("path", "momentum of blow and hit, then energy / F", "m", 0.01, "relative"),),
        lambda lab: in_one_step(lab, 0.5),
    ),
    case("fence-0.9", 0.9),
    case("fence-1.1", 1.1),
    case("fence-3x0.45", 0.45, 0.45, 0.45),
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
