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

if TYPE_CHECKING:
    from rigdda.model.site import Site
    from rigdda.model.site_tables import Drawn

FRICTION, FRICTION_SD, RESTITUTION, RESTITUTION_SD, ROLLING, ROLLING_SD, VARIES, SPEED = range(8)
"""Columns of the table of surfaces: friction angle [deg], coefficient of restitution [-] and of
rolling resistance [-], each followed by its standard deviation; 1 if releases vary them; and the
speed at which restitution has fallen to half [m/s] (inf: it does not fall)."""

Rows = tuple[int, int, int, int]
"""Two rows whose smaller friction and restitution apply, and two for rolling resistance."""


class ContactProperties:
    """Contact properties of all pairs of surfaces of a site in a release.

    N is the number of surfaces of the site, in order.

    Parameters
    ----------
    site : Site
        The site, without surfaces of restitution None.

    Attributes
    ----------
    friction_deg : (N, N) array
        Friction angle of each pair in the last drawn release [deg].
    restitution : (N, N) array
        Coefficient of restitution [-].
    rolling : (N, N) array
        Coefficient of rolling resistance [-].
    restitution_speed : (N, N) array
        Speed at which restitution has fallen to half [m/s]; inf: it does not fall.
    """

    def __init__(self, site: Site):
        names = list(site.surfaces)
        own = [(surface, surface.varies) for surface in site.surfaces.values()]
        given = [(pair.surface, False) for pair in site.interfaces]
        self._table = np.array(
            [
                (
                    s.friction_deg,
                    s.friction_sd_deg,
                    s.restitution,
                    s.restitution_sd,
                    s.rolling,
                    s.rolling_sd,
                    varies,
                    math.inf if s.restitution_speed is None else s.restitution_speed,
                )
                for s, varies in own + given
            ],
            dtype=np.float64,
        )
        self._names = len(names)
        self._now = self._table.copy()
        self._no_strengths = np.zeros((len(names), 3))
        found, every = _rows(site, names), range(len(names))
        usual = [
            [found.get((i, j)) or found.get((j, i)) or (i, j, i, j) for j in every] for i in every
        ]
        self._rows = np.array(usual, dtype=np.int64)
        shape = len(names), len(names)
        self.friction_deg, self.restitution = np.zeros(shape), np.zeros(shape)
        self.rolling, self.restitution_speed = np.zeros(shape), np.zeros(shape)

    def draw(self, drawn: Drawn) -> None:
        """Set the values to those of a release."""
        strengths = np.array(drawn.strengths) if drawn.strengths else self._no_strengths
        _vary.call(
            self._table, strengths, float(drawn.friction_deg), self._rows, self._now,
            self.friction_deg, self.restitution, self.rolling, self.restitution_speed,
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
        rolling = usual[2:] if pair.rolling is None else (number, number)
        found[i, j] = (number, number, *rolling)
    return found


@short_kernel
def vary(
    table: NDArray, strengths: NDArray, shift: float, rows: NDArray, now: NDArray,
    friction_deg: NDArray, restitution: NDArray, rolling: NDArray, restitution_speed: NDArray,
) -> None:  # fmt: skip
    """Write the contact properties of all pairs.

    Parameters
    ----------
    table : (T, 8) array
        Surfaces of the site, then its interfaces, see `VARIES`.
    strengths : (N, 3) array
        Standard normal numbers for friction, restitution and rolling resistance of the first rows.
    shift : float
        Shift of all friction angles [deg].
    rows : (N, N, 4) array of int
        Rows of each pair, see `Rows`.
    now : (T, 8) array
        Output: the table in this release.
    friction_deg, restitution, rolling, restitution_speed : (N, N) arrays
        Output [deg, -, -, m/s].
    """
    for k in range(len(table)):
        angle = table[k, FRICTION]
        if table[k, VARIES] > 0.0:
            angle = _steepened(angle, strengths[k, 0] * table[k, FRICTION_SD])
            rebound = table[k, RESTITUTION] + strengths[k, 1] * table[k, RESTITUTION_SD]
            resistance = table[k, ROLLING] + strengths[k, 2] * table[k, ROLLING_SD]
            now[k, RESTITUTION] = min(max(rebound, 0.0), 1.0)
            now[k, ROLLING] = min(max(resistance, 0.0), 1.0)
        now[k, FRICTION] = angle if shift == 0.0 else _steepened(angle, shift)
    for i in range(len(rows)):
        for j in range(len(rows)):
            a, b, c, d = rows[i, j, 0], rows[i, j, 1], rows[i, j, 2], rows[i, j, 3]
            friction_deg[i, j] = min(now[a, FRICTION], now[b, FRICTION])
            restitution[i, j] = min(now[a, RESTITUTION], now[b, RESTITUTION])
            rolling[i, j] = min(now[c, ROLLING], now[d, ROLLING])
            restitution_speed[i, j] = min(now[a, SPEED], now[b, SPEED])


_vary = Direct(vary)


@kernel
def _steepened(angle: float, change: float) -> float:
    """Return a changed friction angle, clipped to its bounds [deg]."""
    return min(max(angle + change, 0.0), max(angle, STEEPEST_DEG))
