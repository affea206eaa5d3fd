"""The analyses of the debris that a run's page shows."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from mpisph.case import Case
from mpisph.snapshot import Snapshot


class AnalysisFigure(NamedTuple):
    """A figure made of one snapshot.

    Attributes
    ----------
    title : str
        What it shows.
    caption : str
        How to read it.
    draw : callable
        Draws a snapshot of a case into a PNG file.
    """

    title: str
    caption: str
    draw: Callable[[Snapshot, Case, Path], None]


ANALYSES: tuple[AnalysisFigure, ...] = ()
"""The figures, in the order in which they are shown."""
