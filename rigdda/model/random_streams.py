"""Streams of random numbers by seeds, those of numpy in a quarter of the time.

`numpy.random.default_rng(seed)` takes 7 us, most of it to hash the seed, which is a good part of
drawing a block. Here a kernel hashes it as `numpy.random.SeedSequence` does, whose results are the
same in all versions of numpy by its policy of compatibility (NEP 19). The algorithm is that of
M. E. O'Neill (2015), Developing a seed_seq alternative, with the constants of numpy.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.random.bit_generator import ISeedSequence
from numpy.typing import NDArray

from rigdda.kernel import Direct, kernel, short_kernel

POOL = 4
"""Words of 32 bits in the pool that seeds are mixed into; longer seeds are left to numpy."""

WORD = 0xFFFFFFFF
"""Greatest word of 32 bits: all its bits are set."""

ENTROPY_START, ENTROPY_FACTOR = 0x43B0D7E5, 0x931E8875
STATE_START, STATE_FACTOR = 0x8B51F9DD, 0x58F38DED
MIX_FIRST, MIX_SECOND = 0xCA01F9DD, 0x4973F715
HALF = 16
"""Constants of the hash: where its factor starts and how it goes on, for the pool and for the words
that are taken from it; the factors of the two words that are mixed; the bits of a shift."""


class _Words(ISeedSequence):
    """A seed that is hashed already: all that `numpy.random.PCG64` wants of one."""

    def __init__(self, words: NDArray[np.uint64]):
        self._words = words

    def generate_state(self, n_words: int, dtype: Any = np.uint32) -> NDArray[np.uint64]:
        """Return the words, which are as many as PCG64 asks for."""
        return self._words


def stream(seed: Sequence[int]) -> np.random.Generator:
    """Return the generator that `numpy.random.default_rng` gives for a seed of whole numbers."""
    if len(seed) > POOL or max(seed) > WORD:
        return np.random.Generator(np.random.PCG64(seed))
    words = np.empty(2 * POOL, dtype=np.uint32)
    padded = (*seed, 0, 0, 0)
    _hash.call(padded[0], padded[1], padded[2], padded[3], words)
    hashed: Any = _Words(words.view(np.uint64))  # of a type that the hints of PCG64 leave out
    return np.random.Generator(np.random.PCG64(hashed))


@short_kernel
def hash_seed(a: int, b: int, c: int, d: int, words: NDArray) -> None:
    """Write eight words of 32 bits that depend on four of them, as numpy.random.SeedSequence does.

    Products of whole numbers of 64 bits may overflow: the last 32 bits are right all the same.
    """
    factor = ENTROPY_START
    a, factor = _hashed(a, factor, ENTROPY_FACTOR)
    b, factor = _hashed(b, factor, ENTROPY_FACTOR)
    c, factor = _hashed(c, factor, ENTROPY_FACTOR)
    d, factor = _hashed(d, factor, ENTROPY_FACTOR)
    for source in range(POOL):
        for target in range(POOL):
            if target == source:
                continue
            word = a if source == 0 else b if source == 1 else c if source == 2 else d
            word, factor = _hashed(word, factor, ENTROPY_FACTOR)
            if target == 0:
                a = _mixed(a, word)
            elif target == 1:
                b = _mixed(b, word)
            elif target == 2:
                c = _mixed(c, word)
            else:
                d = _mixed(d, word)
    factor = STATE_START
    for k in range(2 * POOL):
        place = k % POOL
        word = a if place == 0 else b if place == 1 else c if place == 2 else d
        words[k], factor = _hashed(word, factor, STATE_FACTOR)


_hash = Direct(hash_seed)


@kernel
def _hashed(word: int, factor: int, step: int) -> tuple[int, int]:
    """Return the hash of a word, and the factor of the next one."""
    word = (word ^ factor) & WORD
    factor = (factor * step) & WORD
    word = (word * factor) & WORD
    return word ^ (word >> HALF), factor


@kernel
def _mixed(first: int, second: int) -> int:
    """Return a word that depends on two."""
    word = (MIX_FIRST * first - MIX_SECOND * second) & WORD
    return word ^ (word >> HALF)
