"""The figure of a ballistic limit: what holds, what fails, and the equation's curve."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mpisph.analysis.ballistic import (
    BALLISTIC_VELOCITY,
    HYPERVELOCITY,
    critical_diameter,
)
from mpisph.case.shield import Shield
from mpisph.figures.style import DPI, STYLE, WIDTH, Out, save
from mpisph.io.verdict import FAILED
from mpisph.study.assess.published import PublishedTest
from mpisph.study.limit.outcome import Limit
from mpisph.study.limit.plan import Plan, whipple

__all__ = ["FIGURE_FILE", "alike", "draw_limits", "limit_figure"]

FIGURE_FILE = "limit.png"

ALIKE = 0.05
"""Relative difference of a published test's shield from the case's, at most."""

_HELD, _FAILED, _OPEN = "#0072B2", "#D55E00", "0.5"
_MARGIN = 1.12
_REGIMES = ("whole", "shatters", "melts")


def draw_limits(
    plan: Plan, found: Sequence[Limit], tests: Sequence[PublishedTest], out: Out
) -> None:
    """Draw the limits with all tries, the equation and published tests.

    Parameters
    ----------
    plan : Plan
    found : sequence of Limit
        At least one with a try.
    tests : sequence of PublishedTest
        Of this shield, from `alike`.
    out : Path or BytesIO

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    with mpl.rc_context(STYLE):
        save(limit_figure(plan, found, tests), out)


def alike(plan: Plan, tests: Sequence[PublishedTest]) -> list[PublishedTest]:
    """Return the tests of the plan's shield: all is alike but what varies.

    Parameters
    ----------
    plan : Plan
    tests : sequence of PublishedTest
    """
    shield = plan.case.shield
    if shield is None or len(shield.bumpers) != 1:
        return []
    free = {plan.find.name, plan.along.name if plan.along else ""}
    return [test for test in tests if _is_alike(shield, test, free)]


def _is_alike(shield: Shield, test: PublishedTest, free: set[str]) -> bool:
    (bumper,) = shield.bumpers
    pairs = {
        "diameter": (test.diameter, shield.projectile.diameter),
        "velocity": (test.velocity, shield.projectile.velocity),
        "thickness": (test.shield.wall_thickness, shield.wall.thickness),
        "standoff": (test.shield.standoff, bumper.standoff),
        "bumper": (test.shield.bumper_thickness, bumper.thickness),
    }
    cards = (test.projectile.card, test.bumper.card, test.wall.card)
    own = (shield.projectile.material, bumper.material, shield.wall.material)
    return cards == own and all(
        abs(theirs / ours - 1.0) <= ALIKE
        for name, (theirs, ours) in pairs.items()
        if name not in free
    )


def limit_figure(
    plan: Plan, found: Sequence[Limit], tests: Sequence[PublishedTest]
) -> Figure:
    """Return the figure; see `draw_limits`.

    Parameters
    ----------
    plan : Plan
    found : sequence of Limit
    tests : sequence of PublishedTest
    """
    figure = Figure((WIDTH, 0.75 * WIDTH), dpi=DPI, layout="constrained")
    axes = figure.add_subplot()
    _draw_tries(axes, plan, found)
    _draw_bars(axes, plan, found)
    _draw_tests(axes, plan, tests)
    _lay_out(axes, plan)
    _draw_equation(axes, plan, found)
    figure.suptitle(plan.case.title, fontsize=9.5, wrap=True)
    figure.legend(loc="outside lower center", ncols=3, handletextpad=0.4)
    return figure


def _place(plan: Plan, at: float | None) -> float:
    return 0.0 if plan.along is None or at is None else at / plan.along.scale


def _draw_tries(axes: Axes, plan: Plan, found: Sequence[Limit]) -> None:
    """Mark every run by its verdict."""
    kinds: dict[str, list[tuple[float, float]]] = {}
    for limit in found:
        for j in limit.tries:
            kind: str = "fails" if j.outcome in FAILED else j.outcome
            place = _place(plan, limit.at), j.trial.value / plan.find.scale
            kinds.setdefault(kind, []).append(place)
    looks: dict[str, dict[str, Any]] = {
        "holds": {"marker": "o", "facecolors": _HELD, "edgecolors": "none"},
        "fails": {"marker": "^", "facecolors": _FAILED, "edgecolors": "none"},
        "undecided": {"marker": "s", "facecolors": "none", "edgecolors": _OPEN},
    }
    for kind, look in looks.items():
        if kind in kinds:
            x, y = zip(*kinds[kind], strict=True)
            axes.scatter(x, y, s=20, alpha=0.75, label=f"computed: {kind}", **look)


def _draw_bars(axes: Axes, plan: Plan, found: Sequence[Limit]) -> None:
    """Draw the limits, each as a bar from what holds to what fails."""
    known = [x for x in found if x.holds is not None and x.fails is not None]
    if not known:
        return
    scale = plan.find.scale
    x = [_place(plan, limit.at) for limit in known]
    middle = np.array([limit.middle for limit in known], dtype=float) / scale
    ends = np.array([sorted((a.holds or 0.0, a.fails or 0.0)) for a in known]) / scale
    bars = np.abs(ends.T - middle)
    order = np.argsort(x)
    axes.errorbar(
        np.array(x)[order], middle[order], yerr=bars[:, order], color="black",
        linewidth=1.3, capsize=3, elinewidth=1.0, label="computed limit",
    )  # fmt: skip


def _draw_tests(axes: Axes, plan: Plan, tests: Sequence[PublishedTest]) -> None:
    """Mark published tests of this shield."""
    for failed, marker, colour, word in (
        (False, "o", _HELD, "held"),
        (True, "^", _FAILED, "failed"),
    ):
        mine = [test for test in tests if test.failed == failed]
        if mine:
            along = plan.along.name if plan.along else ""
            x = [_of(t, along) / plan.along.scale if plan.along else 0.0 for t in mine]
            y = [_of(t, plan.find.name) / plan.find.scale for t in mine]
            axes.scatter(x, y, s=46, marker=marker, facecolors="none",
                         edgecolors=colour, linewidths=1.4, zorder=3,
                         label=f"test: {word}")  # fmt: skip


def _of(test: PublishedTest, name: str) -> float:
    return {
        "diameter": test.diameter,
        "velocity": test.velocity,
        "thickness": test.shield.wall_thickness,
        "standoff": test.shield.standoff,
    }[name]


def _lay_out(axes: Axes, plan: Plan) -> None:
    axes.set_ylabel(f"{plan.find.label} [{plan.find.unit}]")
    if plan.along is None:
        axes.set_xticks([])
    else:
        axes.set_xlabel(f"{plan.along.label} [{plan.along.unit}]")
    axes.margins(x=0.06, y=0.12)
    low, high = axes.get_ylim()
    axes.set_ylim(max(low, 0.0), high)


def _draw_equation(axes: Axes, plan: Plan, found: Sequence[Limit]) -> None:
    """Draw Christiansen's curve, with its regimes where velocity is the axis."""
    wall, along = whipple(plan.case), plan.along
    if wall is None or along is None:
        return
    if along.name == "velocity" and plan.find.name == "diameter":
        low, high = axes.get_xlim()
        v = np.linspace(max(low, 0.05), high, 400)
        d = critical_diameter(wall, v * along.scale) / plan.find.scale
        axes.plot(v, d, color="0.35", linewidth=1.1, linestyle=(0, (5, 2)),
                  label="Christiansen’s equation")  # fmt: skip
        axes.set_xlim(low, high)
        top = max(axes.get_ylim()[1], _MARGIN * float(d.max()))
        axes.set_ylim(axes.get_ylim()[0], top)
        _mark_regimes(axes, low, high, along.scale)
        return
    known = [x for x in found if x.equation is not None and x.at is not None]
    if known:
        order = sorted(known, key=lambda x: x.at or 0.0)
        axes.plot([_place(plan, x.at) for x in order],
                  [(x.equation or 0.0) / plan.find.scale for x in order],
                  color="0.35", linewidth=1.1, linestyle=(0, (5, 2)),
                  label="Christiansen’s equation")  # fmt: skip


def _mark_regimes(axes: Axes, low: float, high: float, scale: float) -> None:
    """Divide the velocities by what becomes of the projectile."""
    edges = [low, BALLISTIC_VELOCITY / scale, HYPERVELOCITY / scale, high]
    for edge in edges[1:3]:
        if low < edge < high:
            axes.axvline(edge, color="0.75", linewidth=0.8, zorder=0)
    for word, begin, end in zip(_REGIMES, edges, edges[1:], strict=False):
        begin, end = max(begin, low), min(end, high)
        if end - begin > 0.08 * (high - low):
            axes.text(0.5 * (begin + end), 0.985, word, ha="center", va="top",
                      transform=axes.get_xaxis_transform(), fontsize=8.0,
                      color="0.45")  # fmt: skip
