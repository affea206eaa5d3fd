"""Noh's problem in a plane: two streams along z that meet."""

from mpisph.verify.noh import Stream, noh_problem

PROBLEM = noh_problem(
    Stream(
        name="noh-planar",
        title="Noh's problem, planar",
        dimensions=1,
        shape={"shape": "cylinder", "radius": 0.65, "position": -1.0, "length": 2.0},
        look=0.06,
    )
)
