"""Fused multiply-adds alone, to measure how many a core can do.

Eight registers of sums keep the core busy without waiting for one another, and fit into
any processor: registers of four numbers, or of eight.
"""

from mpisph.core.jit import EXACT
from mpisph.core.jitted import jitted
from mpisph.core.particles import FloatArray

_FUSED = {**EXACT, "fastmath": {"contract"}}


@jitted(**_FUSED)
def rounds_of_32(sums: FloatArray, rounds: int) -> None:
    """Multiply and add to each of 32 sums, so many times."""
    for _ in range(rounds):
        for k in range(32):
            sums[k] = sums[k] * 0.99 + 0.5


@jitted(**_FUSED)
def rounds_of_64(sums: FloatArray, rounds: int) -> None:
    """Multiply and add to each of 64 sums, so many times."""
    for _ in range(rounds):
        for k in range(64):
            sums[k] = sums[k] * 0.99 + 0.5
