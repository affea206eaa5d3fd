"""R21: artificial stress."""

import numpy as np
import pytest
from oracles import approx

from mpisph.physics.artificial_stress import artificial_stress, repulsion

CONSTANTS = artificial_stress(0.1, 1.5, 3.0)


def taken_back(x, stress, constants=CONSTANTS):
    """The traction that is taken back at a distance in spacings, of both together."""
    x = np.array(x, float)
    t = np.array(stress) @ x
    q2 = x @ x / constants.per_spacing
    return repulsion(q2, *x, x @ x, *t, constants) * t


@pytest.mark.parametrize("nph", [1.2, 1.5, 2.0, 2.5])
def test_an_even_lattice_r21_keeps_its_stress(nph):
    """The sum over a lattice of the force times the distance is the added stress."""
    constants = artificial_stress(0.1, nph, 3.0)
    tension = np.diag([0.0, -1e9])
    added = size = np.zeros((2, 2))
    for i in range(-8, 9):
        for j in range(-8, 9):
            if 0 < i * i + j * j < (3.0 * nph) ** 2:
                weight = np.exp(-(i * i + j * j) / nph**2)
                force = weight * taken_back((i, j), tension, constants)
                added = added + np.outer(force, (i, j))
                size = size + abs(np.outer(force, (i, j)))
    assert abs(added).max() < 1e-13 * size.max()


def test_a_lattice_r21_without_neighbours_needs_no_balance():
    assert artificial_stress(0.1, 0.5, 1.5).g == 0.0


def test_a_pair_r21_is_held_apart_by_a_share_of_its_tension():
    tension = np.diag([0.0, -1e9])
    assert taken_back((0, 1), tension) == approx([0.0, 1e9 * 0.1 * (1 - CONSTANTS.g)])
    # Nearer: the force a distance rises to (2.25/1.25)^2.
    force = taken_back((0, 1e-3), tension)[1] / 1e-3
    assert force == approx(1e9 * 0.1 * (1.8**2 - CONSTANTS.g), rel=1e-5)
    # Beyond the diagonal g alone is left.
    assert taken_back((0, 2), tension)[1] == approx(-2e9 * 0.1 * CONSTANTS.g)


def test_pressed_pairs_and_those_across_r21_are_left_alone():
    for stress in (np.diag([0.0, 1e9]), np.diag([-1e9, 0.0]), np.zeros((2, 2))):
        assert np.all(taken_back((0, 1), stress) == 0.0)
    shear = np.array([[0.0, 1e9], [1e9, 0.0]])
    assert np.all(taken_back((0, 1), shear) == 0.0)
    assert np.all(taken_back((0, 0), shear) == 0.0)


@pytest.mark.parametrize("turn", [0.3, 1.2, 2.5])
def test_turned_axes_r21_give_the_turned_force(turn):
    R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    x, stress = np.array([0.4, 0.9]), np.array([[-3e8, 2e8], [2e8, -1e9]])
    want = R @ taken_back(x, stress)
    assert taken_back(R @ x, R @ stress @ R.T) == approx(want, rel=1e-13)
