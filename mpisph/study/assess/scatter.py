"""The figure of an assessment: computed damage against the equation's d/d_c."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from mpisph.core.words import counted
from mpisph.figures.style import DPI, STYLE, WIDTH, Out, label_log_axis, save
from mpisph.study.assess.outcome import Assessed

__all__ = ["FIGURE_FILE", "can_draw", "draw_scatter", "scatter_figure"]

FIGURE_FILE = "damage.png"

RANGE = (0.1, 10.0)
"""Damage that is shown; what lies outside stands at the edge."""

_TICKS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
_HELD, _FAILED = "#0072B2", "#D55E00"
_INSIDE = 1.04
_MARGIN = 1.15


def can_draw(tests: Sequence[Assessed]) -> bool:
    """Say whether any test has a damage to show.

    Parameters
    ----------
    tests : sequence of Assessed
    """
    return any(test.damage is not None for test in tests)


def draw_scatter(tests: Sequence[Assessed], out: Out) -> None:
    """Draw the damage of each test against its diameter over the critical one.

    Parameters
    ----------
    tests : sequence of Assessed
        Those without a damage are left out.
    out : Path or BytesIO

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    with mpl.rc_context(STYLE):
        save(scatter_figure(tests), out)


def scatter_figure(tests: Sequence[Assessed]) -> Figure:
    """Return the figure; see `draw_scatter`.

    Parameters
    ----------
    tests : sequence of Assessed
    """
    shown = [test for test in tests if test.damage is not None]
    figure = Figure((WIDTH, 0.78 * WIDTH), dpi=DPI, layout="constrained")
    axes = figure.add_subplot()
    for failed, colour, marker, word in (
        (False, _HELD, "o", "held"),
        (True, _FAILED, "^", "failed"),
    ):
        mine = [test for test in shown if test.test.failed == failed]
        decided = [test for test in mine if test.fails is not None]
        rest = [test for test in mine if test.fails is None]
        label = f"{counted(len(mine), 'test')} that {word}"
        axes.scatter(*_places(decided), s=24, c=colour, marker=marker, label=label,
                     alpha=0.75, linewidths=0)  # fmt: skip
        if rest:
            axes.scatter(*_places(rest), s=24, facecolors="none", edgecolors=colour,
                         marker=marker, linewidths=0.9,
                         label=f"of these undecided: {len(rest)}")  # fmt: skip
    figure.legend(loc="outside lower center", ncols=4, handletextpad=0.3)
    _lay_out(axes, [test.test.ratio for test in shown])
    return figure


def _places(tests: Sequence[Assessed]) -> tuple[list[float], list[float]]:
    low, high = RANGE[0] * _INSIDE, RANGE[1] / _INSIDE
    damage = [float(np.clip(test.damage or 0.0, low, high)) for test in tests]
    return [test.test.ratio for test in tests], damage


def _lay_out(axes: Axes, ratios: Sequence[float]) -> None:
    """Set axes, limits and the lines that divide holds from fails."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    ends = min([*ratios, 0.5]) / _MARGIN, max([*ratios, 2.0]) * _MARGIN
    axes.set_xlim(*ends)
    axes.set_ylim(*RANGE)
    label_log_axis(axes.xaxis)
    axes.set_yticks(_TICKS, labels=[f"{tick:g}" for tick in _TICKS])
    axes.yaxis.set_minor_locator(NullLocator())
    axes.axhline(1.0, color="0.35", linewidth=0.9)
    axes.axvline(1.0, color="0.35", linewidth=0.9, linestyle=(0, (5, 3)))
    axes.set_xlabel("diameter over Christiansen’s critical one, $d/d_c$")
    axes.set_ylabel("damage over its critical value, computed")
    for x, y, text, place in (
        (0.99, 0.515, "computed: fails", "bottom"),
        (0.99, 0.485, "computed: holds", "top"),
    ):
        axes.text(x, y, text, transform=axes.transAxes, ha="right", va=place,
                  fontsize=8.0, color="0.35")  # fmt: skip
    above = axes.get_xaxis_transform()
    for text, side, factor in (
        ("equation: holds ", "right", 1.0),
        (" equation: fails", "left", 1.0),
    ):
        axes.text(factor, 1.01, text, transform=above, ha=side, va="bottom",
                  fontsize=8.0, color="0.35")  # fmt: skip
