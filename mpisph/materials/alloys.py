"""Alloys as reports of tests name them: the cards that stand for them, their yield."""

from __future__ import annotations

import re
import tomllib
from functools import cache
from importlib import resources
from typing import NamedTuple

from mpisph.materials.library import card_names

__all__ = ["KSI", "Alloy", "alloys", "card_yield", "find_alloy"]

KSI = 6.894757e6
"""A thousand pounds a square inch [Pa]."""


class Alloy(NamedTuple):
    """An alloy of the table.

    Attributes
    ----------
    name : str
        As reports give it, such as ``AA6061-T6``; of what is no alloy of the table, the
        name of its card.
    card : str
        The material card that stands for it.
    stand_in : str
        Why another alloy's card does; empty where it is its own.
    yield_strength : float or None
        Stress at 0.2 % plastic strain [Pa], where it is listed.
    """

    name: str
    card: str
    stand_in: str
    yield_strength: float | None


@cache
def alloys() -> tuple[Alloy, ...]:
    """Return all alloys of the table, by name."""
    file = resources.files("mpisph.materials") / "alloys.toml"
    entries = tomllib.loads(file.read_text(encoding="utf-8"))
    found = []
    for name, entry in entries.items():
        ksi = entry.get("yield_ksi")
        strength = None if ksi is None else ksi * KSI
        found.append(Alloy(name, entry["card"], entry.get("stand_in", ""), strength))
    return tuple(sorted(found))


def find_alloy(name: str) -> Alloy | None:
    """Return the alloy that a name means, None where there is none.

    Parameters
    ----------
    name : str
        ``AA6061-T6``, ``Al 6061-T6`` and ``6061 T6`` are one; so are the names of
        cards, of any material.
    """
    if name.strip() in card_names():
        return Alloy(name.strip(), name.strip(), "", card_yield(name.strip()))
    wanted = _plain(name)
    return next((alloy for alloy in alloys() if _plain(alloy.name) == wanted), None)


def card_yield(card: str) -> float | None:
    """Return the yield strength of a card's own alloy [Pa], where it is listed."""
    own = (a for a in alloys() if a.card == card and not a.stand_in)
    return next((alloy.yield_strength for alloy in own), None)


def _plain(name: str) -> str:
    """Return a name without what reports write in different ways."""
    word = re.sub(r"[\s_-]+", "", name.casefold())
    return re.sub(r"^(?:aa|aluminium|aluminum|al)(?=\d)", "", word)
