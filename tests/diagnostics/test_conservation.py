"""Changes of what is conserved."""

import pytest

from mpisph.diagnostics.conservation import conservation_errors


def sums(mass, momentum_z, kinetic_energy, internal_energy):
    return {
        "mass": mass,
        "momentum_z": momentum_z,
        "kinetic_energy": kinetic_energy,
        "internal_energy": internal_energy,
    }


def test_conservation_errors_are_relative():
    errors = conservation_errors(sums(2.0, 8.0, 30.0, 10.0), sums(2.2, 7.2, 20.0, 24.0))
    assert errors.mass == pytest.approx(0.1)
    assert errors.momentum_z == pytest.approx(-0.1)
    assert errors.energy == pytest.approx(0.1)


@pytest.mark.parametrize("momentum", [0.0, 1e-16])
def test_momentum_error_of_a_system_at_rest_has_a_scale(momentum):
    errors = conservation_errors(
        sums(2.0, momentum, 0.0, 9.0), sums(2.0, 0.06, 0.0, 9.0)
    )
    assert errors.momentum_z == pytest.approx(0.06 / 6.0)


def test_nothing_conserves_itself():
    assert conservation_errors(sums(*[0.0] * 4), sums(*[0.0] * 4)) == (0.0, 0.0, 0.0)
