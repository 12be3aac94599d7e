"""Records that the kernels work on, in structured arrays. `pack` fills them.

M bodies: the N blocks of the scene, its gravity walls and fences, then its walls. G: those that may
move, all but the walls. B: barriers. R: polygons, the M outlines of the bodies, then
the convex parts of those that are not convex. P: most corners of a polygon. S: terrain segments. C:
room for contacts.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def _record(**fields: type) -> np.dtype:
    """Return a structured type; one such array is far cheaper to compile than its many columns."""
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
    quiet=float,  # time it has been quiet [s]
    slowest=float,  # its least speed for so long [m/s]
    lately=float,  # what is left of its greatest speed of late, see constants.LATELY [m/s]
    path=float,  # bound on the way of its points in this step: dt max(top speed, lately) [m]
    count=int,  # corners
    part=int,  # first polygon of its convex parts: itself where it is convex
    parts=int,  # number of them
    surface=int,  # index of the surface
    status=int,  # AWAKE, ASLEEP, FIXED, RETIRED
    brake=float,  # force against which it gives way along x, of a fence; 0: it moves freely [N]
    elongation=float,  # by which a fence may still give way [m]
    held_at=float,  # x up to which it has spent it [m]
    island=int,  # island in which a sleeping body fell asleep
    apart=float,  # time since a contact of it was closed, 0 if one was in the last step [s]
    damping=float,  # that of what it touched last, see assembly.island.damping_of [1/s]
    whole=bool,  # whether its island was solved as a whole in the last step
    force_x=float,  # dead load [N]
    force_y=float,
    moment_cos=float,  # its moment is moment_cos cos(theta) + moment_sin sin(theta) [N m]
    moment_sin=float,
)
"""State of a body. Angle and body coordinates are the state, so area is kept."""

CONTACT = _record(
    a=np.int32,  # block
    b=np.int32,  # body or TERRAIN; the normal points to a
    key=np.int32,  # vertex and its owner, the same over steps; -1 - q for support q
    owner=np.int32,  # 1: the vertex belongs to a, 0: to b
    other=np.int32,  # surface of b
    state=np.int32,  # OPEN, STICK, SLIP
    kind=np.int32,  # REST, NEW, PLAIN, BOLT, PIN
    struck=np.int32,  # 1 if it was struck in this step
    pair=np.int32,  # off-diagonal block of the pair of bodies, -1: no coupling
    x=float,  # the vertex [m]
    y=float,
    nx=float,
    ny=float,
    gap=float,  # positive is open [m]
    ra_x=float,  # arms from the centroids when the force acts [m]
    ra_y=float,
    rb_x=float,
    rb_y=float,
    un=float,  # normal and shear relative velocity at the start [m/s], positive separates
    us=float,
    friction=float,  # tan phi
    restitution=float,
    bond=float,  # length of joint that the contact stands for and that is not broken [m]
    cohesion=float,  # shear force that it bears without normal force [N]
    tension=float,  # tension that it, or a bolt before it yields, bears [N]
    stiffness=float,  # of the contact at rest [N/m]
    kappa=float,  # in this step [N/m]
    bias=float,  # displacement at which the spring is free [m], see contact.law
    accumulated_normal=float,  # forces carried over from the last step [N]
    accumulated_shear=float,
    normal=float,  # force of this step [N], on a
    shear=float,
    lag=float,  # friction force assumed in this iteration; its sign is the direction of slip [N]
)
"""One contact in one step: a vertex and a face that may meet in it. OPEN: they do not."""

LINK = _record(
    a=int,  # block
    b=int,  # block or TERRAIN
    kind=int,  # BOLT or PIN
    number=int,  # index of the support in the scene
    sign=float,  # -1 where a is the second block of the support, else 1 [-]
    ax=float,  # anchors in body coordinates, in the ground where b is TERRAIN [m]
    ay=float,
    bx=float,
    by=float,
    stiffness=float,  # [N/m]
    prestress=float,  # [N]
    yielding=float,  # tension at which it yields [N]
    length=float,  # at which the tension is `prestress`; grows as it yields [m]
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
"""Swept box of a body."""

SEGMENT = _record(
    x=float,  # where it starts [m]
    y=float,
    normal_x=float,  # unit normal out of the ground
    normal_y=float,
    length=float,  # [m]
    turn=float,  # of the ground where it starts [rad], positive concave, 0 at the ends
    surface=int,
    left=float,  # its extent [m]
    right=float,
    bottom=float,
    top=float,
    bin=int,  # the first one that it is in
)
"""One segment of the terrain."""

STATION = _record(
    x=float,  # chainage [m]
    ground=float,  # elevation of the highest ground there [m]
)
"""Where crossings are recorded."""

WATCHED = _record(
    next=int,  # first station that it has not passed
    energy=float,  # largest energy in the interval watched [J]
    low=float,  # least and greatest x that its circle came to [m]
    high=float,
)
"""What is known of a block."""

TARGET = _record(
    absorbed=float,  # [J]
    ground=float,  # elevation from which impact heights count [m]
    sag=float,  # height that a fence loses by what it gives way [-]
    low=float,  # interval of an embankment [m], empty for what is not one
    high=float,
    most=float,  # greatest thrust of a contact in this step [N]
    block=int,  # whose it is
    x=float,  # and where [m]
    y=float,
    thrust=float,  # greatest mean over a second so far [N]
    limit=float,  # beyond which it fails; inf: it does not, or has [N]
)
"""What is known of a barrier."""

SHAKING = _record(
    time=float,  # [s]
    x=float,  # acceleration of the ground [m/s2]
    y=float,
    sum_x=float,  # integrals up to then [m/s]
    sum_y=float,
)
"""One corner of the polygon that is the motion of the ground."""

INTERFACE = _record(
    friction=float,  # tan phi
    cohesion=float,  # [Pa]
    tension=float,  # [Pa]
    restitution=float,  # PLAIN_CONTACT: the paper's penalty contact
    damping=float,  # mass-proportional, of blocks that touch [1/s]
)
"""How two surfaces meet."""

PARAMETERS = _record(
    blocks=int,  # bodies that may move: the blocks of the scene, its gravity walls and fences
    dt=float,
    gravity_x=float,  # [m/s2]
    gravity_y=float,
    gravity=float,  # its magnitude
    field_x=float,  # acceleration of free blocks in this step, of gravity and the ground [m/s2]
    field_y=float,
    damping=float,  # mass-proportional, of what supports hold [1/s]
    damping_in_flight=float,  # mass-proportional, of blocks that touch nothing [1/s]
    block_weight=float,  # mean of the free blocks [N]
    penetration=float,  # wanted [m]
    margin=float,  # of contact [m], see constants.MARGIN_RATIO
    tolerance=float,  # of the solver: residual over forces [-]
    sweep_tolerance=float,  # [m/s]
    iterations=int,  # most open-close iterations
    static=bool,
    post_correction=bool,
    islands=bool,
    solver=int,  # PCG, BLOCK_PCG, SOR, DIRECT
    relaxation=float,  # over-relaxation factor of SOR [-]; not that of relaxation
    sleeping=bool,
    floor=float,  # a centroid below it is retired [m]
    bonded=bool,  # whether a surface has cohesion or tension
)
"""Numbers of the scene and the settings."""

Bodies = NDArray[np.void]
"""(M,) array of BODY."""
Body = Any
"""One BODY: a record of an array, which is written where it is."""
Contacts = NDArray[np.void]
"""(C,) array of CONTACT."""
Contact = Any
"""One CONTACT."""
Links = NDArray[np.void]
"""Array of LINK in order of a."""
Link = Any
"""One LINK."""
Shaking = NDArray[np.void]
"""(K,) array of SHAKING, times never falling; none where the ground rests."""
Interfaces = NDArray[np.void]
"""(surfaces, surfaces) array of INTERFACE."""
Box = Any
"""One BOX."""
Parameters = Any
"""One PARAMETERS."""

POLYGON = _record(
    count=int,  # corners
    body=int,
    middle_x=float,  # mean of the corners now [m]
    middle_y=float,
    inside=float,  # radius of the circle about it that touches the nearest edge [m]
    low_x=float,  # its extent now [m]
    high_x=float,
    low_y=float,
    high_y=float,
)
"""One outline or convex part."""

CORNER = _record(
    x=float,  # now [m]
    y=float,
    normal_x=float,  # outward unit normal of the edge that starts here, now
    normal_y=float,
    number=np.int32,  # the same corner in the outline of the body
    inner=bool,  # whether the edge that starts here is inside the body
    reentrant=bool,  # whether the body is concave here
)
"""One corner of a polygon."""

LOCAL = _record(
    x=float,  # [m]
    y=float,
    normal_x=float,  # outward unit normal of the edge that starts here
    normal_y=float,
)
"""A corner in body coordinates: about the centroid at theta = 0."""


Polygons = NDArray[np.void]
"""(R,) array of POLYGON."""
Corners = NDArray[np.void]
"""(R, P) array of CORNER."""


LEDGER = ("friction", "impact", "damping", "external", "links")
"""Work done on the blocks so far [J]: entries of the ledger array."""

COUNTERS = 10
"""Length of the counter array. Its entries:"""

STEPS, ITERATIONS, RELAXED, SOLVES, SOLVER_ITERATIONS = 0, 1, 2, 3, 4
CONTACTS, EVENTS, CONTACT_TOTAL, SWEEPS, STILL = 5, 6, 7, 8, 9
"""Steps; open-close iterations; islands relaxed; systems solved and iterations of their solver;
contacts now; events not yet read; contacts and sweeps of relaxation so far; steps since anything
moved that matters."""
