"""Broad phase: pairs of bodies with overlapping swept boxes, by sort and sweep along x."""

from __future__ import annotations

import math

import numpy as np

from rigdda.dynamics.arrays import Boxes
from rigdda.dynamics.constants import AWAKE, RETIRED
from rigdda.dynamics.motion import top_speed
from rigdda.dynamics.records import Bodies, Parameters, Polygons
from rigdda.kernel import kernel


@kernel
def sweep_boxes(bodies: Bodies, polygon: Polygons, boxes: Boxes, p: Parameters) -> None:
    """Set the swept box of each body, which contains it over the step even if it is deflected."""
    for i in range(len(bodies)):
        body, outline, grow = bodies[i], polygon[i], p.margin
        if body.status == AWAKE:
            # a body that is struck within the step moves farther, and is detected in the next step
            body.path = top_speed(body) * p.dt
            grow += body.path + p.gravity * p.dt * p.dt
        box = boxes.swept[i]
        box.low_x, box.high_x = outline.low_x - grow, outline.high_x + grow
        box.low_y, box.high_y = outline.low_y - grow, outline.high_y + grow
        box.body, box.awake = i, body.status == AWAKE
        if body.status == RETIRED:  # an empty box, which overlaps no other
            box.low_y, box.high_y = math.inf, -math.inf


@kernel
def sort_by_low(boxes: Boxes) -> None:
    """Sort `boxes.row` by low_x, ties by body, so that a sweep reads it sequentially.

    Insertion sort is used because the order changes little from step to step.
    """
    row = boxes.row
    for k in range(len(row)):
        body = row[k].body
        low, j = boxes.swept[body].low_x, k - 1
        while j >= 0 and (row[j].low_x > low or (row[j].low_x == low and row[j].body > body)):
            row[j + 1].body, row[j + 1].low_x = row[j].body, row[j].low_x
            j -= 1
        row[j + 1].body, row[j + 1].low_x = body, low
    for k in range(len(row)):
        row[k] = boxes.swept[row[k].body]


@kernel
def overlapping_pairs(boxes: Boxes) -> int:
    """Write the pairs with at least one awake body into boxes.pairs.

    Every candidate is written, and overwritten by the next one if it does not overlap, because an
    unpredictable branch that few candidates take would cost five times the rest.

    Returns
    -------
    int
        Number of pairs, or -1 if they do not fit.
    """
    box, pairs, count = boxes.row, boxes.pairs, 0
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
def sweep_and_prune(bodies: Bodies, polygon: Polygons, boxes: Boxes, p: Parameters) -> int:
    """Write the pairs of bodies that may touch in this step; return their number, or -1.

    The number is -1 if they do not fit.
    """
    sweep_boxes(bodies, polygon, boxes, p)
    sort_by_low(boxes)
    return overlapping_pairs(boxes)


@kernel
def partners_of_bodies(boxes: Boxes, count: int) -> None:
    """Group the second bodies of the pairs by first body, in ascending order."""
    start, pairs, partner = boxes.partner_start, boxes.pairs, boxes.partner
    for a in range(len(start)):
        start[a] = 0
    for q in range(count):
        start[pairs[2 * q] + 1] += 1
    for a in range(1, len(start)):
        start[a] += start[a - 1]
    for q in range(count):
        a, b = pairs[2 * q], pairs[2 * q + 1]
        place = start[a]
        start[a] += 1
        partner[place] = b
    for a in range(len(start) - 1, 0, -1):
        start[a] = start[a - 1]
    start[0] = 0
    for a in range(len(start) - 1):
        for q in range(start[a] + 1, start[a + 1]):
            b, place = partner[q], q - 1
            while place >= start[a] and partner[place] > b:
                partner[place + 1] = partner[place]
                place -= 1
            partner[place + 1] = b
