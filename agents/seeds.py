"""Seeds of releases: disjoint streams for searching, choosing, looking and verifying."""

from __future__ import annotations

import numpy as np

from agents import limits
from rigdda import check

STREAMS = ("search", "semifinal", "final", "ensemble", "verification")
"""search: all layouts of a search; semifinal, final: the best of them again; ensemble: barrier-free
releases that a designer looks at; verification: seen by no search."""


def release_seeds(stream: str, seed: int, n: int) -> tuple[int, ...]:
    """Return the first `n` release seeds of a stream.

    A seed's remainder by the number of streams is its stream, so that no two streams share one,
    whatever the seeds of the searches.

    Parameters
    ----------
    stream : str
        One of `STREAMS`.
    seed : int
        Seed of the search, at least 0.
    n : int
        How many.

    Raises
    ------
    BadInput
        If the stream is unknown or a number is not whole or outside its range.
    """
    tag = STREAMS.index(check.one_of("stream", stream, STREAMS))
    entropy = [check.integer("seed", seed, 0), tag]
    count = check.integer("releases", n, 0, limits.RELEASES)
    words = np.random.SeedSequence(entropy).generate_state(count)
    return tuple(int(word) * len(STREAMS) + tag for word in words)
