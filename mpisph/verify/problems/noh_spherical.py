"""Noh's problem at a point: a ball whose gas streams inwards."""

from mpisph.verify.exact.riemann import GasState
from mpisph.verify.gas import KM_S, GasBody
from mpisph.verify.noh import Stream, noh_problem

_BALL = {"shape": "sphere", "radius": 1.0, "radial_velocity": -KM_S}

PROBLEM = noh_problem(
    Stream(
        name="noh-spherical",
        title="Noh's problem, spherical",
        dimensions=3,
        bodies=[GasBody(_BALL, GasState(1.0, 0.0, 0.0))],
        look=0.0,
    )
)
