"""Response of matter to its state: pressure, sound speed, shear modulus and yield.

The models that a material has chosen stand in its row of the table of constants.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from mpisph.core.jit import EXACT
from mpisph.inputs.sourced import Sourced
from mpisph.physics import eos, failure, strength
from mpisph.physics.eos import pressure
from mpisph.physics.failure import limit_pressure
from mpisph.physics.models import Model, record, record_type
from mpisph.physics.sound import sound_speed
from mpisph.physics.strength import shear_modulus, yield_stress
from mpisph.physics.stress import equivalent_stress, plastic_increment, yield_factor

MaterialTable = npt.NDArray[np.void]
"""Structured array of the constants of all models, one row a material."""

KINDS: Mapping[str, Mapping[str, Model]] = {
    "eos": eos.MODELS,
    "strength": strength.MODELS,
    "failure": failure.MODELS,
}
"""All models, by kind and name."""


class MaterialModels(NamedTuple):
    """The models of one material, and their constants.

    Attributes
    ----------
    material : str
        Name of the material.
    rho0 : float
        Reference density [kg/m3].
    names : mapping of str to str
        Name of the model of each kind.
    constants : mapping of str to Sourced
        By the name of the model; those of other models are not used.
    """

    material: str
    rho0: float
    names: Mapping[str, str]
    constants: Mapping[str, Sourced]

    @property
    def bulk_sound_speed(self) -> float:
        """Sound speed at rest, without strength [m/s]."""
        chosen: Any = self.constants[self.names["eos"]]
        return float(chosen.bulk_sound_speed(self.rho0))


def table_type() -> np.dtype[Any]:
    """Return the structured type of a row of the table of constants."""
    common = [
        ("rho0", np.float64),
        ("bulk_sound_speed", np.float64),
        ("gas", np.bool_),
    ]
    numbers = [(kind, np.int64) for kind in KINDS]
    models = [
        (model.attribute, record_type(model.constants))
        for known in KINDS.values()
        for model in known.values()
        if model.constants is not None
    ]
    # A record gives its fields as attributes, with and without compiling.
    return np.dtype((np.record, [*common, *numbers, *models]))


def material_table(materials: Sequence[MaterialModels]) -> MaterialTable:
    """Return the constants as the structured array that jitted functions index.

    Parameters
    ----------
    materials : sequence of MaterialModels
    """
    table = np.zeros(len(materials), table_type())
    for row, material in zip(table, materials, strict=True):
        row["rho0"] = material.rho0
        row["bulk_sound_speed"] = material.bulk_sound_speed
        row["gas"] = material.names["eos"] in eos.GASES
        for kind, models in KINDS.items():
            chosen = models[material.names[kind]]
            row[kind] = list(models).index(chosen.name)
            if chosen.constants is not None:
                row[chosen.attribute] = record(material.constants[chosen.name])
    return table


@njit(**EXACT)
def respond(x, table, sound_speed_floor):
    """Set P, c and G (R7-R9), and bring the stress back to the yield surface (R7).

    Parameters
    ----------
    x : MaterialState
        Of particles: stress, history and response are set.
    table : structured ndarray
    sound_speed_floor : float
        Smallest sound speed in units of the bulk sound speed.
    """
    for k in range(x.material.size):
        mat = table[x.material[k]]
        P, dP_drho, dP_dE = pressure(x, k, mat)
        floor = sound_speed_floor * mat.bulk_sound_speed
        x.P[k] = P
        x.P[k] = limit_pressure(x, k, mat)
        x.c[k] = sound_speed(x.rho[k], x.P[k], dP_drho, dP_dE, floor)
        torn = x.P[k] > P  # such matter carries no shear either
        x.G[k] = 0.0 if torn else shear_modulus(x, k, mat)
        stress = equivalent_stress(x.S_rr[k], x.S_zz[k], x.S_rz[k])
        factor = yield_factor(stress, 0.0 if torn else yield_stress(x, k, mat))
        x.plastic[k] = 1.0 if factor < 1.0 else 0.0
        x.plastic_strain[k] += plastic_increment(stress, factor, x.G[k])
        x.S_rr[k] *= factor
        x.S_zz[k] *= factor
        x.S_rz[k] *= factor
