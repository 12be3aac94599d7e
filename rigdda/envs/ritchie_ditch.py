"""Ritchie's ditch: width and depth that a ditch at the foot of a rock cut should have.

Ritchie, Evaluation of rockfall and its control, Highway Research Record 17 (1963) 13-28, rolled
rock down cuts and gives a chart by height and inclination of the cut. The FHWA adopted it as a
table (Brawner, Rockfall Hazard Mitigation Methods, FHWA SA-93-085, 1994). The figures here are that
table, from memory; they could not be compared with the original. Pierson, Gullixson and Chassie
(Rockfall Catchment Area Design Guide, FHWA-OR-RD-02-04, 2001) found that such ditches hold less
than was thought, because rock that rolls on its way out was not counted.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rigdda import Ditch, Site

CHART = {
    85.0: ((3.7, 1.0), (4.6, 1.2), (6.1, 1.2), (6.1, 1.2)),
    75.0: ((3.7, 1.0), (4.6, 1.2), (6.1, 1.8), (7.6, 1.8)),
    63.0: ((3.7, 1.2), (4.6, 1.8), (6.1, 1.8), (7.6, 2.7)),
    53.0: ((3.7, 1.0), (4.6, 1.2), (4.6, 1.8), (4.6, 1.8)),
    45.0: ((3.7, 1.0), (3.7, 1.5), (4.6, 1.8), (4.6, 1.8)),
}
"""Width and depth of a ditch [m] by inclination of the cut [deg], for cuts up to 10, 20 and 30 m
high and for higher ones."""

CHART_COLUMNS = (10.0, 20.0, 30.0)
"""Heights up to which the columns of the chart apply [m]."""

INCLINATIONS = (40.0, 90.0)
"""Inclinations for which the chart applies [deg]: half the distance of two rows beyond its ends."""

OUTSIDE_CHART = "outside the range of the chart"
"""Words for a cut that the chart does not cover."""

CHART_HEIGHTS = (5.0, 40.0)
"""Heights of cuts for which the chart applies [m]. Ritchie's tests reached about 40 m."""


class RitchieDitch(NamedTuple):
    """Ritchie's ditch for a cut.

    Parameters
    ----------
    height : float
        Height of the cut above its foot [m].
    inclination : float
        Mean inclination of the cut from its crest to its foot [deg].
    width, depth : float
        Width and depth of the ditch in the nearest row and column of the chart [m].
    """

    height: float
    inclination: float
    width: float
    depth: float

    @classmethod
    def of(cls, site: Site) -> RitchieDitch:
        """Return the ditch for the slope above the toe of a site."""
        points = np.array(site.slope.points)
        toe = site.slope.toe
        above = points[points[:, 0] < toe]
        rise = max(above[:, 1].max() - np.interp(toe, *points.T), 0.1)
        crest = above[above[:, 1] >= above[:, 1].max() - 0.1 * rise][-1]  # the crest of the cut
        steep = math.degrees(math.atan2(rise, max(toe - crest[0], 1e-3)))
        row = CHART[min(CHART, key=lambda angle: abs(angle - steep))]
        width, depth = row[int(np.searchsorted(CHART_COLUMNS, rise))]
        return cls(float(rise), steep, width, depth)

    @property
    def caveat(self) -> str:
        """Why the chart does not apply to the cut; empty if it does."""
        words = []
        if not INCLINATIONS[0] <= self.inclination <= INCLINATIONS[1]:
            words.append(f"inclination {self.inclination:.0f} deg")
        if not CHART_HEIGHTS[0] <= self.height <= CHART_HEIGHTS[1]:
            words.append(f"height {self.height:.0f} m")
        return f"{OUTSIDE_CHART}: {', '.join(words)}" if words else ""

    def name_of(self, ditch: Ditch) -> str:
        """Return the name of a ditch in tables: that of Ritchie only if it is as large."""
        whole = ditch.width >= self.width - 1e-6 and ditch.depth >= self.depth - 1e-6
        return "Ritchie ditch" if whole and not self.caveat else "ditch"
