"""What a replay shows beside the scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from rigdda import check
from rigdda.barriers import describe
from rigdda.errors import BadInput
from rigdda.model.scene import Scene


@dataclass(frozen=True, slots=True)
class Marks:
    """What a replay shows that the scene does not know.

    Parameters
    ----------
    road : (float, float), optional
        Chainages of the road's uphill and downhill edge [m].
    notes : mapping of str to str
        Words about the episode: seed, layout, reward, objective.
    title : str
        Name of the recording.
    labels : sequence of str
        What each barrier of the scene is called, a fence with its class; without any, the words
        that the scene has for them.

    Raises
    ------
    BadInput
        If the road is not an interval.
    """

    road: tuple[float, float] | None = None
    notes: Mapping[str, str] = field(default_factory=dict)
    title: str = "rockfall"
    labels: Sequence[str] = ()

    def __post_init__(self) -> None:
        if self.road is None:
            return
        uphill, downhill = check.interval("road", self.road)
        if uphill == downhill:
            raise BadInput("road", self.road, "give its uphill edge, then its downhill edge")

    def labels_of(self, scene: Scene) -> Sequence[str]:
        """Return what each barrier of a scene is called.

        Raises
        ------
        BadInput
            If there are labels, but not one for each barrier.
        """
        count = len(scene.barriers)
        if self.labels and len(self.labels) != count:
            mend = f"give one for each of {count} barriers, or none"
            raise BadInput("labels", self.labels, mend)
        return self.labels or [describe(barrier) for barrier in scene.barriers]
