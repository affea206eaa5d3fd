"""Curves of a material, by the models that a run computes with.

Shocks, the isentrope, melting, yield stress and strain to fracture; for figures, and
for comparison with measurements.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from mpisph.core.particles import FloatArray, Particles
from mpisph.materials.model import TABLES, Material
from mpisph.physics.ductile.johnson_cook_damage import fracture_strain
from mpisph.physics.eos import is_gas
from mpisph.physics.isentrope import fill_isentrope, on_isentrope
from mpisph.physics.models import record, record_type
from mpisph.physics.response import (
    KINDS,
    MaterialModels,
    MaterialTable,
    material_table,
    respond,
)
from mpisph.physics.strength import flow_stress, shear_modulus
from mpisph.physics.thermal.heat_capacity import melting_temperature

ROOM_TEMPERATURE = 300.0
"""Of the reference state [K] where no thermal model gives one."""

_MOST_ITERATIONS = 60
_ROUNDING = 1e-12
"""The secant method for the energy behind a shock ends at a change below this share."""

_INSTANT = 1e-12
"""Time [s] that the strain's last increment takes."""


class States(NamedTuple):
    """States of a material, an array each.

    Attributes
    ----------
    rho : ndarray
        Density [kg/m3].
    P : ndarray
        Pressure [Pa].
    E : ndarray
        Specific internal energy [J/kg].
    T : ndarray
        Temperature [K]; zero where the material has no thermal model.
    melt : ndarray
        Molten share of the mass.
    """

    rho: FloatArray
    P: FloatArray
    E: FloatArray
    T: FloatArray
    melt: FloatArray


class Shocks(NamedTuple):
    """Shocks into matter at rest at its reference density, an array each.

    Attributes
    ----------
    u_p : ndarray
        Particle velocity [m/s].
    u_s : ndarray
        Shock velocity [m/s].
    states : States
        Behind the shock.
    """

    u_p: FloatArray
    u_s: FloatArray
    states: States


def equations_of_state(card: Material) -> list[str]:
    """Return the names of the equations of state that a card has for a solid.

    A bulk modulus that follows from another one is left out.
    """
    return [
        name
        for name in card.given
        if name in KINDS["eos"] and not is_gas(name, card.constants(name), card.rho0)
    ]


def table_of(card: Material, eos: str, strength: str = "none") -> MaterialTable:
    """Return the table of constants of one material, whole and without failure.

    Parameters
    ----------
    card : Material
    eos : str
        Equation of state.
    strength : str, optional

    Returns
    -------
    structured ndarray
        Of one row, with the thermal model that the card has.
    """
    names = {kind: "none" for kind in KINDS if kind != "eos"}
    names |= {"eos": eos, "strength": strength}
    if thermal := thermal_of(card):
        names["thermal"] = thermal
    constants = {name: own for name in TABLES if (own := card.constants(name))}
    table = material_table([MaterialModels(card.name, card.rho0, names, constants)])
    if not thermal:
        fill_isentrope(table[0], ROOM_TEMPERATURE)
    return table


def thermal_of(card: Material) -> str:
    """Return the thermal model that a card has constants for; empty for none."""
    return next((name for name in card.given if name in KINDS["thermal"]), "")


def states_at(table: MaterialTable, rho: FloatArray, E: FloatArray) -> States:
    """Return the states of a material at densities and energies."""
    matter = Particles.zeros(rho.size)
    matter.rho[:], matter.E[:] = rho, E
    matter.r[:] = matter.m[:] = matter.h[:] = 1.0
    respond(matter.material_state(), table, 1e-6, 0.0)
    return States(rho, matter.P, E, matter.T, matter.melt)


def isentrope(table: MaterialTable, rho: FloatArray) -> States:
    """Return the states on the isentrope through the reference state (R13)."""
    row = table[0]
    E = np.array([on_isentrope(x / row.rho0, row.isentrope)[0] for x in rho])
    return states_at(table, rho, E)


def shocks(table: MaterialTable, largest_velocity: float, count: int = 200) -> Shocks:
    """Return shocks up to a particle velocity.

    Parameters
    ----------
    table : structured ndarray
        As of `table_of`.
    largest_velocity : float
        Particle velocity [m/s].
    count : int, optional
        Of the shocks; they are even in the compression ``1 - rho0/rho``.

    Returns
    -------
    Shocks
        With rising velocity; fewer where no shock compresses matter so much.
    """
    rho0 = float(table["rho0"][0])
    end = 0.9
    for _ in range(2):  # the second time within the range that was found
        found = _shocks(table, rho0 / (1.0 - end * np.arange(1, count + 1) / count))
        rising = np.isfinite(found.u_p) & (found.states.P > 0.0)
        rising &= np.maximum.accumulate(np.nan_to_num(found.u_p)) <= found.u_p
        within = np.logical_and.accumulate(rising & (found.u_p <= largest_velocity))
        last = int(np.count_nonzero(within))
        end = end * min(last + 1, count) / count
    states = States(*(x[:last] for x in found.states))
    return Shocks(found.u_p[:last], found.u_s[:last], states)


def _shocks(table: MaterialTable, rho: FloatArray) -> Shocks:
    """Return shocks to densities: ``E = P (1/rho0 - 1/rho)/2``, by secants."""
    rho0 = float(table["rho0"][0])
    squeezed = 1.0 / rho0 - 1.0 / rho

    def excess(E: FloatArray) -> FloatArray:
        return 0.5 * states_at(table, rho, E).P * squeezed - E

    with np.errstate(all="ignore"):
        old, new = np.zeros(rho.size), np.maximum(excess(np.zeros(rho.size)), 1.0)
        f_old, f_new = excess(old), excess(new)
        for _ in range(_MOST_ITERATIONS):
            step = np.where(f_new == f_old, 0.0, f_new * (new - old) / (f_new - f_old))
            old, f_old, new = new, f_new, new - step
            if np.all(np.abs(step) <= _ROUNDING * np.abs(new)):
                break
            f_new = excess(new)
        states = states_at(table, rho, new)
        u_p = np.sqrt(states.P * squeezed)
        u_s = states.P / (rho0 * u_p)
    return Shocks(u_p, u_s, states)


def melting_line(card: Material, rho: FloatArray) -> FloatArray:
    """Return the melting temperatures [K] of a card with a thermal model (R13)."""
    own = card.constants(thermal_of(card))
    numbers = own.melting_temperature, own.melting_gamma, own.melting_slope
    return np.array([melting_temperature(x / card.rho0, *numbers) for x in rho])


def yield_stresses(
    table: MaterialTable, strain: FloatArray, rate: float, T: float
) -> FloatArray:
    """Return yield stresses [Pa] over the equivalent plastic strain, at no pressure.

    Parameters
    ----------
    table : structured ndarray
        As of `table_of`, with the strength model.
    strain : ndarray
    rate : float
        Of the plastic strain [1/s].
    T : float
        Temperature [K].
    """
    matter = Particles.zeros(strain.size)
    increment = rate * _INSTANT
    matter.rho[:], matter.T[:], matter.distension[:] = table["rho0"][0], T, 1.0
    matter.plastic_strain[:] = np.maximum(strain - increment, 0.0)
    state, row = matter.material_state(), table[0]
    found = np.zeros(strain.size)
    for k in range(strain.size):
        matter.G[k] = shear_modulus(state, k, row)
        found[k] = flow_stress(state, k, row, increment, _INSTANT)[0]
    return found


def fracture_strains(
    constants: Any, triaxiality: FloatArray, rate: float, T: float
) -> FloatArray:
    """Return strains to fracture over the triaxiality (R18).

    Parameters
    ----------
    constants : JohnsonCookDamage
    triaxiality : ndarray
        Mean stress, tension positive, over equivalent stress.
    rate : float
        Of the plastic strain [1/s].
    T : float
        Temperature [K].
    """
    row = np.array([record(constants)], record_type(type(constants)))[0]
    return np.array([fracture_strain(x, rate, T, row) for x in triaxiality])
