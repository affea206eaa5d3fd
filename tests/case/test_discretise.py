import hashlib
import math
import time
import tracemalloc

import numpy as np
import pytest
from launch import CASES

from mpisph.case import case_from_dict, load_case
from mpisph.case.bodies import particle_count
from mpisph.case.discretise import discretise, initial_count

RHO = 2710.0


def sphere(**changes):
    body = {"shape": "sphere", "name": "ball", "radius": 0.005}
    return {**body, "material": "al-lee2003", **changes}


def shell(**changes):
    body = {"shape": "spherical_shell", "name": "shell", "outer_radius": 0.005}
    return {**body, "inner_radius": 0.003, "material": "al-lee2003", **changes}


def plate(**changes):
    body = {"shape": "plate", "name": "wall", "thickness": 0.002, "radius": 0.02}
    return {**body, "material": "al-lee2003", "position": 0.01, **changes}


def make(bodies, **resolution):
    data = {"title": "t", "bodies": bodies, "time": {"end": 1e-6}}
    return case_from_dict({**data, "resolution": resolution or {"npr": 10}})


def started(middle, dx):
    """Where rings of a lattice start (R1)."""
    return middle + dx**2 / (24.0 * middle) + 0.00767 * dx**6 / (24.0 * middle**5)


def test_small_sphere_by_hand():
    p = discretise(make([sphere(position=0.001)], npr=2))
    # Of the 2 x 4 lattice points the two corners lie outside.
    dx = 0.0025
    z = np.array([-1.5, -0.5, -0.5, 0.5, 0.5, 1.5]) * dx + 0.001
    middle = np.array([0.5, 0.5, 1.5, 0.5, 1.5, 0.5]) * dx
    np.testing.assert_allclose(p.r, started(middle, dx))
    np.testing.assert_allclose(p.z, z)
    np.testing.assert_allclose(p.m, 2.0 * np.pi * middle * RHO * dx**2)


@pytest.mark.parametrize("npr", [1, 4, 10, 37])
def test_sphere_count_is_the_number_of_lattice_points(npr):
    half = np.arange(npr) + 0.5
    quarter = np.count_nonzero(half[:, None] ** 2 + half**2 <= npr**2)
    assert discretise(make([sphere()], npr=npr)).id.size == 2 * quarter


@pytest.mark.parametrize(
    ("body", "volume"),
    [
        (sphere(), 4.0 / 3.0 * math.pi * 0.005**3),
        (shell(), 4.0 / 3.0 * math.pi * (0.005**3 - 0.003**3)),
    ],
)
def test_round_mass_converges(body, volume):
    def error(npr):
        # The error jitters with the lattice; average it over a range of npr.
        ratios = [
            discretise(make([body], npr=n)).m.sum() / (RHO * volume)
            for n in range(npr, npr + npr // 2)
        ]
        return np.mean(np.abs(np.array(ratios) - 1.0))

    coarse, fine = error(10), error(80)
    assert coarse < 0.02
    # At least first order: eight times finer, at least eight times better.
    assert fine < coarse / 8.0


@pytest.mark.parametrize("spacing", [0.0003, 0.0007, 0.0039])
def test_plate_and_cylinder_mass_is_exact(spacing):
    rod = {"shape": "cylinder", "name": "rod", "radius": 0.003, "length": 0.02}
    rod = {**rod, "inner_radius": 0.001, "position": -0.05, "material": "cu-ofhc"}
    hollow = plate(inner_radius=0.004)
    p = discretise(make([hollow, rod], spacing=spacing))
    mass = np.bincount(p.body, weights=p.m)
    area = math.pi * np.array([0.02**2 - 0.004**2, 0.003**2 - 0.001**2])
    volume = area * np.array([0.002, 0.02])
    np.testing.assert_allclose(mass, volume * [RHO, 8930.0], rtol=1e-13)


def test_plate_cells():
    p = discretise(make([plate()], spacing=0.0007))
    # 2 / 0.7 rounds to 3 layers, 20 / 0.7 to 29 rings.
    assert p.id.size == 3 * 29
    dx = 0.02 / 29
    middle = (np.arange(29) + 0.5) * dx
    np.testing.assert_allclose(np.unique(p.r), started(middle, dx))
    expected = 0.01 + (np.arange(3) + 0.5) * 0.002 / 3
    np.testing.assert_allclose(p.z[::29], expected)


def test_a_thin_plate_has_one_layer():
    p = discretise(make([plate()], spacing=0.0038))
    assert set(p.z) == {0.011}


def test_ids_run_body_by_body_along_z_then_r():
    bodies = [sphere(position=-0.005), plate(), shell(position=0.05)]
    p = discretise(make(bodies, npr=10))
    np.testing.assert_array_equal(p.id, np.arange(p.id.size))
    assert np.all(np.diff(p.body) >= 0)
    for body in range(3):
        mine = p.body == body
        order = np.lexsort((p.r[mine], p.z[mine]))
        np.testing.assert_array_equal(order, np.arange(mine.sum()))


def test_fields_come_from_the_bodies():
    bodies = [
        sphere(position=-0.005, velocity="6 km/s"),
        plate(material="cu-ofhc"),
        shell(position=0.05, eos="tillotson", velocity=-1.0),
    ]
    case = make(bodies)
    p = discretise(case)
    np.testing.assert_array_equal(p.material, p.body)
    np.testing.assert_array_equal(p.u_z, np.array([6000.0, 0.0, -1.0])[p.body])
    np.testing.assert_array_equal(p.rho, np.array([RHO, 8930.0, RHO])[p.body])
    np.testing.assert_array_equal(p.h, case.smoothing_length)
    assert {p.id.dtype, p.body.dtype, p.material.dtype} == {np.dtype(np.int64)}
    floats = (p.m, p.r, p.z, p.u_z, p.rho, p.h)
    assert {field.dtype for field in floats} == {np.dtype(np.float64)}


def test_particles_stay_inside_and_off_the_axis():
    p = discretise(make([shell(position=0.02)], npr=23))
    distance = np.hypot(p.r, p.z - 0.02)
    assert distance.min() >= 0.003
    assert distance.max() <= 0.005
    assert p.r.min() > 0.0


def test_bodies_are_symmetric_about_their_middle():
    p = discretise(make([sphere()], npr=13))
    np.testing.assert_array_equal(np.sort(-p.z), np.sort(p.z))


@pytest.mark.parametrize("npr", [8, 20, 100])
def test_estimate_is_near_the_count(npr):
    case = make([sphere(position=-0.005), plate(), shell(position=0.05)], npr=npr)
    count = discretise(case).id.size
    assert particle_count(case.bodies, case.spacing) == pytest.approx(count, rel=0.02)


@pytest.mark.parametrize("inner", [0.0, 0.2e-3, 2.13e-3, 4.4e-3])
@pytest.mark.parametrize("npr", [10, 17, 50])
def test_round_bodies_take_every_lattice_point_within(inner, npr):
    body = shell(inner_radius=inner) if inner else sphere()
    p = discretise(make([body], npr=npr))
    half = (np.arange(-npr, npr) + 0.5) * 0.005 / npr
    z, r = (a.ravel() for a in np.meshgrid(half, half[npr:], indexing="ij"))
    within = (np.hypot(r, z) >= inner) & (np.hypot(r, z) <= 0.005)
    r = started(r, 0.005 / npr)
    np.testing.assert_allclose(p.r, r[within], rtol=1e-14)
    np.testing.assert_allclose(p.z, z[within], rtol=1e-14)


def test_a_thin_shell_takes_little_memory():
    # The square around it has 2e10 lattice points.
    body = shell(outer_radius=1.0, inner_radius=0.99998)
    p = discretise(make([body], spacing=1e-5))
    assert p.id.size == pytest.approx(np.pi * 2e5, rel=0.01)


@pytest.mark.parametrize("inner", [1e-5, 0.3333e-3, 1.9e-3])
def test_the_thinnest_wall_allowed_holds_particles(inner):
    body = shell(inner_radius=inner, outer_radius=inner + 1e-4)
    assert discretise(make([body], spacing=1e-4 * (1 - 1e-9))).id.size > 0


def test_a_million_particles_take_a_second():
    case = make([sphere()], npr=800)
    start = time.process_time()
    assert discretise(case).id.size > 10**6
    assert time.process_time() - start < 5.0


def test_a_share_has_the_bits_that_its_particles_have_among_all():
    """Whatever the share is: within a row, across bodies, or nothing."""
    bodies = [sphere(position=-0.005), plate(inner_radius=1e-3), shell(position=0.05)]
    case = make(bodies, npr=9)
    everything = discretise(case)
    n = everything.id.size
    assert initial_count(case) == n
    for first, end in [(0, n), (0, 1), (n - 1, n), (3, 3), (n, n), (7, 300), (100, n)]:
        share = discretise(case, first, end)
        fields = share.fields()
        assert fields.keys() == everything.fields().keys()
        for name, whole in everything.fields().items():
            assert fields[name].dtype == whole.dtype
            assert fields[name].tobytes() == whole[first:end].tobytes()


def test_a_share_takes_memory_for_itself_alone():
    case = make([sphere()], npr=1500)
    tracemalloc.start()
    share = discretise(case, 1_000_000, 1_001_000)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert share.id.size == 1000
    assert initial_count(case) > 3_000_000
    assert peak < 1e6, "3000 rows, 1000 particles"


def test_a_porous_body_starts_with_its_pores():
    """With the mass that is left of the solid's."""
    pores = {"initial_distension": 2.5, "elastic_pressure": 0.0}
    table = {"porosity": "p-alpha", "p-alpha": pores | {"solid_pressure": 1e8}}
    data = {"title": "t", "bodies": [sphere(), plate(material="al-6061-t6")]}
    data |= {"time": {"end": 1e-6}, "resolution": {"npr": 5}}
    solid = discretise(case_from_dict(data))
    porous = discretise(case_from_dict(data | {"materials": {"al-6061-t6": table}}))
    assert "distension" not in solid.history
    share = np.where(porous.body == 1, 1.0 / 2.5, 1.0)
    np.testing.assert_allclose(porous.rho, share * solid.rho, rtol=1e-15)
    np.testing.assert_allclose(porous.m, share * solid.m, rtol=1e-15)
    np.testing.assert_array_equal(porous.history["distension"], 1.0 / share)


def digest(p):
    """Of all bits of all particles, in their order."""
    arrays = list(p.fields().values())
    return hashlib.sha256(b"".join(a.tobytes() for a in arrays)).hexdigest()[:16]


ROD = {"shape": "cylinder", "name": "rod", "radius": 0.003, "length": 0.02}
ROD |= {"inner_radius": 0.7e-3, "position": -0.05, "material": "cu-ofhc"}


@pytest.mark.parametrize(
    ("body", "spacing", "expected"),
    [
        (sphere(position=-0.005, velocity=6680.0), 3.1e-5, "02f880105523795a"),
        (shell(position=0.7e-3, inner_radius=3.1e-3), 1.3e-4, "05290d811e8ec148"),
        (plate(inner_radius=1.3e-3, velocity=-1.0), 1.3e-4, "d5937d69cc97c8be"),
        (ROD, 3.1e-5, "e758013cf2f86310"),
    ],
    ids=lambda value: value.get("shape") if isinstance(value, dict) else "",
)
def test_no_bit_of_a_body_changes(body, spacing, expected):
    assert digest(discretise(make([body], spacing=spacing, nph=2.0))) == expected


@pytest.mark.parametrize(
    ("name", "overrides", "expected"),
    [
        ("paper-base-case", [], "d40de4e292bbcd87"),
        ("piekutowski-4-1283", [], "e8c36af131e838b0"),
        ("piekutowski-4-1291", [], "14c32c324d399e58"),
        ("piekutowski-4-1352", [], "b711c480edb2e80c"),
        ("piekutowski-4-1353", [], "41ec8c21e8eb2506"),
        ("piekutowski-4-1353", ["resolution.npr=131"], "e774eece66b5f8b7"),
        ("plate-impact", [], "20e5dbbc6438c7b2"),
    ],
)
def test_no_bit_of_a_shipped_case_changes(name, overrides, expected):
    particles = discretise(load_case(CASES / f"{name}.toml", overrides))
    assert digest(particles) == expected
