"""What a verification found, as files: a table (CSV) and a record (JSON)."""

import csv
import io
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mpisph.io.files import write_text
from mpisph.io.provenance import git_revision, versions
from mpisph.verify.problem import Check
from mpisph.verify.runner import Verdict

CSV_FILE = "verify.csv"
JSON_FILE = "verify.json"

COLUMNS = (
    "problem",
    "quantity",
    "unit",
    "measured",
    "exact",
    "low",
    "high",
    "order",
    "verdict",
    "reason",
)


def write_record(folder: Path, verdicts: Sequence[Verdict]) -> None:
    """Write `CSV_FILE` and `JSON_FILE` into a folder; on rank 0.

    Raises
    ------
    OSError
        If a file cannot be written.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for verdict in verdicts:
        writer.writerows(_csv_rows(verdict))
    write_text(folder / CSV_FILE, text.getvalue())
    record = {
        "revision": git_revision(),
        "versions": versions(),
        "problems": [_entry(verdict) for verdict in verdicts],
    }
    write_text(folder / JSON_FILE, json.dumps(record, indent=2) + "\n")


def verdict_word(passed: bool) -> str:
    """Return ``pass`` or ``FAIL``."""
    return "pass" if passed else "FAIL"


def _csv_rows(verdict: Verdict) -> list[list[Any]]:
    name = verdict.problem.name
    if verdict.reason:
        blank = [""] * (len(COLUMNS) - 3)
        return [[name, *blank, verdict_word(False), verdict.reason]]
    return [
        [
            name,
            c.quantity,
            c.unit,
            repr(c.measured),
            repr(float(c.exact)),
            repr(float(c.low)),
            repr(float(c.high)),
            "" if c.order is None else repr(c.order),
            verdict_word(c.passed),
            "",
        ]
        for c in verdict.checks
    ]


def _entry(verdict: Verdict) -> dict[str, Any]:
    return {
        "name": verdict.problem.name,
        "title": verdict.problem.title,
        "source": verdict.problem.source,
        "passed": verdict.passed,
        "reason": verdict.reason,
        "checks": [_check_entry(check) for check in verdict.checks],
        "runs": [facts._asdict() for facts in verdict.runs],
    }


def _check_entry(check: Check) -> dict[str, Any]:
    """Return a check; JSON knows neither NaN nor infinity: they are null."""
    values = check._asdict() | {"passed": check.passed}
    return {
        key: None if isinstance(value, float) and not math.isfinite(value) else value
        for key, value in values.items()
    }
