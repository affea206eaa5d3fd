"""All problems, quick: nothing fails but what is known to, and that does."""

import pytest
from mpi4py import MPI

from mpisph.verify.problems import PROBLEMS
from mpisph.verify.runner import verify_one

FAULTS = {
    "sod": {
        "pressure at the contact, error beyond its first layers",
        "velocity behind the shock",
    },
    "strong-tube": {
        "pressure at the contact, error beyond its first layers",
        "pressure behind the shock",
        "density behind the shock",
        "mean error of the density over its jump",
    },
    "noh-planar": {"density behind the shock", "density, worst layer"},
    "noh-cylindrical": {
        "density behind the shock",
        "density, worst layer",
        "place of the shock",
    },
    "noh-spherical": {
        "density behind the shock",
        "density, worst layer",
        "place of the shock",
    },
    "sedov": {"peak density", "place of the shock", "mean error of the density"},
    "plates": {"mie-grueneisen 3 km/s: energy nearer to the contact"},
    "precursor": {"stress between the waves (elastic limit)"},
    "taylor": {"plastic work over kinetic energy"},
    "taylor-johnson-cook": {"temperature there with viscous heat"},
    "verney": {
        "square, 6 cm: inner radius where it is farthest off",
        "square, 6 cm: outer radius where it is farthest off",
    },
}
"""Checks that fail, by problem: what the scheme does not reach."""


@pytest.mark.slow
@pytest.mark.parametrize("name", PROBLEMS)
def test_a_problem_fails_where_it_is_known_to(name, tmp_path):
    verdict = verify_one(PROBLEMS[name], MPI.COMM_SELF, tmp_path, quick=True)
    assert not verdict.reason
    assert set(verdict.failed) == FAULTS.get(name, set())
