"""Material cards of one's own, and tables of equations of state, named by files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mpisph.core.errors import CaseError, Problem
from mpisph.inputs.findings import Finding, Key, Origins, as_problems
from mpisph.inputs.toml_file import read_toml
from mpisph.inputs.toml_lines import line_numbers
from mpisph.materials.table_files import embed_table

__all__ = ["embed_card_files", "embed_tables"]

ENDING = ".toml"


def embed_card_files(
    data: Mapping[str, Any], folder: Path, origins: Origins
) -> tuple[Mapping[str, Any], Origins, list[Problem]]:
    """Put the cards that bodies name by files among the materials of a raw case.

    A body whose material is ``cards/steel.toml`` has the material ``steel`` then, and
    the case a table of it, as if that had been written there.

    Parameters
    ----------
    data : mapping
        The case as read from TOML, with overrides applied; it is not changed.
    folder : Path
        From which the files count.
    origins : Origins
        Where the keys come from.

    Returns
    -------
    data : mapping
    origins : Origins
        Which knows the lines of the cards too.
    problems : list of Problem
        Files that cannot be read, and names that are taken.
    """
    bodies, materials = data.get("bodies"), data.get("materials", {})
    if not isinstance(bodies, list | tuple) or not isinstance(materials, Mapping):
        return data, origins, []
    paths = [_card_path(body, folder) for body in bodies]
    if not any(paths):
        return data, origins, []
    cards = {path.stem: path for path in paths[::-1] if path is not None}
    findings = [
        Finding(("bodies", i, "material"), f"the name {path.stem} is taken: {taken}")
        for i, path in enumerate(paths)
        if path is not None and (taken := _taken(path, cards, materials))
    ]
    problems = as_problems(findings, data, origins)
    tables: dict[str, Any] = {}
    elsewhere: dict[Key, Origins] = {}
    for name, path in cards.items():
        try:
            content, card = read_toml(path)
            tables[name] = embed_table(card, path.parent)
        except CaseError as error:
            problems += error.problems
        else:
            lines = line_numbers(content)
            elsewhere["materials", name] = Origins(str(path), lines, {})
    renamed = [
        body if path is None else {**body, "material": path.stem}
        for body, path in zip(bodies, paths, strict=True)
    ]
    merged = {**data, "bodies": renamed, "materials": {**materials, **tables}}
    return merged, origins._replace(elsewhere=elsewhere), problems


def embed_tables(
    data: Mapping[str, Any], folder: Path
) -> tuple[Mapping[str, Any], list[Problem]]:
    """Put the tables that a raw case's own materials name by files into it.

    Parameters
    ----------
    data : mapping
        The case as read from TOML, with overrides applied; it is not changed.
    folder : Path
        From which the files count.

    Returns
    -------
    data : mapping
    problems : list of Problem
        Files that are no tables.
    """
    materials = data.get("materials", {})
    if not isinstance(materials, Mapping):
        return data, []
    merged, problems = dict(materials), []
    for name, material in materials.items():
        try:
            merged[name] = embed_table(material, folder)
        except CaseError as error:
            problems += error.problems
    return ({**data, "materials": merged} if materials else data), problems


def _taken(path: Path, cards: Mapping[str, Path], materials: Mapping[str, Any]) -> str:
    """Return who else has a card's name; empty for none."""
    if path.stem in materials:
        return f"the case has a table materials.{path.stem}"
    return "" if cards[path.stem] == path else f"by {cards[path.stem]}"


def _card_path(body: Any, folder: Path) -> Path | None:
    material = body.get("material") if isinstance(body, Mapping) else None
    if isinstance(material, str) and material.endswith(ENDING):
        return folder / material
    return None
