"""Seeds of releases: disjoint streams for searching, choosing, reporting, looking and verifying."""

from __future__ import annotations

import numpy as np

from rigdda import check
from rigdda.agents import limits

STREAMS = ("search", "semifinal", "final", "report", "ensemble", "verification")
"""search: all layouts of a search; semifinal, final: the best of them again, to choose; report: the
chosen one, whose value it tells without having chosen anything; ensemble: barrier-free releases
that a designer looks at; verification: seen by no search."""


def release_seeds(stream: str, seed: int, n: int, start: int = 0) -> tuple[int, ...]:
    """Return `n` release seeds of a stream, by default the first.

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
    start : int
        How many of the stream are passed over.

    Raises
    ------
    BadInput
        If the stream is unknown or a number is not whole or outside its range.
    """
    tag = STREAMS.index(check.one_of("stream", stream, STREAMS))
    entropy = [check.integer("seed", seed, 0), tag]
    count = check.integer("releases", n, 0, limits.RELEASES)
    words = np.random.SeedSequence(entropy).generate_state(start + count)[start:]
    return tuple(int(word) * len(STREAMS) + tag for word in words)
