"""R7: strength, against algebra with 3x3 tensors."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import approx, deviator, jaumann

from mpisph.physics.stress import equivalent_stress, jaumann_rate

MU = 25e9
GRADIENTS = st.tuples(*[st.floats(-1e6, 1e6)] * 5)
STRESSES = st.tuples(*[st.floats(-1e9, 1e9)] * 3)


def gradient(L_rr, L_tt, L_rz, L_zr, L_zz):
    return np.array([[L_rr, 0, L_rz], [0, L_tt, 0], [L_zr, 0, L_zz]])


@given(L=GRADIENTS, S=STRESSES)
def test_jaumann_rate_r7_equals_tensor_algebra(L, S):
    want = jaumann(gradient(*L), deviator(*S), MU)
    got = deviator(*jaumann_rate(*L, *S, MU))
    # Each of the few terms is at most 2 mu L or 2 S w, with a rounding of 1e-16.
    size = MU * np.abs(L).max() + np.abs(S).max() * np.abs(L).max()
    np.testing.assert_allclose(got, want, rtol=0.0, atol=2e-15 * size)


def test_jaumann_rate_r7_of_a_uniform_expansion_is_zero():
    L = (2e5, 2e5, 0.0, 0.0, 2e5)
    rates = jaumann_rate(*L, 1e8, -3e8, 2e8, MU)
    # 2 mu L is 1e16; a third of a sum of three may be off by its rounding.
    np.testing.assert_allclose(rates, 0.0, atol=1e16 * 3e-16)


@pytest.mark.parametrize("angle", [0.3, -2.0, 2.0 * math.pi])
def test_a_rigid_rotation_r7_turns_the_stress_and_changes_nothing_else(angle):
    """Integrated over a finite angle with the classic fourth-order rule."""
    S = np.array([3e8, -1e8, 2e8])
    steps = 400

    def rate(S):
        # u_r = omega z, u_z = -omega r: L_rz = omega, L_zr = -omega.
        return np.array(jaumann_rate(0.0, 0.0, angle, -angle, 0.0, *S, MU)) / steps

    start = deviator(*S)
    for _ in range(steps):
        k1 = rate(S)
        k2 = rate(S + 0.5 * k1)
        k3 = rate(S + 0.5 * k2)
        S = S + (k1 + 2.0 * k2 + 2.0 * k3 + rate(S + k3)) / 6.0
    turn = np.array(
        [
            [math.cos(angle), 0, math.sin(angle)],
            [0, 1, 0],
            [-math.sin(angle), 0, math.cos(angle)],
        ]
    )
    want = turn @ start @ turn.T
    # Error of the rule: (2 angle)^5 / 120 / steps^4, 1e-7 for the full turn.
    tolerance = abs(2.0 * angle) ** 5 / 120.0 / steps**4 + 1e-13
    np.testing.assert_allclose(deviator(*S), want, atol=tolerance * 5e8)
    assert not np.allclose(want, start, rtol=0.01) or angle > 6.0
    before = equivalent_stress(start[0, 0], start[2, 2], start[0, 2])
    assert equivalent_stress(*S) == approx(before, rel=2.0 * tolerance)


@given(S=STRESSES)
def test_equivalent_stress_r7_is_that_of_von_mises(S):
    T = deviator(*S)
    want = math.sqrt(1.5 * (T * T).sum())
    assert equivalent_stress(*S) == approx(want, rel=1e-14, abs=1e-150)


def test_equivalent_stress_r7_of_known_states():
    # Uniaxial tension s: deviator (2/3, -1/3, -1/3) s. Pure shear t: sqrt(3) t.
    assert equivalent_stress(-1e8, 2e8, 0.0) == approx(3e8, rel=1e-15)
    assert equivalent_stress(0.0, 0.0, 1e8) == approx(3**0.5 * 1e8, rel=1e-15)
