"""Bodies and gauges: sums and samples by hand, the same on any number of ranks."""

import math

import numpy as np
import pytest
from launch import CASES
from mpi4py import MPI
from oracles import agree, bits

from mpisph.case import load_case
from mpisph.case.discretise import discretise
from mpisph.case.sections import Boundary, Gauge
from mpisph.core.particles import Particles
from mpisph.diagnostics.probes import (
    BODY_QUANTITIES,
    GAUGE_QUANTITIES,
    body_columns,
    gauge_columns,
    nearest_particles,
    note_peaks,
    read_probes,
)
from mpisph.diagnostics.series import Scales

SELF = MPI.COMM_SELF
CASE = load_case(CASES / "piekutowski-4-1353.toml", ["resolution.npr=6"])
SCALES = Scales(mass=1.0, speed=1e4)
FIXED = (
    Gauge(name="inside", z=2e-3, r=10e-3),
    Gauge(name="axis", z=2e-3),
    Gauge(name="void", z=30e-3),
)
MOVING = (
    Gauge(name="tracer", kind="moving", z=2e-3, r=10e-3),
    Gauge(name="first", kind="moving", z=-4.765e-3),
)
GAUGES = (FIXED[0], MOVING[0], *FIXED[1:], MOVING[1])


def matter():
    """The bodies of the shot with fields that are linear in space."""
    start = discretise(CASE)
    p = Particles.zeros(start.id.size)
    for name in ("id", "body", "material", "m", "r", "z", "u_z", "rho", "h"):
        getattr(p, name)[:] = getattr(start, name)
    p.P[:] = 1e9 * (1.0 + 100.0 * p.z)
    p.E[:] = 1e5 * (1.0 + 20.0 * p.r)
    p.u_r[:] = 5e4 * p.r
    return p


def read(comm, p, gauges=GAUGES, boundary=CASE.boundary):
    peaks = np.full(2, -np.inf)
    note_peaks(p, peaks)
    followed = nearest_particles(comm, p, gauges)
    kappa = CASE.scheme.kappa
    return read_probes(
        comm, [p], peaks, gauges, followed, SCALES, kappa, boundary.planes
    )


def at(values, name):
    row = values.gauges[[gauge.name for gauge in GAUGES].index(name)]
    return dict(zip([q.name for q in GAUGE_QUANTITIES], row.tolist(), strict=True))


def test_bodies_are_sums_over_their_particles():
    p = matter()
    names = [q.name for q in BODY_QUANTITIES]
    for k, row in enumerate(read(SELF, p).bodies):
        q = p.take(p.body == k)
        assert dict(zip(names, row.tolist(), strict=True)) == {
            "mass": math.fsum(q.m),
            "momentum_z": math.fsum(q.m * q.u_z),
            "momentum_r": math.fsum(q.m * q.u_r),
            "kinetic_energy": math.fsum(0.5 * q.m * (q.u_r**2 + q.u_z**2)),
            "internal_energy": math.fsum(q.m * q.E),
            "peak_pressure": q.P.max(),
        }


def test_the_peak_is_the_largest_of_all_steps():
    p = matter()
    peaks = np.full(2, -np.inf)
    note_peaks(p, peaks)
    highest = p.P[p.body == 1].max()
    p.P[:] = 0.0
    note_peaks(p, peaks)
    assert peaks[1] == highest


def test_a_fixed_gauge_is_a_weighted_mean_of_what_is_around():
    values = read(SELF, matter())
    found = at(values, "inside")
    assert (found["z"], found["r"]) == (2e-3, 10e-3)
    assert found["P"] == pytest.approx(1.2e9, rel=2e-3)  # at the middle of the plate
    assert found["E"] == pytest.approx(1.2e5, rel=2e-3)
    assert found["u_r"] == pytest.approx(500.0, rel=0.01)
    assert found["rho"] == pytest.approx(2710.0)
    assert found["u_z"] == pytest.approx(0.0, abs=1e-6)


def test_on_the_axis_the_other_side_counts():
    found = at(read(SELF, matter()), "axis")
    assert found["u_r"] == pytest.approx(0.0, abs=1e-9)
    assert 1e9 < found["P"] < 1.2e9  # the sphere touches there


def test_at_a_plane_the_images_count():
    """The matter stands still across the plane, and is covered wholly."""
    p = matter()
    p.u_z[:] = 100.0
    gauges = [Gauge(name="wall", z=0.0, r=10e-3), Gauge(name="behind", z=-1e-6, r=0.01)]
    behind_sphere = p.z >= 0.0
    p.h[~behind_sphere] = 1e-9  # it lies behind the plane
    free = read(SELF, p, gauges).gauges[0]
    wall, behind = read(SELF, p, gauges, Boundary(z_min=0.0)).gauges
    u_z, rho = (list(q.name for q in GAUGE_QUANTITIES).index(n) for n in ("u_z", "rho"))
    assert free[u_z] == pytest.approx(100.0)
    assert abs(wall[u_z]) < 1e-9
    assert wall[rho] == pytest.approx(free[rho])
    assert np.isnan(behind[u_z])


def test_where_there_is_no_matter_there_is_no_number():
    found = at(read(SELF, matter()), "void")
    assert (found["z"], found["r"]) == (30e-3, 0.0)
    assert all(math.isnan(found[name]) for name in ("P", "rho", "E", "u_z", "u_r"))


def test_a_moving_gauge_reads_its_particle_wherever_that_is():
    p = matter()
    followed = nearest_particles(SELF, p, GAUGES)
    assert set(followed) == {"tracer", "first"}
    who = followed["tracer"]
    k = int(np.flatnonzero(p.id == who)[0])
    assert math.hypot(p.r[k] - 10e-3, p.z[k] - 2e-3) < CASE.spacing
    assert p.body[np.flatnonzero(p.id == followed["first"])] == 0
    p.z[k], p.P[k] = 0.7, -3.25
    peaks = np.zeros(2)
    values = read_probes(
        SELF, [p], peaks, GAUGES, followed, SCALES, 3.0, CASE.boundary.planes
    )
    found = at(values, "tracer")
    assert (found["z"], found["P"], found["r"]) == (0.7, -3.25, p.r[k])


def test_columns_are_as_many_as_the_values():
    values = read(SELF, matter())
    assert len(body_columns(["a", "b"])) == values.bodies.size
    assert len(gauge_columns([g.name for g in GAUGES])) == values.gauges.size
    assert body_columns(["a"])[1] == "momentum_z_a_kg_m_per_s"
    assert gauge_columns(["g"])[3] == "rho_g_kg_per_m3"


@pytest.mark.mpi(min_size=1)
def test_probes_have_the_same_bits_on_any_ranks():
    comm = MPI.COMM_WORLD
    p = matter()
    want = read(SELF, p)
    problems = []
    for seed in range(3):
        lowest = min(1, comm.size - 1)  # rank 0 owns none where there are others
        owner = np.random.default_rng(seed).integers(lowest, comm.size, p.n)
        got = read(comm, p.take(owner == comm.rank))
        for one, other in zip(got, want, strict=True):
            if not np.array_equal(bits(one.ravel()), bits(other.ravel())):
                problems.append(f"{one - other}")
    agree(comm, problems)
