"""The acceleration that gravity and the motion of the ground give free blocks."""

from __future__ import annotations

from rigdda.kernel import kernel
from rigdda.records import Floats, Parameters, Shaking


@kernel
def velocity(t: Floats, a: Floats, total: Floats, time: float) -> float:
    """Return the integral up to `time` of a polygon with corners (t, a) [m/s]."""
    if len(t) == 0 or time <= t[0]:
        return 0.0
    low, high = 0, len(t)  # the last corner at or before `time`
    while high - low > 1:
        mid = (low + high) // 2
        if t[mid] <= time:
            low = mid
        else:
            high = mid
    if low == len(t) - 1:
        return total[low]
    past = time - t[low]
    slope = (a[low + 1] - a[low]) / (t[low + 1] - t[low])
    return total[low] + past * (a[low] + 0.5 * slope * past)


@kernel
def set_field(shaking: Shaking, start: float, end: float, p: Parameters) -> None:
    """Set the acceleration of free blocks relative to the ground, averaged over a step."""
    t, x, y = shaking.time, shaking.x, shaking.y
    gain_x = velocity(t, x, shaking.sum_x, end) - velocity(t, x, shaking.sum_x, start)
    gain_y = velocity(t, y, shaking.sum_y, end) - velocity(t, y, shaking.sum_y, start)
    p.field_x = p.gravity_x - gain_x / (end - start)
    p.field_y = p.gravity_y - gain_y / (end - start)
