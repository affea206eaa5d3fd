"""Johnson-Cook: plastic strain to fracture by triaxiality, rate and temperature (R18).

References
----------
Johnson, Cook (1985), Eng. Fract. Mech. 21, 31. Bao, Wierzbicki (2005), Eng. Fract.
Mech. 72, 1049: the triaxiality below which nothing breaks.
"""

import math
from typing import Annotated

from pydantic import Field, model_validator

from mpisph.core.jit import ENTRY, EXACT
from mpisph.core.jitted import jitted
from mpisph.inputs.quantities import (
    CrackEnergy,
    Quantity,
    Temperature,
    check_melting,
)
from mpisph.inputs.sourced import Sourced
from mpisph.physics.models import Model
from mpisph.physics.strength.johnson_cook import homologous_temperature
from mpisph.physics.stress import equivalent_stress

Coefficient = Annotated[float, Field(ge=-100, le=100), Quantity("")]

LOWEST_TRIAXIALITY, HIGHEST_TRIAXIALITY = -1.0 / 3.0, 1.5
"""Mean stress over equivalent stress: at the first and below, that of a bar in
compression, no strain breaks matter; above the second the law is taken there."""

SHEAR, UNIAXIAL = 0.0, 1.0 / 3.0
"""Triaxialities of pure shear, and of a bar in tension."""

FASTEST = 1e6
"""Strain rate [1/s] of an impact, up to which the law is to make sense."""


class JohnsonCookDamage(Sourced):
    """Constants of Johnson-Cook's strain to fracture (R18)."""

    D1: Coefficient
    """Strain to fracture without the term of triaxiality."""
    D2: Coefficient
    """Coefficient of the term of triaxiality."""
    D3: Coefficient
    """Exponent of triaxiality: mean stress (tension positive) over equivalent one."""
    D4: Coefficient
    """Coefficient of the logarithm of the strain rate."""
    D5: Coefficient
    """Coefficient of temperature."""
    melting_temperature: Temperature
    """Temperature at which the homologous temperature is one."""
    reference_temperature: Temperature = 298.0
    """Temperature at which it is zero."""
    reference_rate: Annotated[float, Field(gt=0, le=1e12), Quantity("1/s")] = 1.0
    """Strain rate up to which rate does not count."""
    least_strain: Annotated[float, Field(gt=0, le=10), Quantity("")] = 0.01
    """What the strain to fracture is at least."""
    crack_energy: CrackEnergy = 0.0
    """Energy that an area takes to tear; 0: it tears as fast as a crack runs."""

    @property
    def needs_temperature(self) -> bool:
        """Whether heat changes the strain to fracture."""
        return self.D5 != 0.0

    @model_validator(mode="after")
    def _check_fracture(self) -> "JohnsonCookDamage":
        """Refuse constants by which matter breaks before it is strained."""
        check_melting(self.melting_temperature, self.reference_temperature)
        for name, where in (("pure shear", SHEAR), ("a bar in tension", UNIAXIAL)):
            strain = self.D1 + self.D2 * math.exp(self.D3 * where)
            if strain <= 0.0:
                raise ValueError(
                    f"D1, D2, D3: {name} would break at a strain of {strain:g}; "
                    f"expected D1 + D2 exp({where:.3g} D3) above zero"
                )
        fast = 1.0 + self.D4 * math.log(max(FASTEST / self.reference_rate, 1.0))
        if fast <= 0.0:
            raise ValueError(
                f"D4: matter would break at once at {FASTEST:g} per second; expected "
                "1 + D4 ln(rate/reference_rate) above zero"
            )
        if self.D5 <= -1.0:
            raise ValueError(
                "D5: matter would break at once when it melts; expected more than -1"
            )
        return self


@jitted(**EXACT)
def fracture_strain(triaxiality, rate, T, mat):
    """Return the equivalent plastic strain to fracture, infinite if pressed (R18).

    Parameters
    ----------
    triaxiality : float
        Mean stress, tension positive, over equivalent stress.
    rate : float
        Of the plastic strain [1/s].
    T : float
        Temperature [K].
    mat : record of JohnsonCookDamage
    """
    if triaxiality <= LOWEST_TRIAXIALITY:
        return math.inf
    hot = homologous_temperature(T, mat.reference_temperature, mat.melting_temperature)
    fast = math.log(max(rate / mat.reference_rate, 1.0))
    within = min(triaxiality, HIGHEST_TRIAXIALITY)
    shape = mat.D1 + mat.D2 * math.exp(mat.D3 * within)
    strain = shape * (1.0 + mat.D4 * fast) * (1.0 + mat.D5 * hot)
    return max(strain, mat.least_strain)


@jitted(**EXACT)
def tearing(work, crack_energy):
    """Return the damage of matter that tears as it is strained (R18).

    The stress falls from that of sound matter to zero while it does the work of the
    crack. Without such an energy the result is infinite.

    Parameters
    ----------
    work : float
        Plastic work of the sound share per area, in the band of a crack [J/m2].
    crack_energy : float
        [J/m2].
    """
    if crack_energy <= 0.0:
        return math.inf
    return 0.5 * work / crack_energy


@jitted(**ENTRY)
def _used_up(x, k, mat, increment, dt):
    stress = equivalent_stress(x.S_rr[k], x.S_zz[k], x.S_rz[k])
    triaxiality = -x.P[k] / stress if stress > 0.0 else LOWEST_TRIAXIALITY
    rate = increment / dt if dt > 0.0 else 0.0
    return increment / fracture_strain(
        triaxiality, rate, x.T[k], mat.johnson_cook_damage
    )


@jitted(**ENTRY)
def _torn(x, k, mat, work):
    return tearing(work, mat.johnson_cook_damage.crack_energy)


MODEL = Model(
    "johnson-cook-damage",
    "Johnson-Cook damage",
    JohnsonCookDamage,
    {"used_up": _used_up, "torn": _torn},
    ("ductile_damage", "damage"),
)
