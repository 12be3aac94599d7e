"""Seeds: values that recorded results depend on, and streams that never meet."""

from __future__ import annotations

import numpy as np
import pytest

from rigdda import BadInput, seeds, sites
from rigdda.envs.problem import events_of_seeds
from rigdda.seeds import (
    EPISODES,
    STREAMS,
    derive,
    design_envelope_seed,
    episode_seeds,
    is_of_stream,
    release_seeds,
)

FIRST = {
    "search": (9461343906, 17417326746, 3644310486),
    "semifinal": (2743141681, 15961837363, 5156046661),
    "final": (5761979000, 16031384948, 11688462602),
    "report": (25519558053, 17470113237, 16861078137),
    "ensemble": (16478693212, 22749287068, 18325054840),
    "verification": (22476028259, 13678895033, 4961099417),
}
"""First release seeds of each stream for the seed 3. They are part of all recorded results."""


@pytest.mark.parametrize("stream", STREAMS)
def test_seeds_of_a_stream_are_those_of_recorded_results(stream: str) -> None:
    assert release_seeds(stream, 3, 3) == FIRST[stream]
    assert [name for name in STREAMS if is_of_stream(FIRST[stream][0], name)] == [stream]


def test_other_seeds_are_those_of_recorded_results() -> None:
    assert derive(7, 2) == 1009178997
    assert derive(7, *b"cliff-17") == 3095103434
    assert design_envelope_seed(3) == 2**34 + 3 * 2**20
    first = (seeds.EPISODES, seeds.OBSERVATIONS, seeds.NO_BARRIERS, seeds.DESIGN_ENVELOPES)
    assert first == (2**31, 2**32, 2**33, 2**34)
    assert events_of_seeds({"a": 0.5, "b": 0.3, "c": 0.2}, [11, 12, 13]) == ("a", "a", "b")
    site = sites.load("cliff-17")
    assert [site.event_names.index(site.pick(i)) for i in range(6)] == [2, 0, 0, 2, 0, 0]


def test_parts_of_a_release_are_drawn_as_in_recorded_results() -> None:
    first = sites.load("cliff").draw(5, "small, face")
    assert first.blocks[0].vertices[0].tolist() == pytest.approx([0.6638666, 11.87236665])
    assert first.strengths[0] == pytest.approx((-1.12684260, -0.10691606, 0.94954615))
    assert seeds.entropy(5, 1, "pits") == (5, 1, 2) and seeds.entropy(5, 1, "stems") == (5, 1, 3)


def test_an_unknown_stream_or_number_is_refused() -> None:
    with pytest.raises(BadInput, match="stream"):
        release_seeds("serach", 0, 1)
    with pytest.raises(BadInput, match="releases"):
        release_seeds("search", 0, seeds.LONGEST_STREAM + 1)


def test_no_seed_occurs_twice_in_a_stream() -> None:
    """The generator draws words of 32 bits, of which two are equal in many long streams."""
    for stream in STREAMS:
        seeds = release_seeds(stream, 0, 20_000)
        assert len(set(seeds)) == len(seeds)
        assert release_seeds(stream, 0, 500, 19_500) == seeds[19_500:]


def test_streams_of_release_seeds_never_meet() -> None:
    drawn = [
        {s for seed in range(20) for s in release_seeds(stream, seed, 200)} for stream in STREAMS
    ]
    assert len(set.union(*drawn)) == sum(map(len, drawn)) == len(STREAMS) * 20 * 200
    assert release_seeds("search", 3, 8) == release_seeds("search", 3, 32)[:8]
    assert release_seeds("search", 3, 8, 5) == release_seeds("search", 3, 32)[5:13]


def test_seeds_of_an_episode_are_different() -> None:
    found = episode_seeds(np.random.default_rng(0), 100_000)
    assert len(set(found)) == len(found) == 100_000
    few = np.random.default_rng(3).integers(EPISODES, size=6).tolist()
    assert episode_seeds(np.random.default_rng(3), 6) == tuple(few)
