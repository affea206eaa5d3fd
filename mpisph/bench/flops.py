"""What an interaction costs in arithmetic, and what this machine could do.

The pair loop is run with numbers that count what is done with them, in a process of its
own where nothing is compiled: ``NUMBA_DISABLE_JIT=1 python -m mpisph.bench.flops``.
"""

import json
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from mpisph.bench.record import Arithmetic
from mpisph.bench.startup import launched
from mpisph.core.errors import MpisphError
from mpisph.core.particles import FloatArray
from mpisph.core.peak import rounds_of_32, rounds_of_64
from mpisph.physics.artificial_stress import artificial_stress
from mpisph.physics.scheme import SchemeConstants
from mpisph.sph.pair_records import RECORD_FIELDS, PairRecord
from mpisph.sph.pairs import GROUP, LANES, pair_sums

COPIES = 3
"""Times a neighbour's record passes between core and first-level cache: it is read in
the global order, written to the buffer, and read from there."""

ROUNDS = 200_000


def measure_arithmetic() -> Arithmetic:
    """Count the arithmetic of an interaction, measure the peak of one core.

    Raises
    ------
    MpisphError
        If the process that counts fails.
    """
    done = launched([sys.executable, "-m", __name__], NUMBA_DISABLE_JIT="1")
    if done.returncode != 0:
        raise MpisphError(f"counting the arithmetic failed:\n{done.stderr.strip()}")
    return Arithmetic(
        flops=json.loads(done.stdout),
        bytes=COPIES * 8 * RECORD_FIELDS,
        peak=max(_measure_peak(rounds_of_32, 32), _measure_peak(rounds_of_64, 64)),
    )


def _measure_peak(rounds_of: Callable[[FloatArray, int], None], lanes: int) -> float:
    """Return the fastest of some measurements of fused multiply-adds [flop/s]."""
    sums = np.zeros(lanes)
    rounds_of(sums, 1)
    fastest = np.inf
    for _ in range(5):
        begin = time.perf_counter()
        rounds_of(sums, ROUNDS)
        fastest = min(fastest, time.perf_counter() - begin)
    return 2.0 * lanes * ROUNDS / fastest


class Counting(np.float64):
    """A number that counts additions, multiplications and divisions."""

    done = 0


def _counted(name: str) -> Callable[..., Any]:
    plain = getattr(np.float64, name)

    def operation(self: Any, *others: Any) -> Any:
        Counting.done += 1
        return Counting(plain(self, *others))

    return operation


for _name in ("add", "sub", "mul", "truediv"):
    for _place in ("", "r"):
        setattr(Counting, f"__{_place}{_name}__", _counted(f"__{_place}{_name}__"))


def count_flops() -> float:
    """Return the operations of an interaction far from the axis, as it is written.

    Nothing must be compiled here. Comparisons, signs and absolute values count nothing.
    """
    each = [_flops_of(n) for n in (LANES, 2 * LANES)]
    return (each[1] - each[0]) / LANES


def _flops_of(n: int) -> int:
    scheme = SchemeConstants(
        lee2003=False, alpha=2.5, beta=1.5, epsilon=0.001, printed=False, g1=0.5,
        g2=1.0, kappa=3.0, self_term=True, smoothing=0, sound_speed_floor=0.01,
        artificial_stress=artificial_stress(0.2, 1.5, 3.0),
    )  # fmt: skip
    numbers = np.random.default_rng(1).uniform(1.0, 1.1, (n + 1, RECORD_FIELDS))
    records = [PairRecord(*map(Counting, row)) for row in numbers]
    buffer = np.empty((RECORD_FIELDS // GROUP, GROUP * n), object)
    for k, record in enumerate(records[1:]):
        for field, value in enumerate(record):
            buffer[field // GROUP, GROUP * k + field % GROUP] = value
    Counting.done = 0
    pair_sums(records[0], buffer, n, scheme, None, None)
    return Counting.done


if __name__ == "__main__":
    print(json.dumps(count_flops()))
