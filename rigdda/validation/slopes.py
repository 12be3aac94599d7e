"""Slopes: blocks that leave a crest, toppling columns, and Ritchie's modes of rockfall.

Crests: a box slides off the crest of a bench, tips over it and falls. Its rotation and landing
point are compared with the equations of motion.

Toppling: a slope of 16 columns in static mode is compared with its limit equilibrium. This is the
example of Goodman and Bray (1976) that Koo and Chern (1998) analyse in Figs 6 to 8 and Table 1:
base dip 30 deg, columns 10 m wide, base steps of 1 m, rock of 25 kN/m3.

Modes of rockfall and ditches: Ritchie (1963, Evaluation of rockfall and its control, Highway
Research Record 17) filmed rocks that were pushed off crests: below 45 deg they roll, from 45 to
75 deg they bounce, above 75 deg they fall. Here single blocks of random shape are pushed off the
crests of the sites `ritchie-35`, `ritchie-60` and `ritchie-80`, which differ only in their slope
angle. Closed contacts do not distinguish the modes: impacts of rigid blocks are instantaneous, and
an angular block that rolls faster than sqrt(g r cos) leaves the ground between its corners. The
modes are distinguished by the distance from the slope over block size and by the number of hits.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from rigdda.barriers import Ditch, Layout
from rigdda.limit_equilibrium import Toppling, columns, toppling
from rigdda.model.loads import PointLoad
from rigdda.model.scene import Block, Scene, Surface, Terrain
from rigdda.model.site import Site
from rigdda.validation.case import Case, Check, Lab, Measured, Metered
from rigdda.validation.scenes import GRAVITY, Floats, box, polygon, rock, rough

BOX_WIDTH, BOX_HEIGHT, CREST_HEIGHT = 1.0, 0.6, 14.0
"""Sides of the box and height of the crest above the landing level [m]."""

EVALUATION_HEIGHT = 0.2
"""Height of the lowest corner above that level at which the flight is evaluated [m]."""


class CrestSlide(NamedTuple):
    """Dip of a bench, its friction angle, and the speed of the box with its front at the crest."""

    bench_deg: float
    friction_deg: float
    speed: float


CREST_SLIDES = (
    CrestSlide(10.0, 5.0, 2.0),
    CrestSlide(10.0, 5.0, 4.0),
    CrestSlide(25.0, 20.0, 4.0),
    CrestSlide(0.0, 0.0, 3.0),
)


def over_the_crest(slide: CrestSlide) -> tuple[float, float]:
    """Return the rate of rotation in flight [rad/s] and the centroid's x at landing [m].

    The crest is at (0, 0). The box slides flat until the resultant of its base pressure, which
    friction shifts forward by h tan(phi)/2, reaches the crest. Then its base slides over the crest
    with Coulomb friction. With e and n along and normal to the base, s the position of the crest
    along the base from the centroid, and k the radius of gyration,

        N = (-g n + v_e w - w s') / (1 + s (s - mu h/2) / k^2),   F = -mu N,
        a = g + N n + F e,   w' = (s N + h F/2) / k^2,   s' = -v_e - w h/2,

    until the rear corner reaches the crest. From there the box flies until a corner reaches the
    level.
    """
    w, h, mu = BOX_WIDTH, BOX_HEIGHT, math.tan(math.radians(slide.friction_deg))
    bench, k2 = math.radians(slide.bench_deg), (BOX_WIDTH**2 + BOX_HEIGHT**2) / 12.0
    down = np.array([math.cos(bench), -math.sin(bench)])
    out = np.array([math.sin(bench), math.cos(bench)])
    gain = GRAVITY * (math.sin(bench) - mu * math.cos(bench))
    speed = math.sqrt(slide.speed**2 + 2.0 * gain * 0.5 * (w - mu * h))
    pull = np.array([0.0, -GRAVITY])

    def tip(_: float, state: np.ndarray) -> np.ndarray:
        position, velocity = state[:2], state[3:5]
        along = np.array([math.cos(state[2]), math.sin(state[2])])
        normal, rate = np.array([-along[1], along[0]]), state[5]
        s, slip = -position @ along, velocity @ along + 0.5 * h * rate
        push = -pull @ normal + velocity @ along * rate + rate * slip
        push /= 1.0 + s * (s - 0.5 * mu * h) / k2
        drag = -mu * push
        spin = (s * push + 0.5 * h * drag) / k2
        return np.array([*velocity, rate, *(pull + push * normal + drag * along), spin])

    def leaves(_: float, state: np.ndarray) -> float:
        along = np.array([math.cos(state[2]), math.sin(state[2])])
        return 0.5 * w - float(np.dot(state[:2], along))

    def lands(_: float, state: np.ndarray) -> float:
        return lowest(state[1], state[2]) + CREST_HEIGHT

    leaves.terminal = lands.terminal = True  # type: ignore[attr-defined]
    start = (*(0.5 * h * out - 0.5 * mu * h * down), -bench, *(speed * down), 0.0)
    exact = {"rtol": 1e-10, "atol": 1e-12}
    off = solve_ivp(tip, (0.0, 10.0), start, events=leaves, **exact).y[:, -1]
    end = solve_ivp(lambda _, y: (*y[3:], *pull, 0.0), (0.0, 20.0), off, events=lands, **exact)
    return float(off[5]), float(end.y[0, -1])


def lowest(y: float, angle: float) -> float:
    """Return the elevation of the lowest corner of the box at a position and an angle [m, rad]."""
    reach = 0.5 * (BOX_WIDTH * abs(math.sin(angle)) + BOX_HEIGHT * abs(math.cos(angle)))
    return y - reach


def bench_ground(bench_deg: float, pieces: int) -> tuple[Terrain, list[Block]]:
    """Return the bench above level ground, made of terrain or of `pieces` fixed blocks if not 0."""
    bench = math.radians(bench_deg)
    down = np.array([math.cos(bench), -math.sin(bench)])
    top = -12.0 * down
    if pieces == 0:
        chain = np.array(
            [(top[0], top[1]), (0.0, 0.0), (1e-6, -CREST_HEIGHT), (80.0, -CREST_HEIGHT)]
        )
        return Terrain(chain), []
    ends = [top + way * down for way in np.linspace(0.0, 12.0, pieces + 1)]
    blocks = [Block([a, (a[0], -40.0), (b[0], -40.0), b], fixed=True) for a, b in pairwise(ends)]
    return Terrain([(1e-3, -CREST_HEIGHT), (80.0, -CREST_HEIGHT)]), blocks


def fall_over_crest(lab: Lab, slide: CrestSlide, pieces: int) -> tuple[float, float]:
    """Return the results of `over_the_crest` from a simulation with a bench of `pieces` blocks."""
    terrain, fixed = bench_ground(slide.bench_deg, pieces)
    bench = math.radians(slide.bench_deg)
    down = np.array([math.cos(bench), -math.sin(bench)])
    centre = (
        0.5 * BOX_HEIGHT * np.array([math.sin(bench), math.cos(bench)]) - 0.5 * BOX_WIDTH * down
    )
    velocity = (slide.speed * down[0], slide.speed * down[1], 0.0)
    rock_block = box(centre[0], centre[1], BOX_WIDTH, BOX_HEIGHT, -bench, velocity=velocity)
    sim = lab.simulate(Scene(terrain, (rock_block, *fixed), rock(slide.friction_deg)))
    while True:
        sim.step()
        (x, y, turned), (vx, vy, spin) = sim.poses[0], sim.velocities[0]
        height = lowest(y, turned - bench) + CREST_HEIGHT
        if height < EVALUATION_HEIGHT - vy * lab.dt:
            break
    time = (vy + math.sqrt(vy**2 + 2.0 * GRAVITY * height)) / GRAVITY
    return float(spin), float(x + vx * time)


def measure_crest(lab: Lab, pieces: int) -> tuple[Measured, Measured]:
    """Simulate the slides over each crest."""
    computed = np.array([fall_over_crest(lab, slide, pieces) for slide in CREST_SLIDES]).T
    exact = np.array([over_the_crest(slide) for slide in CREST_SLIDES]).T
    return Measured(computed[0], exact[0]), Measured(computed[1], exact[1])


def crest_case(name: str, pieces: int, bar: float, dt: float | None = None) -> Case:
    """Return the case of a bench of `pieces` fixed blocks, or of terrain if 0, at a step [s]."""
    checks = (
        Check("rate of rotation", "a base that slides over a corner with friction", "rad/s", bar,
              "relative"),
        Check("landing", "the same, then free flight", "m", 5e-3, "relative"),
    )  # fmt: skip
    return Case(name, checks, lambda lab: measure_crest(lab, pieces), dt=dt)


CRESTS = (
    crest_case("crest", 0, 1.5e-2),
    crest_case("crest-1ms", 0, 5e-3, 1e-3),
    crest_case("crest-block", 1, 1.5e-2),
    crest_case("crest-blocks", 5, 1.5e-2),
)
"""All cases with a crest."""


COLUMN_WIDTH, BASE_STEP, BASE_DIP_DEG, UNIT_WEIGHT = 10.0, 1.0, 30.0, 25e3
"""Width of a column [m], step of the base [m], dip [deg], unit weight [N/m3]."""

COLUMN_HEIGHTS = columns(crest=10, above=6, rise=5.0, fall=5.0, step=BASE_STEP)
"""Heights of the columns from the toe upwards [m]."""

LIMIT_DEG = 38.15
"""Friction angle at which forces are compared [deg]; the limit is 38.151 deg."""

BOLTED_DEG = math.degrees(math.atan(0.65))
"""Friction angle at which a bolt force of 2,013 kN is required in the toe column [deg]."""

STATIC_STEPS, STATIC_STEP_TIME, PENETRATION = 2000, 1e-2, 1e-3
"""Number of static steps, their length [s] and the target penetration [m].

k_n dt^2/M = g dt^2/penetration is about 1 for the highest column. If it is much smaller, forces do
not converge in this number of steps; if it is much greater, they do not converge at all.
"""

STILL = 1e-6
"""Displacement per step over that of a free fall, g dt^2/2, below which a slope is stable [-]."""


def limit_state(friction_deg: float) -> Toppling:
    """Return the limit equilibrium of the slope."""
    return toppling(
        COLUMN_HEIGHTS, COLUMN_WIDTH, BASE_STEP, BASE_DIP_DEG, friction_deg, UNIT_WEIGHT
    )


def toppling_slope() -> tuple[Terrain, tuple[Block, ...]]:
    """Return the stepped base and the columns; the slope rises to the right."""
    dip = math.radians(BASE_DIP_DEG)
    chain, blocks = [(-40.0, 0.0)], []
    for n, height in enumerate(COLUMN_HEIGHTS):
        left, right, base = n * COLUMN_WIDTH, (n + 1) * COLUMN_WIDTH, n * BASE_STEP
        chain += [(left, base), (right, base)] if n else [(right, base)]
        column = [(left, base), (right, base), (right, base + height), (left, base + height)]
        blocks.append(Block(polygon(column, angle=dip), density=UNIT_WEIGHT / GRAVITY))
    top = len(COLUMN_HEIGHTS) * BASE_STEP
    chain += [(right, top), (right + 40.0, top)]
    return Terrain(polygon(chain, angle=dip)), tuple(blocks)


def relax(lab: Lab, friction_deg: float, bolt: float = 0.0) -> Metered:
    """Return the slope after static steps, with a horizontal force [N] into the toe column.

    Contacts are the paper's plain springs. Higher columns settle more on them, which mobilises
    friction between columns that then slide together, as the limit equilibrium assumes.
    """
    terrain, blocks = toppling_slope()
    centre = blocks[0].vertices.mean(axis=0)
    loads = (PointLoad(0, tuple(centre), (bolt, 0.0)),) if bolt else ()
    surfaces = {"rock": Surface(friction_deg=friction_deg, restitution=None)}
    scene = Scene(terrain, blocks, surfaces, loads=loads)
    sim = lab.simulate(scene, mode="static", penetration=PENETRATION, sleeping=False)
    sim.step(STATIC_STEPS)
    return sim


def base_forces(sim: Metered) -> tuple[Floats, Floats]:
    """Return normal and shear forces of the base on each column [N], shear positive up the dip."""
    contacts = sim.contacts()
    force = np.zeros((len(COLUMN_HEIGHTS), 2))
    for c in contacts[contacts["block_b"] == -1]:
        along = np.array([-c["ny"], c["nx"]])
        normal = np.array([c["nx"], c["ny"]])
        force[c["block_a"]] += c["normal_force"] * normal + c["shear_force"] * along
    local = polygon(force, angle=-math.radians(BASE_DIP_DEG))
    return local[:, 1], local[:, 0]


def toppling_modes(sim: Metered, steps: int) -> list[str]:
    """Return the mode of motion of each column in the next `steps` steps.

    The mode is given by the greater of the displacement of its top by rotation and the sliding of
    its lower corner. A column is stable if both are below a hundredth of the greatest displacement
    of all columns.
    """
    heel, angle = heels(sim), sim.poses[:, 2]
    sim.step(steps)
    turned = np.abs(sim.poses[:, 2] - angle) * np.array(COLUMN_HEIGHTS)
    slid = np.hypot(*(heels(sim) - heel).T)
    most = np.maximum(turned, slid)
    moving = np.where(turned > slid, "toppling", "sliding")
    return [str(mode) for mode in np.where(most < 0.01 * most.max(), "stable", moving)]


def heels(sim: Metered) -> Floats:
    """Return the lower downhill corners of all columns, (N, 2) [m]."""
    return np.array([sim.vertices(n)[0] for n in range(len(COLUMN_HEIGHTS))])


def measure_base_forces(lab: Lab) -> tuple[Measured, Measured]:
    """Compare the 32 base forces."""
    exact = limit_state(LIMIT_DEG)
    normal, shear = base_forces(relax(lab, LIMIT_DEG))
    return Measured(normal, exact.normal), Measured(shear, exact.shear)


def measure_toppling_modes(lab: Lab) -> tuple[Measured]:
    """Count the columns whose mode differs from the limit equilibrium, below the limit."""
    found, exact = toppling_modes(relax(lab, 38.0), STATIC_STEPS), limit_state(38.0).mode
    return (Measured(sum(a != b for a, b in zip(found, exact, strict=True))),)


def advance(sim: Metered) -> float:
    """Return the greatest displacement of a column per step over that of a free fall [-]."""
    start, dt = sim.poses, sim.settings.dt
    sim.step(STATIC_STEPS // 2)
    moved = float(np.hypot(*(sim.poses - start)[:, :2].T).max())
    return moved / (STATIC_STEPS // 2) / (0.5 * GRAVITY * dt**2)


def measure_standing(lab: Lab) -> tuple[Measured, Measured, Measured]:
    """Compare a slope above the limit, one with sufficient bolting and one with too little."""
    return (
        Measured(advance(relax(lab, 38.3))),
        Measured(advance(relax(lab, BOLTED_DEG, 2150e3))),
        Measured(float(advance(relax(lab, BOLTED_DEG, 1500e3)) > STILL), 1.0),
    )


GOODMAN_BRAY = "limit equilibrium (Goodman, Bray 1976)"

TOPPLING = (
    Case(
        "toppling-forces",
        (
            Check("base normal forces", GOODMAN_BRAY, "N", 1e-2, "relative"),
            Check("base shear forces", GOODMAN_BRAY, "N", 1e-2, "relative"),
        ),
        measure_base_forces,
        dt=STATIC_STEP_TIME,
    ),
    Case(
        "toppling-modes",
        (Check("other modes", f"none: {GOODMAN_BRAY}", "-", 0.0, "bound"),),
        measure_toppling_modes,
        dt=STATIC_STEP_TIME,
    ),
    Case(
        "toppling-stands",
        (
            Check(
                "advance at 38.3 deg", f"none: limit 38.151, {GOODMAN_BRAY}", "-", STILL, "bound"
            ),
            Check("advance at 2,150 kN", f"none: limit 2,013, {GOODMAN_BRAY}", "-", STILL, "bound"),
            Check("moves at 1,500 kN", f"yes: limit 2,013, {GOODMAN_BRAY}", "-", 0.0, "absolute"),
        ),
        measure_standing,
        dt=STATIC_STEP_TIME,
    ),
)


RITCHIE = "Ritchie (1963)"

ROLLING, BOUNCING, FALLING = 35, 60, 80
"""Slope angles for each mode [deg]."""

PUSHED_BLOCKS, BLOCKS_ABOVE_DITCH = 64, 200
"""Number of blocks pushed off each crest to observe their descent, and above each ditch."""

LONGEST_DESCENT = 15.0
"""Time after which a block that has not reached the foot counts as stopped on the slope [s]."""

RUN_OUT = 10.0
"""Time in which a block comes to rest at the foot [s]."""

RITCHIE_DITCHES = {60: (1.8, 4.6), 80: (1.2, 4.6)}
"""Depth and width [m] of Ritchie's ditches below slopes of 0.5:1 and near vertical, 10 to 20 m
high. They are quoted from memory and serve as input only, not for comparison."""


CONTACT_PUSH = 1e-6
"""Change of velocity in a step, other than by gravity, that indicates contact [m/s]. The contacts
that are closed at the end of a step would miss impacts that are over by then."""


class RitchieDescent(NamedTuple):
    """Descent of a block down a slope, until its height above the foot equals its size.

    `aloft` is the fraction of time in which its lowest corner is higher above the slope than its
    size, and `contact` the fraction in which it touches the slope. `touches` counts contacts
    separated by a flight, however short. `turns` is the distance over the circumference of its
    circumcircle.
    """

    aloft: float
    contact: float
    touches: int
    turns: float


def pushed(site: Site, rng: np.random.Generator) -> tuple[Block, float]:
    """Return a block that leaves the crest at 0.5 to 1.5 m/s, and its diameter [m]."""
    crest = max(site.slope.points, key=lambda point: (point[1], point[0]))
    radius = rng.uniform(0.3, 0.6)
    corners = polygon(
        rough(rng, int(rng.integers(7, 12)), radius), angle=rng.uniform(0.0, 2.0 * math.pi)
    )
    corners += np.array(crest) - corners.min(axis=0) + 0.05
    velocity = (rng.uniform(0.5, 1.5), 0.0, 0.0)
    return Block(corners, site.sources[0].density, velocity=velocity), 2.0 * radius


def descend(lab: Lab, site: Site, rng: np.random.Generator) -> RitchieDescent:
    """Push a block off the crest of a site and follow it down to the foot."""
    block, size = pushed(site, rng)
    sim = lab.simulate(Scene(site.profile, (block,), site.surfaces))
    foot = site.profile.height(site.slope.toe)
    ground = np.array(site.slope.points).T
    start = sim.poses[0, :2]
    aloft, touching = [], []
    while sim.poses[0, 1] > foot + size and sim.time < LONGEST_DESCENT:
        before = sim.velocities[0, :2]
        sim.step()
        corners = sim.vertices(0)
        height = corners[:, 1] - np.interp(corners[:, 0], *ground)
        aloft.append(height.min() > size)
        change = sim.velocities[0, :2] - before - np.multiply(sim.scene.gravity_vector, lab.dt)
        touching.append(np.hypot(*change) > CONTACT_PUSH)
    way = float(np.hypot(*(sim.poses[0, :2] - start)))
    touches = int((np.diff(touching, prepend=False) & touching).sum())
    return RitchieDescent(
        float(np.mean(aloft)), float(np.mean(touching)), touches, way / (math.pi * size)
    )


def descents(lab: Lab, slope_deg: int) -> Floats:
    """Return all descents of a slope, one row each with the fields of `RitchieDescent`."""
    site = Site.load(f"ritchie-{slope_deg}")
    return np.array([descend(lab, site, lab.random(slope_deg, i)) for i in range(PUSHED_BLOCKS)])


def interval(values: Floats) -> Floats:
    """Return the lower and upper limits of the 95 % confidence interval of the mean."""
    half = 1.96 * values.std(ddof=1) / math.sqrt(len(values))
    return values.mean() + np.array([-half, half])


def overlaps(*intervals: Floats) -> list[float]:
    """Return the overlap of each interval with the next higher one, negative if disjoint."""
    return [float(a[1] - b[0]) for a, b in pairwise(intervals)]


def measure_rockfall_modes(lab: Lab) -> tuple[Measured, ...]:
    """Compare the descents on the three slopes."""
    roll, bounce, fall = (descents(lab, deg) for deg in (ROLLING, BOUNCING, FALLING))
    aloft, _, touches, turns = range(len(RitchieDescent._fields))
    return (
        Measured(roll[:, turns].sum() / roll[:, touches].sum()),
        Measured(roll[:, aloft].mean()),
        Measured(bounce[:, touches].sum() / bounce[:, turns].sum()),
        Measured(fall[:, touches].mean()),
        Measured(1.0 - fall[:, aloft].mean()),
        Measured(overlaps(*(interval(mode[:, aloft]) for mode in (roll, bounce, fall)))),
        Measured(overlaps(*(interval(mode[:, touches]) for mode in (fall, bounce, roll)))),
    )


def passing(lab: Lab, site: Site, layout: Layout, station: float) -> float:
    """Return the fraction of blocks that come to rest beyond a chainage."""
    past = 0
    for i in range(BLOCKS_ABOVE_DITCH):
        block, _ = pushed(site, lab.random(i))
        sim = lab.simulate(Scene(site.profile, (block,), site.surfaces, layout))
        sim.step(lab.steps(RUN_OUT))
        past += bool(sim.poses[0, 0] > station)
    return past / BLOCKS_ABOVE_DITCH


def measure_ditch(lab: Lab, slope_deg: int) -> tuple[Measured, Measured]:
    """Push the same blocks off a crest with and without a ditch at the toe."""
    site = Site.load(f"ritchie-{slope_deg}")
    depth, width = RITCHIE_DITCHES[slope_deg]
    ditch = Ditch(site.slope.toe, depth, width)
    dug, level = (passing(lab, site, layout, ditch.end) for layout in ((ditch,), ()))
    return Measured(dug), Measured(dug - level)


ROCKFALL_MODES = Case(
    "ritchie-modes",
    (
        # a rolling block touches at least once per turn and is mostly near the slope
        Check("turns a touch at 35 deg", f"at most 1: it rolls, {RITCHIE}", "-", 1.0, "bound"),
        Check("time aloft at 35 deg", f"none: it rolls, {RITCHIE}", "-", 0.5, "bound"),
        # a bouncing block makes more than a turn between touches
        Check("touches a turn at 60 deg", f"under 1: it bounces, {RITCHIE}", "-", 1.0, "bound"),
        # a block pushed off at v meets the face after a fall of 2 v^2 tan^2/g, 6.6 m at 1 m/s,
        # three times on a face of 20 m
        Check("touches at 80 deg", f"few: it falls, {RITCHIE}", "-", 3.0, "bound"),
        Check("time not aloft at 80 deg", f"none: it falls, {RITCHIE}", "-", 0.5, "bound"),
        Check("overlap of time aloft", "none: 35 < 60 < 80 deg", "-", 0.0, "bound"),
        Check("overlap of touches", "none: 35 > 60 > 80 deg", "-", 0.0, "bound"),
    ),
    measure_rockfall_modes,
    slow=True,
)


def ditch_case(slope_deg: int) -> Case:
    """Return the case of a ditch; its retention is reported, but it only has to be effective."""
    return Case(
        f"ritchie-ditch-{slope_deg}",
        (
            Check("past the ditch", f"none: it keeps them, {RITCHIE}", "-", 0.5, "bound"),
            Check("past it less past level ground", "below 0: it helps", "-", 0.0, "bound"),
        ),
        lambda lab: measure_ditch(lab, slope_deg),
    )


RITCHIE_CASES = (ROCKFALL_MODES, *(ditch_case(slope_deg) for slope_deg in RITCHIE_DITCHES))
