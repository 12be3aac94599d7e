"""Repetition of the episode or release of a replay from the record that it contains."""

from __future__ import annotations

from dataclasses import dataclass

import msgspec
import numpy as np

import rigdda
from rigdda.barriers import from_table
from rigdda.envs import environments
from rigdda.envs.registration import ENVIRONMENTS
from rigdda.envs.replay_record import EpisodeRecord, ReleaseRecord, Versions, as_json


@dataclass(frozen=True, slots=True)
class Repetition:
    """Recorded and recomputed results, as texts that are equal only if every bit is."""

    what: str
    recorded: str
    computed: str
    versions: Versions

    @property
    def same(self) -> bool:
        """Whether both agree to the last bit."""
        return self.recorded == self.computed

    @property
    def other_versions(self) -> list[str]:
        """Descriptions of the programs whose versions differ from those of the record."""
        then, now = (msgspec.structs.asdict(v) for v in (self.versions, Versions.of_today()))
        return [f"{name} {then[name]}, now {now[name]}" for name in then if then[name] != now[name]]


def repeat(record: EpisodeRecord | ReleaseRecord) -> Repetition:
    """Compute a recorded episode or release again."""
    if isinstance(record, EpisodeRecord):
        return _repeat_episode(record)
    return _repeat_release(record)


def _repeat_episode(record: EpisodeRecord) -> Repetition:
    env = _environment(record)
    env.draw(record.seed)
    env.seeds = tuple(record.release_seeds)
    env.begin()
    rewards = [env.step(np.array(action))[1] for action in record.actions]
    return Repetition(
        what=f"{record.environment}, site {record.site.name}, {len(rewards)} steps",
        recorded="reward " + " ".join(map(repr, record.rewards)),
        computed="reward " + " ".join(map(repr, rewards)),
        versions=record.versions,
    )


def _environment(record: EpisodeRecord) -> environments.BarrierEnv:
    """Return an environment with the keywords of a record, whose episodes are on its site.

    The site is given as a sequence, because the kinds of a record may be those of a split, of which
    the site offers only some.
    """
    name = ENVIRONMENTS[record.environment][0].rpartition(":")[2]
    made: environments.BarrierEnv = getattr(environments, name)(
        [record.site],
        max_barriers=record.max_barriers,
        kinds=tuple(record.kinds),
        releases=record.releases,
        targets=record.targets,
        max_cost=record.max_cost,
        checks=record.checks,
    )
    return made


def _repeat_release(record: ReleaseRecord) -> Repetition:
    tables = enumerate(record.barriers)
    layout = tuple(from_table(f"barriers[{i}]", table) for i, table in tables)
    _, outcome = rigdda.release(record.site, layout, record.seed, record.event)
    return Repetition(
        what=f"release {record.seed} of {record.site.name}, event {outcome.event}",
        recorded=f"outcome {record.outcome}",
        computed=f"outcome {as_json(outcome)}",
        versions=record.versions,
    )
