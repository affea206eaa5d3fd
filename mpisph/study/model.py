"""The study file: a base case, and what is varied in it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import Field, ValidationError, field_validator, model_validator

from mpisph.case import Case, CaseSource
from mpisph.case.identity import case_key
from mpisph.case.times import same_time
from mpisph.core.errors import CaseError, Problem
from mpisph.inputs.findings import (
    Finding,
    Origins,
    as_problems,
    integer_problems,
    model_problems,
)
from mpisph.inputs.folder_name import folder_name
from mpisph.inputs.quantities import (
    Description,
    FrozenModel,
    Identifier,
    PositiveTime,
    Source,
    TimeOffset,
    Title,
)
from mpisph.inputs.spelling import nearest
from mpisph.inputs.toml_file import read_toml
from mpisph.inputs.toml_lines import line_numbers
from mpisph.study.columns import number_columns
from mpisph.study.designs import Designs, read_designs

MOST_CASES = 100_000
"""More cases than this are taken for a slip."""

Key = Annotated[str, Field(min_length=1, max_length=200)]
Value = bool | int | float | Annotated[str, Field(max_length=200)]
Settings = dict[Key, Value]


class Parameter(FrozenModel):
    """A setting that is varied, in every combination with the others."""

    name: Identifier
    """Name of its column in the table."""
    key: Key
    """Key of the case that it sets, such as ``resolution.nph``."""
    values: Annotated[tuple[Value, ...], Field(min_length=1, max_length=10_000)]
    """Its values, as a case file would give them."""
    unit: Annotated[str, Field(max_length=20)] = ""
    """Unit of the values, where they are numbers; by default SI."""
    label: Description = ""
    """What it is called in figures; by default its name."""
    joined: bool = False
    """Whether it varies together with the others that are so: a column of `rows`."""

    @property
    def numeric(self) -> bool:
        """Whether all of its values are numbers."""
        return all(
            isinstance(v, int | float) and not isinstance(v, bool) for v in self.values
        )


class Derived(FrozenModel):
    """A setting that follows a parameter."""

    key: Key
    """Key of the case that it sets."""
    parameter: Identifier
    """Name of the parameter that it follows."""
    factor: float = 1.0
    """It is so many times the parameter, where that is a number."""


class Variant(FrozenModel):
    """A case of its own, crossed with all parameters."""

    name: Identifier
    """Name in the table and in figures."""
    label: Description = ""
    """What it is called in figures; by default its name."""
    base: Annotated[str, Field(max_length=500)] | None = None
    """Case file, relative to the study's; by default the study's."""
    set: Settings = Field(default_factory=dict)
    """Further settings."""


class FigureSpec(FrozenModel):
    """How a study is drawn."""

    kind: Literal["lines", "map", "shots", "convergence"]
    """Lines against a parameter; a map of the total error over three; computed beside
    measured values of each variant; quantities against resolution."""
    x: Identifier | None = None
    """Parameter along the horizontal axis."""
    lines: Identifier | None = None
    """Parameter, or ``variant``, that each line stands for."""
    panels: Identifier | None = None
    """Parameter, or ``variant``, that each panel stands for."""
    y: tuple[Annotated[str, Field(max_length=200)], ...] = ()
    """Columns of the table that are drawn; by default `quantities` at the exposures, or
    at the end of the run where nothing is measured."""
    quantities: tuple[Literal["R_b", "L_b"], ...] = ("R_b", "L_b")
    """What is drawn at the exposures."""
    exposures: tuple[float, ...] = ()
    """Nominal times of the exposures drawn [us]; by default all."""
    clocks: Annotated[
        tuple[Literal["nominal", "offset"], ...], Field(min_length=1, max_length=2)
    ] = ("nominal", "offset")
    """Readings of the clock that are drawn; `convergence` takes the last."""
    x_scale: Literal["linear", "log"] = "linear"
    """Scale of the horizontal axis, where it shows numbers."""

    @field_validator("y", mode="before")
    @classmethod
    def _one_or_several(cls, value: Any) -> Any:
        """Take a single column for a list of one."""
        return [value] if isinstance(value, str) else value

    @model_validator(mode="after")
    def _check_y(self) -> FigureSpec:
        """Check that the kind can draw the columns."""
        if self.kind == "shots" and self.y:
            raise ValueError("a figure of kind shots has no y")
        if self.kind == "map" and len(self.y) > 1:
            raise ValueError("y: a figure of kind map shows one column")
        return self

    def axes(self) -> dict[str, str]:
        """Return the parameter, or ``variant``, of each axis that is given."""
        named = {"x": self.x, "lines": self.lines, "panels": self.panels}
        return {key: name for key, name in named.items() if name is not None}


class PaperRange(FrozenModel):
    """Range of a parameter that a source gives for a combination of others."""

    at: dict[Identifier, float]
    """The combination."""
    low: float | None = None
    """Lower end; left out with `high` where the source names no range."""
    high: float | None = None
    """Upper end; left out where the source names none."""


class PaperValue(FrozenModel):
    """A figure that a source gives for a case."""

    at: dict[Identifier, Value]
    """The case: ``variant``, or parameters."""
    time: float
    """Nominal time of the exposure [us]."""
    radius: float | None = None
    """R_b [mm]."""
    length: float | None = None
    """L_b [mm]."""


class Paper(FrozenModel):
    """What the source that a study follows gives in numbers."""

    parameter: Identifier | None = None
    """The parameter that `ranges` are of."""
    limit_percent: float | None = None
    """Total error below which a setting is in a range [%]."""
    ranges: tuple[PaperRange, ...] = ()
    """Ranges."""
    values: tuple[PaperValue, ...] = ()
    """Single figures."""

    @model_validator(mode="after")
    def _check(self) -> Paper:
        """Check that it is said what the ranges are of."""
        if self.ranges and (self.parameter is None or self.limit_percent is None):
            raise ValueError("ranges need parameter and limit_percent")
        return self


class StudyFile(FrozenModel):
    """A study, as its file describes it."""

    title: Title
    """What is studied."""
    source: Source | None = None
    """Where the study comes from."""
    base: Annotated[str, Field(max_length=500)] | None = None
    """Case file that is varied, relative to this one."""
    set: Settings = Field(default_factory=dict)
    """Settings of all cases."""
    parameters: Annotated[tuple[Parameter, ...], Field(max_length=100)] = ()
    """What is varied."""
    rows: Annotated[str, Field(max_length=500)] | None = None
    """CSV file of further settings, a case in each row, relative to this file."""
    times: Annotated[tuple[PositiveTime, ...], Field(max_length=100)] = ()
    """Times at which the table has columns, besides exposures and the end."""
    derived: Annotated[tuple[Derived, ...], Field(max_length=100)] = ()
    """What follows."""
    variants: Annotated[tuple[Variant, ...], Field(max_length=1000)] = ()
    """Cases that are crossed with the parameters."""
    figure: FigureSpec | None = None
    """How it is drawn."""
    clock_from: Identifier | None = None
    """Variant on whose runs alone the clock's offset is fitted when settings are
    judged over all variants; see `best`."""
    clock_offsets: tuple[TimeOffset, ...] = ()
    """Further offsets by which every combination is judged, such as one from a finer
    run."""
    paper: Paper = Paper()
    """What the source gives in numbers."""

    @model_validator(mode="after")
    def _check(self) -> StudyFile:
        """Check names, and that there is something to vary."""
        names = [p.name for p in self.parameters]
        for kind, found in (
            ("parameters", names),
            ("variants", [v.name for v in self.variants]),
        ):
            twice = [name for name in found if found.count(name) > 1]
            if twice:
                raise ValueError(f"two {kind} are called {twice[0]}")
        unknown = [d.parameter for d in self.derived if d.parameter not in names]
        if unknown:
            raise ValueError(f"derived: no parameter {unknown[0]}")
        if "variant" in names:
            raise ValueError("a parameter may not be called variant")
        if self.base is None and not (
            self.variants and all(variant.base for variant in self.variants)
        ):
            raise ValueError("required: base, the case file that is varied")
        count = self.count
        if count > MOST_CASES:
            raise ValueError(f"{count} cases; expected at most {MOST_CASES}")
        if self.clock_from not in {None, *(v.name for v in self.variants)}:
            raise ValueError(f"clock_from: no variant {self.clock_from}")
        self._check_ranges()
        return self

    def _check_ranges(self) -> None:
        """Check that the paper's ranges are of numbers that are varied."""
        numbers = {p.name for p in self.parameters if p.numeric}
        for given in self.paper.ranges:
            for name in (str(self.paper.parameter), *given.at):
                if name not in numbers:
                    raise ValueError(f"paper: no parameter {name} with numbers")
            if given.at.keys() != self.paper.ranges[0].at.keys():
                raise ValueError("paper: all ranges need the same parameters")

    @model_validator(mode="after")
    def _check_figure(self) -> StudyFile:
        """Check that the figure has a place for all that is varied."""
        if self.figure is None:
            return self
        axes, kind = self.figure.axes(), self.figure.kind
        numbers = {p.name for p in self.parameters if p.numeric}
        needed = {"lines": ("x",), "map": ("x", "lines"), "convergence": ("x",)}
        for key in needed.get(kind, ()):
            if key not in axes:
                raise ValueError(f"figure: a figure of kind {kind} needs {key}")
        for key, name in axes.items():
            if name not in {"variant", *(p.name for p in self.parameters)}:
                raise ValueError(f"figure.{key}: no parameter {name}")
        if kind == "convergence" and axes["x"] not in numbers:
            raise ValueError(f"figure.x: expected numbers, but {axes['x']} has names")
        if len(set(axes.values())) < len(axes):
            raise ValueError("figure: two axes stand for the same")
        # What the rows of a file vary besides is checked when all cases are known.
        varied = {p.name for p in self.parameters if len(p.values) > 1 and not p.joined}
        varied |= {"variant"} if len(self.variants) > 1 else set()
        drawn = {*axes.values(), *(["variant"] if kind == "shots" else [])}
        lost = sorted(varied - drawn)
        if lost:
            raise ValueError(f"figure: no axis stands for {lost[0]}, which is varied")
        return self

    @property
    def count(self) -> int:
        """Number of cases."""
        values = math.prod(len(p.values) for p in self.parameters if not p.joined)
        joined = [len(p.values) for p in self.parameters if p.joined]
        return values * max(joined, default=1) * max(len(self.variants), 1)


class StudyCase(NamedTuple):
    """One case of a study.

    Attributes
    ----------
    number : int
        Its number in the study, from 0 on.
    variant : str
        Name of its variant; empty where the study has none.
    settings : dict
        Value of each parameter, by name, as the study file gives it.
    overrides : tuple of str
        ``key=value``, as ``mpisph run --set`` takes them.
    case : Case
    key : str
        See `case_key`; cases of different studies with the same key share a run.
    """

    number: int
    variant: str
    settings: dict[str, Any]
    overrides: tuple[str, ...]
    case: Case
    key: str

    def name(self) -> str:
        """Return the case's variant and settings for people."""
        return case_name(self.variant, self.settings)


def case_name(variant: str, settings: Mapping[str, Any]) -> str:
    """Return the variant and the settings of a case for people."""
    texts = [f"{name} = {value}" for name, value in settings.items()]
    return ", ".join([variant] * bool(variant) + texts) or "base"


class Plan(NamedTuple):
    """A case of a study that has not been made.

    Attributes
    ----------
    base : Path
        Case file.
    variant, settings, overrides
        See `StudyCase`.
    row : int
        Number of its design.
    """

    base: Path
    variant: str
    settings: dict[str, Any]
    overrides: tuple[str, ...]
    row: int


class Study(NamedTuple):
    """A study that has been read and checked.

    Attributes
    ----------
    path : Path
        The study file.
    file : StudyFile
    cases : tuple of StudyCase
    """

    path: Path
    file: StudyFile
    cases: tuple[StudyCase, ...]

    @property
    def name(self) -> str:
        """Name of the study, and of its folder."""
        return folder_name(self.path)

    def times(self, chosen: Sequence[float] = ()) -> list[float]:
        """Return the nominal times of the exposures of all cases [s], in order.

        Parameters
        ----------
        chosen : sequence of float, optional
            Those to return [us]; by default all.
        """
        times = {
            exposure.time
            for case in self.cases
            if case.case.measured is not None
            for exposure in case.case.measured.exposures
        }
        return sorted(
            time
            for time in times
            if not chosen or any(math.isclose(1e6 * time, t) for t in chosen)
        )

    @property
    def drawn(self) -> tuple[str, ...]:
        """Columns that the figure draws; empty where it draws measured sizes."""
        figure = self.file.figure
        if figure is None or figure.y or self.times():
            return figure.y if figure else ()
        return ("R_b_mm",) if figure.kind == "map" else ("R_b_mm", "L_b_mm")

    def columns(self) -> list[str]:
        """Return the columns of numbers that runs can add to the table."""
        bodies = [body.name for case in self.cases for body in case.case.bodies]
        shields = any(case.case.shield is not None for case in self.cases)
        return number_columns(
            self.times(), self.file.times, list(dict.fromkeys(bodies)), shields
        )


def load_study(path: Path) -> Study:
    """Read a study and make all of its cases.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Study

    Raises
    ------
    CaseError
        If no folder may have the study's name; with every mistake of the file; or, if
        the file is sound, with those of the cases that it makes, each once.
    """
    file, designs, plans = read_plans(path)
    cases: list[StudyCase] = []
    problems: dict[str, Problem] = {}
    sources: dict[Path, CaseSource] = {}
    for index, (base, name, settings, overrides, row) in enumerate(plans):
        try:
            if base not in sources:
                sources[base] = CaseSource(base)
                _refuse_clash(path, sources[base].clash(overrides))
            case = sources[base].case(overrides)
        except CaseError as error:
            found = [_placed(problem, designs, row) for problem in error.problems]
            problems |= {str(problem): problem for problem in found}
            continue
        cases.append(StudyCase(index, name, settings, overrides, case, case_key(case)))
    if problems:
        first = Problem("the cases of this study are not sound:", file=str(path))
        raise CaseError([first, *problems.values()])
    study = Study(path, file, tuple(cases))
    mistakes = list(_mistakes(study))
    if mistakes:
        raise CaseError(mistakes)
    return study


def _refuse_clash(path: Path, clash: tuple[str, str] | None) -> None:
    """Raise where two settings of a study change one key: only one would count."""
    if clash is not None:
        first, second = (text.partition("=")[0] for text in clash)
        text = f"{first} and {second} are the same key of the case"
        raise CaseError([Problem(text, file=str(path))])


def read_plans(path: Path) -> tuple[StudyFile, Designs | None, list[Plan]]:
    """Read a study without making its cases.

    Parameters
    ----------
    path : Path

    Raises
    ------
    CaseError
        If no folder may have the study's name; with every mistake of the file.
    """
    folder_name(path)
    file, designs = _read_file(path)
    plans = [
        Plan(
            path.parent / str((variant and variant.base) or file.base),
            variant.name if variant else "",
            settings,
            _overrides(file, variant, settings),
            row,
        )
        for variant, row, settings in _combinations(file)
    ]
    return file, designs, plans


def _placed(problem: Problem, designs: Designs | None, row: int) -> Problem:
    """Return a problem of a case with the line of the design that it comes from."""
    key = (problem.file or "").removeprefix("--set ").partition("=")[0]
    if designs is None or key not in {column.key for column in designs.columns}:
        return problem
    return replace(problem, file=str(designs.path), line=designs.lines[row])


def _mistakes(study: Study) -> Iterator[Problem]:
    """Require snapshots at the times asked for, and a figure that can be drawn."""
    file = str(study.path)
    for time in study.file.times:
        for case in study.cases:
            if not any(same_time(time, other) for other in case.case.output_times):
                text = f"{case.name()} has no snapshot at {1e6 * time:g} us"
                expected = f"{text}; see output.times and output.every"
                yield Problem(expected, file=file, key="times")
                break
    figure = study.file.figure
    if figure is None:
        return
    if (figure.kind == "shots" or figure.exposures) and not study.times(
        figure.exposures
    ):
        text = "no case has a measured exposure that is to be drawn"
        yield Problem(text, file=file, key="figure")
    known = study.columns()
    for name in figure.y:
        if name not in known:
            text = "no column of numbers in the table"
            guess = nearest(name, known)
            yield Problem(text, file, key="figure.y", value=name, suggestion=guess)
    drawn = [*figure.axes().values(), *["variant"] * (figure.kind == "shots")]
    seen: dict[tuple[Any, ...], StudyCase] = {}
    for case in study.cases:
        settings: dict[str, Any] = {**case.settings, "variant": case.variant}
        place = tuple(settings[name] for name in drawn)
        other = seen.setdefault(place, case)
        if other is not case:
            text = (
                f"the cases {other.number} ({other.name()}) and {case.number} "
                f"({case.name()}) have the same place: no axis tells them apart"
            )
            yield Problem(text, file=file, key="figure")
            return


def _read_file(path: Path) -> tuple[StudyFile, Designs | None]:
    """Return a study file, with the columns of its designs among the parameters."""
    text, data = read_toml(path)
    origins = Origins(str(path), line_numbers(text), {})
    problems = integer_problems(data, origins)
    table = next((name for name in ("bodies", "shield") if name in data), None)
    if table is not None:
        line = origins.lines.get((table,))
        problems = [Problem("is a case, not a study", file=str(path), line=line)]
    given = data.get("parameters", ())
    for k, parameter in enumerate(given if isinstance(given, list) else ()):
        if isinstance(parameter, dict) and "joined" in parameter:
            key = ("parameters", k, "joined")
            problems += as_problems([Finding(key, "unknown key")], data, origins)
    if problems:
        raise CaseError(problems)
    designs = None
    if isinstance(data.get("rows"), str) and isinstance(given, list | tuple):
        designs = read_designs(path.parent / data["rows"])
        joined = [{**column._asdict(), "joined": True} for column in designs.columns]
        data = {**data, "parameters": [*given, *joined]}
    try:
        return StudyFile.model_validate(data), designs
    except ValidationError as error:
        raise CaseError(model_problems(error, origins)) from None


def _combinations(
    file: StudyFile,
) -> Iterator[tuple[Variant | None, int, dict[str, Value]]]:
    """Return all variants with all rows and all combinations of the other values.

    A row is given by its number in the file of designs.
    """
    free = [parameter for parameter in file.parameters if not parameter.joined]
    joined = [parameter for parameter in file.parameters if parameter.joined]
    rows = list(zip(*(p.values for p in joined), strict=True)) or [()]
    for variant in file.variants or (None,):
        for number, row in enumerate(rows):
            chosen = dict(zip((p.name for p in joined), row, strict=True))
            for values in itertools.product(*(p.values for p in free)):
                others = dict(zip((p.name for p in free), values, strict=True))
                yield variant, number, {**others, **chosen}


def _overrides(
    file: StudyFile, variant: Variant | None, settings: Mapping[str, Value]
) -> tuple[str, ...]:
    """Return what a case changes in its base, the later before the earlier."""
    changes: Settings = {**file.set, **(variant.set if variant else {})}
    for p in file.parameters:
        if not p.joined or settings[p.name] != "":
            changes[p.key] = _with_unit(p, settings[p.name])
    for derived in file.derived:
        value = settings[derived.parameter]
        if isinstance(value, int | float) and not isinstance(value, bool):
            value = value if derived.factor == 1.0 else derived.factor * value
        changes[derived.key] = value
    return tuple(f"{key}={_as_text(value)}" for key, value in changes.items())


def _with_unit(parameter: Parameter, value: Value) -> Value:
    """Return a parameter's value as the case gives it."""
    if not parameter.unit or isinstance(value, str):
        return value
    return f"{value} {parameter.unit}"


def _as_text(value: Value) -> str:
    """Return a value as an override gives it."""
    return str(value).lower() if isinstance(value, bool) else str(value)
