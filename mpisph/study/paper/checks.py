"""The computations that decide claims, from the table of a study."""

from collections.abc import Callable, Sequence

from mpisph.study.model import Study
from mpisph.study.paper.claims_file import Try
from mpisph.study.paper.ranges import agreement
from mpisph.study.paper.trends import (
    check_falls,
    check_grows,
    check_grows_by_less,
    check_step,
)
from mpisph.study.paper.verdict import (
    Verdict,
    figure_of,
    is_stable,
    limit_of,
    span_text,
    unit_of,
    word_of,
)
from mpisph.study.table import Row

_OF_INSTABILITY = {"unstable", "all_unstable"}
# Checks that unstable runs alone can decide; all others need figures of stable ones.


def decide(attempt: Try, study: Study, table: Sequence[Row]) -> Verdict:
    """Make the check of a try on the table of its study.

    Parameters
    ----------
    attempt : Try
        From `load_claims`, which sees to it that the study has what the try names.
    study : Study
    table : sequence of dict
        From `collect`.

    Returns
    -------
    Verdict
    """
    rows = [row for row in table if attempt.where.holds(row)]
    missing = sum(row["status"] not in {"completed", "unstable"} for row in rows)
    if missing:
        return Verdict("not run", f"{missing} of {len(rows)} cases have not been run")
    if not rows:
        return Verdict("undecided", "the study has no such case")
    if attempt.check not in _OF_INSTABILITY and not any(map(is_stable, rows)):
        return Verdict("undecided", f"none of the {len(rows)} cases is stable")
    return CHECKS[attempt.check](attempt, study, rows)


def check_unstable(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether the unstable cases are those of the regions, and no others.

    A column above `limit`, such as a front faster than the projectile, counts as an
    instability too. In part: more cases are as claimed than if all were stable.
    """
    broken = [_breaks_down(attempt, row) for row in rows]
    unknown = broken.count(None)
    if unknown:
        text = f"{unknown} stable cases lack {' or '.join(attempt.columns)}"
        return Verdict("undecided", text)
    claimed = [any(c.holds(row) for c in attempt.regions) for row in rows]
    pairs = list(zip(claimed, broken, strict=True))
    hits, wrong = pairs.count((True, True)), pairs.count((False, True))
    inside = claimed.count(True)
    return Verdict(
        word_of(hits == inside and wrong == 0, hits > wrong),
        f"{hits} of the {inside} cases said to be unstable are, and {wrong} of "
        f"the {len(rows) - inside} others",
    )


def _breaks_down(attempt: Try, row: Row) -> bool | None:
    """Say whether a run is unstable or a column above the limit; None if unknown."""
    if not is_stable(row):
        return True
    figures = [row.get(column) for column in attempt.columns]
    if None in figures:
        return None
    return any(figure > limit_of(attempt) for figure in figures if figure is not None)


def check_all_unstable(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether every case is unstable. In part: some are."""
    unstable = sum(not is_stable(row) for row in rows)
    text = f"{unstable} of {len(rows)} cases are unstable"
    return Verdict(word_of(unstable == len(rows), unstable > 0), text)


def check_alike(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether the regions' cases differ little from the reference's.

    `limit` is the largest difference of a column [%]. In part: half of the cases.
    """
    found = _ratios(attempt, rows)
    changes = [100.0 * (ratio - 1.0) for ratio in found if ratio is not None]
    if not changes:
        return _no_figure(attempt)
    good = sum(abs(change) <= limit_of(attempt) for change in changes)
    return Verdict(
        word_of(good == len(found), good > len(found) / 2),
        f"{span_text(changes)} % from the reference{_lost(found)}",
    )


def check_smaller(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether the columns of the regions' cases are far below the reference's.

    `limit` is the largest ratio allowed. In part: for some cases. An unstable case
    counts for neither.
    """
    return _far(attempt, rows, lambda ratio: ratio <= limit_of(attempt))


def check_larger(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether the columns of the regions' cases are far above the reference's.

    `limit` is the smallest ratio allowed. In part: for some cases.
    """
    return _far(attempt, rows, lambda ratio: ratio >= limit_of(attempt))


def _far(attempt: Try, rows: Sequence[Row], is_far: Callable[[float], bool]) -> Verdict:
    found = _ratios(attempt, rows)
    ratios = [ratio for ratio in found if ratio is not None]
    if not ratios:
        return _no_figure(attempt)
    far = sum(map(is_far, ratios))
    percents = [100.0 * ratio for ratio in ratios]
    return Verdict(
        word_of(far == len(found), far > 0),
        f"{span_text(percents)} % of the reference{_lost(found)}",
    )


def _ratios(attempt: Try, rows: Sequence[Row]) -> list[float | None]:
    """Return the columns of the regions' cases over those of the reference.

    None where either is unstable or has no such figure, or the reference's is zero.
    """
    ratios: list[float | None] = []
    for row, (other,) in attempt.compared(rows):
        for column in attempt.columns:
            figure, reference = figure_of(row, column), figure_of(other, column)
            ratios.append(
                figure / reference if figure is not None and reference else None
            )
    return ratios


def _lost(ratios: Sequence[float | None]) -> str:
    """Return how many comparisons could not be made, as the end of a sentence."""
    lost = ratios.count(None)
    if not lost:
        return ""
    verb = "lacks" if lost == 1 else "lack"
    return f"; {lost} of {len(ratios)} comparisons {verb} a value"


def check_errors(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether all errors of the columns are within `limit` [%]. In part: most are."""
    errors = [figure_of(row, column) for row in rows for column in attempt.columns]
    known = [error for error in errors if error is not None]
    if not known:
        return _no_figure(attempt)
    good = sum(abs(error) <= limit_of(attempt) for error in known)
    texts = ", ".join("none" if e is None else f"{e:+.1f}" for e in errors)
    return Verdict(
        word_of(good == len(errors), good > len(errors) / 2),
        f"{good} of {len(errors)} within {attempt.limit:g} %: {texts}",
    )


def check_outside(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether the columns lie outside their variants' bands. In part: some do."""
    return _beside_bands(attempt, rows, inside=False)


def check_inside(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether the columns lie inside their variants' bands. In part: some do."""
    return _beside_bands(attempt, rows, inside=True)


def _beside_bands(attempt: Try, rows: Sequence[Row], inside: bool) -> Verdict:
    """Say whether figures lie in the bands, or outside; a missing one does neither."""
    found = [
        (row["variant"], figure_of(row, column), attempt.bands[row["variant"]])
        for row in rows
        for column in attempt.columns
    ]
    if all(x is None for _, x, _ in found):
        return _no_figure(attempt)
    good = [
        x is not None and (low <= x <= high) == inside for _, x, (low, high) in found
    ]
    texts = ", ".join(
        f"{name} {'none' if x is None else f'{x:.1f}'} ({low:g} to {high:g})"
        for name, x, (low, high) in found
    )
    where = "inside" if inside else "outside"
    return Verdict(
        word_of(all(good), any(good)),
        f"{sum(good)} of {len(found)} {where}: {texts}{unit_of(attempt)}",
    )


def check_ranges(attempt: Try, study: Study, rows: Sequence[Row]) -> Verdict:
    """Whether the total error is below the source's limit where the source says so.

    `limit` is the share of the cases that must be judged alike. In part: more cases are
    alike than if all were said to be inside, or all outside.
    """
    found = agreement(study, rows, attempt.clock)
    if not found.compared:
        text = "no case has a total error that could be compared"
        return Verdict("undecided", text)
    inside = sum(cell.both + cell.paper_only for cell in found.cells)
    blind = max(inside, found.compared - inside)
    ours = sum(cell.both + cell.ours_only for cell in found.cells)
    return Verdict(
        word_of(found.fraction >= limit_of(attempt), found.alike > blind),
        f"{found.alike} of {found.compared} cases judged alike; below the limit here "
        f"{ours}, in the paper {inside}",
    )


def _no_figure(attempt: Try) -> Verdict:
    return Verdict("undecided", f"no stable case has {' or '.join(attempt.columns)}")


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
