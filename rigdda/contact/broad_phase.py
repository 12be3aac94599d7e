"""Pairs of bodies whose swept boxes overlap, by sort and sweep along x."""

from __future__ import annotations

from rigdda.constants import AWAKE, HELD, LATELY, RETIRED
from rigdda.kernel import kernel
from rigdda.motion import top_speed
from rigdda.records import Bodies, Outlines, Parameters, Work


@kernel
def sweep_boxes(bodies: Bodies, outlines: Outlines, work: Work, p: Parameters) -> None:
    """Set the box of each body that holds it over the step, however it is deflected, with slack."""
    for i in range(len(bodies)):
        n = bodies[i].count
        low_x = high_x = outlines.world_x[i, 0]
        low_y = high_y = outlines.world_y[i, 0]
        for k in range(1, n):
            low_x = min(low_x, outlines.world_x[i, k])
            high_x = max(high_x, outlines.world_x[i, k])
            low_y = min(low_y, outlines.world_y[i, k])
            high_y = max(high_y, outlines.world_y[i, k])
        grow = p.slack
        if bodies[i].status == AWAKE:
            bodies[i].lately = max(top_speed(bodies, i), LATELY * bodies[i].lately)
            work.path[i] = bodies[i].lately * p.dt
            grow += work.path[i] + p.gravity * p.dt * p.dt
        work.low_x[i], work.high_x[i] = low_x - grow, high_x + grow
        work.low_y[i], work.high_y[i] = low_y - grow, high_y + grow


@kernel
def sort_by_low(work: Work) -> None:
    """Sort by low_x, ties by index; by insertion, since little changes from step to step."""
    order, low = work.sorted, work.low_x
    for k in range(1, len(order)):
        item = order[k]
        j = k - 1
        while j >= 0 and (
            low[order[j]] > low[item] or (low[order[j]] == low[item] and order[j] > item)
        ):
            order[j + 1] = order[j]
            j -= 1
        order[j + 1] = item


@kernel
def overlapping_pairs(bodies: Bodies, work: Work) -> int:
    """Write pairs with at least one awake body into work.pairs.

    Returns
    -------
    int
        Number of pairs, or -1 if they do not fit.
    """
    order, count = work.sorted, 0
    room = len(work.pairs) // 2
    for k in range(len(order)):
        i = order[k]
        status_i = bodies[i].status
        if status_i == RETIRED or status_i == HELD:
            continue
        low, high, end = work.low_y[i], work.high_y[i], work.high_x[i]
        for m in range(k + 1, len(order)):
            j = order[m]
            if work.low_x[j] > end:
                break
            if work.low_y[j] > high or low > work.high_y[j]:
                continue
            status_j = bodies[j].status
            if status_j == RETIRED or status_j == HELD:
                continue
            if status_i != AWAKE and status_j != AWAKE:
                continue
            if count == room:
                return -1
            # a is the awake body, so that b may be asleep or fixed
            first = min(i, j) if status_i == status_j else (i if status_i == AWAKE else j)
            work.pairs[2 * count] = first
            work.pairs[2 * count + 1] = i + j - first
            count += 1
    return count


@kernel
def sweep_and_prune(bodies: Bodies, outlines: Outlines, work: Work, p: Parameters) -> int:
    """Write the pairs of bodies that may touch in this step; returns how many, -1: too many."""
    sweep_boxes(bodies, outlines, work, p)
    sort_by_low(work)
    return overlapping_pairs(bodies, work)


@kernel
def partners_of_bodies(work: Work, pairs: int) -> None:
    """Gather the second bodies of the pairs by their first one, in ascending order."""
    start = work.partner_start
    for a in range(len(start)):
        start[a] = 0
    for q in range(pairs):
        start[work.pairs[2 * q] + 1] += 1
    for a in range(1, len(start)):
        start[a] += start[a - 1]
    for q in range(pairs):
        a, b = work.pairs[2 * q], work.pairs[2 * q + 1]
        place = start[a]
        start[a] += 1
        work.partner[place] = b
    for a in range(len(start) - 1, 0, -1):
        start[a] = start[a - 1]
    start[0] = 0
    for a in range(len(start) - 1):
        for q in range(start[a] + 1, start[a + 1]):
            b, place = work.partner[q], q - 1
            while place >= start[a] and work.partner[place] > b:
                work.partner[place + 1] = work.partner[place]
                place -= 1
            work.partner[place + 1] = b
