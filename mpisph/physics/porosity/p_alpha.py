"""The P-alpha model (R19): pores that pressure crushes, for good.

Matter of the distension alpha has the pressure ``P_s(alpha rho, E)/alpha``, with that
of its solid. Below the crush curve alpha stays as it is; on the curve it falls as

    alpha = 1 + (alpha0 - 1) ((P_solid - P)/(P_solid - P_elastic))^n.

References
----------
Herrmann (1969), J. Appl. Phys. 40, 2490: the model, with n = 2.
Carroll, Holt (1972), J. Appl. Phys. 43, 1626: the factor 1/alpha.
"""

from typing import Annotated

from pydantic import Field, model_validator

from mpisph.core.jit import ENTRY, EXACT
from mpisph.core.jitted import jitted
from mpisph.inputs.quantities import NonNegativePressure, PositivePressure, Quantity
from mpisph.inputs.sourced import Sourced
from mpisph.physics.eos import pressure
from mpisph.physics.models import Model

MOST_ITERATIONS = 100
ROUNDING = 1e-14
"""Of the pressure of full compaction: the search for alpha ends below."""


class PAlpha(Sourced):
    """Constants of the P-alpha model (R19)."""

    initial_distension: Annotated[float, Field(gt=1, le=1000), Quantity("")]
    """Reference density of the solid over that of the porous body, alpha0."""
    elastic_pressure: NonNegativePressure
    """Pressure from which on pores are crushed."""
    solid_pressure: PositivePressure
    """Pressure at which no pores are left."""
    exponent: Annotated[float, Field(ge=1, le=10), Quantity("")] = 2.0
    """Power n of the crush curve."""

    @model_validator(mode="after")
    def _check_pressures(self) -> "PAlpha":
        """Require the two pressures in their order."""
        if self.solid_pressure <= self.elastic_pressure:
            raise ValueError(
                f"solid_pressure must exceed elastic_pressure = "
                f"{self.elastic_pressure:g} Pa, got {self.solid_pressure:g}"
            )
        return self


@jitted(**EXACT)
def crush_pressure(pores, constants):
    """Return the pressure [Pa] at which pores are crushed (R19).

    Parameters
    ----------
    pores : float
        ``((alpha - 1)/(alpha0 - 1))^(1/n)``, by which the curve is straight.
    constants : record
        Those of `PAlpha`.
    """
    width = constants.solid_pressure - constants.elastic_pressure
    return constants.solid_pressure - width * pores


@jitted(**EXACT)
def crushed_distension(rho, E, alpha, mat):
    """Return the distension at a density and energy, at most `alpha` (R19).

    Newton's method for ``P_s(alpha rho, E) = alpha P_crush(alpha)``, within bounds that
    close.
    """
    constants = mat.p_alpha
    largest, n = constants.initial_distension - 1.0, constants.exponent
    if alpha <= 1.0:
        return 1.0
    high = ((alpha - 1.0) / largest) ** (1.0 / n)
    if pressure(alpha * rho, E, mat)[0] <= alpha * crush_pressure(high, constants):
        return alpha
    if pressure(rho, E, mat)[0] >= constants.solid_pressure:
        return 1.0
    low, pores = 0.0, high
    width = constants.solid_pressure - constants.elastic_pressure
    for _ in range(MOST_ITERATIONS):
        alpha = 1.0 + largest * pores**n
        crush = crush_pressure(pores, constants)
        P, dP_drho, _ = pressure(alpha * rho, E, mat)
        excess = P - alpha * crush
        if abs(excess) <= ROUNDING * constants.solid_pressure:
            break
        if excess > 0.0:
            high = pores
        else:
            low = pores
        rise = n * largest * pores ** (n - 1.0)
        pores -= excess / (rise * (rho * dP_drho - crush) + alpha * width)
        if not low < pores < high:
            pores = 0.5 * (low + high)
    return alpha


@jitted(**ENTRY)
def _distension(x, k, mat):
    return crushed_distension(x.rho[k], x.E[k], x.distension[k], mat)


MODEL = Model(
    "p-alpha", "P-alpha", PAlpha, {"distension": _distension}, ("distension",)
)
