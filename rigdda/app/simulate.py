"""Simulation of a layout for `rigdda simulate`: outcomes of releases, passages and stops."""

from __future__ import annotations

import hashlib
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np

import rigdda
from rigdda import MECHANICS, Layout, Outcome, Run, Site
from rigdda.envs.envelope import largest
from rigdda.envs.outcome_cache import fingerprint
from rigdda.files import UNFINISHED, atomic
from rigdda.passages import Passages, passages

Tick = Callable[[int, str], None]
"""Called during a job with the number of releases so far and a description of the activity."""


CHUNK, LEAST = 256, 16
"""Blocks that are simulated before they are written to disk, and least number of releases."""


class Simulated(NamedTuple):
    """Results of releases: the run of the first one, all outcomes, passages and stops."""

    run: Run
    outcomes: list[Outcome]
    passages: Passages
    resumed: int
    """Number of releases that an interrupted job with the same task left in the folder."""


def simulate(
    site: Site,
    layout: Layout,
    seeds: range,
    event: str | None,
    stations: Sequence[float],
    out: Path,
    tick: Tick,
) -> Simulated:
    """Simulate releases on all cores.

    Releases are written into the folder `.unfinished` of `out` as they are done. A job that was
    killed continues from there if it is given the same task, or a larger number of releases.

    Raises
    ------
    BadInput
        If the layout cannot be placed on the slope, a station is not within the profile, or there
        is no such event.
    Diverged
        If a simulation diverges.
    """
    tick(0, "simulating")
    run, _ = rigdda.release(site, layout, seeds[0], event)
    names = site.event_names if event is None else (event,)
    chunk = max(LEAST, CHUNK // max(largest(site, name) for name in names))
    where = fingerprint(site).hex()
    asked = [rigdda.__version__, MECHANICS, where, list(layout), event, list(stations)]
    key = hashlib.sha256(msgspec.json.encode(asked)).hexdigest()[:16]
    outcomes: list[Outcome] = []
    found: list[Passages] = []
    resumed = 0
    for start in range(0, len(seeds), chunk):
        part = seeds[start : start + chunk]
        file = out / UNFINISHED / f"{key}-{part[0]}-{len(part)}.npz"
        known = _read_part(file, part)
        if known is None:
            own = rigdda.release_many([(site, layout, seed, event) for seed in part])
            passed = passages(site, layout, [(seed, event) for seed in part], stations)
            _write_part(file, own, passed)
        else:
            own, passed = known
            resumed += len(part)
        outcomes += own
        found.append(passed)
        tick(len(outcomes), "simulating")
    return Simulated(run, outcomes, Passages.join(found), resumed)


def _write_part(file: Path, outcomes: list[Outcome], found: Passages) -> None:
    """Write some releases to disk atomically."""
    words = np.frombuffer(msgspec.msgpack.encode(outcomes), dtype=np.uint8)
    arrays = {name: getattr(found, name) for name in ("stations", "event", "table", "stops")}
    with atomic(file) as part, part.open("wb") as opened:
        np.savez(opened, outcomes=words, **arrays)


def _read_part(file: Path, seeds: range) -> tuple[list[Outcome], Passages] | None:
    """Return the releases of some seeds in a file, None if there is none or it is damaged."""
    try:
        with np.load(file) as stored:
            data = {name: stored[name] for name in stored.files}
        words = data.pop("outcomes").tobytes()
        return msgspec.msgpack.decode(words, type=list[Outcome]), Passages(
            seed=tuple(seeds), **data
        )
    except (
        OSError, KeyError, TypeError, ValueError, EOFError, zipfile.BadZipFile,
        msgspec.MsgspecError,
    ):  # fmt: skip
        return None
