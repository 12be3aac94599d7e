"""Ranges of the generator: the splits keep theirs, and wide ranges give valid and varied sites."""

from __future__ import annotations

import numpy as np
import pytest

from rigdda import sites
from rigdda.model.site_generator import NARROW, WIDE, generate


@pytest.mark.parametrize("family", sites.WIDE_FAMILIES)
def test_wide_ranges_give_sites_that_differ_more(family: str) -> None:
    base = sites.load(family)
    heights = {}
    for name, by in (("narrow", NARROW), ("wide", WIDE)):
        made = [generate(base, f"{family}-{i}", i, by) for i in range(12)]
        heights[name] = np.log([site.slope.points[0][1] for site in made])
        assert all(site.barrier_zone.start < site.barrier_zone.end for site in made)
    assert heights["wide"].std() > 1.5 * heights["narrow"].std()


def test_the_sites_of_the_splits_have_the_narrow_ranges() -> None:
    base = sites.load("bench")
    assert generate(base, "bench-7", 7) == generate(base, "bench-7", 7, NARROW)
    assert sites.load("bench-7").slope == generate(base, "bench-7", 7).slope
