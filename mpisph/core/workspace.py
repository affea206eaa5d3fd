"""Arrays that each step fills anew, kept from one step to the next."""

import math

import numpy as np

from mpisph.core.particles import FloatArray

SPARE = 0.25
"""Share by which an array that has become too small is made larger than it must be."""


class Workspace:
    """Room for arrays by their names.

    What is fresh from the system is filled with zeros as it is first written, which
    takes longer than to write it.
    """

    def __init__(self) -> None:
        self._kept: dict[str, FloatArray] = {}

    def room(self, name: str, *shape: int) -> FloatArray:
        """Return an array of any content; what was last returned by `name` is void."""
        size = math.prod(shape)
        kept = self._kept.get(name)
        if kept is None or kept.size < size:
            kept = self._kept[name] = np.empty(size + int(SPARE * size))
        return kept[:size].reshape(shape)
