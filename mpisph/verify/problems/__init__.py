"""The verification problems: one file each, with a ``PROBLEM``, listed here."""

from collections.abc import Sequence
from importlib import import_module

from mpisph.core.errors import InputError
from mpisph.inputs.spelling import nearest
from mpisph.verify.problem import Problem

_MODULES = [
    "constant_pressure",
    "uniform_expansion",
    "free_flight",
    "galilean_shift",
    "conservation",
    "sod",
    "strong_tube",
    "noh_planar",
    "noh_cylindrical",
    "noh_spherical",
    "sedov",
    "plates",
    "contact",
    "precursor",
    "spin",
    "rotation",
    "torus",
    "sphere",
    "tension",
    "static_tension",
    "necking",
    "verney",
    "taylor",
    "taylor_johnson_cook",
    "taylor_6061",
    "spall",
    "crater",
    "thin_plate",
]

PROBLEMS: dict[str, Problem] = {
    problem.name: problem
    for problem in (import_module(f"{__name__}.{m}").PROBLEM for m in _MODULES)
}
"""All problems by name, in the order in which they are run."""


def find_problems(names: Sequence[str]) -> list[Problem]:
    """Return the problems of these names, each once; all for no name.

    Raises
    ------
    InputError
        If there is no problem of a name; with the name that looks most like it.
    """
    unknown = [name for name in names if name not in PROBLEMS]
    if unknown:
        raise InputError("\n".join(_no_problem(name) for name in unknown))
    return [PROBLEMS[name] for name in dict.fromkeys(names or PROBLEMS)]


def _no_problem(name: str) -> str:
    near = nearest(name, PROBLEMS)
    hint = f"did you mean {near}?" if near else f"there are {', '.join(PROBLEMS)}"
    return f"no verification problem {name!r}; {hint}"
