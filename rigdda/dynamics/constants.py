"""Tolerances and limits of the mechanics, each with its unit, its reason and its effect."""

PENETRATION_RATIO = 1e-4
"""Target penetration of a contact at rest over the block size [-]. Smaller values give stiffer
contacts, which keep taller stacks stable but take more solver iterations."""

RIGID = 1e7
"""Stiffness of a pin, and of a new contact in an island that is solved as a whole, over effective
mass / dt^2 [-]. The velocity at the end of a step misses its target by half the inverse of this
ratio, 5e-8 of the change. The blocks of a tall stack, whose contacts compress one after another,
therefore start without a jolt."""

NEW_SHARE = 1e-3
"""Stiffness of a contact that forms after the first step of a simulation, as a fraction of the
stiffness set by `RIGID` [-]."""

AT_ONCE = 1e-4
"""Shortest substep of a lone body over the step, which is that of an impact [-]. With 2e-2, in
steps of 10 ms with a restitution of 0.5, the velocity of a square that lands on one corner is wrong
by 5 % if the next corner is 1 mm above the ground, and by up to 43 % at other heights."""

ROUNDING = 1e-12
"""Relative error of sums of work [-], by which the energy of an elastic impact may seem to grow."""

RECOVERY_SWEEPS = 6
"""Number of sweeps over the contacts of an island in position correction."""

SETTLED = 0.02
"""Relative change per iteration at which an iteration may stop [-]. In open-close iteration this is
the change of a friction force over its limit; in relaxation, the change of a normal velocity over
the speed of the island, so that slow islands come to rest. Without the first criterion, a block
with the paper's contacts on a 35 deg slope with 34 deg of friction slides six times too far in
steps of 10 ms. With 0.05, masses in motion take a fifth less time and penetrate as little, but the
thrust on the wall of a silo differs by 14 % between steps of 1 and 10 ms."""

SUBSTEPS = 8
"""Number of substeps in the relaxation of an island of several bodies [-]. An impact propagates
from contact to contact in each of them, and the error that the sweeps leave decreases with their
length. With 5 substeps, a silo filled in steps of 10 ms gains up to 1.5 % of the released
energy."""

MOST_SWEEPS = 100
"""Maximum number of sweeps over the contacts of an island in a substep. Sweeps stop earlier when
none changes a normal velocity by more than the tolerance."""

SET_OF_SWEEPS = 10
"""Number of sweeps between two extrapolations of impulses. Most substeps need fewer sweeps and no
extrapolation. After two sweeps, several modes of error are left, and extrapolations may diverge."""

PROGRESS = 0.01
"""Least decrease of the square of the residual by an extrapolation of impulses that is kept [-].
Without it, impulses on a wedge that locks by friction grow without bounds, because its residual
stays the same. With 0.1, a silo of 40 layers takes about ten times the processor time until it is
at rest."""

SAME_NORMAL = 0.7
"""Least cosine of the angle between the normals of a vertex's contacts in two successive steps for
them to count as the same contact [-]."""

SAME_FACE = 0.999
"""Cosine of the angle above which two edges, or the faces of two contacts of a vertex, count as
collinear [-]."""

MARGIN_RATIO = 5e-3
"""Distance over block size within which even bodies at rest are contact candidates [-]."""

SLEEP_SPEED = 0.02
"""Speed of the fastest point of a block below which the block is quiet [m/s]. An island of quiet
blocks for which relaxation does not converge is solved as a whole."""

SLEEP_TIME = 0.5
"""Time for which all blocks of an island must be quiet before the island sleeps [s]."""

GROWN = 0.1
"""Increase in speed, over `SLEEP_SPEED`, above which a block is not quiet [-]. Without it, blocks
on a slope 0.2 deg too steep for them fell asleep before they slid."""

SPEED_LIMIT = 1e4
"""Speed above which a simulation is stopped as diverged [m/s], thirty times the speed of any
rockfall."""

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
