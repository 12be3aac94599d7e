"""Seeds: how every random number of a simulation is derived from whole numbers.

A *release seed* fixes the random properties of one release, see `generator`. Each use has release
seeds of its own. The exception is the designers: their seeds are spread over all numbers below
6 x 2**32, so that one of them may coincide with a seed of another use. With 20,000 releases of
each use, fewer than one design in fifty is expected to have such a release.

=================  =============================================================================
use                release seeds
=================  =============================================================================
episodes           drawn below `EPISODES` by the environments in `rigdda.envs`
observations       from `OBSERVATIONS`: `rigdda.envs.envelope` and `rigdda.envs.environments`
no barriers        from `NO_BARRIERS`: statistics of a site, `rigdda.envs.ensemble`
design envelopes   `design_envelope_seed`: `rigdda.envs.design_envelope`
designers          `release_seeds`: searches, choices and the verification; sections of a
                   corridor and sites of a data set first `derive` a seed of their own
others             the seed that the user gives and the numbers after it: `rigdda simulate`,
                   `study`, `sensitivity` and `fit`
=================  =============================================================================

The exam derives the seeds of its verification from the submitted layouts, see
`rigdda.app.exam.scorer`. Generated sites are numbered by `rigdda.model.site_names`, and
`rigdda.model.site_generator` draws them.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from rigdda import check

EPISODES, OBSERVATIONS, NO_BARRIERS, DESIGN_ENVELOPES = 2**31, 2**32, 2**33, 2**34
"""Upper limit of the seeds of scored releases of episodes, and first seeds of the releases that
are observed, of those without barriers, and of design envelopes."""

LONGEST_STREAM = 2**20
"""Largest number of release seeds that belong to one seed of a user."""

STREAMS = ("search", "semifinal", "final", "report", "ensemble", "verification")
"""Streams of release seeds. search: all layouts of a search; semifinal, final: the best layouts
again, to choose one of them; report: the chosen layout, for an unbiased evaluation; ensemble:
releases without barriers that a designer analyses; verification: releases that no search uses."""

RANDOM_PARTS = {"blocks": (), "strengths": (1,), "pits": (2,), "stems": (3,)}
"""Words that follow the seed and the event for each random part of a release."""

Part = Literal["blocks", "strengths", "pits", "stems"]


def entropy(seed: int, event: int, part: Part = "blocks") -> tuple[int, ...]:
    """Return the words from which a part of a release is drawn.

    Every part has a random stream of its own, so that, for example, the blocks do not depend on the
    variations of the ground or on the forest.

    Parameters
    ----------
    seed : int
        Release seed.
    event : int
        Index of the event.
    part : str
        Blocks with the friction of the ground, strengths of surfaces, pits, or stems of a forest.
    """
    return (seed, event, *RANDOM_PARTS[part])


def generator(seed: int, event: int, part: Part = "blocks") -> np.random.Generator:
    """Return the generator of a part of a release, see `entropy`."""
    return np.random.default_rng(entropy(seed, event, part))


def event_generator(seed: int, events: int) -> np.random.Generator:
    """Return the generator that selects one of `events` events for a release seed."""
    return np.random.default_rng([seed, events])


def first_event_generator(seed: int, events: int) -> np.random.Generator:
    """Return the generator of the place at which a series of releases enters the events.

    It is that of the first release seed of the series.
    """
    return np.random.default_rng([seed, events, 2**31])


def episode_seeds(rng: np.random.Generator, n: int) -> tuple[int, ...]:
    """Return `n` different release seeds of an episode."""
    drawn = dict.fromkeys(rng.integers(EPISODES, size=n).tolist())
    while len(drawn) < n:  # of 10,000 seeds, two are equal once in 40 episodes
        drawn |= dict.fromkeys(rng.integers(EPISODES, size=n - len(drawn)).tolist())
    return tuple(drawn)


def design_envelope_seed(seed: int) -> int:
    """Return the first release seed of a design envelope for a seed of a user."""
    return DESIGN_ENVELOPES + seed * LONGEST_STREAM


def derive(seed: int, *words: int) -> int:
    """Return a seed of 32 bits for a part of a job, such as a section of a corridor.

    Parameters
    ----------
    seed : int
        Seed of the job.
    *words : int
        What identifies the part: its number, or the bytes of its name.
    """
    return int(np.random.SeedSequence([seed, *words]).generate_state(1)[0])


def release_seeds(stream: str, seed: int, n: int, start: int = 0) -> tuple[int, ...]:
    """Return `n` release seeds of a stream.

    The remainder of a seed modulo the number of streams is the index of its stream. Therefore two
    streams never share a seed, whatever the seeds of the searches are.

    Parameters
    ----------
    stream : str
        One of `STREAMS`.
    seed : int
        Seed of the search, at least 0.
    n : int
        Number of seeds, at most `LONGEST_STREAM`.
    start : int
        Number of seeds at the beginning of the stream that are skipped, at most `LONGEST_STREAM`.

    Raises
    ------
    BadInput
        If the stream is unknown, or if a number is not an integer or is outside its range.
    """
    tag = stream_index(check.one_of("stream", stream, STREAMS))
    words = [check.integer("seed", seed, 0), tag]
    first = check.integer("start", start, 0, LONGEST_STREAM)
    count = check.integer("releases", n, 0, LONGEST_STREAM)
    drawn = _distinct(np.random.SeedSequence(words), first + count)[first:]
    return tuple(word * len(STREAMS) + tag for word in drawn)


def stream_index(stream: str) -> int:
    """Return the index of a stream, which is the remainder of its seeds."""
    return STREAMS.index(stream)


def is_of_stream(seed: int, stream: str) -> bool:
    """Return whether a release seed of a designer belongs to a stream."""
    return seed % len(STREAMS) == stream_index(stream)


def _distinct(sequence: np.random.SeedSequence, n: int) -> list[int]:
    """Return the first `n` different words of a sequence.

    Among 20,000 words of 32 bits, two are often equal.
    """
    drawn = n
    while len(words := dict.fromkeys(sequence.generate_state(drawn).tolist())) < n:
        drawn += n - len(words)
    return list(words)
