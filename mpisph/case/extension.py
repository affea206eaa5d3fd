"""Cases that continue others: what may change in a run that goes on longer."""

from __future__ import annotations

import tomllib

from mpisph.case.identity import differences
from mpisph.case.load import case_from_dict
from mpisph.case.model import Case
from mpisph.core.errors import CaseError, Problem

__all__ = ["EXTENDING", "extended_case", "is_extension"]

EXTENDING = ("time.end", "output.times", "output.every")
"""Keys that may change in a run that is extended, besides those that may change in any
run under way. No step so far depends on them where all output times so far stay."""


def extended_case(old: Case, new: Case) -> Case:
    """Return the case with which a run of one case continues as another.

    A step before an output time is shortened to meet it. So all output times of the old
    case stay, its end among them: those that the new case would not have by itself are
    added to ``output.times``. Then a run of the new case from its beginning makes the
    same steps.

    Parameters
    ----------
    old : Case
        That of the run so far.
    new : Case
        That of the longer run; its times of output may leave out earlier ones.

    Returns
    -------
    Case

    Raises
    ------
    CaseError
        If the new case asks for anything else, or for output at an earlier time that
        the old one has not.
    """
    problems = [
        Problem(f"cannot change in a run that is extended ({difference})", key=key)
        for difference in differences(old, new)
        if not (key := difference.partition(":")[0]).startswith(EXTENDING)
    ]
    if new.end_time < old.end_time:
        text = f"a run that is to end at {old.end_time:.12g} s can only be made longer"
        problems.append(Problem(text, key="time.end", value=f"{new.end_time:.12g}"))
    if problems:
        raise CaseError(problems)
    missing = sorted({*old.output_times} - {*new.output_times})
    times = (*new.output.times, *missing)
    output = new.output.model_copy(update={"times": times})
    # Checked as a case that is read: there may be too many times.
    text = new.model_copy(update={"output": output}).to_toml()
    case = case_from_dict(tomllib.loads(text))
    case = case.model_copy(update={"initial": new.initial})  # its place is no text's
    if not is_extension(old, case):
        pairs = zip(case.output_times, old.output_times, strict=False)
        early = next(now for now, before in pairs if now != before)
        text = (
            f"no snapshot can be added at {early:.12g} s, before the end of the run; "
            "later times can be added as output.times"
        )
        raise CaseError([Problem(text, key="output")])
    return case


def is_extension(old: Case, new: Case) -> bool:
    """Say whether a run of one case, continued as another, is one of the other."""
    changed = [d.partition(":")[0] for d in differences(old, new)]
    before = new.output_times[: len(old.output_times)]
    return all(k.startswith(EXTENDING) for k in changed) and before == old.output_times
