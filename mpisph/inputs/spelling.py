"""The known name that a mistyped one looks most like."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


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
