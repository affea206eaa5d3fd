"""Noh's problem in a plane: two streams along z that meet."""

from mpisph.verify.exact.riemann import GasState
from mpisph.verify.gas import GasBody
from mpisph.verify.noh import Stream, noh_problem

_ROD = {"shape": "cylinder", "radius": 0.65, "length": 1.0}

PROBLEM = noh_problem(
    Stream(
        name="noh-planar",
        title="Noh's problem, planar",
        dimensions=1,
        bodies=[
            GasBody({**_ROD, "position": -1.0}, GasState(1.0, 1.0, 0.0)),
            GasBody({**_ROD, "position": 0.0}, GasState(1.0, -1.0, 0.0)),
        ],
        look=0.06,
    )
)
