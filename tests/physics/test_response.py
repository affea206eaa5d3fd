"""R7-R9: the response of particles to their state."""

import numpy as np
import pytest
from oracles import (
    ALUMINIUM,
    COPPER,
    SCHEME,
    bits,
    cloud,
    deviator,
    pressure_and_sound_speed,
)

from mpisph.core.particles import Particles
from mpisph.physics.eos import CLAMP, LINEAR, OFF, TILLOTSON, ZERO
from mpisph.physics.response import limit_stress, material_table, respond

MATERIALS = [ALUMINIUM._replace(eos=TILLOTSON), COPPER._replace(eos=LINEAR)]
TABLE = material_table(MATERIALS)


def test_the_table_holds_every_constant():
    for row, mat in zip(TABLE, MATERIALS, strict=True):
        assert tuple(row) == tuple(mat)
        assert TABLE.dtype.names == mat._fields
    assert np.issubdtype(TABLE.dtype["eos"], np.integer)


def test_an_unknown_equation_of_state_is_refused():
    with pytest.raises(ValueError, match="equation of state number 9"):
        material_table([ALUMINIUM, ALUMINIUM._replace(eos=9)])


@pytest.mark.parametrize("mode", [OFF, CLAMP, ZERO])
def test_respond_sets_pressure_and_sound_speed_r8_r9(mode):
    p = cloud(60, 1, n_materials=2)
    p.rho[:10] *= 0.6
    scheme = SCHEME._replace(P_min=-1e9, P_min_mode=mode, sound_speed_floor=0.9)
    state = [MATERIALS[k] for k in p.material]
    want = np.array(
        [
            pressure_and_sound_speed(*one, scheme)
            for one in zip(p.rho.tolist(), p.E.tolist(), state, strict=True)
        ]
    )
    respond(p, TABLE, scheme)
    # The pressure is a difference of terms up to 1e11 Pa.
    np.testing.assert_allclose(p.P, want[:, 0], rtol=1e-14, atol=1e11 * 1e-15)
    np.testing.assert_allclose(p.c, want[:, 1], rtol=1e-13)
    limited = {OFF: p.P < -1.1e9, CLAMP: p.P == -1e9, ZERO: p.P == 0.0}[mode]
    assert limited.sum() >= 3
    bulk = np.array([(78.5e9 / 2710.0) ** 0.5, (140e9 / 8930.0) ** 0.5])
    floor = 0.9 * bulk[p.material]
    assert (p.c >= floor * (1.0 - 1e-15)).all()
    assert np.isclose(p.c, floor).any()


def test_respond_brings_the_stress_to_the_yield_surface_r7():
    p = cloud(60, 2, n_materials=2)
    p.stress[:, ::2] *= 1e-3
    before = p.stress.copy()
    other = p.values.copy()
    respond(p, TABLE, SCHEME)
    T = np.array([deviator(*stress) for stress in before.T])
    size = np.sqrt(1.5 * (T * T).sum((1, 2)))
    Y = np.array([mat.Y for mat in MATERIALS])[p.material]
    outside = size > Y
    assert 3 < outside.sum() < 57
    want = before * np.where(outside, Y / size, 1.0)
    np.testing.assert_allclose(p.stress, want, rtol=1e-14)
    np.testing.assert_array_equal(p.stress[:, ~outside], before[:, ~outside])
    np.testing.assert_array_equal(p.plastic, outside.astype(float))
    # Nothing else changes.
    changed = (bits(p.values) != bits(other)).any(axis=1)
    fresh = Particles.zeros(1)
    assert changed.sum() == 6
    assert fresh.values.shape[0] == len(changed)
    # Applied again it changes nothing but the last bits.
    again = p.stress.copy()
    limit_stress(again, p.material, TABLE, p.plastic)
    np.testing.assert_allclose(again, p.stress, rtol=4e-16)


def test_limit_stress_r7_without_strength_is_a_fluid():
    table = material_table([ALUMINIUM._replace(Y=0.0, mu=0.0)])
    stress = np.array([[1e8, 0.0], [2e8, 0.0], [-1e8, 0.0]])
    plastic = np.full(2, 9.0)
    limit_stress(stress, np.zeros(2, np.int64), table, plastic)
    assert np.abs(stress).max() == 0.0
    assert plastic.tolist() == [1.0, 0.0]
