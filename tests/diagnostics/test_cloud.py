"""R12: cloud measures against figures worked out by hand or by brute force."""

import math

import numpy as np
import pytest
from launch import CASES
from mpi4py import MPI

from mpisph.case import case_from_dict, load_case
from mpisph.case.sections import Exposure
from mpisph.core.particles import Particles
from mpisph.diagnostics.cloud import (
    NEEDED,
    CloudDefinition,
    CloudMeasure,
    cloud_definition,
    cloud_size,
    compare,
    impact_direction,
    in_cloud,
    measure_arrays,
    measure_cloud,
    next_body,
    rear_face,
    target_plate,
)

SELF = MPI.COMM_SELF
DEFINITION = CloudDefinition(rear=4e-3, min_velocity=600.0, quantile=0.9)


def debris(n=400, seed=1):
    """Debris, a lip that hardly moves axially, and ejecta before the plate."""
    rng = np.random.default_rng(seed)
    p = Particles.zeros(n)
    p.id[:] = rng.permutation(n)
    p.m[:] = rng.uniform(1e-9, 5e-9, n)
    p.r[:] = rng.uniform(0, 15e-3, n)
    p.z[:] = rng.uniform(-5e-3, 30e-3, n)
    p.u_z[:] = rng.uniform(-2000, 6000, n)
    p.u_r[:] = rng.uniform(0, 3000, n)
    p.E[:] = rng.uniform(0, 1e7, n)
    return p


def arrays(p):
    return {name: getattr(p, name) for name in NEEDED}


def flipped(p):
    """Return the particles as seen from the other side."""
    q = p.take(np.arange(p.n))
    q.z[:], q.u_z[:] = -p.z, -p.u_z
    return q


def brute_force(p, d):
    """Measure with plain loops over Python numbers."""
    cloud = [i for i in range(p.n) if p.z[i] > d.rear and p.u_z[i] > d.min_velocity]

    def quantile(x):
        pairs = sorted((x(i), p.m[i]) for i in cloud)
        need = d.quantile * sum(m for _, m in pairs)
        have = 0.0
        for value, m in pairs:
            have += m
            if have >= need:
                return value
        return pairs[-1][0]

    front = max(cloud, key=lambda i: p.z[i])
    return CloudMeasure(
        max(p.r[i] for i in cloud),
        p.z[front] - d.rear,
        quantile(lambda i: p.r[i]),
        quantile(lambda i: p.z[i] - d.rear),
        p.u_z[front],
        math.fsum(p.m[i] for i in cloud),
    )


def test_cloud_leaves_out_lip_and_ejecta():
    z = np.array([5e-3, 5e-3, -1e-3, 4e-3])
    u_z = np.array([700.0, 500.0, 900.0, 900.0])
    body = np.zeros(4, np.int64)
    assert in_cloud(body, z, u_z, DEFINITION).tolist() == [True, False, False, False]


@pytest.mark.parametrize("quantile", [0.01, 0.5, 0.9, 0.99, 1.0])
def test_measure_r12_agrees_with_brute_force(quantile):
    p = debris()
    d = DEFINITION._replace(quantile=quantile)
    got = measure_arrays(arrays(p), d)
    assert got == pytest.approx(brute_force(p, d), rel=1e-14)


def test_full_quantile_is_the_outermost_particle():
    p = debris()
    d = DEFINITION._replace(quantile=1.0)
    got = measure_arrays(arrays(p), d)
    assert (got.radius_robust, got.length_robust) == (got.radius, got.length)


def test_one_stray_particle_moves_only_the_outermost_figure():
    p = debris()
    before = measure_arrays(arrays(p), DEFINITION)
    stray = np.flatnonzero(p.r == before.radius)[0]
    p.r[stray] *= 10
    after = measure_arrays(arrays(p), DEFINITION)
    assert after.radius == 10 * before.radius
    assert after.radius_robust == before.radius_robust


def test_order_of_particles_does_not_matter():
    p = debris()
    p.z[::3] = p.z[0] = 29e-3  # ties
    rng = np.random.default_rng(2)
    results = set()
    for _ in range(5):
        q = p.take(rng.permutation(p.n))
        results.add(measure_arrays(arrays(q), DEFINITION))
    assert len(results) == 1


@pytest.mark.parametrize("rear", [1.0, math.inf])
def test_no_cloud_measures_zero(rear):
    p = debris()
    d = DEFINITION._replace(rear=rear)
    assert measure_cloud(SELF, p, d) == (0.0,) * 6


def test_compare_gives_signed_fractions_and_leaves_gaps():
    measure = CloudMeasure(0.011, 0.018, 0.010, 0.017, 0.0, 0.0)
    exposure = Exposure(time=6e-6, radius=0.010, length=0.020, source="s")
    assert compare(measure, exposure) == pytest.approx((0.1, -0.1))
    assert compare(measure, exposure, "robust") == pytest.approx((0.0, -0.15))
    partial = Exposure(time=6e-6, length=0.020, source="s")
    assert compare(measure, partial) == (None, pytest.approx(-0.1))
    assert cloud_size(measure, "robust") == (0.010, 0.017)


def test_definition_of_the_shot():
    case = load_case(CASES / "piekutowski-4-1353.toml")
    assert rear_face(case) == pytest.approx(4.039e-3)
    assert case.impact_velocity == 6680.0
    assert cloud_definition(case) == CloudDefinition(
        pytest.approx(4.039e-3),
        pytest.approx(668.0),
        0.99,
        1.0,
        stirred=pytest.approx(66.8),
    )


def test_without_measurements_the_slowest_plate_is_the_target():
    case = load_case(CASES / "plate-impact.toml")
    assert rear_face(case) == pytest.approx(3e-3)
    assert cloud_definition(case) == CloudDefinition(
        pytest.approx(3e-3), pytest.approx(300.0), 0.99, 1.0, stirred=30.0
    )


def test_without_a_plate_nothing_lies_behind_it():
    case = load_case(CASES / "plate-impact.toml")
    case = case.model_copy(update={"bodies": ()})
    assert rear_face(case) == math.inf


def test_a_body_that_flies_along_minus_z_is_not_the_target():
    """The same impact seen from the other side has the same cloud."""
    case = load_case(CASES / "plate-impact.toml")
    flyer, target = case.bodies
    swapped = (
        target.model_copy(update={"position": -target.rear_face}),
        flyer.model_copy(
            update={"velocity": -flyer.velocity, "position": -flyer.rear_face}
        ),
    )
    mirrored = case.model_copy(update={"bodies": swapped})
    assert impact_direction(case) == 1.0
    assert impact_direction(mirrored) == -1.0
    assert rear_face(mirrored) == -rear_face(case)
    p = debris()
    there, here = cloud_definition(mirrored), cloud_definition(case)
    assert measure_arrays(arrays(flipped(p)), there) == measure_arrays(arrays(p), here)


@pytest.mark.mpi(min_size=1)
def test_measures_do_not_depend_on_the_number_of_ranks():
    comm = MPI.COMM_WORLD
    p = debris()
    want = measure_arrays(arrays(p), DEFINITION)
    for seed in range(3):
        # Rank 0 owns none where there are others.
        lowest = min(1, comm.size - 1)
        owner = np.random.default_rng(seed).integers(lowest, comm.size, p.n)
        mine = p.take(owner == comm.rank)
        assert measure_cloud(comm, mine, DEFINITION) == want


def shield(direction=1.0, order=1, moving=0.0, **measured):
    """A sphere, a bumper of two layers and two walls behind, from either side."""
    layers = (("front", 0.0, 1e-3), ("back", 1e-3, 1e-3), ("wall", 50e-3, 3e-3),
              ("witness", 80e-3, 1e-3))  # fmt: skip
    plates = [
        {
            "name": name,
            "shape": "plate",
            "thickness": thickness,
            "radius": 30e-3,
            "position": z if direction > 0.0 else -z - thickness,
            "velocity": moving * direction if name == "wall" else 0.0,
            "material": "al-6061-t6",
        }
        for name, z, thickness in layers
    ]
    sphere = {
        "name": "sphere",
        "shape": "sphere",
        "radius": 2e-3,
        "position": -2e-3 * direction,
        "velocity": 5e3 * direction,
        "material": "al-6061-t6",
    }
    return case_from_dict(
        {
            "title": "t",
            "bodies": [*plates, sphere][::order],
            "resolution": {"spacing": 0.25e-3},
            "time": {"end": 1e-5},
            **({"measured": measured} if measured else {}),
        }
    )


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize("order", [1, -1])
def test_the_cloud_lies_between_the_plate_that_is_hit_first_and_the_next(
    direction, order
):
    """Whatever the order in the file, and from which side; layers are one plate."""
    case = shield(direction, order)
    d = cloud_definition(case)
    assert target_plate(case).name == "back"
    assert next_body(case).name == "wall"
    assert (d.rear, d.direction) == (pytest.approx(2e-3 * direction), direction)
    assert d.stop == pytest.approx(48e-3)
    names = [body.name for body in case.bodies]
    behind = {name for name, u_z in zip(names, d.behind, strict=True) if u_z == 0.0}
    assert behind == {"wall", "witness"}
    assert shield(direction, order, min_velocity_fraction=0.2).measured.plate == "back"


def test_the_plate_named_is_that_from_which_the_cloud_is_measured():
    case = shield(plate="wall")
    assert next_body(case).name == "witness"
    assert cloud_definition(case).stop == pytest.approx(27e-3)
    assert next_body(shield(plate="witness")) is None


def test_matter_of_the_wall_is_no_cloud_and_its_stirring_ends_the_measures():
    case = shield(moving=-500.0)
    d = cloud_definition(case)
    assert d.stop == math.inf  # it moves: its place changes
    wall, sphere = (
        [b.name for b in case.bodies].index(name) for name in ("wall", "sphere")
    )
    p = debris()
    p.body[:] = sphere
    p.body[:100], p.u_z[:100], p.u_r[:100] = wall, -500.0, 0.0
    before = measure_arrays(arrays(p), d)
    assert before == measure_arrays(arrays(p.take(np.arange(100, p.n))), d)
    assert before.mass > 0.0
    p.u_z[7] += 40.0  # a hundredth of the impact velocity is 55
    assert measure_arrays(arrays(p), d) == before
    p.u_z[7] += 40.0
    assert all(map(math.isnan, measure_arrays(arrays(p), d)))


def test_the_measures_end_at_the_face_of_a_wall_at_rest():
    case = shield()
    d = cloud_definition(case)
    p = debris()
    p.body[:] = [b.name for b in case.bodies].index("sphere")
    front = np.argmax(np.where(p.u_z > d.min_velocity, p.z, -1.0))
    p.z[front] = 49.9e-3
    assert measure_arrays(arrays(p), d).length == pytest.approx(47.9e-3)
    p.z[front] = 50.1e-3
    assert all(map(math.isnan, measure_arrays(arrays(p), d)))
    assert all(map(math.isnan, measure_cloud(SELF, p, d)))
    p.u_z[front] = 0.0  # it stays in the crater
    assert all(map(math.isnan, measure_arrays(arrays(p), d)))
