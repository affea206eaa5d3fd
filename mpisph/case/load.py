"""Reading a case from a TOML file or a dict."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from mpisph.case.card_files import embed_card_files, embed_tables
from mpisph.case.initial import read_initial, with_particles
from mpisph.case.model import Case
from mpisph.case.problems import case_problems
from mpisph.case.sections import Initial
from mpisph.case.shield import expand_shield, name_materials, shield_findings
from mpisph.core.errors import CaseError, Problem
from mpisph.inputs.findings import Key, Origins, as_problems, integer_problems
from mpisph.inputs.overrides import apply_override
from mpisph.inputs.toml_file import read_toml
from mpisph.inputs.toml_lines import line_numbers

__all__ = ["CaseSource", "case_from_dict", "load_case"]


def load_case(path: str | PathLike[str], overrides: Sequence[str] = ()) -> Case:
    """Read a case from a TOML file.

    Parameters
    ----------
    path : path
        The file.
    overrides : sequence of str
        Changes ``key=value``, applied in their order: the key is dotted, a body
        is meant by its index or its name, and an empty value removes the key.

    Returns
    -------
    Case
        The case, with all defaults and materials filled in.

    Raises
    ------
    CaseError
        If the file cannot be read, is no TOML, or describes no sound case; with
        every problem, its line and what was expected.
    """
    return CaseSource(Path(path)).case(overrides)


class CaseSource:
    """A case file that has been read, of which variants can be made.

    Parameters
    ----------
    path : Path

    Raises
    ------
    CaseError
        If the file cannot be read or is no TOML.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        text, self._data = read_toml(path)
        self._lines = line_numbers(text)

    def clash(self, overrides: Sequence[str]) -> tuple[str, str] | None:
        """Return the first two changes of one key, if there are any.

        They may spell it in two ways: a body has a name and a number.
        """
        data = copy.deepcopy(self._data)
        seen: dict[Key, str] = {}
        for override in overrides:
            key, problem = apply_override(data, override)
            if problem is None and key in seen:
                return seen[key], override
            seen[key] = override
        return None

    def case(self, overrides: Sequence[str] = ()) -> Case:
        """Return the case with some keys changed; see `load_case`.

        Raises
        ------
        CaseError
            If that is no sound case; with every problem.
        """
        data = copy.deepcopy(self._data)
        overridden: dict[Key, str] = {}
        problems = []
        for override in overrides:
            key, problem = apply_override(data, override)
            if problem is None:
                overridden[key] = override
            else:
                problems.append(problem)
        origins = Origins(str(self.path), self._lines, overridden)
        return _build(data, origins, problems, self.path.parent)


def case_from_dict(data: Mapping[str, Any], folder: Path = Path()) -> Case:
    """Make a case from a dict of the form of a case file.

    Parameters
    ----------
    data : mapping
        What ``tomllib`` would read from a case file.
    folder : Path, optional
        From which the files that it names count; by default the current folder.

    Returns
    -------
    Case
        The case, with all defaults and materials filled in.

    Raises
    ------
    CaseError
        If the dict describes no sound case; with every problem.
    """
    return _build(data, Origins(None, {}, {}), [], folder)


def _build(
    data: Mapping[str, Any],
    origins: Origins,
    problems: list[Problem],
    folder: Path,
) -> Case:
    problems = problems + as_problems(shield_findings(data), data, origins)
    data, no_tables = embed_tables(expand_shield(data), folder)
    data, origins, unread = embed_card_files(data, folder, origins)
    data = name_materials(data)
    unread += no_tables
    problems = problems + unread
    long_integers = integer_problems(data, origins)
    if unread or long_integers:
        raise CaseError(problems + long_integers)
    try:
        case = Case.model_validate(data)
    except ValidationError as error:
        problems = problems + case_problems(data, error, origins)
        raise CaseError(problems) from None
    if problems:
        raise CaseError(problems)
    return case if case.initial is None else _with_initial(case, case.initial, folder)


def _with_initial(case: Case, initial: Initial, folder: Path) -> Case:
    """Return a case with the place, digest and number of its initial particles.

    A case that has the latter is not read for them: a run checks them at its start.
    """
    place = initial.model_copy(update={"file": str((folder / initial.file).absolute())})
    case = case.model_copy(update={"initial": place})
    if initial.digest is not None and initial.particles is not None:
        return case
    return with_particles(case, read_initial(case), Path(place.file))
