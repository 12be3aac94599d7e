"""Seeded random number generators, identical to those of NumPy but four times as fast to create.

`numpy.random.default_rng(seed)` takes 7 us, mostly for hashing the seed, which is a large part of
the time for drawing a block. Here a kernel hashes the seed like `numpy.random.SeedSequence`, whose
results NumPy guarantees to be the same in all versions (NEP 19). The algorithm is that of M. E.
O'Neill (2015), Developing a seed_seq alternative, with the constants of NumPy.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.random.bit_generator import ISeedSequence
from numpy.typing import NDArray

from rigdda.kernel import Direct, kernel, short_kernel

POOL = 4
"""Number of 32-bit words in the pool into which seeds are mixed; longer seeds are left to NumPy."""

WORD = 0xFFFFFFFF
"""Greatest 32-bit word, with all bits set."""

ENTROPY_START, ENTROPY_FACTOR = 0x43B0D7E5, 0x931E8875
STATE_START, STATE_FACTOR = 0x8B51F9DD, 0x58F38DED
MIX_FIRST, MIX_SECOND = 0xCA01F9DD, 0x4973F715
HALF = 16
"""Constants of the hash: initial value and multiplier of its factor, for the pool and for the words
generated from it; factors of the two words that are mixed; and the shift in bits."""


class _Words(ISeedSequence):
    """A hashed seed with the interface that `numpy.random.PCG64` requires."""

    def __init__(self, words: NDArray[np.uint64]):
        self._words = words

    def generate_state(self, n_words: int, dtype: Any = np.uint32) -> NDArray[np.uint64]:
        """Return the words, whose number is the one that PCG64 requests."""
        return self._words


def stream(seed: Sequence[int]) -> np.random.Generator:
    """Return the generator that `numpy.random.default_rng` returns for a seed of whole numbers."""
    if len(seed) > POOL or max(seed) > WORD:
        return np.random.Generator(np.random.PCG64(seed))
    words = np.empty(2 * POOL, dtype=np.uint32)
    padded = (*seed, 0, 0, 0)
    _hash.call(padded[0], padded[1], padded[2], padded[3], words)
    hashed: Any = _Words(words.view(np.uint64))  # a type missing in the type hints of PCG64
    return np.random.Generator(np.random.PCG64(hashed))


@short_kernel
def hash_seed(a: int, b: int, c: int, d: int, words: NDArray) -> None:
    """Write eight 32-bit words that depend on four, as numpy.random.SeedSequence does.

    Products of 64-bit integers may overflow; their last 32 bits are correct nevertheless.
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
    """Return a word that combines two."""
    word = (MIX_FIRST * first - MIX_SECOND * second) & WORD
    return word ^ (word >> HALF)
