"""Cases: what is run, read from TOML, checked and completed."""

from mpisph.case.bodies import Body, Cylinder, Plate, Sphere, SphericalShell
from mpisph.case.load import CaseSource, case_from_dict, load_case
from mpisph.case.model import Case
from mpisph.case.schema import case_schema

__all__ = [
    "Body",
    "Case",
    "CaseSource",
    "Cylinder",
    "Plate",
    "Sphere",
    "SphericalShell",
    "case_from_dict",
    "case_schema",
    "load_case",
]
