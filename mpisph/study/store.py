"""Where a study's runs lie, and how they stand.

Below one root, ``cases/<key>`` holds the run of every case, whichever studies it
belongs to, and ``studies/<name>`` the tables and figures of each study.
"""

from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Literal, NamedTuple, Protocol

from mpisph.io.standing import standing
from mpisph.study.model import Study

CASES_FOLDER = "cases"
STUDIES_FOLDER = "studies"

Standing = Literal["completed", "unstable", "failed", "stopped", "running", "to do"]

STANDINGS: tuple[Standing, ...] = (
    "completed",
    "unstable",
    "failed",
    "stopped",
    "running",
    "to do",
)


class Place(NamedTuple):
    """How the run of a case stands.

    Attributes
    ----------
    standing : str
        A run that was killed has ``stopped``.
    reason : str
        Why, where it did not complete.
    """

    standing: Standing
    reason: str


class Keyed(Protocol):
    """A case with a key, such as `StudyCase`."""

    @property
    def key(self) -> str:
        """See `case_key`."""


def case_folder(root: Path, case: Keyed) -> Path:
    """Return the folder of a case's run."""
    return root / CASES_FOLDER / case.key


def study_folder(root: Path, study: Study) -> Path:
    """Return the folder of a study's tables and figures."""
    return root / STUDIES_FOLDER / study.name


def look_up(folder: Path) -> Place:
    """Say how the run in a folder stands.

    Raises
    ------
    MpisphError
        If its status cannot be understood.
    """
    state, reason, _ = standing(folder)
    return Place("stopped", "killed") if state == "killed" else Place(state, reason)


def look_up_all(root: Path, cases: Iterable[Keyed]) -> list[Place]:
    """Say how each of a study's cases stands."""
    return [look_up(case_folder(root, case)) for case in cases]


def counts(places: list[Place]) -> dict[Standing, int]:
    """Count the cases of each standing, in the order of `STANDINGS`."""
    found = Counter(place.standing for place in places)
    return {standing: found[standing] for standing in STANDINGS}
