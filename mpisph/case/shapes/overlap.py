"""Whether two bodies would occupy the same space."""

from __future__ import annotations

import numpy as np

from mpisph.case.shapes.section import FloatArray, Section

__all__ = ["sections_overlap"]

# Faces that coincide up to rounding touch; they do not overlap. The first is a fraction
# of the smaller body, the second of the coordinates that were rounded.
_SHALLOW = 1e-9
_ROUNDING = 1e-15

_SAMPLES = 32
"""Heights looked at between two that are known to matter."""


def sections_overlap(one: Section, other: Section) -> bool:
    """Say whether two sections share an area; touching does not count.

    Parameters
    ----------
    one, other : Section

    Returns
    -------
    bool
        True where the bodies would occupy the same space.

    Notes
    -----
    At no height that both reach do their intervals of r meet if and only if one of
    them lies within the hollow of the other at all of these heights: to change over,
    they would have to pass through each other, for their ends are continuous. So it
    needs no search for the place where they meet, however thin they are.
    """
    size = min(one.widest, other.widest)
    depth = _SHALLOW * size + _ROUNDING * max(one.extent, other.extent)
    # What overlaps deeper than that still does without a margin of half of it.
    margin = 0.5 * depth
    low = max(one.ends[0], other.ends[0]) + margin
    high = min(one.ends[1], other.ends[1]) - margin
    if low >= high:
        return False
    z = _heights(low, high, margin, (*one.knots, *other.knots))
    inner, outer = _radii_within(one, z, margin)
    other_inner, other_outer = _radii_within(other, z, margin)
    beyond_one = float((other_outer - inner).max())
    beyond_other = float((outer - other_inner).max())
    return min(beyond_one, beyond_other) > depth


def _heights(
    low: float, high: float, margin: float, knots: tuple[float, ...]
) -> FloatArray:
    """Return heights at which to compare, the ends and all knots among them."""
    near = [knot + shift for knot in knots for shift in (-margin, 0.0, margin)]
    known = np.unique([low, high, *(z for z in near if low < z < high)])
    places = np.arange(_SAMPLES * (known.size - 1) + 1) / _SAMPLES
    return np.asarray(np.interp(places, np.arange(known.size), known))


def _radii_within(
    section: Section, z: FloatArray, margin: float
) -> tuple[FloatArray, FloatArray]:
    """Return the radii of a section without a margin at its upper and lower faces.

    Near a pole the smallest rounding along z is a large one along r.
    """
    inner_below, outer_below = section.radii(z - margin)
    inner_above, outer_above = section.radii(z + margin)
    return np.maximum(inner_below, inner_above), np.minimum(outer_below, outer_above)
