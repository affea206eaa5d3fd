"""The study of a file of tests: a shield for each test, and what cannot be computed.

The study is written as files, a base case and a row for each test, so that it can also
be run as any other: by `mpisph study run`, or in the job array of a cluster.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import tomli_w

from mpisph.case import CaseSource
from mpisph.core.errors import CaseError, Problem
from mpisph.io.files import write_text
from mpisph.study.assess.published import PublishedTest
from mpisph.study.model import Study, load_study

__all__ = ["STUDY_FILE", "Assessment", "plan"]

STUDY_FILE = "assess.toml"
BASE_FILE = "shield.toml"
ROWS_FILE = "rows.csv"

_KEYS = (
    "title",
    "shield.projectile.diameter",
    "shield.projectile.velocity",
    "shield.projectile.material",
    "shield.bumpers.0.thickness",
    "shield.bumpers.0.standoff",
    "shield.bumpers.0.material",
    "shield.wall.thickness",
    "shield.wall.material",
)
"""What the tests give of a case; `_values` has its values."""

_DIGITS = 12
# Of numbers in SI: enough for any report, and what 0.318 cm is in m is then 0.00318.


class Assessment(NamedTuple):
    """Tests, and the study that computes them.

    Attributes
    ----------
    tests : tuple of PublishedTest
    study : Study
        A case for each test that can be computed, in the order of the tests.
    refused : dict of str to str
        Why the others cannot, by their row.
    """

    tests: tuple[PublishedTest, ...]
    study: Study
    refused: dict[str, str]

    @property
    def computed(self) -> list[PublishedTest]:
        """Tests that have a case, in the order of the study's cases."""
        return [test for test in self.tests if test.row not in self.refused]


def plan(
    tests: Sequence[PublishedTest],
    root: Path,
    title: str,
    overrides: Sequence[str] = (),
) -> Assessment:
    """Write the study of some tests and make its cases.

    Parameters
    ----------
    tests : sequence of PublishedTest
        At least one.
    root : Path
        Folder of the study and its runs; made where it is missing.
    title : str
        What the study is called.
    overrides : sequence of str
        ``key=value`` for all cases.

    Raises
    ------
    CaseError
        If an override is of no use, or no test can be computed.
    OSError
        If a file cannot be written.
    """
    settings = _settings(overrides)
    root.mkdir(parents=True, exist_ok=True)
    write_text(root / BASE_FILE, _base_case(tests[0]))
    refused = _refused(tests, CaseSource(root / BASE_FILE), overrides)
    computed = [test for test in tests if test.row not in refused]
    if not computed:
        first = Problem("none of the tests can be computed:")
        others = [Problem(f"row {row}: {why}") for row, why in refused.items()]
        raise CaseError([first, *others[:_MOST_NAMED]])
    write_text(root / ROWS_FILE, _rows(computed))
    described = {
        "title": title,
        "base": BASE_FILE,
        "rows": ROWS_FILE,
        # Pictures of misses alone are looked at.
        "set": {"output.figures": False, **settings},
    }
    write_text(root / STUDY_FILE, tomli_w.dumps(described))
    return Assessment(tuple(tests), load_study(root / STUDY_FILE), refused)


_MOST_NAMED = 20


def _settings(overrides: Sequence[str]) -> dict[str, Any]:
    """Return overrides as a study has them; what tests give cannot be overridden."""
    settings: dict[str, Any] = {}
    problems = []
    for text in overrides:
        key, separator, value = text.partition("=")
        key = ".".join(part.strip() for part in key.split("."))
        if not separator:
            expected = "expected key=value, such as resolution.npr=10"
            problems.append(Problem(expected, file=f"--set {text}"))
        elif key in _KEYS:
            problems.append(Problem("each test gives its own", file=f"--set {text}"))
        settings[key] = value
    if problems:
        raise CaseError(problems)
    return settings


def _refused(
    tests: Sequence[PublishedTest], base: CaseSource, overrides: Sequence[str]
) -> dict[str, str]:
    """Return why cases of tests are not sound, by row.

    Raises
    ------
    CaseError
        If an override is not.
    """
    found = {}
    for test in tests:
        values = zip(_KEYS, _values(test), strict=True)
        own = [f"{key}={value}" for key, value in values]
        try:
            base.case([*own, *overrides])
        except CaseError as error:
            named = [p for p in error.problems if not _of_test(p, own)]
            if named:
                raise CaseError(named) from None
            found[test.row] = "; ".join(
                Problem(p.expected, key=p.key).__str__() for p in error.problems
            )
    return found


def _of_test(problem: Problem, own: Sequence[str]) -> bool:
    """Say whether a problem comes from what a test gives."""
    place = problem.file or ""
    return not place.startswith("--set ") or place.removeprefix("--set ") in own


def _values(test: PublishedTest) -> tuple[str, ...]:
    """Return the values of `_KEYS`."""
    shield = test.shield
    return (
        f"test of {test.name}"[:200],
        _metres(test.diameter),
        f"{test.velocity:.{_DIGITS}g} m/s",
        test.projectile.card,
        _metres(shield.bumper_thickness),
        _metres(shield.standoff),
        test.bumper.card,
        _metres(shield.wall_thickness),
        test.wall.card,
    )


def _metres(length: float) -> str:
    return f"{1e3 * length:.{_DIGITS}g} mm"


def _base_case(test: PublishedTest) -> str:
    """Return the case of a test as TOML."""
    _, diameter, velocity, sphere, bumper, standoff, sheet, wall, plate = _values(test)
    return tomli_w.dumps(
        {
            "title": "a published test; the rows of the study have all of them",
            "shield": {
                "projectile": {
                    "diameter": diameter,
                    "velocity": velocity,
                    "material": sphere,
                },
                "bumpers": [
                    {"thickness": bumper, "standoff": standoff, "material": sheet}
                ],
                "wall": {"thickness": wall, "material": plate},
            },
        }
    )


def _rows(tests: Sequence[PublishedTest]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_KEYS)
    writer.writerows(_values(test) for test in tests)
    return text.getvalue()
