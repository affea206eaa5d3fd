"""The keys of a study's cases, kept beside its tables.

A key takes the whole case, which takes 1 ms to make and check; a study may have 100 000
of them. To say how they stand takes the keys alone, which change with the files only.
"""

import hashlib
import json
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from mpisph.case import CaseSource
from mpisph.case.identity import case_key
from mpisph.core.errors import CaseError
from mpisph.io.files import write_text
from mpisph.io.run_folder import KEYS_FILE
from mpisph.study.model import Plan, Study, case_name, load_study, read_plans
from mpisph.study.store import STUDIES_FOLDER, study_folder

SAMPLE = 50
"""Keys that are computed again where they are kept: another version of mpisph, or a
file that a case names, may have changed."""


class KeyedCase(NamedTuple):
    """A case of a study by its key; see `model.StudyCase`."""

    variant: str
    settings: dict[str, Any]
    key: str

    def name(self) -> str:
        """Return the case's variant and settings for people."""
        return case_name(self.variant, self.settings)


def keep_keys(study: Study, root: Path) -> None:
    """Write the keys of a study's cases into its folder, which must exist.

    Raises
    ------
    OSError
        If they cannot be written.
    """
    plans = read_plans(study.path)[2]
    keys = [case.key for case in study.cases]
    text = json.dumps({"of": _digest(plans), "keys": keys})
    write_text(study_folder(root, study) / KEYS_FILE, text + "\n")


def keyed_cases(path: Path, root: Path) -> list[KeyedCase]:
    """Return the cases of a study by their keys, without making them if possible.

    Parameters
    ----------
    path : Path
        The study file.
    root : Path
        See `store`.

    Raises
    ------
    CaseError
        See `load_study`.
    """
    plans = read_plans(path)[2]
    folder = root / STUDIES_FOLDER / path.stem
    keys = _kept_keys(plans, folder / KEYS_FILE)
    if keys is None:
        study = load_study(path)
        keys = [case.key for case in study.cases]
        if folder.is_dir():
            with suppress(OSError):  # a folder that is not ours to write
                keep_keys(study, root)
    return [
        KeyedCase(plan.variant, plan.settings, key)
        for plan, key in zip(plans, keys, strict=True)
    ]


def _kept_keys(plans: Sequence[Plan], path: Path) -> list[str] | None:
    """Return the keys that are kept for these cases; None where they must be made."""
    try:
        kept = json.loads(path.read_text(encoding="utf-8"))
        keys = [str(key) for key in kept["keys"]]
        if kept["of"] != _digest(plans) or len(keys) != len(plans):
            return None
        step = max(len(plans) // SAMPLE, 1)
        for plan, key in list(zip(plans, keys, strict=True))[::step]:
            if case_key(CaseSource(plan.base).case(plan.overrides)) != key:
                return None
    except (OSError, ValueError, KeyError, TypeError, CaseError):
        return None
    return keys


def _digest(plans: Sequence[Plan]) -> str:
    """Return a digest of the files that a study varies, and of how.

    Raises
    ------
    OSError
        If one cannot be read.
    """
    bases = {plan.base: plan.base.read_bytes() for plan in plans}
    digest = hashlib.sha256(b"".join(bases.values()))
    for plan in plans:
        digest.update(f"{plan.base}\n{plan.overrides}\n".encode())
    return digest.hexdigest()
