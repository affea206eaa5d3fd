"""What all figures share: size, letters, lines and colours, and how they are saved."""

import warnings
from io import BytesIO
from pathlib import Path
from typing import Any

from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
from PIL import features

from mpisph.core.errors import CaseError, Problem
from mpisph.io.files import naming

Out = Path | BytesIO
"""Where a figure goes: into a file, or into memory for a page."""

PAGE_FORMAT = "webp" if features.check("webp") else "png"
"""Of figures in memory; Pillow may have been built without WebP."""

LOSSLESS = {"lossless": True, "method": 1}
"""Settings of it, as compact as slower ones: a third of the bytes of a PNG file."""

BODY_COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00")
"""Okabe and Ito's colours, which colour-blind readers can tell apart."""

MEASURED: dict[str, Any] = {
    "color": "black",
    "linestyle": (0, (6, 3)),
    "linewidth": 1.3,
}
COMPUTED: dict[str, Any] = {
    "color": "#B2182B",
    "linestyle": (0, (1, 1.5)),
    "linewidth": 1.6,
}
BOX: dict[str, Any] = {
    "facecolor": "white",
    "edgecolor": "none",
    "alpha": 0.75,
    "pad": 0.8,
}
BEHIND_PLANE: dict[str, Any] = {
    "facecolor": "0.94",
    "edgecolor": "0.6",
    "hatch": "////",
    "linewidth": 0.8,
}
REAR_FACE: dict[str, Any] = {"color": "0.45", "linestyle": "-", "linewidth": 0.8}

STYLE: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.labelsize": 9.5,
    "axes.titlesize": 10.0,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "legend.handlelength": 2.6,
    "legend.columnspacing": 1.2,
    "legend.labelspacing": 0.35,
    "axes.linewidth": 0.8,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.top": True,
    "ytick.right": True,
}

WIDTH = 7.0
"""Width of a figure [in]."""

DPI = 200
"""Its resolution: 1400 pixels across."""


def save(figure: Figure, out: Out) -> None:
    """Write a figure: into a file in the format that its name says, else for a page.

    Parameters
    ----------
    figure : Figure
    out : Path or BytesIO
        The folder of a file is made where it is missing. What goes into memory is in
        `PAGE_FORMAT`, without loss.

    Raises
    ------
    OSError
        If the file cannot be written.
    CaseError
        If its name says no format that figures can have.
    """
    if isinstance(out, Path):
        known = figure.canvas.get_supported_filetypes()
        if out.suffix[1:].lower() not in known:
            listed = ", ".join(f".{name}" for name in known)
            problem = Problem(f"expected a name that ends in {listed}", file=str(out))
            raise CaseError([problem])
    with warnings.catch_warnings():
        # Of letters in a title that the font lacks; they are drawn as boxes.
        warnings.filterwarnings("ignore", "Glyph", UserWarning)
        if isinstance(out, Path):
            out.parent.mkdir(parents=True, exist_ok=True)
            with naming(out):
                figure.savefig(out)
        else:
            figure.savefig(out, format=PAGE_FORMAT, pil_kwargs=LOSSLESS)


def label_log_axis(axis: Axis) -> None:
    """Label a logarithmic axis with plain numbers, few enough to stand apart.

    Parameters
    ----------
    axis : Axis
        With its final limits.
    """
    low, high = axis.get_view_interval()
    axis.set_major_formatter(lambda x, _: f"{x:g}")
    axis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))
    short = high < 30.0 * low  # with one decade or two
    axis.set_minor_formatter((lambda x, _: f"{x:g}") if short else NullFormatter())


def body_colour(index: int) -> str:
    """Return the colour of the body, run or line of a number."""
    return BODY_COLOURS[index % len(BODY_COLOURS)]
