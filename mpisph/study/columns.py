"""Names of the columns that runs add to a study's table."""

import re
from collections.abc import Sequence

CLOCKS = {"nominal": "", "offset": "_offset"}
"""What the names of columns add for each reading of the clock."""

SIZES = ("mm", "robust_mm")
"""Endings of the columns of R_b and L_b: outermost particle, and mass quantile."""

WALL_FIGURES = {
    "wall_shear": ("shear", 1.0),
    "wall_ligament": ("ligament", 1.0),
    "wall_sound_share": ("sound_share", 1.0),
    "wall_hole_mm": ("hole", 1e3),
    "wall_bulge_mm": ("bulge", 1e3),
    "wall_crater_mm": ("crater_depth", 1e3),
    "wall_crater_diameter_mm": ("crater_diameter", 1e3),
    "wall_detached_g": ("detached", 1e3),
    "wall_detached_m_per_s": ("detached_velocity", 1.0),
}
"""Columns of a wall: the field of its record, and the factor from SI."""

WALL_COLUMNS = ("verdict_damage", *WALL_FIGURES, "wall_rest_us")
"""Figures of a shield's wall at the end of a run, beside its verdict."""

_ENDINGS = {
    "km_per_s": "km/s",
    "kg_m_per_s": "kg m/s",
    "m_per_s": "m/s",
    "percent": "%",
    "mm": "mm",
    "us": "µs",
    "g": "g",
    "J": "J",
    "s": "s",
}


def time_label(time: float) -> str:
    """Return a time [s] as the names of columns give it, such as ``6us``."""
    return f"{time * 1e6:g}us"


def column(quantity: str, where: str, ending: str) -> str:
    """Return the column of a quantity.

    Parameters
    ----------
    quantity : str
        Such as ``R_b``.
    where : str
        The time, as `time_label` gives it; empty for the end of the run.
    ending : str
        Unit, such as ``mm``.
    """
    return "_".join(part for part in (quantity, where, ending) if part)


def quantities(bodies: Sequence[str]) -> list[tuple[str, str]]:
    """Return what is measured at a time: quantities with their endings.

    Parameters
    ----------
    bodies : sequence of str
        Names of the bodies.
    """
    found = [(size, ending) for size in ("R_b", "L_b") for ending in SIZES]
    found += [("front_velocity", "km_per_s"), ("cloud_mass", "g")]
    found += [("hole", "mm"), ("hole_opening", "mm")]
    found += [("cloud_momentum_z", "kg_m_per_s")]
    for body in bodies:
        found += [(f"momentum_z_{body}", "kg_m_per_s")]
        found += [(f"kinetic_energy_{body}", "J"), (f"internal_energy_{body}", "J")]
    return found


def number_columns(
    exposures: Sequence[float],
    times: Sequence[float],
    bodies: Sequence[str],
    shields: bool = False,
) -> list[str]:
    """Return the columns of numbers that runs can add to a table.

    Parameters
    ----------
    exposures : sequence of float
        Nominal times of measured exposures [s].
    times : sequence of float
        Further times [s].
    bodies : sequence of str
        Names of the bodies of all cases.
    shields : bool, optional
        Whether any case has a shield.
    """
    names = ["npr", "particles", "steps", "time_us", "wall_s", "energy_error"]
    names += WALL_COLUMNS if shields else ()
    labels = [time_label(t) + suffix for t in exposures for suffix in CLOCKS.values()]
    if exposures:
        names += [f"total_error{suffix}_percent" for suffix in CLOCKS.values()]
        names += ["fitted_offset_us", "total_error_fitted_percent"]
        sizes = [(size, where) for size in ("R_b", "L_b") for where in labels]
        names += [column(*size, "error_percent") for size in sizes]
    labels += [time_label(time) for time in times] + [""]
    found = quantities(bodies)
    names += [column(name, where, unit) for where in labels for name, unit in found]
    return list(dict.fromkeys(names))


def column_words(name: str) -> tuple[str, str]:
    """Return what a column of numbers is called in figures, and its unit, if any."""
    words, unit = name, ""
    for ending, written in _ENDINGS.items():
        if name.endswith(f"_{ending}"):
            words, unit = name.removesuffix(f"_{ending}"), written
            break
    for size in ("R_b", "L_b"):
        if f"{words}_".startswith(f"{size}_"):
            words = f"${size}$".replace("_", "\0") + words.removeprefix(size)
    words = re.sub(r"_(\d[\d.e+-]*)us(?=_|$)", r" at \1 µs", words)
    return words.replace("_", " ").replace("\0", "_"), unit


def column_label(name: str) -> str:
    """Return the words of a column with its unit in brackets."""
    words, unit = column_words(name)
    return f"{words} [{unit}]" if unit else words
