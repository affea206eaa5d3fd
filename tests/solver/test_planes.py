"""Rigid planes: matter on one is one half of a symmetric collision."""

import numpy as np
import pytest
from mpi4py import MPI
from oracles import agree

from mpisph.case import case_from_dict
from mpisph.core.errors import CaseError
from mpisph.parallel.redistribution import gather_all
from mpisph.solver.start import start
from mpisph.solver.step import advance, reduce_state

ROD = {"shape": "cylinder", "radius": 4e-3, "length": 6e-3, "material": "al-6061-t6"}


def rod(name="rod", **changes):
    return {**ROD, "name": name, **changes}


def make(*bodies, **sections):
    resolution = {"spacing": 5e-4}
    time = {"end": 1e-6}
    data = {"title": "t", "bodies": list(bodies), "resolution": resolution}
    return case_from_dict({**data, "time": time, **sections})


def after_steps(case, comm, steps=40):
    sim = start(case, comm)
    for _ in range(steps):
        advance(sim, 1e-8, reduce_state(sim).rank_boxes)
    return gather_all(comm, sim.particles), reduce_state(sim).series


@pytest.mark.parametrize(("side", "plane"), [(1.0, "z_min"), (-1.0, "z_max")])
def test_a_rod_on_a_plane_r11_is_half_of_a_collision(side, plane):
    at = 0.0 if side > 0 else -6e-3
    mine = rod(position=at, velocity=-1e3 * side)
    other = rod("other", position=-6e-3 - at, velocity=1e3 * side)
    half, series = after_steps(make(mine, boundary={plane: 0.0}), MPI.COMM_SELF)
    both, _ = after_steps(make(mine, other), MPI.COMM_SELF)
    for name in ("r", "z", "u_r", "u_z", "rho", "E", "P", "S_rz", "h"):
        whole = getattr(both, name)
        np.testing.assert_allclose(
            getattr(half, name), whole[: half.n], atol=1e-13 * np.abs(whole).max()
        )
    assert (half.z * side).min() > 0.0
    energy = series["kinetic_energy"] + series["internal_energy"]
    assert energy == pytest.approx(0.5e6 * half.m.sum(), rel=1e-14)
    assert abs(half.u_z.mean()) < 700.0, "the plane has stopped some of it"


@pytest.mark.mpi(min_size=1)
def test_images_have_the_same_bits_on_any_number_of_ranks():
    comm = MPI.COMM_WORLD
    case = make(rod(velocity=-1e3), boundary={"z_min": 0.0, "z_max": 7e-3})
    mine, _ = after_steps(case, comm, 20)
    problems = []
    if comm.rank == 0:
        alone, _ = after_steps(case, MPI.COMM_SELF, 20)
        if mine.pack().tobytes() != alone.pack().tobytes():
            problems.append("other bits")
    agree(comm, problems)


def test_a_particle_that_crosses_a_plane_r11_is_reflected():
    """Far beyond the stable step nothing is left behind a plane."""
    case = make(rod(velocity=-1e3), boundary={"z_min": 0.0})
    sim = start(case, MPI.COMM_SELF)
    for _ in range(3):
        advance(sim, 3e-7, reduce_state(sim).rank_boxes)
    assert sim.particles.z.min() >= 0.0


@pytest.mark.parametrize(
    ("boundary", "words"),
    [
        ({"z_min": 1e-3}, 'z_min = 0.001: the body "rod" reaches 0.001 m through'),
        ({"z_max": "5 mm"}, 'the body "rod" reaches 0.001 m through the plane z = 0.0'),
        ({"z_min": 0.0, "z_max": 6e-3}, "expected at least 2 reaches of the kernel"),
    ],
)
def test_a_plane_needs_room_for_the_bodies(boundary, words):
    resolution = {"spacing": 5e-4, "nph": 3.0}
    with pytest.raises(CaseError) as caught:
        make(rod(), boundary=boundary, resolution=resolution)
    assert words in str(caught.value)


def test_a_body_touches_a_plane_though_its_place_is_rounded():
    above = 0.3 + 1e-12
    assert make(rod(position=0.3), boundary={"z_min": above}).boundary.z_min == above
    with pytest.raises(CaseError, match="through the plane"):
        make(rod(position=0.3), boundary={"z_min": 0.3 + 1e-6})
