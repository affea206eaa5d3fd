"""Noh's problem at an axis: a rod whose gas streams inwards."""

from mpisph.verify.noh import Stream, noh_problem

PROBLEM = noh_problem(
    Stream(
        name="noh-cylindrical",
        title="Noh's problem, cylindrical",
        dimensions=2,
        shape={"shape": "cylinder", "radius": 1.0, "position": -0.65, "length": 1.3},
        look=0.06,
    )
)
