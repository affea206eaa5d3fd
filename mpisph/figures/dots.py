"""The particles of a figure: dots, coloured by one field or by two, half and half."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, ListedColormap, Normalize
from matplotlib.lines import Line2D

from mpisph.case import Case
from mpisph.core.particles import FloatArray
from mpisph.figures.fields import BODY, Chosen, ShownField
from mpisph.figures.sections import section_area
from mpisph.figures.style import body_colour
from mpisph.figures.view import View, only_finite
from mpisph.io.snapshot import Snapshot

_MOST_POINTS = 400_000
# More points than this in a figure of 1400 pixels only cover each other.

_ROBUST = (0.01, 0.99)
# Quantiles of the values shown at which colours end.

_LEVELS = np.linspace(0.0, 1.0, 501)
# Quantiles that are kept of a snapshot.

BAR_MARGIN = 0.78
"""Room for colour bars at the right of axes [in]."""

_BAR_GAP, _BAR_WIDTH = 0.08, 0.13  # [in]

_LEVELS_OF_COLOUR = 1000

_COVER = math.sqrt(2.0)
# Diameter of a dot over the side of the particle's section.

_EDGE = 1.5
# What is added to the diameter of a dot, for its edge covers pixels in part [pixels].

_LEAST, _FEW = (2.0, 3.0), 1e4
# Least diameter of a dot among many and among few [pixels]; how many are few.

_CLASS = 0.05
# Of two classes of sizes, the larger over the smaller one, less one.

_BOTH = (1.0, -1.0)
# Sides of the axis.

_NO_VALUE = "0.75"
# Colour of bodies whose models do not give the field.

_PALEST = 0.94
# Where colour maps are cut, for their pale ends fade on white.


class Shading(NamedTuple):
    """A field with the limits of its colours.

    Attributes
    ----------
    field : ShownField
    low, high : float
        Where the colours begin and end, in the field's unit; of no use where these are
        those of names.
    extend : {"neither", "min", "max", "both"}
        Beyond which of them values may lie.
    """

    field: ShownField
    low: float = 0.0
    high: float = 1.0
    extend: str = "neither"

    @property
    def has_bar(self) -> bool:
        """Whether a colour bar explains it, and not a legend."""
        return self.field.names is None

    @property
    def norm(self) -> Normalize:
        """Its scale."""
        return Normalize(self.low, self.high)

    @property
    def colour_map(self) -> Colormap:
        """Its colours; those of a centred field are as far from the middle as it is.

        So values of both signs have one scale.
        """
        whole = mpl.colormaps[self.field.colours]
        first, last = 0.0, _PALEST
        if self.field.centred:
            reach = max(abs(self.low), abs(self.high))
            first, last = 0.5 + 0.5 * self.low / reach, 0.5 + 0.5 * self.high / reach
        return ListedColormap(whole(np.linspace(first, last, _LEVELS_OF_COLOUR)))


BODIES: Sequence[Shading] = (Shading(BODY.field),)
"""By bodies, as pictures are by default."""


def find_shadings(
    chosen: Sequence[Chosen], snapshots: Iterable[Snapshot], view: View, case: Case
) -> tuple[Shading, ...]:
    """Find limits of the colours that serve for all snapshots.

    Parameters
    ----------
    chosen : sequence of Chosen
    snapshots : iterable of Snapshot
        Not looked at where all limits are known.
    view : View
        What lies outside of it does not count.
    case : Case

    Returns
    -------
    tuple of Shading
        Where no limits were chosen, and a field has none of its own, those between
        which 98 % of the particles lie, of all snapshots alike.
    """
    found: list[list[FloatArray]] = [[] for _ in chosen]
    if any(_must_look(each) for each in chosen):
        for snapshot in map(only_finite, snapshots):
            arrays = snapshot.arrays
            seen = view.shows(1e3 * arrays["z"], 1e3 * arrays["r"])
            for values, each in zip(found, chosen, strict=True):
                if _must_look(each) and seen.any():
                    shown = each.field.shown(arrays, case)[seen]
                    shown = shown[~np.isnan(shown)]
                    if shown.size:
                        values.append(np.quantile(shown, _LEVELS))
    return tuple(_shading(*pair) for pair in zip(chosen, found, strict=True))


def _must_look(chosen: Chosen) -> bool:
    field, limits = chosen
    return field.names is None and limits is None and field.limits is None


def _shading(chosen: Chosen, found: list[FloatArray]) -> Shading:
    """Return the shading of a field, of which quantiles of the values were found."""
    field, limits = chosen
    if field.names is not None:
        return Shading(field)
    if limits is not None:
        return Shading(field, *limits, extend="both")
    if field.limits is not None:
        return Shading(field, *field.limits)
    values = np.concatenate(found) if found else np.zeros(1)
    low, high = (float(x) for x in np.quantile(values, _ROBUST))
    if field.centred:
        low, high = min(low, 0.0), max(high, 0.0)
    if low == high:
        room = 0.05 * abs(low) or 1.0
        low, high = low - room, high + room
    below, above = bool(values.min() < low), bool(values.max() > high)
    ends = ("neither", "min", "max", "both")
    return Shading(field, low, high, ends[below + 2 * above])


class Dots:
    """The particles in axes, one snapshot after another.

    Each is a disc that covers its own section, see `dot_sizes`.

    Parameters
    ----------
    axes : Axes
        Its legend gets an entry for each name, such as that of a body.
    case : Case
    view : View
        What is outside of it is not drawn.
    shadings : sequence of Shading
        One for both halves of the picture, or those of the upper and lower half.
    """

    def __init__(
        self,
        axes: Axes,
        case: Case,
        view: View,
        shadings: Sequence[Shading] = BODIES,
    ) -> None:
        self._axes = axes
        self._case = case
        self._view = view
        self._halves: list[_NamedDots | _ColouredDots] = []
        for shading, sides, place in _halves(shadings):
            if shading.has_bar:
                self._halves.append(_ColouredDots(axes, case, shading, sides))
            else:
                self._halves.append(_NamedDots(axes, case, shading, sides, place))

    def show(self, snapshot: Snapshot) -> None:
        """Draw the particles of a snapshot in place of those shown before."""
        shown, sizes = _drawn(self._axes, snapshot, self._case, self._view)
        for half in self._halves:
            half.show(shown, sizes)


def draw_plain(
    axes: Axes, snapshot: Snapshot, case: Case, view: View, colour: str, label: str
) -> None:
    """Draw particles in one colour, below those of `Dots`.

    Parameters
    ----------
    axes : Axes
        Its legend gets an entry with the label.
    snapshot : Snapshot
    case : Case
    view : View
        What is outside of it is not drawn.
    colour : str
    label : str
    """
    shown, sizes = _drawn(axes, snapshot, case, view)
    z, r = _places(shown["z"], shown["r"], _BOTH)
    _SizedDots(axes, colour, zorder=1.5).show(z, r, np.tile(sizes, 2))
    _add_entry(axes, colour, label)


def _drawn(
    axes: Axes, snapshot: Snapshot, case: Case, view: View
) -> tuple[dict[str, npt.NDArray[Any]], FloatArray]:
    """Return the arrays of the particles that are drawn, and their sizes [pt]."""
    arrays = snapshot.arrays
    drawn = view.shows(arrays["z"] * 1e3, arrays["r"] * 1e3)
    drawn &= arrays["id"] % _particles_a_dot(snapshot) == 0
    shown = {name: values[drawn] for name, values in arrays.items()}
    area = section_area(shown, case) * _particles_a_dot(snapshot)
    return shown, dot_sizes(axes, area, len(drawn))


def _halves(
    shadings: Sequence[Shading],
) -> list[tuple[Shading, tuple[float, ...], str]]:
    """Return each shading with the signs of its radii, and where that is."""
    if len(shadings) == 1:
        return [(shadings[0], _BOTH, "")]
    above, below = shadings
    return [(above, (1.0,), "above"), (below, (-1.0,), "below")]


class _NamedDots:
    """Dots with one colour for each name."""

    def __init__(
        self,
        axes: Axes,
        case: Case,
        shading: Shading,
        sides: tuple[float, ...],
        place: str,
    ) -> None:
        self._field, self._sides = shading.field, sides
        assert self._field.names is not None, "a field with names"
        self._dots = []
        for index, name in enumerate(self._field.names(case)):
            colour = body_colour(index)
            self._dots.append(_SizedDots(axes, colour, zorder=2.0 + 0.01 * index))
            label = f"{name}, {place}" if place else name
            _add_entry(axes, colour, label)

    def show(self, arrays: Mapping[str, npt.NDArray[Any]], sizes: FloatArray) -> None:
        """Draw particles as dots of these sizes [pt]."""
        which = self._field.values(arrays)
        for index, dots in enumerate(self._dots):
            mine = which == index
            z, r = _places(arrays["z"][mine], arrays["r"][mine], self._sides)
            dots.show(z, r, np.tile(sizes[mine], len(self._sides)))


class _SizedDots:
    """Dots of one colour; the smaller lie upon the larger.

    Sizes are rounded up to classes, each with a line of its own, which draws several
    times faster than a size for each dot.
    """

    def __init__(self, axes: Axes, colour: str, zorder: float) -> None:
        self._axes, self._zorder = axes, zorder
        self._style: dict[str, Any] = {"markeredgewidth": 0.0, "color": colour}
        self._lines: dict[int, Line2D] = {}

    def show(self, z: FloatArray, r: FloatArray, sizes: FloatArray) -> None:
        """Draw dots of some sizes [pt] at places [mm]."""
        classes = np.ceil(np.log(sizes) / _CLASS).astype(int)
        for line in self._lines.values():
            line.set_data([], [])
        for each in np.unique(classes):
            mine = classes == each
            self._line(int(each)).set_data(z[mine], r[mine])

    def _line(self, each: int) -> Line2D:
        """Return the line of a class; its place among the others is its size's."""
        if each not in self._lines:
            size, zorder = math.exp(each * _CLASS), self._zorder - 1e-5 * each
            (self._lines[each],) = self._axes.plot(
                [], [], "o", ms=size, zorder=zorder, rasterized=True, **self._style
            )
        return self._lines[each]


class _ColouredDots:
    """Dots with colours along a scale; grey where there is no value."""

    def __init__(
        self, axes: Axes, case: Case, shading: Shading, sides: tuple[float, ...]
    ) -> None:
        self._field, self._sides, self._case = shading.field, sides, case
        self._dots = axes.scatter(
            [],
            [],
            c=[],
            cmap=shading.colour_map.with_extremes(bad=_NO_VALUE),
            norm=shading.norm,
            plotnonfinite=True,
            linewidths=0.0,
            rasterized=True,
            zorder=2,
        )
        if shading.field.is_missing(case):
            _add_entry(axes, _NO_VALUE, f"no model of {shading.field.label}")

    def show(self, arrays: Mapping[str, npt.NDArray[Any]], sizes: FloatArray) -> None:
        """Draw particles as dots of these sizes [pt]."""
        z, r = _places(arrays["z"], arrays["r"], self._sides)
        shown = self._field.shown(arrays, self._case)
        self._dots.set_offsets(np.column_stack([z, r]))
        self._dots.set_array(np.ma.masked_invalid(np.tile(shown, len(self._sides))))
        self._dots.set_sizes(np.tile(sizes**2, len(self._sides)))


def _add_entry(axes: Axes, colour: str, label: str) -> None:
    """Add a dot to the legend."""
    axes.plot([], [], "o", markersize=6.0, color=colour, label=label)


def _places(
    z: FloatArray, r: FloatArray, sides: tuple[float, ...]
) -> tuple[FloatArray, FloatArray]:
    """Return z and r [mm] of dots on the sides of the axis, from those in m."""
    z = np.tile(1e3 * z, len(sides))
    return z, np.concatenate([side * 1e3 * r for side in sides])


def draw_bars(axes: Axes, shadings: Sequence[Shading]) -> None:
    """Draw a colour bar at the right of each half of axes that needs one.

    Parameters
    ----------
    axes : Axes
        With room of `BAR_MARGIN` at its right.
    shadings : sequence of Shading
    """
    figure = axes.get_figure(root=True)
    assert figure is not None, "axes that are drawn in"
    inches, box = figure.get_figwidth(), axes.get_position()
    height = box.height / len(shadings)
    between = 0.04 * box.height * (len(shadings) - 1)
    for index, shading in enumerate(shadings):
        if shading.has_bar:
            place = (
                box.x1 + _BAR_GAP / inches,
                box.y1 - (index + 1) * height + between * (1 - index),
                _BAR_WIDTH / inches,
                height - between,
            )
            mapping = ScalarMappable(shading.norm, shading.colour_map)
            bar = figure.add_axes(place)
            figure.colorbar(mapping, bar, extend=shading.extend)
            bar.set_ylabel(shading.field.title, fontsize=8.5)
            bar.tick_params(labelsize=8.0)


def halves_text(shadings: Sequence[Shading]) -> list[str]:
    """Return a line that names the halves of a picture, if these differ."""
    if len(shadings) == 1:
        return []
    above, below = (shading.field.label for shading in shadings)
    return [f"above: {above}; below: {below}"]


def legend_entries(case: Case, shadings: Sequence[Shading] = BODIES) -> int:
    """Return how many entries the legend has: names, grey, rear faces and planes."""
    names = (x.field.names(case) for x in shadings if x.field.names is not None)
    grey = sum(x.has_bar and x.field.is_missing(case) for x in shadings)
    return sum(map(len, names)) + grey + 1 + case.boundary.exists


def _particles_a_dot(snapshot: Snapshot) -> int:
    return 1 + len(snapshot.arrays["z"]) // _MOST_POINTS


def dot_sizes(axes: Axes, area: FloatArray, count: int) -> FloatArray:
    """Return the diameters of dots that cover the sections of particles [pt].

    A dot is the disc about a square of the section's area, so that those of a lattice
    leave no gaps. They have a least value, at which few do not fade and many do not
    merge.

    Parameters
    ----------
    axes : Axes
        With their final limits [mm].
    area : ndarray, shape (n,)
        Of the sections [m2], see `section_area`.
    count : int
        How many particles the snapshot has.

    Returns
    -------
    ndarray, shape (n,)
    """
    figure = axes.get_figure(root=True)
    assert figure is not None, "axes that are drawn in"
    inches = axes.get_position().width * float(figure.get_figwidth())
    points_per_mm = 72.0 * inches / float(np.ptp(axes.get_xlim()))
    pixel = 72.0 / figure.dpi
    sizes = _COVER * 1e3 * np.sqrt(area) * points_per_mm + _EDGE * pixel
    low, high = _LEAST
    least = min(max(high * math.sqrt(_FEW / max(count, 1)), low), high)
    # An area that is no number is that of a run that broke down.
    return np.fmax(sizes, least * pixel)
