"""A bar in tension that hardens: its load, the onset of the neck, and its fracture.

Elastic strains are left out: the volume is kept, and strains are plastic.

References
----------
Considère (1885), on the use of iron and steel in constructions.
Johnson, Cook (1985), Eng. Fract. Mech. 21, 31.
"""

import math
from typing import NamedTuple

from scipy.optimize import brentq

_LEAST, _MOST = 1e-12, 10.0
# Strains between which the onset is looked for.


class Hardening(NamedTuple):
    """A flow stress ``A + B strain**n``.

    Attributes
    ----------
    A, B : float
        [Pa].
    n : float
    """

    A: float
    B: float
    n: float

    def stress(self, strain: float) -> float:
        """Return the flow stress [Pa]."""
        return self.A + self.B * math.pow(strain, self.n)

    def slope(self, strain: float) -> float:
        """Return its derivative [Pa]."""
        return self.B * self.n * math.pow(strain, self.n - 1.0)


def nominal_stress(law: Hardening, strain: float) -> float:
    """Return the load over the first section at a logarithmic strain [Pa]."""
    return law.stress(strain) * math.exp(-strain)


def onset_of_neck(law: Hardening) -> float:
    """Return the strain of the greatest load, where slope and stress are equal.

    From there on a section that is a little thinner than the others bears less, and it
    alone goes on (Considère). It is n for ``A = 0``.
    """
    root = brentq(lambda x: law.slope(x) - law.stress(x), _LEAST, _MOST, xtol=1e-14)
    return float(root)


def fracture_strain(D1: float, D2: float, D3: float) -> float:
    """Return Johnson and Cook's strain to fracture of a bar in tension."""
    return D1 + D2 * math.exp(D3 / 3.0)
