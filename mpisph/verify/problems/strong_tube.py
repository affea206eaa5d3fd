"""A tube whose pressures differ by a factor of 100 000."""

from mpisph.verify.exact.riemann import GasState
from mpisph.verify.tube import Tube, tube_problem

PROBLEM = tube_problem(
    Tube(
        name="strong-tube",
        title="Strong shock tube, pressure ratio 1e5",
        source="Toro (2009), test 3 of table 4.1 with its Riemann solution, ch. 4",
        left=GasState(1.0, 0.0, 1000.0),
        right=GasState(1.0, 0.0, 0.01),
        end=0.012,
        z_low=-1.0,
        z_high=0.4,
        radius=0.6,
        look=0.06,
        tolerance=0.02,
        density_tolerance=0.05,
        spread=0.05,
    )
)
