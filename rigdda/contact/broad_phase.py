"""Pairs of bodies whose swept boxes overlap, by sort and sweep along x."""

from __future__ import annotations

import math

import numpy as np

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
def sort_by_low(bodies: Bodies, work: Work) -> None:
    """Sort by low_x, ties by index; by insertion, since little changes from step to step.

    `work.box` holds the boxes in this order, for a sweep that reads them in a row. Bodies out of
    the simulation get one that nothing overlaps.
    """
    order, box = work.sorted, work.box
    for k in range(len(order)):
        item = order[k]
        low, j = work.low_x[item], k - 1
        while j >= 0 and (box[j].low_x > low or (box[j].low_x == low and order[j] > item)):
            order[j + 1], box[j + 1].low_x = order[j], box[j].low_x
            j -= 1
        order[j + 1], box[j + 1].low_x = item, low
    for k in range(len(order)):
        i, status = order[k], bodies[order[k]].status
        box[k].high_x, box[k].low_y, box[k].high_y = work.high_x[i], work.low_y[i], work.high_y[i]
        box[k].body, box[k].awake = i, status == AWAKE
        if status == RETIRED or status == HELD:
            box[k].low_y, box[k].high_y = math.inf, -math.inf


@kernel
def overlapping_pairs(work: Work) -> int:
    """Write pairs with at least one awake body into work.pairs.

    Every candidate is written, and the next one over it unless they overlap: a branch that few
    candidates take at random would cost five times the rest.

    Returns
    -------
    int
        Number of pairs, or -1 if they do not fit.
    """
    box, pairs, count = work.box, work.pairs, 0
    bodies, room = np.uintp(len(box)), len(pairs) // 2
    for k in range(len(box)):
        one, m = box[k], np.uintp(k + 1)
        while m < bodies and box[m].low_x <= one.high_x and count < room:
            pairs[2 * count], pairs[2 * count + 1] = k, m
            beside = (box[m].low_y <= one.high_y) & (one.low_y <= box[m].high_y)
            count += int(beside & (one.awake | box[m].awake))
            m += np.uintp(1)
    if count == room:
        return -1
    for q in range(count):
        one, two = box[pairs[2 * q]], box[pairs[2 * q + 1]]
        first, second = min(one.body, two.body), max(one.body, two.body)
        if one.awake != two.awake:  # a is the awake body, so that b may be asleep or fixed
            first, second = (one.body, two.body) if one.awake else (two.body, one.body)
        pairs[2 * q], pairs[2 * q + 1] = first, second
    return count


@kernel
def sweep_and_prune(bodies: Bodies, outlines: Outlines, work: Work, p: Parameters) -> int:
    """Write the pairs of bodies that may touch in this step; returns how many, -1: too many."""
    sweep_boxes(bodies, outlines, work, p)
    sort_by_low(bodies, work)
    return overlapping_pairs(work)


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
