"""What a bench found, as it is written to its JSON file."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict

from mpisph.io.files import write_text

SceneName = Literal["block", "impact", "late", "small"]
Scaling = Literal["strong", "weak"]


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Spread(_Model):
    """Some repeats of one measurement."""

    median: float
    """Middle one."""
    smallest: float
    """Smallest one."""
    largest: float
    """Largest one."""

    @classmethod
    def of(cls, values: Sequence[float]) -> Spread:
        """Return the spread of at least one value."""
        return cls(
            median=statistics.median(values),
            smallest=min(values),
            largest=max(values),
        )


class Traffic(_Model):
    """What a rank sends, the mean over ranks and steps."""

    messages: float
    """Number of messages."""
    bytes: float
    """[bytes]."""
    ghosts: float
    """Particles received from other ranks."""


class Measurement(_Model):
    """The steady loop of one scene on some ranks."""

    scene: SceneName
    """A uniform block at rest; the shot at impact; the shot at a late time; the shot at
    impact with some thousand particles."""
    scaling: Scaling
    """``strong``: the same particles on any ranks; ``weak``: the same for each rank."""
    ranks: int
    """Number of ranks."""
    npr: int
    """Particles along the radius of the reference body; a block has as many cells."""
    time: float
    """Time after first contact at which the measurement begins [s]."""
    particles: int
    """Number of particles on all ranks."""
    neighbours: float
    """Mean number of neighbours of a particle, itself included."""
    steps: int
    """Steps of one repeat."""
    repeats: int
    """Number of repeats."""
    interactions: float
    """Directed interactions evaluated in one step, on all ranks."""
    step_ms: Spread
    """Wall time of one step [ms]."""
    interaction_ns: Spread
    """Rank time of the whole step for each directed interaction [ns]."""
    timers: dict[str, Spread]
    """The same for each phase of the step [ns]."""
    traffic: Traffic
    """What a rank sends in a step."""
    imbalance: float
    """Excess of the largest load over the mean."""
    snapshot_ms: float
    """Wall time to write one snapshot [ms]."""
    memory: float | None
    """Growth of the ranks' peak memory for each particle [bytes]; None if unknown."""


class Comparison(_Model):
    """One scene of this program beside that of another, or with another setting."""

    scene: SceneName
    """See `Measurement`."""
    scaling: Scaling
    """See `Measurement`."""
    ranks: int
    """Number of ranks."""
    particles: int
    """Number of particles on all ranks."""
    step_ms: Spread
    """Wall time of one step of this program, of all starts [ms]."""
    other_step_ms: Spread
    """That of the other [ms]."""
    ratio: Spread
    """The first over the second, of each pair of starts."""


class StartUp(_Model):
    """Wall time from the launch of ``mpisph run`` to the end of its first step."""

    ranks: int
    """Number of ranks."""
    cold: float
    """With an empty code cache: everything is compiled [s]."""
    warm: Spread
    """With the compiled code in the cache [s]."""


class Arithmetic(_Model):
    """What an interaction takes, and what one core can do."""

    flops: float
    """Additions, multiplications and divisions of an interaction far from the axis, of
    the sums alone, as they are written."""
    bytes: float
    """What is moved of a neighbour between core and first-level cache [bytes]."""
    peak: float
    """Measured rate of fused multiply-adds, each counted twice [flop/s]."""


class Machine(_Model):
    """Where it was measured."""

    cpu: str
    """Model of the processor."""
    cores: int
    """Number of logical processors."""
    load: tuple[float, float, float]
    """Load average over 1, 5 and 15 minutes at the start."""


class BenchRecord(_Model):
    """All that a bench found."""

    case: str
    """Title of the case."""
    measurements: tuple[Measurement, ...]
    """Steady loops."""
    start_up: StartUp | None
    """Starts of whole programs."""
    machine: Machine
    """Where it was measured."""
    versions: dict[str, str]
    """Versions of the software."""
    revision: str
    """Revision of the source."""
    arithmetic: Arithmetic | None = None
    """Of the pair loop."""
    against: str | None = None
    """What it was compared with."""
    comparisons: tuple[Comparison, ...] = ()
    """With that, in turns."""


def write_bench(path: Path, record: BenchRecord) -> None:
    """Write a record as JSON; call it on one rank.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    write_text(path, record.model_dump_json(indent=2) + "\n")


def read_bench(path: Path) -> BenchRecord:
    """Read a file that `write_bench` wrote.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it is not such a record.
    """
    return BenchRecord.model_validate_json(path.read_text(encoding="utf-8"))
