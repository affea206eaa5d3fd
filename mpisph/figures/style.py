"""What all figures share: their size, letters, lines and colours."""

from typing import Any

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
