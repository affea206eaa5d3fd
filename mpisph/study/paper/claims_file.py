"""The file of a source's claims: what is claimed, and how each claim is decided.

A file lists the claims. Each has one or more tries, the first of which decides: a
study, the cases in it that are meant, and the check that is made of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, model_validator

from mpisph.core.errors import CaseError
from mpisph.inputs.findings import Origins
from mpisph.inputs.quantities import Description, FrozenModel, Identifier
from mpisph.inputs.toml_file import read_toml
from mpisph.inputs.toml_lines import line_numbers
from mpisph.study.model import Value, model_problems

CHECKS = (
    "unstable",
    "falls",
    "grows",
    "grows_by_less",
    "step",
    "alike",
    "all_unstable",
    "smaller",
    "larger",
    "errors",
    "outside",
    "inside",
    "ranges",
)
"""Names of the computations that decide claims; see `checks`."""


class Condition(FrozenModel):
    """Which cases are meant: all that is given must hold."""

    at: dict[Identifier, Value] = Field(default_factory=dict)
    """Columns that must have these values."""
    but: dict[Identifier, Value] = Field(default_factory=dict)
    """Columns that must not have these values."""
    at_least: dict[Identifier, float] = Field(default_factory=dict)
    """Columns that must not be smaller."""
    at_most: dict[Identifier, float] = Field(default_factory=dict)
    """Columns that must not be larger."""

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
    """The computation, one of `CHECKS`."""
    where: Condition = Condition()
    """The cases that are looked at."""
    regions: tuple[Condition, ...] = ()
    """Cases of which something is claimed: those of any region."""
    along: Identifier | None = None
    """Parameter whose influence is claimed."""
    reference: dict[Identifier, Value] = Field(default_factory=dict)
    """Cases that the others are compared with."""
    columns: tuple[Identifier, ...] = ()
    """Columns of the table that are compared."""
    bands: dict[Identifier, tuple[float, float]] = Field(default_factory=dict)
    """For each variant the smallest and the largest figure that is expected."""
    clock: Literal["nominal", "offset", "fitted"] = "nominal"
    """Reading of the clock for the total error."""
    limit: float = 0.0
    """What the figure may not pass; its meaning is the check's."""


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

    @model_validator(mode="after")
    def _check_names(self) -> ClaimsFile:
        for claim in self.claims:
            for attempt in claim.tries:
                if attempt.check not in CHECKS:
                    raise ValueError(
                        f"claim {claim.number}: no check {attempt.check}; expected one "
                        f"of {', '.join(CHECKS)}"
                    )
        return self


def load_claims(path: Path) -> ClaimsFile:
    """Read a file of claims.

    Raises
    ------
    CaseError
        With every mistake of the file.
    """
    text, data = read_toml(path)
    try:
        return ClaimsFile.model_validate(data)
    except ValidationError as error:
        origins = Origins(str(path), line_numbers(text), {})
        raise CaseError(model_problems(error, origins)) from None
