"""A design problem whose answer is known."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor

import numpy as np

from envs import DesignProblem, Evaluation
from envs.evaluation import student_interval
from rigdda import Wall


class Valley(DesignProblem):
    """A problem with a known answer, not simulated: one wall, 3 m high, in the zone's middle.

    The noise of a release depends on its seed only through `noise`.
    """

    def evaluate(
        self, layout: Sequence[Wall], seeds: Sequence[int], executor: Executor | None = None
    ) -> Evaluation:
        zone = self.site.barrier_zone
        middle = (zone.start + zone.end) / 2
        away = [((w.x - middle) / 4) ** 2 + (w.height - 3.0) ** 2 for w in layout]
        value = min(away, default=20.0) + max(len(layout) - 1, 0)
        values = np.array([value + self.noise(tuple(layout), seed) for seed in seeds])
        mean = float(values.mean())
        return Evaluation(
            tuple(layout), tuple(seeds), mean, mean, student_interval(values), (0.0, 1.0), 0.0, ()
        )

    def noise(self, layout: tuple[Wall, ...], seed: int) -> float:
        return 0.0
