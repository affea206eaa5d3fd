"""A bench as tables for people."""

from collections.abc import Sequence

from rich.markup import escape
from rich.table import Table

from mpisph.bench.record import (
    Arithmetic,
    BenchRecord,
    Comparison,
    Measurement,
    Spread,
)


def tables(record: BenchRecord) -> list[Table]:
    """Return the tables that say what a bench found.

    Parameters
    ----------
    record : BenchRecord

    Returns
    -------
    list of rich.table.Table
        Whole steps, their timers, what else they take, start-up, and the comparison
        with another program or setting, as far as they were measured.
    """
    found = []
    if record.measurements:
        parts = (_steps, _timers, _needs)
        found += [make(record.measurements) for make in parts]
        if record.arithmetic is not None:
            found.append(_arithmetic(record.measurements, record.arithmetic))
    if record.start_up is not None:
        found.append(_start_up(record))
    if record.comparisons:
        found.append(_comparisons(record))
    return found


def _scene_table(title: str, caption: str, heads: Sequence[str]) -> Table:
    """Return an empty table with a row for each measurement."""
    table = Table(title=title, caption=escape(caption))
    table.add_column("scene")
    for head in ("ranks", *heads):
        table.add_column(head, justify="right")
    return table


def _steps(measurements: Sequence[Measurement]) -> Table:
    table = _scene_table(
        "Whole steps: reduction, step, balance",
        "Median [smallest, largest]. Interactions are directed, and their time is that "
        "of all ranks together. Relative: to the time of a step on one rank with the "
        "same particles; of weak scaling, with as many particles a rank.",
        ("NPR", "particles", "ms a step", "ns an interaction", "relative"),
    )
    for m in measurements:
        table.add_row(
            _name(m),
            f"{m.ranks}",
            f"{m.npr}",
            f"{m.particles}",
            _text(m.step_ms, 2),
            _text(m.interaction_ns, 1),
            f"{_relative_time(m, measurements):.2f}",
        )
    return table


def _relative_time(m: Measurement, measurements: Sequence[Measurement]) -> float:
    """Return the time of a step over that of the same scene on one rank."""
    one = next(o for o in measurements if o.scene == m.scene and o.ranks == 1)
    return m.step_ms.median / one.step_ms.median


def _timers(measurements: Sequence[Measurement]) -> Table:
    names = list(dict.fromkeys(name for m in measurements for name in m.timers))
    table = _scene_table("Timers, median ns an interaction", "", names)
    for m in measurements:
        spreads = [m.timers.get(name) for name in names]
        cells = ["-" if s is None else f"{s.median:.2f}" for s in spreads]
        table.add_row(_name(m), f"{m.ranks}", *cells)
    return table


def _needs(measurements: Sequence[Measurement]) -> Table:
    table = _scene_table(
        "What else a step takes",
        "Messages and kB: sent by a rank in a step. Memory: growth of the peak, bytes "
        "a particle. Snapshot: one, in ms.",
        ("neighbours", "imbalance", "messages", "kB", "memory", "snapshot"),
    )
    for m in measurements:
        table.add_row(
            _name(m),
            f"{m.ranks}",
            f"{m.neighbours:.1f}",
            f"{m.imbalance:.1%}",
            f"{m.traffic.messages:.1f}",
            f"{m.traffic.bytes / 1e3:.1f}",
            "-" if m.memory is None else f"{m.memory:.0f}",
            f"{m.snapshot_ms:.1f}",
        )
    return table


def _arithmetic(measurements: Sequence[Measurement], known: Arithmetic) -> Table:
    peak = known.peak / 1e9
    table = _scene_table(
        "Arithmetic of the pair loop, with search and packing",
        f"{known.flops:.0f} operations and {known.bytes:.0f} bytes an interaction, "
        f"{known.flops / known.bytes:.2f} a byte, in the sums alone and as they are "
        f"written; a core does {peak:.1f} Gflop/s of fused multiply-adds, which count "
        "twice.",
        ("Gflop/s a rank", "of the peak", "GB/s a rank"),
    )
    for m in measurements:
        if (spent := m.timers.get("pair loop")) is not None:
            rate = known.flops / spent.median
            table.add_row(
                _name(m),
                f"{m.ranks}",
                f"{rate:.1f}",
                f"{rate / peak:.0%}",
                f"{known.bytes / spent.median:.1f}",
            )
    return table


def _start_up(record: BenchRecord) -> Table:
    assert record.start_up is not None
    s = record.start_up
    table = Table(title="Start: from launch to the end of the first step, s")
    for head in ("ranks", "compiling", "compiled before"):
        table.add_column(head, justify="right")
    table.add_row(f"{s.ranks}", f"{s.cold:.1f}", _text(s.warm, 2))
    return table


def _comparisons(record: BenchRecord) -> Table:
    table = _scene_table(
        f"This program against {record.against}, in turns",
        "Median [smallest, largest] of all starts. Ratio: within each pair of starts; "
        "below one, this program is faster.",
        ("particles", "ms a step", "the other's", "ratio"),
    )
    for c in record.comparisons:
        table.add_row(
            _name(c),
            f"{c.ranks}",
            f"{c.particles}",
            _text(c.step_ms, 2),
            _text(c.other_step_ms, 2),
            _text(c.ratio, 3),
        )
    return table


def _name(m: Measurement | Comparison) -> str:
    return m.scene if m.scaling == "strong" else f"{m.scene}, weak"


def _text(spread: Spread, digits: int) -> str:
    middle, low, high = (
        f"{value:.{digits}f}"
        for value in (spread.median, spread.smallest, spread.largest)
    )
    return escape(f"{middle} [{low}, {high}]")
