"""Acceleration of free blocks by gravity and ground motion."""

from __future__ import annotations

from rigdda.dynamics.records import Parameters, Shaking
from rigdda.kernel import kernel


@kernel
def velocity(shaking: Shaking, time: float) -> tuple[float, float]:
    """Return the velocity of the ground at a time, the integral of its acceleration [m/s]."""
    if time <= shaking[0].time:
        return 0.0, 0.0
    low, high = 0, len(shaking)  # the last corner at or before `time`
    while high - low > 1:
        mid = (low + high) // 2
        if shaking[mid].time <= time:
            low = mid
        else:
            high = mid
    a = shaking[low]
    if low == len(shaking) - 1:
        return a.sum_x, a.sum_y
    b, past = shaking[low + 1], time - a.time
    half = 0.5 * past / (b.time - a.time)
    gain_x = past * (a.x + half * (b.x - a.x))
    gain_y = past * (a.y + half * (b.y - a.y))
    return a.sum_x + gain_x, a.sum_y + gain_y


@kernel
def set_field(shaking: Shaking, start: float, end: float, p: Parameters) -> None:
    """Set the acceleration of free blocks relative to the ground, averaged over a step."""
    (x0, y0), (x1, y1) = velocity(shaking, start), velocity(shaking, end)
    p.field_x = p.gravity_x - (x1 - x0) / (end - start)
    p.field_y = p.gravity_y - (y1 - y0) / (end - start)
