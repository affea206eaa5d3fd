"""The file of a source's claims: what is claimed, and how each claim is decided.

A file lists the claims. Each has one or more tries, the first of which decides: a
study, the cases in it that are meant, and the check that is made of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError

from mpisph.core.errors import CaseError
from mpisph.inputs.findings import Finding, Key, Origins, as_problems, model_problems
from mpisph.inputs.quantities import Description, FrozenModel, Identifier
from mpisph.inputs.spelling import nearest
from mpisph.inputs.toml_file import read_toml
from mpisph.inputs.toml_lines import line_numbers
from mpisph.study.model import Study, Value
from mpisph.study.table import Row

NEEDS: dict[str, tuple[str, ...]] = {
    "unstable": ("regions",),
    "falls": ("along", "columns", "limit"),
    "grows": ("along", "columns", "limit"),
    "grows_by_less": ("along", "columns"),
    "step": ("along", "columns", "regions", "limit"),
    "alike": ("reference", "columns", "limit"),
    "all_unstable": (),
    "smaller": ("reference", "columns", "limit"),
    "larger": ("reference", "columns", "limit"),
    "errors": ("columns", "limit"),
    "outside": ("columns", "bands"),
    "inside": ("columns", "bands"),
    "ranges": ("limit",),
}
"""The checks of `checks`, each with the keys that a try must give for it."""


class Condition(FrozenModel):
    """Which cases are meant: all that is given must hold."""

    at: dict[Identifier, Value] = Field(default_factory=dict)
    """Parameters, or ``variant``, that must have these values."""
    but: dict[Identifier, Value] = Field(default_factory=dict)
    """Parameters, or ``variant``, that must not have these values."""
    at_least: dict[Identifier, float] = Field(default_factory=dict)
    """Parameters that must not be smaller."""
    at_most: dict[Identifier, float] = Field(default_factory=dict)
    """Parameters that must not be larger."""

    def holds(self, row: Mapping[str, Any]) -> bool:
        """Say whether a row of a study's table is meant."""
        return (
            all(row.get(name) == value for name, value in self.at.items())
            and all(row.get(name) != value for name, value in self.but.items())
            and all(row[name] >= value for name, value in self.at_least.items())
            and all(row[name] <= value for name, value in self.at_most.items())
        )


class Try(FrozenModel):
    """One way to decide a claim."""

    name: Description
    """What it is, for people; such as ``with self-term``."""
    study: Identifier
    """Name of the study whose table is looked at."""
    check: Identifier
    """The computation, one of `NEEDS`."""
    where: Condition = Condition()
    """The cases that are looked at."""
    regions: tuple[Condition, ...] = ()
    """Cases of which something is claimed: those of any region."""
    along: Identifier | None = None
    """Parameter whose influence is claimed."""
    reference: dict[Identifier, Value] = Field(default_factory=dict)
    """Cases that the others are compared with."""
    columns: tuple[Identifier, ...] = ()
    """Columns of the table, with figures of the runs, that are compared."""
    bands: dict[Identifier, tuple[float, float]] = Field(default_factory=dict)
    """For each variant the smallest and the largest figure that is expected."""
    clock: Literal["nominal", "offset", "fitted"] = "nominal"
    """Reading of the clock for the total error."""
    limit: float | None = None
    """What the figure may not pass; its meaning is the check's."""

    def compared(self, rows: Sequence[Row]) -> Iterator[tuple[Row, list[Row]]]:
        """Return the regions' cases, each with those of the reference beside it.

        Beside a case is one that differs from it in the reference's keys alone.
        Without regions all cases are compared that are not of the reference.
        """
        keys = self.reference
        base = [row for row in rows if all(row[k] == v for k, v in keys.items())]
        rest = [name for name in settings_of(rows) if name not in keys]
        for row in rows:
            meant = not self.regions or any(c.holds(row) for c in self.regions)
            if meant and row not in base:
                yield row, [b for b in base if all(b[n] == row[n] for n in rest)]


class Claim(FrozenModel):
    """One claim of the source."""

    number: Annotated[int, Field(ge=1)]
    """Its number."""
    text: Annotated[str, Field(min_length=1, max_length=500)]
    """What is claimed."""
    tries: Annotated[tuple[Try, ...], Field(min_length=1)]
    """How it is decided."""
    finding: Annotated[str, Field(max_length=2000)] = ""
    """What was found out about it."""


class ClaimsFile(FrozenModel):
    """The claims of a source."""

    title: Description
    """What they are."""
    source: Description
    """Where they are made."""
    claims: Annotated[tuple[Claim, ...], Field(min_length=1)]
    """The claims."""


def settings_of(rows: Sequence[Row]) -> list[str]:
    """Return the columns that say which case a row is: those between case and run."""
    names = list(rows[0])
    return names[1 : names.index("run")]


def load_claims(path: Path, study_of: Callable[[str], Study | None]) -> ClaimsFile:
    """Read a file of claims.

    Parameters
    ----------
    path : Path
    study_of : callable
        Returns the study of a name; None where tries of it are not to be checked.

    Returns
    -------
    ClaimsFile

    Raises
    ------
    CaseError
        With every mistake of the file.
    """
    text, data = read_toml(path)
    origins = Origins(str(path), line_numbers(text), {})
    try:
        file = ClaimsFile.model_validate(data)
    except ValidationError as error:
        raise CaseError(model_problems(error, origins)) from None
    findings = [
        Finding(
            ("claims", k, "tries", j, *found.key),
            f"claim {claim.number}, {attempt.name}: {found.expected}",
            found.suggestion,
        )
        for k, claim in enumerate(file.claims)
        for j, attempt in enumerate(claim.tries)
        for found in _mistakes(attempt, study_of(attempt.study))
    ]
    if findings:
        raise CaseError(as_problems(findings, data, origins))
    return file


def _mistakes(attempt: Try, study: Study | None) -> Iterator[Finding]:
    """Say what is wrong with a try; its keys are those below the try."""
    if attempt.check not in NEEDS:
        expected = f"expected one of {', '.join(NEEDS)}"
        guess = nearest(attempt.check, NEEDS)
        yield Finding(("check",), expected, guess)
        return
    needs = NEEDS[attempt.check]
    if attempt.columns and attempt.check == "unstable":
        needs = (*needs, "limit")
    missing = [key for key in needs if getattr(attempt, key) in ((), {}, None)]
    for key in missing:
        yield Finding((key,), f"required by the check {attempt.check}")
    if study is not None and not missing:
        names = list(_unknown_names(attempt, study))
        yield from names or _empty_choices(attempt, study)


def _unknown_names(attempt: Try, study: Study) -> Iterator[Finding]:
    """Say which parameters, values, columns and variants the study does not have."""
    conditions: list[tuple[Key, Condition]] = [(("where",), attempt.where)]
    conditions += [(("regions", k), c) for k, c in enumerate(attempt.regions)]
    for key, condition in conditions:
        for kind in ("at", "but"):
            yield from _chosen((*key, kind), getattr(condition, kind), study)
        for kind in ("at_least", "at_most"):
            for name in getattr(condition, kind):
                yield from _number((*key, kind, name), name, study)
    yield from _chosen(("reference",), attempt.reference, study)
    if attempt.along is not None:
        yield from _number(("along",), attempt.along, study)
    columns: dict[Key, str] = {
        ("columns", k): name for k, name in enumerate(attempt.columns)
    }
    yield from _unknown(columns, study.columns(), "column", study)
    variants = [variant.name for variant in study.file.variants]
    bands: dict[Key, str] = {("bands", name): name for name in attempt.bands}
    yield from _unknown(bands, variants, "variant", study)
    if attempt.check == "ranges" and not study.file.paper.ranges:
        yield Finding(("check",), f"study {study.name} gives no ranges of a paper")


def _unknown(
    names: Mapping[Key, str], known: Sequence[str], kind: str, study: Study
) -> Iterator[Finding]:
    """Say which names are not known."""
    for key, name in names.items():
        if name not in known:
            text = f"study {study.name} has no {kind} {name}"
            yield Finding(key, text, nearest(name, known))


def _varied(study: Study) -> dict[str, tuple[Value, ...]]:
    """Return what tells the cases of a study apart, with all values of each."""
    values = {p.name: p.values for p in study.file.parameters}
    if study.file.variants:
        values["variant"] = tuple(variant.name for variant in study.file.variants)
    return values


def _chosen(key: Key, given: Mapping[str, Value], study: Study) -> Iterator[Finding]:
    """Say which names the study does not vary, and which values no case has."""
    varied = _varied(study)
    for name, value in given.items():
        if name not in varied:
            yield from _unknown({(*key, name): name}, [*varied], "parameter", study)
        elif value not in varied[name]:
            text = f"no case of study {study.name} has this value"
            guess = nearest(str(value), map(str, varied[name]))
            yield Finding((*key, name), text, guess)


def _number(key: Key, name: str, study: Study) -> Iterator[Finding]:
    """Say whether a name is that of no parameter with numbers."""
    if name not in _varied(study):
        yield from _unknown({key: name}, [*_varied(study)], "parameter", study)
    elif name not in {p.name for p in study.file.parameters if p.numeric}:
        yield Finding(key, "expected a parameter with numbers")


def _empty_choices(attempt: Try, study: Study) -> Iterator[Finding]:
    """Say where a try, whose names are all known, means no case of its study."""
    none = f"no case of study {study.name} matches"
    cases: list[Row] = [
        {"case": c.number, "variant": c.variant, **c.settings, "run": c.key}
        for c in study.cases
    ]
    rows = [row for row in cases if attempt.where.holds(row)]
    if not rows:
        yield Finding(("where",), none)
        return
    for k, region in enumerate(attempt.regions):
        if not any(region.holds(row) for row in rows):
            yield Finding(("regions", k), none)
    if attempt.reference:
        pairs = list(attempt.compared(rows))
        if not pairs:
            text = f"no case of study {study.name} is to be compared with the reference"
            yield Finding(("regions",), text)
        elif any(len(base) != 1 for _, base in pairs):
            text = "expected one reference case for each case that is compared"
            yield Finding(("reference",), text)
    if attempt.bands:
        for name in dict.fromkeys(row["variant"] for row in rows):
            if name not in attempt.bands:
                yield Finding(("bands",), f"required: a band for {name or study.name}")
