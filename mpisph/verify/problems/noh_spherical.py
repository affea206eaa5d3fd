"""Noh's problem at a point: a ball whose gas streams inwards."""

from mpisph.verify.noh import Stream, noh_problem

PROBLEM = noh_problem(
    Stream(
        name="noh-spherical",
        title="Noh's problem, spherical",
        dimensions=3,
        shape={"shape": "sphere", "radius": 1.0},
        look=0.0,
    )
)
