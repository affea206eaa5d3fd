"""Axisymmetric smoothed-particle hydrodynamics for hypervelocity impact.

``open`` opens the folder of a run, ``load_case`` reads a case file, and ``run`` runs a
case. Each is loaded when it is first used: importing the package starts no MPI.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mpisph.analysis.opened_run import open_run as open
    from mpisph.case import Case, case_from_dict, load_case
    from mpisph.run.session import run as run

__version__ = "0.1.0"

__all__ = ["Case", "__version__", "case_from_dict", "load_case", "open", "run"]

_PLACES = {
    "Case": "mpisph.case:Case",
    "case_from_dict": "mpisph.case:case_from_dict",
    "load_case": "mpisph.case:load_case",
    "open": "mpisph.analysis.opened_run:open_run",
    "run": "mpisph.run:",
}


def __getattr__(name: str) -> Any:
    """Return a public function, loaded when it is first used."""
    if name not in _PLACES:
        raise AttributeError(f"module 'mpisph' has no attribute {name!r}")
    module, _, attribute = _PLACES[name].partition(":")
    found = importlib.import_module(module)
    return getattr(found, attribute) if attribute else found


def __dir__() -> list[str]:
    """Return the public names."""
    return sorted({*globals(), *__all__})
