"""The timing of what the page shows after a barrier has moved."""

from __future__ import annotations

from experiments.page.trajectories import ALL, FIRST, layout, row
from rigdda import sites


def test_times_belong_to_layouts_that_were_not_computed_before():
    site = sites.load("verge")
    places = {layout(site, repeat)[0].x for repeat in range(5)}
    assert len(places) == 5 and max(places) < site.barrier_zone.end
    row(site, "block", True, 1)  # compiles the kernels
    found = row(site, "block", True, 1)
    assert (found["site"], found["event"], found["fence"]) == ("verge", "block", 1)
    assert 0.0 < found[f"processor_{FIRST}_ms"] < found[f"processor_{ALL}_ms"]
    assert 3.0 < found["points_per_path"] < 200.0
