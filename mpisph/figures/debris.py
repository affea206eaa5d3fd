"""Figures of the debris: a synthetic radiograph, the spray, and the fragments."""

import math
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import FuncNorm
from matplotlib.figure import Figure

from mpisph.analysis.fragments import CONTACT, Fragments, find_fragments
from mpisph.analysis.radiograph import (
    PHOTON_ENERGY,
    areal_density,
    material_attenuations,
    transmission,
)
from mpisph.analysis.spray import Spray, measure_spray
from mpisph.case import Case
from mpisph.core.particles import FloatArray
from mpisph.diagnostics.cloud import (
    CloudDefinition,
    before_next,
    cloud_definition,
    in_cloud,
)
from mpisph.figures.dots import Dots
from mpisph.figures.style import (
    COMPUTED,
    DPI,
    STYLE,
    WIDTH,
    Out,
    body_colour,
    label_log_axis,
    save,
)
from mpisph.figures.view import (
    View,
    choose_view,
    exposure_at,
    set_limits,
    title_lines,
)
from mpisph.io.snapshot import Snapshot

Arrays = dict[str, npt.NDArray[Any]]
"""As in `Snapshot.arrays`."""

_FILM_PIXELS = 800
# Along the axis; more would only show the particles' square sections.

_WIDEN = 3.0
# Three fifths of what the kernel spreads at two spacings: the core is without a grain,
# and edges stay sharp.

_SHADE = 0.6
# Power of the rays' absorption that the grey follows; below 1 it lifts the thin shell.

_DARKEST = 0.995
# Share of the cloud's pixels that are not black.

_FEWEST_RAYS = 0.1
# What so few rays pass is black in any case.

_FILLED = 5
# Moving particles for each bin of the spray, on average.

_GREY: dict[str, Any] = {"color": "0.4", "linewidth": 0.9}
_FACTORS: dict[float, dict[str, Any]] = {
    1.2: {**_GREY, "linestyle": ":"},
    CONTACT: {**COMPUTED, "linestyle": "-"},
    2.0: {**_GREY, "linestyle": "--"},
    3.0: {**_GREY, "linestyle": "-."},
}
# The default's and others, to show how far the fragments depend on the factor.

_KG_M2 = 0.1
# In g/cm2; so 1 m2/kg is 10 cm2/g.


def draw_radiograph(
    snapshot: Snapshot,
    case: Case,
    out: Out,
    energy: float = PHOTON_ENERGY,
) -> None:
    """Draw a synthetic flash radiograph above the particles, in one scale.

    Dense matter is dark on a light field, as on prints of the experiments: from white,
    where all rays pass, to black, where as few pass as in the cloud's densest parts.
    The plate, seen along its whole diameter, is black as well. Rings are drawn wider
    than they are, at the same mass, so that they merge where the cloud is coherent.

    Parameters
    ----------
    snapshot : Snapshot
    case : Case
    out : Path or BytesIO
    energy : float, optional
        Of the photons [eV]. Each material attenuates them as its composition does.

    Raises
    ------
    OSError
        If the figure cannot be written.
    """
    exposure = exposure_at(case, snapshot.time)
    view = choose_view(snapshot, case, exposure, headroom=1.12)
    lines = title_lines(case, snapshot.time, exposure)
    lines.append("above: synthetic flash radiograph; below: the particles")
    texts = max(len(case.bodies), len(case.material_table) + 3)
    with mpl.rc_context(STYLE):
        figure, film, particles, bar = _make_panels(view, len(lines), texts)
        film.set_title("\n".join(lines), loc="left", parse_math=False)
        attenuations = material_attenuations(case, energy)
        image = _draw_film(film, snapshot, case, view, attenuations)
        film.set_ylabel("lateral distance y [mm]")
        figure.colorbar(
            image, bar, extend="max", label=_density_label(case, attenuations)
        )
        Dots(particles, case, view).show(snapshot)
        particles.set_ylabel("radius r [mm]")
        particles.set_xlabel("axial position z [mm]", loc="left")
        figure.legend(
            loc="lower left", bbox_to_anchor=(particles.get_position().x0, 0.0)
        )
        figure.text(
            particles.get_position().x1,
            0.06 / figure.get_figheight(),
            f"Grey: (1 \u2212 exp(\u2212µσ))$^{{{_SHADE:g}}}$ with µ at "
            f"{1e-3 * energy:g} keV of\n{_attenuations_text(case, attenuations)};\n"
            "parallel rays, no scattering. Each particle is a ring, "
            f"{_WIDEN:g} sizes wide:\n"
            "stripes are single rings, not features of the cloud.",
            ha="right",
            va="bottom",
            fontsize=7.5,
            color="0.3",
        )
        save(figure, out)


def _make_panels(
    view: View, title_count: int, legend_count: int
) -> tuple[Figure, Axes, Axes, Axes]:
    """Return a figure with two panels of one scale, and a place for a colour bar."""
    left, right, gap = 0.62, 0.9, 0.12
    bottom, top = 0.6 + 0.175 * max(legend_count, 3), 0.2 + 0.19 * title_count
    width = WIDTH - left - right
    height = width * view.aspect
    total = bottom + 2.0 * height + gap + top
    figure = Figure(figsize=(WIDTH, total), dpi=DPI)

    def add(x: float, y: float, w: float) -> Axes:
        return figure.add_axes((x / WIDTH, y / total, w / WIDTH, height / total))

    particles = add(left, bottom, width)
    film = add(left, bottom + height + gap, width)
    bar = add(left + width + 0.08, bottom + height + gap, 0.14)
    for axes in (film, particles):
        set_limits(axes, view)
    film.tick_params(labelbottom=False)
    return figure, film, particles, bar


def _draw_film(
    axes: Axes,
    snapshot: Snapshot,
    case: Case,
    view: View,
    attenuations: FloatArray,
) -> Any:
    """Draw the areal density [g/cm2] in greys, and return the image.

    Of several materials it is that of the first which attenuates as much.
    """
    arrays, definition = snapshot.arrays, cloud_definition(case)
    pixel = 1e-3 * (view.z_high - view.z_low) / _FILM_PIXELS
    window = (
        (1e-3 * view.z_low, 1e-3 * view.z_high),
        1e-3 * view.r_high,
        pixel,
        _WIDEN,
    )
    mass_attenuation = float(attenuations[0])
    weights = attenuations / mass_attenuation
    film = areal_density(arrays, *window, weights[arrays["material"]])
    subject = _subject(arrays, definition)
    of_subject = weights[subject["material"]]
    dense = areal_density(subject, *window, of_subject).areal_density
    darkest = -math.log(_FEWEST_RAYS) / mass_attenuation
    if dense.any():
        darkest = min(darkest, float(np.quantile(dense[dense > 0.0], _DARKEST)))

    def shade_of(sigma: Any) -> Any:
        absorption = 1.0 - transmission(sigma / _KG_M2, mass_attenuation)
        return np.maximum(absorption, 0.0) ** _SHADE

    def sigma_of(shade: Any) -> Any:
        absorption = np.clip(shade, 0.0, 1.0 - 1e-12) ** (1.0 / _SHADE)
        return -_KG_M2 / mass_attenuation * np.log1p(-absorption)

    norm = FuncNorm((shade_of, sigma_of), 0.0, _KG_M2 * darkest)
    return axes.pcolormesh(
        1e3 * film.z_edges,
        1e3 * film.y_edges,
        _KG_M2 * film.areal_density,
        norm=norm,
        cmap="gray_r",
        rasterized=True,
        zorder=0,
    )


def _density_label(case: Case, attenuations: FloatArray) -> str:
    """Return what the grey stands for."""
    label = "areal density along the ray"
    if np.ptp(attenuations) > 0.0:
        label = f"{label}, as of {case.material_table[0].material}"
    return f"{label} [g/cm²]"


def _attenuations_text(case: Case, attenuations: FloatArray) -> str:
    """Return the coefficient of each material, and which are not known."""
    found: dict[str, str] = {}
    for models, value in zip(case.material_table, attenuations, strict=True):
        known = case.materials[models.material].composition
        guess = "" if known else " (no composition: as aluminium)"
        found[models.material] = f"{models.material}: {value / _KG_M2:.3g} cm²/g{guess}"
    return ";\n".join(found.values())


def _subject(arrays: Arrays, definition: CloudDefinition) -> Arrays:
    """Return the cloud; before there is one, what moves."""
    subject = in_cloud(arrays["body"], arrays["z"], arrays["u_z"], definition)
    if not subject.any():
        subject = np.hypot(arrays["u_r"], arrays["u_z"]) > definition.min_velocity
    return {name: x[subject] for name, x in arrays.items()}


def draw_spray(snapshot: Snapshot, case: Case, out: Out) -> None:
    """Draw mass and momentum of all that moves against its direction.

    Parameters
    ----------
    snapshot : Snapshot
    case : Case
    out : Path or BytesIO

    Raises
    ------
    OSError
        If the figure cannot be written.
    """
    definition = cloud_definition(case)
    limit = definition.min_velocity
    a = snapshot.arrays
    moving = np.hypot(a["u_r"], a["u_z"]) > limit
    moving &= before_next(a["body"], definition)
    bins = _spray_bins(int(np.count_nonzero(moving)))
    spray = measure_spray(a, definition, bins)
    lines = title_lines(case, snapshot.time, exposure_at(case, snapshot.time))
    lines.append(
        f"everything faster than {limit / 1e3:.2f} km/s: "
        f"{1e3 * spray.mass.sum():.3g} g, axial momentum "
        f"{spray.momentum_z.sum():.3g} N s"
    )
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH, 6.2), dpi=DPI, layout="constrained")
        panels = figure.subplots(3, 1, sharex=True)
        panels[0].set_title("\n".join(lines), loc="left", parse_math=False)
        names = [body.name for body in case.bodies]
        _draw_bins(panels[0], spray, 1e6 * spray.mass, names, "mass [mg/°]")
        _draw_bins(panels[1], spray, spray.momentum_z, names, "axial momentum [N s/°]")
        _draw_bins(panels[2], spray, spray.momentum_r, names, "radial momentum [N s/°]")
        panels[0].legend()
        axes = panels[-1]
        first, last = _occupied(spray)
        axes.set_xlim(first, last)
        axes.set_xticks(np.arange(first, last + 1.0, 15.0))
        axes.set_xlabel("angle between velocity and axis [°]: 0 along +z, 180 back")
        save(figure, out)


def _spray_bins(particles: int) -> int:
    """Return how many bins so many moving particles fill without gaps, about."""
    fine = (bins for bins in (60, 36, 30, 20) if particles >= _FILLED * bins)
    return next(fine, 12)


def _occupied(spray: Spray) -> tuple[float, float]:
    """Return the range of angles in which something moves, in whole 30 degrees."""
    filled = np.flatnonzero(spray.mass.sum(axis=0))
    if not filled.size:
        return 0.0, 180.0
    first, last = spray.edges[filled[0]], spray.edges[filled[-1] + 1]
    return 30.0 * math.floor(first / 30.0), 30.0 * math.ceil(last / 30.0)


def _draw_bins(
    axes: Axes, spray: Spray, values: FloatArray, names: list[str], quantity: str
) -> None:
    """Draw each body's values per degree, stacked."""
    per_degree = values / np.diff(spray.edges)
    base = np.zeros(per_degree.shape[1])
    for index, (name, row) in enumerate(zip(names, per_degree, strict=True)):
        if not spray.mass[index].any():
            continue
        colour = body_colour(index)
        label = f"{name} ({1e3 * spray.mass[index].sum():.3g} g)"
        axes.stairs(
            base + row,
            spray.edges,
            baseline=base,
            fill=True,
            color=colour,
            label=label,
        )
        base = base + row
    axes.axvline(90.0, color="0.6", linewidth=0.6)
    axes.set_ylabel(quantity)


def draw_fragments(snapshot: Snapshot, case: Case, out: Out) -> None:
    """Draw the fragments' masses against velocity, and how many are heavier.

    Parameters
    ----------
    snapshot : Snapshot
    case : Case
    out : Path or BytesIO

    Raises
    ------
    OSError
        If the figure cannot be written.
    """
    a, definition = snapshot.arrays, cloud_definition(case)
    found = {factor: find_fragments(a, definition, factor) for factor in _FACTORS}
    lines = title_lines(case, snapshot.time, exposure_at(case, snapshot.time))
    lines.append(_fragments_text(found[CONTACT]))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH, 3.9), dpi=DPI, layout="constrained")
        left, right = figure.subplots(1, 2)
        figure.suptitle("\n".join(lines), x=0.01, ha="left", fontsize=10.0,
                        parse_math=False)  # fmt: skip
        _draw_masses(left, found[CONTACT], case)
        for factor, style in _FACTORS.items():
            _draw_numbers(right, found[factor], factor, style)
        if len(found[CONTACT].mass):
            left.set_yscale("log")
            right.set(xscale="log", yscale="log")
            for axis in (left.yaxis, right.xaxis, right.yaxis):
                label_log_axis(axis)
        else:
            for axes in (left, right):
                axes.set(xticks=[], yticks=[])
                text = "all of it is broken" if found[CONTACT].broken else "no cloud"
                axes.text(0.5, 0.5, text, ha="center", transform=axes.transAxes)
        right.legend(title="contact within … sizes", title_fontsize=8.0)
        save(figure, out)


def _fragments_text(found: Fragments) -> str:
    """Return what a fragment is, and how much is in none."""
    if not found.broken:
        return (
            "A fragment is a ring of touching particles; their number depends on the "
            "resolution."
        )
    share = 100.0 * found.broken / (found.mass.sum() + found.broken)
    return (
        "A fragment is a ring of touching sound particles; "
        f"{share:.1f} % of the cloud is broken."
    )


def _draw_masses(axes: Axes, found: Fragments, case: Case) -> None:
    """Draw a dot for each fragment, of the colour of the body that most of it is."""
    most = found.body_mass.argmax(axis=1) if len(found.mass) else np.empty(0, int)
    for index, body in enumerate(case.bodies):
        mine = most == index
        axes.plot(
            1e-3 * found.u_z[mine],
            1e6 * found.mass[mine],
            "o",
            markersize=3.5,
            alpha=0.7,
            markeredgewidth=0.0,
            color=body_colour(index),
            label=f"mostly {body.name}",
        )
    axes.set_xlabel("axial velocity [km/s]")
    axes.set_ylabel("mass of a fragment [mg]")
    axes.legend()


def _draw_numbers(
    axes: Axes, found: Fragments, factor: float, style: dict[str, Any]
) -> None:
    """Draw the number of fragments at least as heavy as a mass."""
    numbers = np.arange(1, len(found.mass) + 1)
    label = f"{factor:g}: {len(found.mass)}"
    axes.plot(1e6 * found.mass, numbers, drawstyle="steps-post", label=label, **style)
    axes.set_xlabel("mass [mg]")
    axes.set_ylabel("number of fragments at least as heavy")
