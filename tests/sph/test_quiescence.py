"""Matter at rest: skipped only where nothing in reach could move it, and rightly so."""

import numpy as np
import pytest
from oracles import ALUMINIUM, SCHEME, bits, evaluate, sent_fields, table_of

from mpisph.core.particles import Particles
from mpisph.sph.gradient import UNITY
from mpisph.sph.quiescence import REST, is_negligible
from mpisph.sph.sources import name_fields

DX = 1e-3
H0 = 2.0 * DX


def block(u_z=0.0, n=40):
    """A lattice of rings at rest or moving as one, at the reference density."""
    r, z = np.meshgrid((np.arange(n) + 0.5) * DX, (np.arange(n) - n // 2 + 0.5) * DX)
    p = Particles.zeros(r.size)
    p.id[:] = np.random.default_rng(1).permutation(r.size)
    p.r[:], p.z[:] = r.ravel(), z.ravel()
    p.h[:] = H0
    p.rho[:] = ALUMINIUM.rho0
    p.m[:] = 2.0 * np.pi * p.r * p.rho * DX**2
    p.u_z[:] = u_z
    p.correction[:] = np.array(UNITY)[:, None]
    return p


def both(p, **options):
    """Return particles evaluated with and without skipping."""
    quick, thorough = (p.take(np.arange(p.n)) for _ in range(2))
    evaluate(quick, h0=H0, **options)
    evaluate(thorough, h0=H0, skip_quiescent=False, **options)
    return quick, thorough


def assert_same_bits(quick, thorough):
    np.testing.assert_array_equal(bits(quick.rates), bits(thorough.rates))
    for name in ("div", "damping", "crowding", "correction"):
        got, want = getattr(quick, name), getattr(thorough, name)
        np.testing.assert_array_equal(bits(got), bits(want), err_msg=name)


@pytest.mark.parametrize("u_z", [0.0, 6700.0])
@pytest.mark.parametrize("printed", [False, True])
@pytest.mark.parametrize("eos", ["mie-grueneisen", "tillotson"])
def test_a_block_at_rest_or_in_flight_is_skipped_and_has_no_rates(u_z, printed, eos):
    scheme = SCHEME._replace(printed=printed)
    quick, thorough = both(
        block(u_z), scheme=scheme, materials=(ALUMINIUM._replace(eos=eos),)
    )
    assert_same_bits(quick, thorough)
    assert not thorough.rates.any()
    assert not quick.neighbours.any()
    assert thorough.neighbours.min() > 30.0


DISTURBANCES = {
    "u_r": 1e-3,
    "u_z": 1e-3,
    "E": 1e-3,
    "S_rr": 1e3,
    "S_zz": -1e3,
    "S_rz": 1e3,
    "rho": ALUMINIUM.rho0 * 1e-9,
}


@pytest.mark.parametrize("name", DISTURBANCES)
@pytest.mark.parametrize("place", [(0, 20), (20, 3), (39, 39), (17, 20)])
def test_whatever_a_disturbed_particle_reaches_is_evaluated(name, place):
    p = block()
    i = place[0] + 40 * place[1]
    getattr(p, name)[i] += DISTURBANCES[name]
    quick, thorough = both(p)
    assert_same_bits(quick, thorough)
    within = np.hypot(p.r - p.r[i], p.z - p.z[i]) < SCHEME.kappa * H0 * (1.0 - 1e-9)
    np.testing.assert_array_equal(quick.neighbours[within], thorough.neighbours[within])
    assert quick.neighbours[within].min() > 30.0
    # The test is made on a box that holds the reach of a whole cell.
    far = np.hypot(p.r - p.r[i], p.z - p.z[i]) > 2.5 * SCHEME.kappa * H0
    assert not quick.neighbours[far].any()


def test_energy_alone_disturbs_where_it_makes_no_pressure():
    """With the linear equation heat flows, though nothing is under stress."""
    p = block()
    i = 20 + 40 * 20
    p.E[i] = 1e3
    quick, thorough = both(p, materials=(ALUMINIUM._replace(eos="linear"),))
    assert_same_bits(quick, thorough)
    assert not thorough.rates[[0, 1, 2]].any()
    assert np.count_nonzero(quick.dE) > 30


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_a_cold_thin_gas_rests_wherever_it_is(share):
    """Its density does not go to the kernel sum, which its surface has not."""
    p = block()
    p.rho *= share
    p.m *= share
    gas = ALUMINIUM._replace(eos="ideal-gas", strength="none")
    quick, thorough = both(p, materials=(gas,))
    assert_same_bits(quick, thorough)
    assert not thorough.rates.any()


def test_hoop_stress_alone_disturbs():
    """P = S_rr = S_zz leaves no stress but that around the axis."""
    p = block()
    i = 20 + 40 * 20
    p.rho[i] *= 1.0 + 1e-6
    linear = ALUMINIUM._replace(eos="linear")
    fields, _ = sent_fields(p, SCHEME, table_of(linear))
    p.S_rr[i] = p.S_zz[i] = name_fields(fields).P[i]
    quick, thorough = both(p, materials=(linear,))
    assert_same_bits(quick, thorough)
    assert np.count_nonzero(quick.du_r) > 30


def test_two_blocks_that_meet_are_evaluated_where_they_meet():
    p = block()
    p.u_z[p.z < 0.0] = 100.0
    quick, thorough = both(p)
    assert_same_bits(quick, thorough)
    skipped = quick.neighbours == 0.0
    assert np.abs(p.z[skipped]).min() > SCHEME.kappa * H0 - DX
    assert skipped.sum() > 0.3 * p.n


def test_matter_is_skipped_beside_levels_of_other_smoothing_lengths():
    """A coarse disturbed particle far off reaches fine calm ones."""
    p = block()
    coarse = np.argmax(p.r + p.z)
    p.h[coarse] = 12.0 * H0
    p.E[coarse] = 1.0
    quick, thorough = both(p)
    assert_same_bits(quick, thorough)
    apart = np.hypot(p.r - p.r[coarse], p.z - p.z[coarse])
    within = apart < SCHEME.kappa * 6.5 * H0 * (1.0 - 1e-9)
    assert quick.neighbours[within].min() > 0.0


def test_a_push_below_the_threshold_leaves_matter_at_rest():
    """Far below rounding: 1e-20 of c^2/h for accelerations, of c/h for strain rates."""
    for push, moves in ((1e-30, False), (1e-13, True)):
        p = block()
        i = 20 + 40 * 20
        p.u_r[i] = push
        quick, thorough = both(p)
        assert_same_bits(quick, thorough)
        others = np.arange(p.n) != i
        assert thorough.rates[:, others].any() == moves
        # What is not calm itself keeps its rates, however small.
        assert thorough.drho[i] != 0.0


def test_the_threshold_is_taken_in_each_rate():
    rates = np.zeros(8)
    c, h, rho = 5e3, 2e-3, 2.7e3
    scales = [
        c * c / h, c * c / h, rho * c / h, c**3 / h, *3 * [rho * c**3 / h], c
    ]  # fmt: skip
    for k, scale in enumerate(scales):
        for size, small in ((0.9, True), (1.1, False)):
            for sign in (-1.0, 1.0):
                rates[:] = 0.0
                rates[k] = sign * size * REST * scale
                assert is_negligible(rates, c, h, rho) == small


def test_negative_zeros_are_calm():
    p = block()
    p.u_r[:], p.S_rr[:], p.S_rz[:] = -0.0, -0.0, -0.0
    quick, thorough = both(p)
    assert_same_bits(quick, thorough)
    assert not quick.neighbours.any()
