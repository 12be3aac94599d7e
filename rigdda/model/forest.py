"""Forest: stems that take energy from the blocks that strike them.

Stems stand at random in plan, independently of one another. A block of width w that moves down the
section strikes the stems whose axis is less than (w + d)/2 from its path, where d is the diameter
of the stem. With n stems per area, it therefore strikes n (w + d) of them per metre of chainage on
average, at places that form a Poisson process. The diameters of the stems that it strikes are
those of the forest, weighted by w + d.

A stem that a block strikes head on takes up to ``E = 38.7 r D**2.31`` joules from it, where D is
the diameter at breast height in centimetres and r the fracture energy relative to silver fir
(Dorren and Berger 2006, Tree Physiology 26, 63-71). Of an impact off the axis, it takes a share of
this that falls from 0.98 to 0. This share and r are those of Rockyfor3D (Dorren 2016, Rockyfor3D
(v5.2) revealed, ecorisQ). These figures are quoted from memory; they could not be compared with the
publications.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, ClassVar

import msgspec
import numpy as np
from numpy.typing import NDArray

from rigdda import fields
from rigdda.errors import BadInput
from rigdda.fields import about, documented
from rigdda.rounding import chainage

Floats = NDArray[np.float64]

FACTOR, EXPONENT = 38.7, 2.31
"""Energy that a silver fir of 1 cm takes [J], and the exponent of the diameter in centimetres."""

CONIFER, BROADLEAVED = 0.93, 1.59
"""Mean fracture energy of conifers and of broadleaved trees relative to silver fir [-]."""

SHARE_LEAST, SHARE_RISE, SHARE_MIDDLE, SHARE_STEEPNESS = -0.046, 1.026, 0.58, 8.007
"""Constants of the share of the energy that is taken in an impact off the axis, see `share` [-]."""

HECTARE = 1e4
"""[m2]"""


@documented
class Forest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A forest on a stretch of the slope, whose stems take energy from blocks.

    Where two forests overlap, the stems of both stand.

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range, or the forest ends before it starts.
    """

    start: Annotated[float, about("Chainage where the forest begins.", "m")]
    end: Annotated[float, about("Chainage where the forest ends.", "m")]
    stems: Annotated[
        float, about("Number of stems on a hectare in plan.", "1/ha", ge=0.0, le=20000.0)
    ]
    dbh: Annotated[
        float,
        about("Mean diameter of the stems at breast height.", "m", ge=0.02, le=2.5),
    ]
    dbh_sd: Annotated[
        float,
        about(
            "Standard deviation of these diameters, which have a gamma distribution.",
            "m",
            ge=0.0,
            le=1.0,
        ),
    ] = 0.0
    conifers: Annotated[
        float,
        about(
            "Share of conifers among the stems. The others are broadleaved.", "-", ge=0.0, le=1.0
        ),
    ] = 1.0
    height: Annotated[
        float,
        about(
            "Height above the ground up to which stems take energy from a block, measured "
            "vertically to the centre of the block. Blocks that fly higher pass.",
            "m",
            gt=0.0,
            le=60.0,
        ),
    ] = 5.0
    name: Annotated[str, about("Name of the forest, unique among those of the site.")] = "forest"
    array: ClassVar[str] = "forest"

    def __post_init__(self) -> None:
        fields.check(self, f"forest.{self.name}.")
        if self.end <= self.start:
            hint = f"let it end beyond {chainage(self.start)}, where it begins"
            raise BadInput(f"forest.{self.name}.end", self.end, hint)

    @property
    def basal_area(self) -> float:
        """Cross-section of its stems at breast height [m2/ha]."""
        return self.stems * 0.25 * math.pi * (self.dbh**2 + self.dbh_sd**2)

    def struck(self, width: float) -> float:
        """Return the mean number of stems that a block of this width [m] strikes [1/m]."""
        return self.stems / HECTARE * (width + self.dbh)


def most_energy(dbh: Floats, conifer: NDArray[np.bool_]) -> Floats:
    """Return the greatest energy that stems take in a central impact [J].

    Parameters
    ----------
    dbh : (n,) array
        Diameters at breast height [m].
    conifer : (n,) array of bool
        Whether each is a conifer.
    """
    relative = np.where(conifer, CONIFER, BROADLEAVED)
    found: Floats = relative * FACTOR * (100.0 * dbh) ** EXPONENT
    return found


def share(offset: Floats) -> Floats:
    """Return the share of this energy that is taken in an impact off the axis of a stem [-].

    Parameters
    ----------
    offset : (n,) array
        Distance of the point of impact from the axis of the stem, across the path of the block,
        over the radius of the stem [-]. That of a disc equals the distance of its path from the
        axis over the sum of the two radii.
    """
    found = SHARE_LEAST + SHARE_RISE / (1.0 + 10.0 ** (SHARE_STEEPNESS * (offset - SHARE_MIDDLE)))
    return np.maximum(found, 0.0)


def stems(
    rng: np.random.Generator, forests: Sequence[Forest], start: float, width: float
) -> Floats:
    """Return the stems that a block will strike, at random.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of random numbers.
    forests : sequence of Forest
        The forests of a site.
    start : float
        Chainage of the block at the start [m]; it strikes only stems downhill of it.
    width : float
        Width of the block along the road [m].

    Returns
    -------
    (k, 3) array
        Chainage [m], energy that the stem takes at most per metre of the width of the block [J/m],
        and height up to which it does [m], in order of chainage.
    """
    found = [_struck(rng, forest, max(forest.start, start), width) for forest in forests]
    table = np.concatenate([np.zeros((0, 3)), *found])
    return table[np.argsort(table[:, 0], kind="stable")]


def _struck(rng: np.random.Generator, forest: Forest, start: float, width: float) -> Floats:
    """Return the stems of one forest beyond a chainage, as `stems` does, in any order."""
    count = rng.poisson(forest.struck(width) * max(forest.end - start, 0.0))
    x = start + (forest.end - start) * rng.random(count)
    dbh = _diameters(rng, forest, width, count)
    energy = most_energy(dbh, rng.random(count) < forest.conifers) * share(rng.random(count))
    return np.column_stack([x, energy / width, np.full(count, forest.height)])


def _diameters(rng: np.random.Generator, forest: Forest, width: float, count: int) -> Floats:
    """Return the diameters of stems that a block strikes, weighted by width + diameter [m].

    The weighted distribution is a mixture of the distribution itself and of the one weighted by the
    diameter. For a gamma distribution, the latter is a gamma distribution whose shape is greater by
    one.
    """
    by_size = rng.random(count) < forest.dbh / (width + forest.dbh)
    if forest.dbh_sd == 0.0:
        return np.full(count, forest.dbh)
    shape, scale = (forest.dbh / forest.dbh_sd) ** 2, forest.dbh_sd**2 / forest.dbh
    return rng.gamma(shape + by_size, scale)
