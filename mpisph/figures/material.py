"""A figure of a material: shocks, isentrope, melting, yield, strain to fracture."""

import textwrap
from collections.abc import Callable
from functools import partial
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mpisph.core.errors import CaseError, Problem
from mpisph.core.particles import FloatArray
from mpisph.figures.style import (
    COMPUTED,
    DPI,
    STYLE,
    WIDTH,
    Out,
    body_colour,
    save,
)
from mpisph.materials.curves import (
    ROOM_TEMPERATURE,
    Shocks,
    equations_of_state,
    fracture_strains,
    isentrope,
    melting_line,
    shocks,
    table_of,
    thermal_of,
    yield_stresses,
)
from mpisph.materials.model import Material
from mpisph.physics.response import KINDS, MaterialTable

_FASTEST = 5e3
# Particle velocity [m/s] up to which shocks are drawn: of an impact at 10 km/s on a
# like material.

_LARGEST_STRAIN = 1.0
_SLOW, _FAST = 1.0, 1e6
# Strain rates [1/s]: of a tensile test, and of an impact.

_RATES = {_SLOW: "1/s", _FAST: "10$^6$/s"}

_PIECES = (1e-4, 1.0)
# Sizes of pieces [m] whose strength is drawn.

_HEATED = (0.0, 0.3, 0.6, 0.9)
# Parts of the way from room temperature to melting.

_ROW_HEIGHT = 2.65
_TITLE_WIDTH = 88
_LEGEND: dict[str, Any] = {"fontsize": 7.0, "handlelength": 2.2}
_FLAT: dict[str, Any] = {"color": "0.4", "linestyle": ":", "linewidth": 1.3}

Panel = Callable[[Axes], None]


class _Matter:
    """A material's tables and shocks, one for each of its equations of state."""

    def __init__(self, card: Material) -> None:
        self.card = card
        self.names = equations_of_state(card)
        self.tables: dict[str, MaterialTable] = {
            name: table_of(card, name) for name in self.names
        }
        self.shocks: dict[str, Shocks] = {
            name: shocks(table, _FASTEST) for name, table in self.tables.items()
        }

    def label(self, name: str) -> str:
        """Return what reports call an equation of state."""
        return KINDS["eos"][name].label


def draw_material(card: Material, out: Out) -> None:
    """Draw the curves of a material that its constants allow.

    Parameters
    ----------
    card : Material
    out : Path or BytesIO

    Raises
    ------
    OSError
        If the figure cannot be written.
    CaseError
        If the card has nothing to draw.
    """
    panels = _panels(card)
    if not panels:
        expected = "no equation of state of a solid, so there are no curves to draw"
        raise CaseError([Problem(expected, key="material", value=f'"{card.name}"')])
    rows = -(-len(panels) // 2)
    with mpl.rc_context(STYLE):
        height = _ROW_HEIGHT * rows + 0.35
        figure = Figure(figsize=(WIDTH, height), dpi=DPI, layout="constrained")
        title = f"{card.name}: {card.description}" if card.description else card.name
        title = textwrap.fill(title, _TITLE_WIDTH)
        figure.suptitle(title, x=0.012, ha="left", fontsize=10.0, parse_math=False)
        grid = figure.subplots(rows, 2, squeeze=False).ravel()
        for axes, panel in zip(grid, panels, strict=False):
            panel(axes)
        for axes in grid[len(panels) :]:
            axes.remove()
        save(figure, out)


def _panels(card: Material) -> list[Panel]:
    """Return what there is to draw, in order."""
    found: list[Panel] = []
    matter = _Matter(card)
    if matter.names:
        found += [partial(_draw_velocities, matter), partial(_draw_pressures, matter)]
        if thermal_of(card):
            found += [partial(_draw_temperatures, matter), partial(_draw_melt, matter)]
        elastic = card.constants("elastic-plastic")
        if card.constants("grady-kipp") is not None and elastic is not None:
            found.append(partial(_draw_flaws, card))
        for name in KINDS["strength"]:
            hardens = name not in ("none", "elastic-plastic")
            if hardens and card.constants(name) is not None:
                found.append(partial(_draw_yield, matter, name))
        if elastic is not None and len(found) % 2 and not _hardening(card):
            found.append(partial(_draw_yield, matter, "elastic-plastic"))
    if card.constants("johnson-cook-damage") is not None:
        found.append(partial(_draw_fracture, card))
    return found


def _hardening(card: Material) -> bool:
    return any(
        card.constants(name) is not None
        for name in KINDS["strength"]
        if name not in ("none", "elastic-plastic")
    )


def _draw_velocities(matter: _Matter, axes: Axes) -> None:
    """Draw the shock velocity over the particle velocity."""
    for index, name in enumerate(matter.names):
        found = matter.shocks[name]
        axes.plot(
            1e-3 * found.u_p,
            1e-3 * found.u_s,
            color=body_colour(index),
            label=matter.label(name),
        )
    axes.set_xlim(0.0, 1e-3 * _FASTEST)
    axes.set_xlabel("particle velocity $u_p$ [km/s]")
    axes.set_ylabel("shock velocity $U_s$ [km/s]")
    axes.legend(loc="upper left", **_LEGEND)


def _draw_pressures(matter: _Matter, axes: Axes) -> None:
    """Draw the pressure behind shocks and on the isentrope over the density."""
    rho0 = matter.card.rho0
    for index, name in enumerate(matter.names):
        states, colour = matter.shocks[name].states, body_colour(index)
        cold = isentrope(matter.tables[name], states.rho)
        label = matter.label(name) if len(matter.names) > 1 else ""
        axes.plot(
            states.rho / rho0,
            1e-9 * states.P,
            color=colour,
            label=f"{label} shocks".strip(),
        )
        axes.plot(
            states.rho / rho0,
            1e-9 * cold.P,
            color=colour,
            linestyle="--",
            label=f"{label} isentrope".strip(),
        )
    axes.set_xlim(left=1.0)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("density over reference density")
    axes.set_ylabel("pressure [GPa]")
    axes.legend(loc="upper left", **_LEGEND)


def _draw_temperatures(matter: _Matter, axes: Axes) -> None:
    """Draw temperatures behind shocks and on the isentrope, and the melting line."""
    rho0 = matter.card.rho0
    for index, name in enumerate(matter.names):
        states, colour = matter.shocks[name].states, body_colour(index)
        cold = isentrope(matter.tables[name], states.rho)
        axes.plot(states.rho / rho0, 1e-3 * states.T, color=colour)
        axes.plot(states.rho / rho0, 1e-3 * cold.T, color=colour, linestyle="--")
    plain = body_colour(0) if len(matter.names) == 1 else "0.4"
    axes.plot([], [], color=plain, label="shocks")
    axes.plot([], [], color=plain, linestyle="--", label="isentrope")
    widest = max((found.states.rho for found in matter.shocks.values()), key=np.max)
    axes.plot(
        widest / rho0,
        1e-3 * melting_line(matter.card, widest),
        label="melting",
        **COMPUTED,
    )
    axes.set_xlim(left=1.0)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("density over reference density")
    axes.set_ylabel("temperature [1000 K]")
    axes.legend(loc="upper left", **_LEGEND)


def _draw_melt(matter: _Matter, axes: Axes) -> None:
    """Draw temperatures behind shocks over their pressure, and where matter melts."""
    for index, name in enumerate(matter.names):
        states, colour = matter.shocks[name].states, body_colour(index)
        P = 1e-9 * states.P
        label = f"{matter.label(name)} shocks" if len(matter.names) > 1 else "shocks"
        axes.plot(P, 1e-3 * states.T, color=colour, label=label)
        axes.plot(P, 1e-3 * melting_line(matter.card, states.rho), **COMPUTED)
        begun, ended = states.melt > 0.0, states.melt >= 1.0
        if begun.any() and ended.any():
            at = dict.fromkeys(_short(P[x.argmax()]) for x in (begun, ended))
            axes.axvspan(
                P[begun.argmax()],
                P[ended.argmax()],
                color=colour,
                alpha=0.15,
                label=f"melt at {' to '.join(at)} GPa",
            )
    axes.plot([], [], label="melting", **COMPUTED)
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("pressure behind the shock [GPa]")
    axes.set_ylabel("temperature [1000 K]")
    axes.legend(loc="upper left", **_LEGEND)


def _short(value: float) -> str:
    return f"{value:.0f}" if value >= 10.0 else f"{value:.2g}"


def _draw_yield(matter: _Matter, strength: str, axes: Axes) -> None:
    """Draw the yield stress over the plastic strain, warmer in warmer colours."""
    card = matter.card
    table = table_of(card, matter.names[0], strength)
    # Hardening is steepest at its start.
    strain = _LARGEST_STRAIN * np.linspace(0.0, 1.0, 81) ** 2
    rates = (_SLOW, _FAST) if _depends_on_rate(table, strain) else (_SLOW,)
    for T, colour in _heated(card, card.constants(strength)):
        for rate, style in zip(rates, ("-", "--"), strict=False):
            stress = yield_stresses(table, strain, rate, T)
            label = f"{T:.0f} K" if style == "-" else None
            axes.plot(strain, 1e-6 * stress, color=colour, linestyle=style, label=label)
    if len(rates) > 1:
        axes.plot([], [], color="0.4", label=_RATES[_SLOW])
        axes.plot([], [], color="0.4", linestyle="--", label=_RATES[_FAST])
    elastic = card.constants("elastic-plastic")
    if elastic is not None and strength != "elastic-plastic":
        axes.axhline(1e-6 * elastic.yield_strength, label="perfectly plastic", **_FLAT)
    axes.set_xlim(0.0, _LARGEST_STRAIN)
    axes.set_ylim(0.0, 1.45 * axes.get_ylim()[1])  # room for the legend
    axes.set_xlabel("equivalent plastic strain")
    axes.set_ylabel("yield stress at P = 0 [MPa]")
    axes.set_title(KINDS["strength"][strength].label, fontsize=8.5, loc="left")
    if card.constants(strength).needs_temperature:
        axes.legend(loc="upper left", ncols=2, **_LEGEND)


def _depends_on_rate(table: MaterialTable, strain: FloatArray) -> bool:
    slow, fast = (
        yield_stresses(table, strain[-1:], rate, ROOM_TEMPERATURE)
        for rate in (_SLOW, _FAST)
    )
    return not np.allclose(slow, fast, rtol=1e-9)


def _heated(card: Material, constants: object) -> list[tuple[float, object]]:
    """Return temperatures below melting, with their colours."""
    if not getattr(constants, "needs_temperature", False):
        return [(ROOM_TEMPERATURE, body_colour(0))]
    own = getattr(constants, "melting_temperature", None)
    if own is None:
        thermal = thermal_of(card)
        own = card.constants(thermal).melting_temperature if thermal else 1000.0
    colours = mpl.colormaps["plasma"](np.linspace(0.05, 0.8, len(_HEATED)))
    warm = (ROOM_TEMPERATURE + part * (own - ROOM_TEMPERATURE) for part in _HEATED)
    return list(zip(warm, colours, strict=True))


def _draw_flaws(card: Material, axes: Axes) -> None:
    """Draw the tension at which the weakest flaw of a piece is active, by its size."""
    flaws, G = (
        card.constants("grady-kipp"),
        card.constants("elastic-plastic").shear_modulus,
    )
    K = card.constants("linear").bulk_modulus
    size = np.geomspace(*_PIECES)
    stress = 9.0 * K * G / (3.0 * K + G) * (flaws.k * size**3) ** (-1.0 / flaws.m)
    axes.loglog(1e3 * size, 1e-6 * stress, color=body_colour(0))
    axes.set_xlabel("size of a piece [mm]")
    axes.set_ylabel("tension at the weakest flaw [MPa]")
    axes.set_title(KINDS["failure"]["grady-kipp"].label, fontsize=8.5, loc="left")


def _draw_fracture(card: Material, axes: Axes) -> None:
    """Draw the strain to fracture over the triaxiality."""
    constants = card.constants("johnson-cook-damage")
    triaxiality = np.linspace(-0.33, 1.5, 101)  # below, nothing breaks
    heated = _heated(card, constants)
    for T, colour in heated:
        strain = fracture_strains(constants, triaxiality, _SLOW, T)
        axes.semilogy(triaxiality, strain, color=colour, label=f"{T:.0f} K")
    if constants.D4 != 0.0:
        T, colour = heated[0]
        strain = fracture_strains(constants, triaxiality, _FAST, T)
        label = f"{T:.0f} K, {_RATES[_FAST]}"
        axes.semilogy(triaxiality, strain, color=colour, linestyle="--", label=label)
    for place, name in ((0.0, "shear"), (1.0 / 3.0, "tension")):
        axes.axvline(place, color="0.7", linewidth=0.7, zorder=0)
        axes.annotate(
            name,
            (place, 0.02),
            xycoords=("data", "axes fraction"),
            xytext=(2, 0),
            textcoords="offset points",
            rotation=90,
            fontsize=7.0,
            color="0.4",
        )
    axes.set_xlim(-0.5, 1.5)
    axes.set_xlabel("triaxiality: mean stress over equivalent stress")
    axes.set_ylabel("strain to fracture")
    label = KINDS["ductile"]["johnson-cook-damage"].label
    axes.set_title(label, fontsize=8.5, loc="left")
    axes.legend(loc="best", **_LEGEND)
