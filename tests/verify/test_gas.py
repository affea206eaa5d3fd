"""What is measured on runs of a gas."""

import math

import numpy as np
import pytest

from mpisph.case.discretise import discretise
from mpisph.verify.exact.riemann import GasState
from mpisph.verify.gas import GasBody, gas_setup


def test_a_gas_starts_in_its_state():
    rod = {"shape": "cylinder", "radius": 1.0, "length": 0.5}
    left = GasBody({**rod, "position": -0.5}, GasState(1.0, 0.5, 2.0))
    right = GasBody({**rod, "position": 0.0}, GasState(0.125, 0.0, 0.0))
    more = {"resolution": {"nph": 1.2}}
    made = gas_setup("1/8", "gas", [left, right], 0.125, [0.1, 0.2], 1.4, **more)
    assert made.case.resolution.nph == 1.2
    assert made.case.output_times == (1e-4, 2e-4)
    fields = discretise(made.case).fields()
    energy = np.where(fields["z"] < 0.0, 5e6, 0.0)
    assert fields["E"] == pytest.approx(energy)
    assert fields["u_z"] == pytest.approx(np.where(fields["z"] < 0.0, 500.0, 0.0))
    assert fields["m"].sum() == pytest.approx(math.pi * 0.5 * 1.125)
