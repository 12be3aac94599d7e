"""Records of the kernels as structured types; `packing` fills the arrays.

Sizes: M bodies, in the order blocks of the scene, gravity walls and fences, fixed barriers. N
blocks. G bodies that may move, all but the fixed barriers. B barriers. R polygons: the M outlines
of the bodies, then the convex parts of non-convex bodies. P is the largest number of corners of a
polygon. S terrain segments. C is the room for contacts.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def _record(**fields: type) -> np.dtype:
    """Return a structured type; one such array compiles much faster than many separate columns."""
    return np.dtype(list(fields.items()), align=True)


BODY = _record(
    x=float,  # centroid [m]
    y=float,
    theta=float,  # rotation since the start, unwrapped [rad]
    vx=float,  # [m/s]
    vy=float,
    omega=float,  # [rad/s]
    mass=float,  # per metre of width [kg]
    inertia=float,  # about the centroid [kg m2]
    radius=float,  # of the circumscribed circle about the centroid [m]
    quiet=float,  # time for which it has been quiet [s]
    slowest=float,  # least speed during that time [m/s]
    path=float,  # bound on the path of its points in this step: dt times its greatest speed [m]
    count=int,  # number of corners
    part=int,  # first polygon of its convex parts; the body itself if it is convex
    parts=int,  # number of convex parts
    surface=int,  # index of the surface
    status=int,  # AWAKE, ASLEEP, FIXED, RETIRED
    brake=float,  # force at which a fence yields along x; 0: the body moves freely [N]
    elongation=float,  # elongation that is left in a fence [m]
    held_at=float,  # x up to which the elongation has been used [m]
    island=int,  # island in which a sleeping body fell asleep
    touching=bool,  # whether one of its contacts was closed in the last step
    whole=bool,  # whether its island was solved as a whole in the last step
    force_x=float,  # dead load [N]
    force_y=float,
    moment_cos=float,  # moment of the load: moment_cos cos(theta) + moment_sin sin(theta) [N m]
    moment_sin=float,
)
"""State of a body. Corners follow from angle and body coordinates, so that the area is
conserved."""

CONTACT = _record(
    a=np.int32,  # block
    b=np.int32,  # body or TERRAIN; the normal points to a
    key=np.int32,  # identifies the vertex and its owner between steps; -1 - q for support q
    owner=np.int32,  # 1: the vertex belongs to a; 0: to b
    other=np.int32,  # surface of b
    state=np.int32,  # OPEN, STICK, SLIP
    kind=np.int32,  # REST, NEW, PLAIN, BOLT, PIN
    struck=np.int32,  # 1 after an impact in this step, else 0
    turns=np.int32,  # 1 if rolling resistance is at its limit, else 0
    pair=np.int32,  # off-diagonal block of the pair of bodies, -1: no coupling
    face_x=float,  # chainage of the middle of the terrain segment, else of the vertex [m]
    x=float,  # the vertex [m]
    y=float,
    nx=float,
    ny=float,
    gap=float,  # > 0 is open [m]
    ra_x=float,  # lever arms from the centroids at the time of the force [m]
    ra_y=float,
    rb_x=float,
    rb_y=float,
    un=float,  # relative normal and shear velocity at the start; > 0 separates [m/s]
    us=float,
    ur=float,  # R times the relative rate of rotation at the start [m/s]
    friction=float,  # tan phi
    restitution=float,
    restitution_speed=float,  # closing speed at which restitution has fallen to half [m/s]
    rolling=float,  # coefficient of rolling resistance [-]
    radius=float,  # radius of gyration of the pair, see law.rolling_radius [m]
    bond=float,  # length of unbroken joint that the contact represents [m]
    cohesion=float,  # shear strength at zero normal force [N]
    tension=float,  # tensile strength of the joint, or yield force of a bolt [N]
    stiffness=float,  # at rest [N/m]
    kappa=float,  # in this step [N/m]
    bias=float,  # gap at which the spring is force-free [m], see contact.law
    accumulated_normal=float,  # forces carried over from the last step [N]
    accumulated_shear=float,
    accumulated_roll=float,
    normal=float,  # force on a in this step [N]
    shear=float,
    roll=float,  # moment on a over `radius` [N]
    lag=float,  # friction force assumed in this iteration; its sign is the slip direction [N]
)
"""One contact in one step: a vertex and a face that may meet. In state OPEN they do not touch."""

LINK = _record(
    a=int,  # block
    b=int,  # block or TERRAIN
    kind=int,  # BOLT or PIN
    number=int,  # index of the support in the scene
    sign=float,  # -1 if a is the second block of the support, else 1 [-]
    ax=float,  # anchors in body coordinates, or in the ground where b is TERRAIN [m]
    ay=float,
    bx=float,
    by=float,
    stiffness=float,  # [N/m]
    prestress=float,  # [N]
    yielding=float,  # yield force [N]
    length=float,  # length at which the tension is `prestress`; increases by yielding [m]
)
"""One support."""

BOX = _record(
    low_x=float,  # [m]
    high_x=float,
    low_y=float,
    high_y=float,
    body=np.int32,
    awake=bool,
)
"""Swept bounding box of a body."""

SEGMENT = _record(
    x=float,  # its start [m]
    y=float,
    normal_x=float,  # unit normal out of the ground
    normal_y=float,
    length=float,  # [m]
    turn=float,  # angle by which the ground turns at the start [rad], > 0 concave, 0 at the ends
    surface=int,
    left=float,  # extent [m]
    right=float,
    bottom=float,
    top=float,
    bin=int,  # first bin that contains it
)
"""One segment of the terrain."""

STEM = _record(
    x=float,  # chainage at which the centroid of the block strikes it [m]
    energy=float,  # that it takes at most [J]
    top=float,  # elevation up to which it takes energy [m]
)
"""A stem of a forest that a block strikes."""

STATION = _record(
    x=float,  # chainage [m]
    ground=float,  # elevation of the highest ground there [m]
)
"""A chainage at which crossings are recorded."""

WATCHED = _record(
    next=int,  # first station that it has not passed
    energy=float,  # largest energy in the watched interval [J]
    low=float,  # least and greatest x reached by its circumscribed circle [m]
    high=float,
)
"""Recorded quantities of a block."""

TARGET = _record(
    absorbed=float,  # [J]
    ground=float,  # elevation from which impact heights are measured [m]
    sag=float,  # loss of height of a fence over its displacement [-]
    low=float,  # extent of an embankment, empty for other barriers [m]
    high=float,
    most=float,  # greatest thrust of a single contact in this step [N]
    block=int,  # block of that contact
    x=float,  # position of that contact [m]
    y=float,
    thrust=float,  # greatest thrust averaged over a second so far [N]
    limit=float,  # thrust at which it fails; inf: it cannot fail, or has failed [N]
)
"""Recorded quantities of a barrier."""

SHAKING = _record(
    time=float,  # [s]
    x=float,  # acceleration of the ground [m/s2]
    y=float,
    sum_x=float,  # integrals of the acceleration up to this time [m/s]
    sum_y=float,
)
"""One corner of the piecewise linear ground acceleration."""

INTERFACE = _record(
    friction=float,  # tan phi
    cohesion=float,  # [Pa]
    tension=float,  # [Pa]
    restitution=float,  # PLAIN_CONTACT: the paper's penalty contact
    restitution_speed=float,  # inf: restitution does not depend on the speed [m/s]
    rolling=float,  # coefficient of rolling resistance [-]
)
"""Properties of the interface between two surfaces."""

PARAMETERS = _record(
    blocks=int,  # number of bodies that may move: blocks, gravity walls and fences
    dt=float,
    gravity_x=float,  # [m/s2]
    gravity_y=float,
    gravity=float,  # magnitude
    field_x=float,  # acceleration of free blocks in this step by gravity and ground motion [m/s2]
    field_y=float,
    damping=float,  # mass-proportional [1/s]
    block_weight=float,  # mean weight of the free blocks [N]
    penetration=float,  # target penetration [m]
    margin=float,  # distance of contact candidates [m], see constants.MARGIN_RATIO
    tolerance=float,  # of the solver: residual over forces [-]
    sweep_tolerance=float,  # [m/s]
    iterations=int,  # maximum number of open-close iterations
    static=bool,
    post_correction=bool,
    islands=bool,
    solver=int,  # PCG, BLOCK_PCG, SOR, DIRECT
    relaxation=float,  # over-relaxation factor of the SOR solver; unrelated to `relaxation` [-]
    sleeping=bool,
    floor=float,  # y below which a body is retired [m]
    bonded=bool,  # whether any interface has cohesion or tensile strength
)
"""Parameters of the scene and the settings."""

Bodies = NDArray[np.void]
"""(M,) array of BODY."""
Body = Any
"""One BODY: a view of a record, so that assignments change the array."""
Contacts = NDArray[np.void]
"""(C,) array of CONTACT."""
Contact = Any
"""One CONTACT."""
Links = NDArray[np.void]
"""Array of LINK, ordered by a."""
Link = Any
"""One LINK."""
Shaking = NDArray[np.void]
"""(K,) array of SHAKING in order of time; empty if the ground is at rest."""
Interfaces = NDArray[np.void]
"""(surfaces, surfaces) array of INTERFACE."""
Box = Any
"""One BOX."""
Parameters = Any
"""One PARAMETERS."""

POLYGON = _record(
    count=int,  # number of corners
    body=int,
    middle_x=float,  # mean of the corners [m]
    middle_y=float,
    inside=float,  # radius of the circle about the mean that touches the nearest edge [m]
    low_x=float,  # extent [m]
    high_x=float,
    low_y=float,
    high_y=float,
)
"""One outline or convex part in its current position."""

CORNER = _record(
    x=float,  # current position [m]
    y=float,
    normal_x=float,  # current outward unit normal of the edge that starts here
    normal_y=float,
    number=np.int32,  # index of this corner in the outline of the body
    inner=bool,  # whether the edge that starts here is inside the body, or between fixed blocks
    reentrant=bool,  # whether the outline of the body is concave here
    flush=bool,  # whether fixed bodies around this corner of a fixed body leave no convex corner
)
"""One corner of a polygon."""

LOCAL = _record(
    x=float,  # [m]
    y=float,
    normal_x=float,  # outward unit normal of the edge that starts here
    normal_y=float,
)
"""A corner in body coordinates, relative to the centroid at theta = 0."""


Polygons = NDArray[np.void]
"""(R,) array of POLYGON."""
Corners = NDArray[np.void]
"""(R, P) array of CORNER."""


LEDGER = ("friction", "impact", "damping", "external", "links")
"""Entries of the ledger array: work done on the blocks so far [J]."""

COUNTERS = 10
"""Length of the counter array, whose entries are numbered below."""

STEPS, ITERATIONS, RELAXED, SOLVES, SOLVER_ITERATIONS = 0, 1, 2, 3, 4
CONTACTS, EVENTS, CONTACT_TOTAL, SWEEPS, STILL = 5, 6, 7, 8, 9
"""Entries of the counter array: steps; open-close iterations; relaxed islands; systems solved and
iterations of their solver; contacts in the last step; events not yet read; contacts and relaxation
sweeps so far; steps since the last relevant motion."""
