"""R7-R9, R13-R20: the response of particles to their state."""

from types import SimpleNamespace

import numpy as np
import pytest
from oracles import (
    ALUMINIUM,
    COPPER,
    bits,
    cloud,
    deviator,
    pressure_and_sound_speed,
    table_of,
)

from mpisph.core.particles import HISTORY, Particles
from mpisph.physics.response import KINDS, respond, table_type

MATERIALS = [ALUMINIUM._replace(eos="tillotson"), COPPER._replace(eos="linear")]
TABLE = table_of(*MATERIALS)
FLOOR = 0.01


def test_the_table_holds_the_constants_of_every_model():
    for row, mat in zip(TABLE, MATERIALS, strict=True):
        assert row.rho0 == mat.rho0
        for kind, models in KINDS.items():
            name = mat.models.names[kind]
            assert list(models)[row[kind]] == name
            if models[name].constants is None:
                continue
            own = row[models[name].attribute]
            numbers = mat.models.constants[name].model_dump(exclude={"sources"})
            for key, number in numbers.items():
                assert own[key] == number or isinstance(number, str)
    assert TABLE[0].tillotson.Es_prime == 14.1e6
    assert {"mie_grueneisen", "elastic_plastic"} <= set(table_type().names)


@pytest.mark.parametrize("mode", ["off", "clamp", "zero"])
def test_respond_sets_pressure_and_sound_speed_r8_r9(mode):
    """Each material has a limit of its own."""
    p = cloud(60, 1, n_materials=2)
    p.rho[:20] *= 0.6
    limits = (-1e9, -3e9)
    materials = [
        mat._replace(P_min=limit, P_min_mode=mode)
        for mat, limit in zip(MATERIALS, limits, strict=True)
    ]
    state = [materials[k] for k in p.material]
    scheme = SimpleNamespace(sound_speed_floor=1.05)
    want = np.array(
        [
            pressure_and_sound_speed(*one, scheme)
            for one in zip(p.rho.tolist(), p.E.tolist(), state, strict=True)
        ]
    )
    respond(p.material_state(), table_of(*materials), 1.05, 0.0)
    # The pressure is a difference of terms up to 1e11 Pa.
    np.testing.assert_allclose(p.P, want[:, 0], rtol=1e-14, atol=1e11 * 1e-15)
    np.testing.assert_allclose(p.c, want[:, 1], rtol=1e-13)
    limit = np.array(limits)[p.material]
    limited = {"off": p.P < 1.1 * limit, "clamp": p.P == limit, "zero": p.P == 0.0}
    for k in (0, 1):
        assert limited[mode][p.material == k].sum() >= 3
    bulk = np.array([(78.5e9 / 2710.0) ** 0.5, (140e9 / 8930.0) ** 0.5])
    floor = 1.05 * bulk[p.material]
    assert (p.c >= floor * (1.0 - 1e-15)).all()
    assert np.isclose(p.c, floor).any()


def test_respond_brings_the_stress_to_the_yield_surface_r7():
    p = cloud(60, 2, n_materials=2)
    p.stress[:, ::2] *= 1e-3
    p.plastic_strain[:] = 0.1
    before = p.stress.copy()
    other = p.values.copy()
    respond(p.material_state(), TABLE, FLOOR, 0.0)
    T = np.array([deviator(*stress) for stress in before.T])
    size = np.sqrt(1.5 * (T * T).sum((1, 2)))
    Y, G = (
        np.array([getattr(m, n) for m in MATERIALS])[p.material] for n in ("Y", "mu")
    )
    outside = size > Y
    assert 3 < outside.sum() < 57
    want = before * np.where(outside, Y / size, 1.0)
    np.testing.assert_allclose(p.stress, want, rtol=1e-14)
    np.testing.assert_array_equal(p.stress[:, ~outside], before[:, ~outside])
    np.testing.assert_array_equal(p.plastic, outside.astype(float))
    np.testing.assert_array_equal(p.G, G)
    # The elastic strain that was given up has become plastic.
    strain = 0.1 + np.where(outside, (size - Y) / (3.0 * G), 0.0)
    np.testing.assert_allclose(p.plastic_strain, strain, rtol=1e-13)
    # Nothing else: stress, plastic strain and work, P, c, G, plastic, distension.
    changed = (bits(p.values) != bits(other)).any(axis=1)
    assert changed.sum() == 10
    # Applied again it changes nothing but the last bits.
    again = p.stress.copy()
    respond(p.material_state(), TABLE, FLOOR, 0.0)
    np.testing.assert_allclose(again, p.stress, rtol=4e-16)


@pytest.mark.parametrize("name", HISTORY)
def test_history_is_carried_from_step_to_step(name):
    p = Particles.zeros(3)
    getattr(p, name)[:] = 0.25
    assert getattr(p.material_state(), name).tolist() == [0.25] * 3


def test_without_strength_r7_matter_is_a_fluid():
    p = cloud(2, 4)
    p.stress[:] = [[1e8, 0.0], [2e8, 0.0], [-1e8, 0.0]]
    fluid = ALUMINIUM._replace(strength="none")
    respond(p.material_state(), table_of(fluid), FLOOR, 0.0)
    assert np.abs(p.stress).max() == 0.0
    assert p.plastic.tolist() == [1.0, 0.0]
    assert not p.plastic_strain.any()
    assert not p.G.any()
