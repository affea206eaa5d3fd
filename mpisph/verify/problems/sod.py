"""Sod's shock tube."""

from mpisph.verify.exact.riemann import GasState
from mpisph.verify.tube import Tube, tube_problem

PROBLEM = tube_problem(
    Tube(
        name="sod",
        title="Sod's shock tube",
        source="Sod (1978), J. Comp. Phys. 27, 1-31; solved as in Toro (2009), ch. 4",
        left=GasState(1.0, 0.0, 1.0),
        right=GasState(0.125, 0.0, 0.1),
        end=0.2,
        z_low=-0.6,
        z_high=0.75,
        radius=0.4,
        look=0.06,
        tolerance=0.01,
        density_tolerance=0.02,
        spread=0.02,
    )
)
