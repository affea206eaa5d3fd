"""Noh's problem at an axis: a rod whose gas streams inwards."""

from mpisph.verify.exact.riemann import GasState
from mpisph.verify.gas import KM_S, GasBody
from mpisph.verify.noh import Stream, noh_problem

_ROD = {
    "shape": "cylinder",
    "radius": 1.0,
    "position": -0.65,
    "length": 1.3,
    "radial_velocity": -KM_S,
}

PROBLEM = noh_problem(
    Stream(
        name="noh-cylindrical",
        title="Noh's problem, cylindrical",
        dimensions=2,
        bodies=[GasBody(_ROD, GasState(1.0, 0.0, 0.0))],
        look=0.06,
    )
)
