"""What constants of materials hardly mean: warnings, each with what to do."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from mpisph.materials.model import TABLES, Material
from mpisph.physics.eos.table import States
from mpisph.physics.response import KINDS

__all__ = ["card_doubts", "doubtful_constants", "doubtful_elongation"]

LEAST_SPALL, LARGEST_SPALL = 2e-4, 0.1
"""Spall strength over bulk modulus: ice has 0.002, metals 0.006 to 0.02, and crystals
without a flaw some 0.1."""

LONGEST_OPENING = 1e-2
"""Of a crack that lets nothing through any more [m]; metals have some 0.1 mm."""

LONGEST_RELAXATION = 1e-6
"""Time that cracks may take to open [s]; aluminium's is some 10 ns."""

LARGEST_ELONGATION = 1.0
"""At break; annealed metals have 0.3 to 0.7."""

LEAST_RISE, LARGEST_RISE = 0.2, 30.0
"""Of the shear modulus at a pressure of the bulk modulus; Steinberg's metals have 2
to 6."""

MOST_SOFT = 1.5
"""Share of the shear modulus that heat would take up to melting; titanium's is 1.05."""

LEAST_SHEAR, LARGEST_SHEAR = 0.05, 1.5
"""Shear modulus over bulk modulus: Poisson's ratios of 0.475 and 0."""

LARGEST_YIELD = 0.25
"""Yield stress over shear modulus; crystals without a flaw have 0.1 to 0.2."""

LEAST_FUSION, LARGEST_FUSION = 0.02, 5.0
"""Heat of fusion over heat capacity times melting temperature: metals 0.3 to 0.6."""

LARGEST_HEATING = 3.0
"""Mean heat capacity up to melting over that at the reference temperature."""

LEAST_HEAT, LARGEST_HEAT = 0.8e6, 6e6
"""Heat capacity of a volume of a solid [J/m3/K]; the cards have 1.4 to 3.5 MJ/m3/K."""

LEAST_CRUSH, LARGEST_CRUSH = 1e-8, 0.3
"""Pressures that crush pores over the bulk modulus of the solid."""

COMPRESSED = 0.3
"""Share of the volume by which a strong shock compresses a solid."""

LEAST_MELTING, LARGEST_MELTING = 0.75, 1.1
"""Temperature where strength vanishes over that of melting. Alloys lose their strength
where their melting begins, and melt at the upper end of the range."""

LEAST_SPEED, LARGEST_SPEED = 50.0, 3e4
"""Of sound in a solid [m/s]."""

LEAST_DENSITY, LARGEST_DENSITY = 20.0, 3e4
"""Of a solid [kg/m3]."""


def card_doubts(card: Material) -> Iterator[str]:
    """Yield what is doubtful about a card: its choices, and the constants it has."""
    for name, text in _doubts_of_choices(card):
        yield f"{card.name}.{name}: {text}"
    yield from doubtful_elongation(card.name, card.elongation)
    if (linear := card.constants("linear")) is not None:
        tables = {name: own for name in TABLES if (own := card.constants(name))}
        yield from doubtful_constants(card.name, card.rho0, linear.bulk_modulus, tables)


def doubtful_elongation(key: str, elongation: float | None) -> Iterator[str]:
    """Yield what is doubtful about an elongation at break [1], if there is one.

    Parameters
    ----------
    key : str
        Of the material, such as ``"materials.al-6061-t6"``.
    elongation : float or None
    """
    if elongation is not None and elongation > LARGEST_ELONGATION:
        yield (
            f"{key}.elongation: at {elongation:g} the metal would be "
            f"{1.0 + elongation:g} times as long when it breaks; is it in per cent? "
            f"write {elongation / 100:g}"
        )


def doubtful_constants(
    key: str, rho0: float, bulk_modulus: float, tables: Mapping[str, Any]
) -> Iterator[str]:
    """Yield what is doubtful about the constants of a solid.

    Parameters
    ----------
    key : str
        Of the material, such as ``"materials.al-6061-t6"``.
    rho0 : float
        Reference density [kg/m3].
    bulk_modulus : float
        [Pa].
    tables : mapping
        Constants of models by the models' names.
    """
    for name, text in _doubts(rho0, bulk_modulus, tables):
        yield f"{key}.{name}: {text}"


def _doubts_of_choices(card: Material) -> Iterator[tuple[str, str]]:
    """Yield choices that a case refuses."""
    for kind in KINDS:
        name = getattr(card, kind)
        if name not in TABLES or name == "minimum-pressure":  # the scheme has that
            continue
        constants = card.constants(name)
        if constants is None:
            yield kind, f"it has no {name} constants, without which a case refuses it"
        elif constants.needs_temperature and card.thermal in {None, "none"}:
            has = card.constants("heat-capacity") is not None
            constants_too = "" if has else ", and give it those constants"
            yield (
                kind,
                f"{name} depends on the temperature, which a thermal model gives; "
                f'set thermal = "heat-capacity"{constants_too}',
            )


def _doubts(
    rho0: float, bulk: float, tables: Mapping[str, Any]
) -> Iterator[tuple[str, str]]:
    if not LEAST_DENSITY <= rho0 <= LARGEST_DENSITY:
        yield "rho0", f"{rho0:.4g} kg/m3 of a solid: is the unit right?"
        return
    speed = (bulk / rho0) ** 0.5
    if not LEAST_SPEED <= speed <= LARGEST_SPEED:
        yield "eos", f"sound at {speed:.4g} m/s in a solid: is the unit right?"
        return  # the bulk modulus, by which the others are judged, is wrong too
    yield from _doubts_of_strength(bulk, tables)
    yield from _doubts_of_heat(rho0, tables)
    yield from _doubts_of_pores(bulk, tables)
    if table := tables.get("table"):
        yield from _doubts_of_table(rho0, table.states)
    if spall := tables.get("spall"):
        share = spall.strength / bulk
        if not LEAST_SPALL <= share <= LARGEST_SPALL:
            yield (
                "spall.strength",
                f"{spall.strength:.4g} Pa is {share:.2g} of the bulk modulus, where "
                f"solids part at {LEAST_SPALL:g} to {LARGEST_SPALL:g} of it; is the "
                "unit right?",
            )
        elif (opening := 2.0 * spall.crack_energy / spall.strength) > LONGEST_OPENING:
            yield (
                "spall.crack_energy",
                f"a crack would carry tension until it is {opening:.2g} m wide; is the "
                "unit right?",
            )
        if spall.relaxation_time > LONGEST_RELAXATION:
            yield (
                "spall.relaxation_time",
                f"for {spall.relaxation_time:.2g} s matter would bear any tension; is "
                "the unit right?",
            )
    damage = tables.get("johnson-cook-damage")
    if damage and damage.D2 * damage.D3 > 0.0:
        yield (
            "johnson-cook-damage.D3",
            f"with {damage.D3:g} matter in tension would bear more strain than in "
            "compression; some codes count pressure as positive, and there D3 has the "
            "other sign",
        )


def _doubts_of_strength(
    bulk: float, tables: Mapping[str, Any]
) -> Iterator[tuple[str, str]]:
    for name, constants in tables.items():
        G = getattr(constants, "shear_modulus", 0.0)
        if G > 0.0 and not LEAST_SHEAR <= G / bulk <= LARGEST_SHEAR:
            poisson = (3.0 * bulk - 2.0 * G) / (6.0 * bulk + 2.0 * G)
            yield (
                f"{name}.shear_modulus",
                f"{G:.4g} Pa with a bulk modulus of {bulk:.4g} Pa is a Poisson's ratio "
                f"of {poisson:.2g}; is the unit right?",
            )
        start = "A" if name == "johnson-cook" else "yield_strength"
        Y = getattr(constants, start, 0.0)
        if G > 0.0 and Y > LARGEST_YIELD * G:
            yield (
                f"{name}.{start}",
                f"{Y:.4g} Pa is {Y / G:.2g} of the shear modulus; is the unit right?",
            )
    if steinberg := tables.get("steinberg-guinan"):
        rise = steinberg.A * bulk
        if steinberg.A > 0.0 and not LEAST_RISE <= rise <= LARGEST_RISE:
            yield (
                "steinberg-guinan.A",
                "at a pressure of the bulk modulus the shear modulus would rise "
                f"{rise:.3g}-fold; Steinberg gives it per Mbar, as in "
                '"6.52 Mbar^-1"; is the unit right?',
            )


def _doubts_of_pores(
    bulk: float, tables: Mapping[str, Any]
) -> Iterator[tuple[str, str]]:
    pores = tables.get("p-alpha")
    for name in ("elastic_pressure", "solid_pressure") if pores else ():
        P = getattr(pores, name)
        if P > 0.0 and not LEAST_CRUSH <= P / bulk <= LARGEST_CRUSH:
            yield (
                f"p-alpha.{name}",
                f"{P:.4g} Pa is {P / bulk:.2g} of the bulk modulus of the solid; is "
                "the unit right?",
            )


def _doubts_of_table(rho0: float, states: States) -> Iterator[tuple[str, str]]:
    """Yield where compression would lower the pressure, the first place.

    Below the reference density that is what a loop of van der Waals does.
    """
    rho, P = states.density, states.pressure
    fall = np.argwhere((np.diff(P, axis=0) < 0.0) & (rho[1:, None] > rho0))
    if fall.size:
        i, j = fall[0]
        yield (
            "table",
            f"at {states.temperature[j]:g} K the pressure falls from {P[i, j]:.4g} to "
            f"{P[i + 1, j]:.4g} Pa as the density rises from {rho[i]:g} to "
            f"{rho[i + 1]:g} kg/m3: what is compressed there collapses",
        )


def _doubts_of_heat(
    rho0: float, tables: Mapping[str, Any]
) -> Iterator[tuple[str, str]]:
    heat = tables.get("heat-capacity")
    if heat is None:
        return
    volume = rho0 * heat.heat_capacity
    if not LEAST_HEAT <= volume <= LARGEST_HEAT:
        yield (
            "heat-capacity.heat_capacity",
            f"{heat.heat_capacity:.4g} J/kg/K is {volume / 1e6:.3g} MJ/m3/K, where "
            "solids have 1 to 4; is the unit right?",
        )
        return  # the heats are judged by it
    T_m = heat.melting_temperature
    least = heat.melting_gamma - heat.melting_slope * COMPRESSED
    if least < 0.333:
        at = "" if heat.melting_gamma < 0.333 else f" of {COMPRESSED:.0%}"
        slope = f" and a slope of {heat.melting_slope:g}" if at else ""
        yield (
            "heat-capacity.melting_gamma",
            f"with {heat.melting_gamma:g}{slope} the melting temperature falls with "
            f"compression{at}; take the Grueneisen parameter, or 1/3 for no rise",
        )
    fusion = heat.heat_of_fusion / (heat.heat_capacity * T_m)
    if heat.heat_of_fusion > 0.0 and not LEAST_FUSION <= fusion <= LARGEST_FUSION:
        yield (
            "heat-capacity.heat_of_fusion",
            f"{heat.heat_of_fusion:.4g} J/kg is {fusion:.2g} of heat capacity times "
            "melting temperature, where metals have 0.3 to 0.6; is the unit right?",
        )
    mean = heat.heat_to_melting / (heat.heat_capacity * heat.span)
    if mean > LARGEST_HEATING:
        yield (
            "heat-capacity.heat_to_melting",
            f"the mean heat capacity up to melting would be {mean:.3g} times that at "
            "the reference temperature; is the unit right?",
        )
    for name in ("johnson-cook", "johnson-cook-damage"):
        other = tables.get(name)
        if other and not (
            LEAST_MELTING <= other.melting_temperature / T_m <= LARGEST_MELTING
        ):
            yield (
                f"{name}.melting_temperature",
                f"{other.melting_temperature:g} K, and heat-capacity has {T_m:g} K; "
                "are both in kelvins, and of this material?",
            )
    steinberg = tables.get("steinberg-guinan")
    if steinberg and steinberg.B * (T_m - steinberg.reference_temperature) > MOST_SOFT:
        yield (
            "steinberg-guinan.B",
            f"with {steinberg.B:g} 1/K the shear modulus vanishes far below the "
            f"melting temperature of {T_m:g} K; is the unit right?",
        )
