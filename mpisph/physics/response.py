"""Response of matter to its state: pressure, heat, yield, pores and damage (R7-R20).

The models that a material has chosen stand in its row of the table of constants.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mpisph.core.jit import ENTRY, EXACT
from mpisph.core.jitted import jitted
from mpisph.core.particles import VALUE, MaterialState
from mpisph.inputs.sourced import Sourced
from mpisph.physics import ductile, eos, failure, porosity, strength, thermal
from mpisph.physics.cracks import BAND, borne, crack_growth, ring_size
from mpisph.physics.ductile import torn, used_up
from mpisph.physics.eos import pressure
from mpisph.physics.failure import damage_growth, limit_tension, sound_share
from mpisph.physics.isentrope import ISENTROPE, fill_isentrope
from mpisph.physics.models import Model, record, record_type
from mpisph.physics.porosity import distension
from mpisph.physics.sound import sound_speed
from mpisph.physics.strength import flow_stress, shear_modulus
from mpisph.physics.stress import equivalent_stress
from mpisph.physics.thermal import temperature

MaterialTable = npt.NDArray[np.void]
"""Structured array of the constants of all models, one row a material."""

KINDS: Mapping[str, Mapping[str, Model]] = {
    "eos": eos.MODELS,
    "porosity": porosity.MODELS,
    "thermal": thermal.MODELS,
    "strength": strength.MODELS,
    "failure": failure.MODELS,
    "ductile": ductile.MODELS,
}
"""All models, by kind and name."""

MODEL_FIELDS = frozenset(
    field for models in KINDS.values() for m in models.values() for field in m.fields
)
"""Particle fields that mean something with some models alone."""

MOST_ITERATIONS = 60
ROUNDING = 1e-14
"""The plastic increment is found when this share of the stress is left."""

FARTHEST = 30.0
"""Longest step of its logarithm: what is beyond is out of bounds anyway."""


class MaterialModels(NamedTuple):
    """The models of one material, and their constants.

    Attributes
    ----------
    material : str
        Name of the material.
    rho0 : float
        Reference density of the solid [kg/m3].
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
    def fields(self) -> frozenset[str]:
        """Those of `MODEL_FIELDS` that its models give."""
        chosen = (KINDS[kind][name] for kind, name in self.names.items())
        return frozenset(field for model in chosen for field in model.fields)

    @property
    def bulk_sound_speed(self) -> float:
        """Sound speed at rest, without strength [m/s]."""
        chosen: Any = self.constants[self.names["eos"]]
        return float(chosen.bulk_sound_speed(self.rho0))

    @property
    def gas(self) -> bool:
        """Whether it expands without being hit."""
        name = self.names["eos"]
        return eos.is_gas(name, self.constants.get(name), self.rho0)

    @property
    def initial_distension(self) -> float:
        """Volume with pores over that of the solid, at the start."""
        pores: Any = self.constants.get(self.names["porosity"])
        return 1.0 if pores is None else float(pores.initial_distension)

    @property
    def rest_density(self) -> float:
        """Density at the start, with pores [kg/m3]."""
        return self.rho0 / self.initial_distension


def table_type() -> np.dtype[Any]:
    """Return the structured type of a row of the table of constants."""
    common = [
        ("rho0", np.float64),
        ("rest_density", np.float64),
        ("bulk_sound_speed", np.float64),
        ("gas", np.bool_),
        ("isentrope", ISENTROPE),
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
        row["rest_density"] = material.rest_density
        row["bulk_sound_speed"] = material.bulk_sound_speed
        row["gas"] = material.gas
        for kind, models in KINDS.items():
            chosen = models[material.names[kind]]
            row[kind] = list(models).index(chosen.name)
            if chosen.constants is not None:
                row[chosen.attribute] = record(
                    material.constants[chosen.name], material.rho0
                )
        if material.names["thermal"] != "none":
            thermal_constants: Any = material.constants[material.names["thermal"]]
            fill_isentrope(row, thermal_constants.reference_temperature)
    return table


@jitted(**ENTRY)
def plastic_return(x, k, mat, stress, Y, dt):
    """Return the factor of the stress and the plastic strain of its return (R7).

    The strain that the stress gives up, ``stress - Y = 3 G increment``, is that by
    which the material hardens: solved by Newton's method, within bounds that close,
    from the increment without hardening.

    Parameters
    ----------
    stress : float
        Equivalent stress before the return, over the sound share [Pa].
    Y : float
        Flow stress without an increment [Pa].
    dt : float
        Time that the increment takes [s].
    """
    stiffness = 3.0 * x.G[k]
    if stiffness <= 0.0:
        return Y / stress, 0.0
    low, high = 0.0, (stress - Y) / stiffness
    increment = high
    for _ in range(MOST_ITERATIONS):
        Y, slope = flow_stress(x, k, mat, increment, dt)
        excess = stress - Y - stiffness * increment
        if abs(excess) <= ROUNDING * stress:
            break
        if excess > 0.0:
            low = increment
        else:
            high = increment
        # In the logarithm, for that is how the rate counts: 4 iterations, not 15.
        step = excess / (increment * (stiffness + slope))
        increment *= math.exp(min(step, FARTHEST))
        if not low < increment < high:
            increment = 0.5 * (low + high)
    return Y / stress, increment


@jitted(**EXACT)
def share_left(before, lost):
    """Return what is left of stress as a lost share of matter grows (R16).

    What melts or breaks takes its elastic strain along, and that is no plastic strain.
    What freezes is without stress.
    """
    return (1.0 - lost) / (1.0 - before) if lost > before else 1.0


@jitted(**EXACT)
def state_of(ids, material, rows, at):
    """Return the `MaterialState` of rows of fields, in the places that `at` holds."""
    return MaterialState(
        id=ids,
        material=material,
        m=rows[at.m],
        r=rows[at.r],
        u_r=rows[at.u_r],
        u_z=rows[at.u_z],
        rho=rows[at.rho],
        E=rows[at.E],
        S_rr=rows[at.S_rr],
        S_zz=rows[at.S_zz],
        S_rz=rows[at.S_rz],
        h=rows[at.h],
        plastic_strain=rows[at.plastic_strain],
        plastic_work=rows[at.plastic_work],
        ductile_damage=rows[at.ductile_damage],
        damage=rows[at.damage],
        opening=rows[at.opening],
        distension=rows[at.distension],
        P=rows[at.P],
        c=rows[at.c],
        G=rows[at.G],
        plastic=rows[at.plastic],
        T=rows[at.T],
        melt=rows[at.melt],
    )


OF_VALUES = MaterialState(*(getattr(VALUE, name, -1) for name in MaterialState._fields))
"""Rows of the fields in `Particles.values`; labels have none."""


@jitted(**EXACT)
def respond(x, table, sound_speed_floor, dt):
    """Set the response to the state; bring the stress back to yield (R7-R9, R13-R20).

    Parameters
    ----------
    x : MaterialState
        Of particles: stress, history and response are set.
    table : structured ndarray
    sound_speed_floor : float
        Smallest sound speed in units of the bulk sound speed.
    dt : float
        Time since the last response that was kept [s]; ``x.melt`` is of then.
    """
    for k in range(x.material.size):
        mat = table[x.material[k]]
        alpha = distension(x, k, mat)
        x.distension[k] = alpha
        P, dP_drho, dP_dE = pressure(alpha * x.rho[k], x.E[k], mat)
        P, dP_dE = P / alpha, dP_dE / alpha
        x.P[k] = P
        molten = x.melt[k]
        x.T[k], x.melt[k] = temperature(x, k, mat)
        x.G[k] = shear_modulus(x, k, mat)
        solid = 1.0 - x.melt[k]
        sound = solid * sound_share(x, k, mat)
        left = share_left(molten, x.melt[k]) if dt > 0.0 else 1.0
        stress = left * equivalent_stress(x.S_rr[k], x.S_zz[k], x.S_rz[k])
        factor, increment, work = 1.0, 0.0, 0.0
        if stress > 0.0 and sound > 0.0:
            # Most matter does not yield; to know it costs less than the call.
            Y, _ = flow_stress(x, k, mat, 0.0, dt)
            if stress / sound > Y:
                factor, increment = plastic_return(x, k, mat, stress / sound, Y, dt)
        elif stress > 0.0:
            factor = 0.0
        x.plastic[k] = 1.0 if factor < 1.0 else 0.0
        x.plastic_strain[k] += increment
        if increment > 0.0:
            work = factor * stress / sound * increment
            x.plastic_work[k] += sound * work / x.rho[k]
        x.S_rr[k] *= left * factor
        x.S_zz[k] *= left * factor
        x.S_rz[k] *= left * factor
        P, excess = limit_tension(x, k, mat, dt)
        P = borne(P, solid)
        floor = sound_speed_floor * mat.bulk_sound_speed
        x.c[k] = sound_speed(x.rho[k], P, dP_drho, dP_dE, floor)
        growth = damage_growth(x, k, mat, excess, dt)
        x.P[k] = P
        if increment > 0.0:
            x.ductile_damage[k] += used_up(x, k, mat, increment, dt)
        if x.ductile_damage[k] >= 1.0:
            size = ring_size(x.m[k], x.r[k], x.rho[k])
            crack = crack_growth(x.c[k], x.G[k], x.rho[k], size, dt)
            tear = torn(x, k, mat, BAND * x.h[k] * work)
            growth += min(crack, tear) * (1.0 - x.opening[k])
        if growth > 0.0:
            damage = min(x.damage[k] + growth, 1.0)
            left = share_left(x.damage[k], damage)
            x.damage[k] = damage
            x.S_rr[k] *= left
            x.S_zz[k] *= left
            x.S_rz[k] *= left
        x.G[k] *= sound


@jitted(**EXACT)
def respond_rows(ids, material, rows, at, table, sound_speed_floor, dt):
    """Set the response to the state in rows of fields; see `respond` and `state_of`.

    Both evaluations of a step call this: compiled for each by itself, all models would
    take their time twice.
    """
    respond(state_of(ids, material, rows, at), table, sound_speed_floor, dt)
