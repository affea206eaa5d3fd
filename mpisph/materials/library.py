"""The material cards that come with mpisph, one TOML file each."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterable
from functools import lru_cache
from importlib import resources
from typing import Any

from mpisph.core.errors import CaseError, Problem
from mpisph.materials.model import Material

__all__ = ["card_data", "card_names", "load_card", "nearest", "nearest_quoted"]


def nearest(word: str, known: Iterable[str]) -> str | None:
    """Return the known name that looks most like `word`, or None."""
    names = {name.lower(): name for name in known}
    typed = word.lower()
    matches = difflib.get_close_matches(typed, list(names), n=3, cutoff=0.6)

    def likeness(name: str) -> tuple[float, bool]:
        # Of equally like names, swapped letters (nhp, nph) are the likelier slip.
        ratio = difflib.SequenceMatcher(None, name, typed).ratio()
        return ratio, sorted(name) == sorted(typed)

    return names[max(matches, key=likeness)] if matches else None


def nearest_quoted(word: str, known: Iterable[str]) -> str | None:
    """Return the known name that looks most like `word`, in quotes, or None."""
    name = nearest(word, known)
    return None if name is None else f'"{name}"'


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
    file = resources.files("mpisph.materials") / "cards" / f"{name}.toml"
    return {"name": name, **tomllib.loads(file.read_text(encoding="utf-8"))}


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
