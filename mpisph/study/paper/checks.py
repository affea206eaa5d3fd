"""The computations that decide claims, from the table of a study."""

import itertools
import statistics
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, Literal, NamedTuple

from mpisph.core.errors import MpisphError
from mpisph.study.model import Study
from mpisph.study.paper.claims_file import Condition, Try
from mpisph.study.paper.ranges import agreement
from mpisph.study.table import Row

Word = Literal["reproduced", "in part", "not reproduced", "not run"]


class Verdict(NamedTuple):
    """What a try has come to.

    Attributes
    ----------
    word : str
    figure : str
        The numbers behind it, for people.
    """

    word: Word
    figure: str


def decide(attempt: Try, study: Study, table: Sequence[Row]) -> Verdict:
    """Make the check of a try on the table of its study.

    Parameters
    ----------
    attempt : Try
    study : Study
    table : sequence of dict
        From `collect`.

    Returns
    -------
    Verdict

    Raises
    ------
    MpisphError
        If the study has no such case.
    """
    rows = [row for row in table if attempt.where.holds(row)]
    if not rows:
        raise MpisphError(
            f"claims: study {attempt.study} has no case for {attempt.name}"
        )
    missing = sum(row["status"] not in {"completed", "unstable"} for row in rows)
    if missing:
        return Verdict("not run", f"{missing} of {len(rows)} cases have not been run")
    return CHECKS[attempt.check](attempt, study, rows)


def _is_stable(row: Row) -> bool:
    return bool(row["status"] == "completed")


def _word(all_of_it: bool, some_of_it: bool) -> Word:
    if all_of_it:
        return "reproduced"
    return "in part" if some_of_it else "not reproduced"


def check_unstable(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether the unstable cases are those of the regions, and no others.

    A column above `limit`, such as a front faster than the projectile, counts as an
    instability too. In part: more cases are as claimed than if all were stable.
    """
    inside = [row for row in rows if any(c.holds(row) for c in attempt.regions)]
    outside = [row for row in rows if row not in inside]
    hits = sum(_breaks_down(attempt, row) for row in inside)
    wrong = sum(_breaks_down(attempt, row) for row in outside)
    return Verdict(
        _word(hits == len(inside) and wrong == 0, hits > wrong),
        f"{hits} of the {len(inside)} cases said to be unstable are, and {wrong} of "
        f"the {len(outside)} others",
    )


def _breaks_down(attempt: Try, row: Row) -> bool:
    """Say whether a run is unstable or a column above the limit."""
    return not _is_stable(row) or any(row[c] > attempt.limit for c in attempt.columns)


def check_falls(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether the columns fall from each value of the parameter to the next.

    `limit` is the share of the steps that must fall. In part: more than half do.
    """
    return _monotone(attempt, rows, -1.0)


def check_grows(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether the columns grow from each value of the parameter to the next.

    `limit` is the share of the steps that must grow. In part: more than half do.
    """
    return _monotone(attempt, rows, 1.0)


def _monotone(attempt: Try, rows: Sequence[Row], sign: float) -> Verdict:
    steps, changes = [], []
    for line in _lines(attempt, rows):
        steps += [sign * (b - a) > 0.0 for a, b in itertools.pairwise(line)]
        changes.append(100.0 * (line[-1] / line[0] - 1.0))
    if not steps:
        return Verdict("not reproduced", "fewer than two stable cases on every line")
    share = sum(steps) / len(steps)
    verb = "grows" if sign > 0.0 else "falls"
    return Verdict(
        _word(share >= attempt.limit, share > 0.5),
        f"{verb} in {sum(steps)} of {len(steps)} steps; from the first value to the "
        f"last by {_range(changes)} %",
    )


def check_grows_by_less(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether the columns grow along the parameter, each time by less.

    In part: they grow from the first to the last, by less in the second half.
    """
    good, partly, texts = True, True, []
    for line in _lines(attempt, rows):
        steps = [b - a for a, b in itertools.pairwise(line)]
        good &= all(0.0 < b < a for a, b in itertools.pairwise(steps)) and steps[0] > 0
        half = len(steps) // 2
        partly &= 0.0 < sum(steps[-half:]) < sum(steps[:half])
        texts.append(", ".join(f"{step:+.2f}" for step in steps))
    return Verdict(_word(good, partly), f"steps of {'; '.join(texts)} mm")


def check_step(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether only the steps of the regions are unstable, and the step hardly matters.

    `limit` is the largest change of a column along the parameter [%], among the stable
    cases. In part: one of the two holds.
    """
    stable_only = all(
        _is_stable(row) or any(c.holds(row) for c in attempt.regions) for row in rows
    )
    some = any(not _is_stable(row) for row in rows)
    unstable = sum(not _is_stable(row) for row in rows)
    spreads = [
        100.0 * (max(line) / min(line) - 1.0)
        for line in _lines(attempt, rows)
        if min(line) > 0.0
    ]
    if not spreads:
        return Verdict("not reproduced", "fewer than two stable cases on every line")
    middle, largest = statistics.median(spreads), max(spreads)
    little = middle <= attempt.limit
    return Verdict(
        _word(stable_only and some and little, (stable_only and some) or little),
        f"{unstable} of {len(rows)} cases are unstable, "
        f"{'none' if stable_only else 'some'} at other steps than claimed; the step "
        f"moves the columns by {middle:.1f} % (median), {largest:.1f} % (largest)",
    )


def check_alike(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether the regions' cases differ little from the reference's.

    `limit` is the largest difference of a column [%]. In part: half of the cases.
    """
    found = list(_ratios(attempt, rows))
    unstable = sum(ratio is None for ratio in found)
    changes = [100.0 * (ratio - 1.0) for ratio in found if ratio is not None]
    good = [abs(change) <= attempt.limit for change in changes]
    return Verdict(
        _word(bool(good) and all(good), sum(good) > len(found) / 2),
        f"{_range(changes)} % from the reference"
        + (f"; {unstable} comparisons lack a stable run" if unstable else ""),
    )


def check_all_unstable(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether every case is unstable. In part: some are."""
    unstable = sum(not _is_stable(row) for row in rows)
    text = f"{unstable} of {len(rows)} cases are unstable"
    return Verdict(_word(unstable == len(rows), unstable > 0), text)


def check_smaller(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether the columns of the regions' cases are far below the reference's.

    `limit` is the largest ratio allowed. In part: for some cases. An unstable case
    counts for neither.
    """
    return _far(attempt, rows, lambda ratio: ratio <= attempt.limit)


def check_larger(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether the columns of the regions' cases are far above the reference's.

    `limit` is the smallest ratio allowed. In part: for some cases.
    """
    return _far(attempt, rows, lambda ratio: ratio >= attempt.limit)


def _far(attempt: Try, rows: Sequence[Row], is_far: Callable[[float], bool]) -> Verdict:
    found = list(_ratios(attempt, rows))
    ratios = [ratio for ratio in found if ratio is not None]
    far = sum(map(is_far, ratios))
    lost = len(found) - len(ratios)
    return Verdict(
        _word(bool(ratios) and far == len(found), far > 0),
        f"{_range([100.0 * ratio for ratio in ratios])} % of the reference"
        + (f"; {lost} comparisons lack a stable run" if lost else ""),
    )


def check_errors(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether all errors of the columns are within `limit` [%]. In part: most are."""
    errors = [row.get(column) for row in rows for column in attempt.columns]
    known = [error for error in errors if error is not None]
    good = sum(abs(error) <= attempt.limit for error in known)
    texts = ", ".join("unstable" if e is None else f"{e:+.1f}" for e in errors)
    return Verdict(
        _word(good == len(errors), good > len(errors) / 2),
        f"{good} of {len(errors)} within {attempt.limit:g} %: {texts}",
    )


def check_outside(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether the columns lie outside their variants' bands. In part: some do."""
    found = _beside_bands(attempt, rows)
    outside = [not _is_within(x, band) for _, x, band in found]
    return Verdict(
        _word(all(outside), any(outside)),
        f"{sum(outside)} of {len(found)} outside: {_band_text(found)} mm",
    )


def check_inside(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether the columns lie inside their variants' bands. In part: some do."""
    found = _beside_bands(attempt, rows)
    inside = [_is_within(x, band) for _, x, band in found]
    return Verdict(
        _word(all(inside), any(inside)),
        f"{sum(inside)} of {len(found)} inside: {_band_text(found)} mm",
    )


_Banded = tuple[str, float | None, tuple[float, float]]


def _beside_bands(attempt: Try, rows: Sequence[Row]) -> list[_Banded]:
    """Return each variant with its figure and the band that is expected."""
    return [
        (row["variant"], _figure(row, column), attempt.bands[row["variant"]])
        for row in rows
        for column in attempt.columns
    ]


def _is_within(value: float | None, band: tuple[float, float]) -> bool:
    return value is not None and band[0] <= value <= band[1]


def _band_text(found: Sequence[_Banded]) -> str:
    return ", ".join(
        f"{name} {'unstable' if x is None else f'{x:.1f}'} ({low:g} to {high:g})"
        for name, x, (low, high) in found
    )


def check_ranges(attempt: Try, study: Study, rows: Sequence[Row]) -> Verdict:
    """Whether the total error is below the source's limit where the source says so.

    `limit` is the share of the cases that must be judged alike. In part: more cases are
    alike than if all were said to be inside, or all outside.
    """
    found = agreement(study, rows, attempt.clock)
    cells = found.cells
    alike = sum(cell.alike for cell in cells)
    compared = sum(cell.compared for cell in cells)
    inside = sum(cell.both + cell.paper_only for cell in cells)
    blind = max(inside, compared - inside)
    ours = sum(cell.both + cell.ours_only for cell in cells)
    return Verdict(
        _word(alike >= attempt.limit * compared, alike > blind),
        f"{alike} of {compared} cases judged alike; below the limit here {ours}, in "
        f"the paper {inside}",
    )


def _ratios(attempt: Try, rows: Sequence[Row]) -> Iterator[float | None]:
    """Return the columns of the regions' cases over those of the reference.

    A case is compared with the one that differs from it in the reference's keys alone.
    None where either is unstable, or has no such figure.
    """
    keys = attempt.reference
    base = [row for row in rows if all(row.get(k) == v for k, v in keys.items())]
    rest = [name for name in _settings(rows) if name not in keys]
    for row in rows:
        if row in base or not any(
            c.holds(row) for c in attempt.regions or [Condition()]
        ):
            continue
        (other,) = (b for b in base if all(b[name] == row[name] for name in rest))
        for column in attempt.columns:
            values = _figure(row, column), _figure(other, column)
            if values[0] is None or not values[1]:
                yield None
            else:
                yield values[0] / values[1]


def _figure(row: Row, column: str) -> float | None:
    """Return a figure of a stable run."""
    return row.get(column) if _is_stable(row) else None


def _lines(attempt: Try, rows: Sequence[Row]) -> Iterator[list[float]]:
    """Return the columns along the parameter for each combination of the others."""
    rest = [name for name in _settings(rows) if name != attempt.along]
    groups: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        groups.setdefault(tuple(row[name] for name in rest), []).append(row)
    for group in groups.values():
        group.sort(key=lambda row: row[attempt.along or "case"])
        for column in attempt.columns:
            line = [_figure(row, column) for row in group]
            found = [value for value in line if value is not None]
            if len(found) > 1:
                yield found


def _settings(rows: Sequence[Row]) -> list[str]:
    """Return the columns that say which case a row is: those between case and run."""
    names = list(rows[0])
    return names[1 : names.index("run")]


def _range(values: Iterable[float]) -> str:
    """Return the smallest and the largest of some numbers, for people."""
    known = sorted(values)
    if not known:
        return "nothing"
    low, high = f"{known[0]:.1f}", f"{known[-1]:.1f}"
    return low if low == high else f"{low} to {high}"


CHECKS: dict[str, Callable[[Try, Study, Sequence[Row]], Verdict]] = {
    "unstable": check_unstable,
    "falls": check_falls,
    "grows": check_grows,
    "grows_by_less": check_grows_by_less,
    "step": check_step,
    "alike": check_alike,
    "all_unstable": check_all_unstable,
    "smaller": check_smaller,
    "larger": check_larger,
    "errors": check_errors,
    "outside": check_outside,
    "inside": check_inside,
    "ranges": check_ranges,
}
"""The computations that decide claims, by name."""
