"""The material cards that come with mpisph, one TOML file each."""

from __future__ import annotations

import tomllib
from functools import cache, lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from mpisph.core.errors import CaseError, Problem
from mpisph.inputs.findings import Origins, model_problems
from mpisph.inputs.spelling import nearest_quoted
from mpisph.inputs.toml_file import read_toml
from mpisph.inputs.toml_lines import line_numbers
from mpisph.materials.model import Material
from mpisph.materials.table_files import embed_table


@lru_cache(maxsize=1)
def card_names() -> tuple[str, ...]:
    """Return the names of all cards, sorted."""
    folder = resources.files("mpisph.materials") / "cards"
    files = (entry.name for entry in folder.iterdir())
    return tuple(sorted(f.removesuffix(".toml") for f in files if f.endswith(".toml")))


def card_data(name: str) -> dict[str, Any]:
    """Return a card as it is written, with its sources.

    Parameters
    ----------
    name : str
        Name of the card, such as ``"al-6061-t6"``.

    Returns
    -------
    dict
        The card's table.

    Raises
    ------
    CaseError
        If there is no such card; the error names the nearest one.
    """
    if name not in card_names():
        known = ", ".join(card_names())
        raise CaseError(
            [
                Problem(
                    f"no such material card; there are {known}",
                    key="material",
                    value=f'"{name}"',
                    suggestion=nearest_quoted(name, card_names()),
                )
            ]
        )
    return {"name": name, **_read_card(name)}


@cache
def _read_card(name: str) -> dict[str, Any]:
    # Read once: a study may have many thousands of cases.
    file = resources.files("mpisph.materials") / "cards" / f"{name}.toml"
    return tomllib.loads(file.read_text(encoding="utf-8"))


def load_card(name: str) -> Material:
    """Return the material of a card.

    Parameters
    ----------
    name : str
        Name of the card, such as ``"al-6061-t6"``.

    Returns
    -------
    Material
        Its constants in SI, with a source for every number.

    Raises
    ------
    CaseError
        If there is no such card.
    """
    return Material.model_validate(card_data(name))


def read_card(path: Path) -> Material:
    """Return the material of a card of one's own.

    Parameters
    ----------
    path : Path
        A TOML file of the form of the cards that come with mpisph.

    Raises
    ------
    CaseError
        If it cannot be read, or with every mistake and its line.
    """
    text, data = read_toml(path)
    try:
        card = embed_table({**data, "name": path.stem}, path.parent)
        return Material.model_validate(card)
    except ValidationError as error:
        origins = Origins(str(path), line_numbers(text), {})
        raise CaseError(model_problems(error, origins)) from None
