"""Wall time of the phases of a step."""

import time
from collections.abc import Iterator
from contextlib import contextmanager


class Phases:
    """Accumulates wall time by name, on this rank.

    Attributes
    ----------
    seconds : dict of str to float
        Time spent so far in each phase [s].
    """

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def measure(self, name: str) -> Iterator[None]:
        """Add the time spent inside the block to phase `name`."""
        begin = time.perf_counter()
        try:
            yield
        finally:
            spent = time.perf_counter() - begin
            self.seconds[name] = self.seconds.get(name, 0.0) + spent
