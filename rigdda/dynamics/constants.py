"""Tolerances and limits of the mechanics: unit, reason and consequence of each."""

PENETRATION_RATIO = 1e-4
"""Wanted penetration over block size [-]. Smaller: stiffer contacts, taller stacks stand, more
solver iterations."""

RIGID = 1e7
"""Stiffness of a pin, and of a new contact where an island is solved as a whole, times effective
mass / dt^2 [-]. The velocity after a step misses its target by half the inverse of this, 5e-8 of
the change. The blocks of a tall stack, which give way one after the other, start without a jolt."""

NEW_SHARE = 1e-3
"""Stiffness of a contact that is new after the first step of a simulation, over that [-]."""

IMPACT_STEPS = 3.0
"""Least closing speed of an impact in units of g dt [-], of a lone body in units of g dt over
`SUBSTEPS`: what gravity alone gives a resting body in a few steps is no impact."""

AT_ONCE = 1e-4
"""Least substep of a lone body over the step [-]: corners that strike within it do so at once. With
2e-2 a square that lands on a corner, the next one 1 mm above the ground, misses its velocity by
5 %, at most by 43 %, in steps of 10 ms with a restitution of 0.5."""

RECOVERY_SWEEPS = 6
"""Sweeps over the contacts of an island that push out what they are too deep."""

RETARDATION_TIME = 5e-3
"""Retardation time of contacts at rest: viscosity over stiffness [s]. Longer steps damp more, as
the force follows the velocity at their end. Without it an arch near its limit vibrates in steps of
0.1 ms until it falls."""

SETTLED = 0.02
"""Greatest change in an iteration at which it may end [-]: in open-close iteration of a friction
force, over its limit; in relaxation of a normal velocity, over the speed of the island, so that
slow islands come to rest. Without the first a block on the paper's contacts, at 35 deg with 34 deg
of friction, slides six times as far as it should in steps of 10 ms."""

SUBSTEPS = 8
"""Substeps in the relaxation of an island of several bodies [-]: a blow goes on from contact to
contact in each, and what the sweeps leave of it is as much smaller as they are shorter. With 5 a
silo that fills in steps of 10 ms gains up to 1.5 % of the energy that was released."""

MOST_SWEEPS = 100
"""Most sweeps over the contacts of an island in a substep. They end once none changes a normal
velocity by more than the tolerance."""

SAME_NORMAL = 0.7
"""Least cosine between the normals of one vertex's contact in two steps, for it to be one [-]."""

SAME_FACE = 0.999
"""Cosine above which two edges, or two contacts of one vertex, count as in one line [-]."""

LATELY = 0.7
"""Share of a body's greatest speed of late that counts on in the next step [-]. In a pile blocks
are stopped and driven on step by step: the path of one that stands for a moment is not nothing.
Without it the thrust of a row on an embankment is 53 kN in steps of 10 ms, 38 in shorter ones."""

MARGIN_RATIO = 5e-3
"""Distance over block size within which contacts are candidates even at rest [-]."""

SLEEP_SPEED = 0.02
"""Speed of any point of a block below which it counts as quiet [m/s]. An island of such blocks that
does not settle in relaxation is solved as a whole."""

SLEEP_TIME = 0.5
"""Time for which a whole island must be quiet before it sleeps [s]."""

GROWN = 0.1
"""Growth of its speed, over the speed below which it counts as quiet, from which on a block is not
[-]. Without it what is 0.2 deg too steep to stand fell asleep before it slid."""

APART = 0.1
"""Time since the last touch after which a block is apart [s]: from a barrier, so that it may hit it
anew; from everything, so that damping in contact ends. Were that to end with the touch, a block
that rattles down would be damped in proportion to the step: of a mass .50 / .53 / .54 / .57 reached
the road of `quick` at 10 / 5 / 2.5 / 1.25 ms, +- .02; like this .44 / .45 / .44 at 10 / 5 / 1 ms,
+- .006."""

LONGEST_FLIGHT = 64
"""Steps for which a flight is looked ahead: the more, the wider the search for what may be met."""

SPEED_LIMIT = 1e4
"""Speed at which a simulation is stopped as diverged [m/s], thirty times any rockfall."""

# status of a body
AWAKE, ASLEEP, FIXED, RETIRED = 0, 1, 2, 3
# state of a contact
OPEN, STICK, SLIP = 0, 1, 2
# kind of a contact in one step
REST, NEW, PLAIN, BOLT, PIN = 0, 1, 2, 3, 4
# why the step loop returned
DONE, CONTACTS_FULL, EVENTS_FULL, BAD_STATE, GROUND_MOVED, ENDED = 0, 1, 2, 3, 4, 5
# solver
PCG, BLOCK_PCG, SOR, DIRECT = 0, 1, 2, 3
TERRAIN = -1
PLAIN_CONTACT = -1.0
