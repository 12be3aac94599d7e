"""Contact properties of all pairs of surfaces of a site in a release, computed by a kernel.

The values are bit-identical to those of `rigdda.Site.strength` and `rigdda.Scene.interface`, but
take a hundredth of the time because no surfaces are built and checked. A contact of two surfaces
has the smaller value of each property, except for pairs that have the properties of one surface.
Every pair is therefore represented by two rows of a table, possibly the same, whose smaller values
apply.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rigdda.kernel import Direct, kernel, short_kernel
from rigdda.model.site import STEEPEST_DEG, pairs
from rigdda.model.surface import MOST_DAMPING

if TYPE_CHECKING:
    from rigdda.model.site import Site
    from rigdda.model.site_tables import Drawn

FRICTION, FRICTION_SD, RESTITUTION, RESTITUTION_SD, DAMPING, DAMPING_SD, VARIES = range(7)
"""Columns of the table of surfaces: friction angle [deg], coefficient of restitution [-] and
damping [1/s] (inf: that of the scene), each followed by its standard deviation; then 1 if releases
vary them."""

Rows = tuple[int, int, int, int]
"""Two rows whose smaller friction and restitution apply, and two for damping."""


class Meetings:
    """Contact properties of all pairs of surfaces of a site in a release.

    N is the number of surfaces of the site, in order. S is N, plus one for the surface of fences if
    there are any.

    Parameters
    ----------
    site : Site
        The site, without surfaces of restitution None.
    fences : str or None
        Name of the surface whose damping fences have; None if there are no fences.

    Attributes
    ----------
    friction_deg : (S, S) array
        Friction angle of each pair in the last drawn release [deg]; fences are frictionless, so
        their rows are not used.
    restitution : (N, N) array
        Coefficient of restitution of each pair of surfaces of the site [-].
    damping : (S, S) array
        Damping of blocks in contact [1/s].
    """

    def __init__(self, site: Site, fences: str | None):
        names = list(site.surfaces)
        fallback = math.inf if site.motion.damping is None else site.motion.damping
        self._left_open = site.motion.damping or 0.0
        own = [(surface, surface.varies) for surface in site.surfaces.values()]
        given = [(pair.surface, False) for pair in site.interfaces]
        self._table = np.array(
            [
                (
                    s.friction_deg,
                    s.friction_sd_deg,
                    s.restitution,
                    s.restitution_sd,
                    (fallback if varies else math.inf) if s.damping is None else s.damping,
                    s.damping_sd,
                    varies,
                )
                for s, varies in own + given
            ],
            dtype=np.float64,
        )
        self._names = len(names)
        self._now = self._table.copy()
        self._no_strengths = np.zeros((len(names), 3))
        every = [*range(len(names)), *([names.index(fences)] if fences is not None else [])]
        found = _rows(site, names)
        usual = [
            [found.get((i, j)) or found.get((j, i)) or (i, j, i, j) for j in every] for i in every
        ]
        self._rows = np.array(usual, dtype=np.int64)
        shape = self._rows.shape[:2]
        self.friction_deg = np.zeros(shape)
        self.restitution, self.damping = np.zeros((len(names),) * 2), np.zeros(shape)

    def draw(self, drawn: Drawn) -> None:
        """Set the values to those of a release."""
        strengths = np.array(drawn.strengths) if drawn.strengths else self._no_strengths
        _vary.call(
            self._table, strengths, float(drawn.friction_deg), self._left_open, self._rows,
            self._now, self.friction_deg, self.restitution, self.damping,
        )  # fmt: skip

    @property
    def least_friction_deg(self) -> float:
        """Least friction angle of a surface of the site in the last release [deg]."""
        return min(self._now[: self._names, FRICTION].tolist())


def _rows(site: Site, names: list[str]) -> dict[tuple[int, int], Rows]:
    """Return the rows of pairs that do not simply have the smaller values of both surfaces."""
    place = {name: i for i, name in enumerate(names)}
    found: dict[tuple[int, int], Rows] = {}
    for (first, second), row in pairs(site, place).items():
        found[place[first], place[second]] = (row, row, row, row)
    for number, pair in enumerate(site.interfaces, start=len(names)):
        i, j = place[pair.first], place[pair.second]
        usual = found.pop((j, i), None) or found.get((i, j)) or (i, j, i, j)
        damping = usual[2:] if pair.damping is None else (number, number)
        found[i, j] = (number, number, *damping)
    return found


@short_kernel
def vary(
    table: NDArray, strengths: NDArray, shift: float, left_open: float, rows: NDArray,
    now: NDArray, friction_deg: NDArray, restitution: NDArray, damping: NDArray,
) -> None:  # fmt: skip
    """Write the contact properties of all pairs.

    Parameters
    ----------
    table : (T, 7) array
        Surfaces of the site, then its interfaces, see `VARIES`.
    strengths : (N, 3) array
        Standard normal numbers for friction, restitution and damping of the first rows.
    shift : float
        Shift of all friction angles [deg].
    left_open : float
        Damping if no surface of a pair specifies one [1/s].
    rows : (S, S, 4) array of int
        Rows of each pair, see `Rows`.
    now : (T, 7) array
        Output: the table in this release.
    friction_deg, restitution, damping : (S, S), (N, N) and (S, S) arrays
        Output [deg, -, 1/s].
    """
    for k in range(len(table)):
        angle = table[k, FRICTION]
        if table[k, VARIES] > 0.0:
            angle = _steepened(angle, strengths[k, 0] * table[k, FRICTION_SD])
            rebound = table[k, RESTITUTION] + strengths[k, 1] * table[k, RESTITUTION_SD]
            loss = table[k, DAMPING]
            if loss < math.inf:
                loss = min(max(loss + strengths[k, 2] * table[k, DAMPING_SD], 0.0), MOST_DAMPING)
            now[k, RESTITUTION], now[k, DAMPING] = min(max(rebound, 0.0), 1.0), loss
        now[k, FRICTION] = angle if shift == 0.0 else _steepened(angle, shift)
    for i in range(len(rows)):
        for j in range(len(rows)):
            a, b, c, d = rows[i, j, 0], rows[i, j, 1], rows[i, j, 2], rows[i, j, 3]
            friction_deg[i, j] = min(now[a, FRICTION], now[b, FRICTION])
            if i < len(restitution) and j < len(restitution):
                restitution[i, j] = min(now[a, RESTITUTION], now[b, RESTITUTION])
            loss = min(now[c, DAMPING], now[d, DAMPING])
            damping[i, j] = loss if loss < math.inf else left_open


_vary = Direct(vary)


@kernel
def _steepened(angle: float, change: float) -> float:
    """Return a changed friction angle, clipped to its bounds [deg]."""
    return min(max(angle + change, 0.0), max(angle, STEEPEST_DEG))
