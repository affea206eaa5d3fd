"""What a study's page shows beside a paper: its figures, its ranges, the best sets."""

import re
from collections.abc import Sequence
from typing import Any, NamedTuple

from mpisph.case.sections import Exposure
from mpisph.case.times import same_time
from mpisph.report.page import NONE, Table
from mpisph.report.run_tables import mm
from mpisph.report.study_tables import (
    Cells,
    error_text,
    label_of,
    number,
    settings_text,
    size_text,
    value_text,
    variant_names,
)
from mpisph.study.model import Study, StudyCase, Value
from mpisph.study.paper.best import BestSet
from mpisph.study.paper.ranges import Agreement, RangeCell, RangeClock
from mpisph.study.plots.axes import axis_of
from mpisph.study.table import Row

BEST_SHOWN = 10
"""Sets of parameters listed."""

PAPER_NPH, PAPER_ALPHA, PAPER_BETA = 2.0, 5.0, 5.0
"""The set that Lee, Seo and Min (2003) choose in section 4."""

READINGS: dict[RangeClock, str] = {
    "nominal": "nominal times",
    "offset": "the case’s clock offset",
    "fitted": "clock offset fitted by run",
}
"""What the readings of the clock are called."""

SHADES = 5
"""Steps of colour from no case judged as in the paper to all."""

_ERROR = re.compile(r"(.*)_([RL]_b)_(.+us)_error_percent")


class GridCell(NamedTuple):
    """A combination of settings, with a range of one more here and in the paper.

    Attributes
    ----------
    ours, paper : str
        The ranges.
    alike : str
        How many of the values compared are judged alike, such as ``17/19``.
    shade : int or None
        From 0, none alike, to `SHADES` - 1, all; None where nothing is compared.
    """

    ours: str
    paper: str
    alike: str
    shade: int | None


class Grid(NamedTuple):
    """Ranges over one or two parameters.

    Attributes
    ----------
    title : str
    corner : str
        What the heads of rows and columns are.
    columns : list of str
        Heads.
    rows : list of (str, list of GridCell or None)
        Each with its head; None where the paper says nothing.
    """

    title: str
    corner: str
    columns: list[str]
    rows: list[tuple[str, list[GridCell | None]]]


def paper_table(study: Study, rows: Sequence[Row]) -> Table:
    """Return the single figures that the paper gives, beside the runs'.

    Parameters
    ----------
    study : Study
    rows : sequence of dict
        From `collect`.

    Returns
    -------
    Table
        Without rows where the paper gives none.
    """
    found: list[Cells] = []
    for given in study.file.paper.values:
        for case, row in zip(study.cases, rows, strict=True):
            if any(row[name] != value for name, value in given.at.items()):
                continue
            for e in _exposures_at(case, 1e-6 * given.time):
                cells: Cells = (settings_text(study, row), f"{given.time:g} µs")
                for q, measured, paper in (
                    ("R_b", e.radius, given.radius),
                    ("L_b", e.length, given.length),
                ):
                    cells += (mm(measured), _beside(paper, measured))
                    cells += (size_text(row, q, e.time, "nominal"),)
                    cells += (size_text(row, q, e.time, "offset"),)
                found.append(cells)
    kinds = ("measured", "paper", "nominal", "offset")
    heads = [f"{name} {kind}" for name in ("R_b", "L_b") for kind in kinds]
    caption = (
        "In mm, outermost particles, in brackets the error against the measurement in "
        "%. The paper’s figures are at the nominal time; nominal and offset are ours."
    )
    return Table(
        "", ("case", "exposure", *heads), found, caption, numbers=True, words=(1,)
    )


def _exposures_at(case: StudyCase, time: float) -> list[Exposure]:
    measured = case.case.measured
    if measured is None:
        return []
    return [e for e in measured.exposures if same_time(e.time, time)]


def _beside(paper: float | None, measured: float | None) -> str:
    """Return the paper's size [mm] with its error against the measured one [m]."""
    if paper is None:
        return NONE
    if measured is None:
        return f"{paper:.1f}"
    return f"{paper:.1f} ({error_text(100.0 * (1e-3 * paper / measured - 1.0))})"


def agreement_table(study: Study, found: Sequence[Agreement]) -> Table:
    """Return how far the runs agree with the paper's ranges, for each clock.

    Parameters
    ----------
    study : Study
        With ranges.
    found : sequence of Agreement
    """
    rows: list[Cells] = []
    for a in found:
        both = sum(cell.both for cell in a.cells)
        ours = sum(cell.ours_only for cell in a.cells)
        paper = sum(cell.paper_only for cell in a.cells)
        blind = max(both + paper, a.compared - both - paper)
        rows.append(
            (
                READINGS[a.clock],
                f"{a.alike} of {a.compared}",
                share(a.alike, a.compared),
                share(blind, a.compared),
                str(both),
                str(ours),
                str(paper),
            )
        )
    limit = f"{study.file.paper.limit_percent:g} %"
    heads = (
        "reading of the clock", "judged alike", "share", "one answer for all",
        "below in both", "here alone", "in the paper alone",
    )  # fmt: skip
    caption = (
        f"A case is judged alike where its total error is below {limit} here and in "
        f"the paper, or in neither; an unstable run is not below. {len(study.cases)} "
        "cases; those that have not been run are not compared. One answer for all: the "
        "share if every case, or none, were said to be below, whichever is larger."
    )
    return Table("", heads, rows, caption, numbers=True)


def share(part: int, whole: int) -> str:
    """Return a part of a whole [%]; a dash where there is none."""
    return f"{100 * part / whole:.0f}\u00a0%" if whole else NONE


def best_table(study: Study, sets: Sequence[BestSet]) -> Table:
    """Return the best sets of parameters, and the paper's own.

    Parameters
    ----------
    study : Study
    sets : sequence of BestSet
        From `best_sets`.

    Returns
    -------
    Table
        Without rows where no set has all of its runs, and the paper's has none.
    """
    ranked = [s for s in sets if s.max_percent is not None]
    own = _paper_set(study)
    rows = [
        _best_row(study, f"{rank}{', the paper’s' * (s.settings == own)}", s)
        for rank, s in enumerate(ranked, 1)
        if rank <= BEST_SHOWN
    ]
    for s in sets:
        if s.settings == own and s not in ranked[:BEST_SHOWN]:
            rank = f"{ranked.index(s) + 1}, " if s in ranked else ""
            rows.append(_best_row(study, f"{rank}the paper’s", s))
    errors = list(sets[0].errors) if sets else []
    names = variant_names(study)
    heads = ["rank", *(label_of(p) for p in study.file.parameters), "offset [µs]"]
    heads += [
        "largest error [%]",
        "mean error [%]",
        *(_error_head(e, names) for e in errors),
    ]
    clock = names.get(study.file.clock_from or "", "")
    caption = (
        f"{len(ranked)} of {len(sets)} sets have all of their runs; ranked by the "
        "largest of the absolute errors at the exposures that all variants have. The "
        f"clock offset is fitted on {clock} alone, for each set on its own run. Errors "
        "in %, by the outermost particles."
    )
    return Table("", tuple(heads), rows, caption, numbers=True)


def _paper_set(study: Study) -> dict[str, Any] | None:
    """Return the settings of the paper's own set, where the study has it."""
    for case in study.cases:
        viscosity = case.case.scheme.viscosity
        found = (case.case.resolution.nph, viscosity.alpha, viscosity.beta)
        if found == (PAPER_NPH, PAPER_ALPHA, PAPER_BETA):
            return case.settings
    return None


def _error_head(column: str, names: dict[str, str]) -> str:
    found = _ERROR.fullmatch(column)
    if found is None:
        return column
    variant, quantity, time = found.groups()
    # Broken between its three parts alone.
    name = names.get(variant, variant).replace("-", "\N{NON-BREAKING HYPHEN}")
    return f"{name} {quantity} {time.removesuffix('us')}\u00a0µs".strip()


def _best_row(study: Study, rank: str, s: BestSet) -> Cells:
    offset = number(s.offset_us, ".2f")
    return (
        rank,
        *(value_text(s.settings[p.name]) for p in study.file.parameters),
        offset if s.fitted else f"{offset}, not fitted",
        number(s.max_percent, ".1f"),
        number(s.mean_percent, ".1f"),
        *(error_text(error) for error in s.errors.values()),
    )


def ranges_text(study: Study) -> str:
    """Return how the grids of ranges are to be read."""
    paper = study.file.paper
    label = axis_of(study, paper.parameter).label
    return (
        f"Values of {label} with a total error below {paper.limit_percent:g} %. Bold: "
        "ours; a range ends where a value has not been run. Below: the paper’s range, "
        "and how many of the values compared are judged alike. The darker a cell, the "
        "fewer are; grey: nothing to compare."
    )


def grid_of(study: Study, found: Agreement) -> Grid | None:
    """Return the paper's ranges over one or two parameters; None for more."""
    if not found.cells or len(found.cells[0].at) > 2:
        return None
    names: list[str | None] = [*found.cells[0].at, None]
    down, across = (axis_of(study, name) for name in names[:2])
    cells: dict[tuple[Value, ...], GridCell] = {}
    for cell in found.cells:
        at: list[Value] = [*cell.at.values(), ""]
        cells[tuple(at[:2])] = _grid_cell(cell)
    share_alike = share(found.alike, found.compared)
    alike = f"{found.alike} of {found.compared} alike, {share_alike}"
    return Grid(
        title=f"{READINGS[found.clock]}: ".capitalize() + alike,
        corner=f"{down.label}\u00a0\\ {across.label}".removesuffix("\u00a0\\ "),
        columns=list(across.names),
        rows=[
            (name, [cells.get((value, other)) for other in across.values])
            for value, name in zip(down.values, down.names, strict=True)
        ],
    )


def _grid_cell(cell: RangeCell) -> GridCell:
    shade = None
    if cell.compared:
        shade = min(int(SHADES * cell.alike / cell.compared), SHADES - 1)
    alike = f"{cell.alike}/{cell.compared}" if cell.compared else ""
    ours = _range_words(cell.ours) if cell.compared else NONE
    return GridCell(ours, _range_words(cell.paper), alike, shade)


def _range_words(text: str) -> str:
    """Return ranges as `ranges` writes them, with an open end in words of signs."""
    pieces = [
        f"≥\u00a0{piece[:-1]}" if piece.endswith("-") else piece.replace("-", "–")
        for piece in text.split(", ")
    ]
    return ", ".join(pieces)
