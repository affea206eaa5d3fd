"""What is measured on the rear wall of a shield."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from mpisph.case.model import Case
from mpisph.diagnostics.condition import BROKEN
from mpisph.io.verdict import WallRecord

__all__ = ["Layout", "column_sound", "ligament", "measure_wall", "shear", "wall_layout"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

BOND = 2.0
"""Distance within which sound particles hold together, in initial spacings: more than a
diagonal of the lattice stretched by a third, less than the reach of the kernel."""

GAP = 1.5
"""Distance behind the rear face from which matter has come off, in spacings."""


class Layout(NamedTuple):
    """The wall at the start: a lattice of rows along r, columns along z.

    Attributes
    ----------
    body : int
        Index of the wall in the case.
    first_id : int
        Of its particles, whose ids run row by row.
    r : ndarray, shape (columns,)
        Of the columns [m].
    z : ndarray, shape (rows,)
        Of the rows [m], rising.
    front, rear : float
        Axial positions of the faces [m].
    spacing : float
        Larger of the distances of rows and of columns [m].
    """

    body: int
    first_id: int
    r: FloatArray
    z: FloatArray
    front: float
    rear: float
    spacing: float

    @property
    def thickness(self) -> float:
        """Thickness of the wall [m]."""
        return self.rear - self.front


def wall_layout(case: Case) -> Layout:
    """Return how the wall of a shield is made of particles.

    Parameters
    ----------
    case : Case
        With a shield.
    """
    fillings = [body.section.fill(case.spacing, body.filling) for body in case.bodies]
    first = sum(int(filling.length.sum()) for filling in fillings[:-1])
    wall, filling = case.bodies[-1], fillings[-1]
    rows, columns = filling.length.size, int(filling.length[0])
    rings = filling.rings(np.arange(rows).repeat(columns), _tile(rows, columns))
    r, z = rings.r.reshape(rows, columns)[0], rings.z.reshape(rows, columns)[:, 0]
    low, high = wall.section.ends
    width = case.bodies[-1].section.widest / columns
    spacing = max((high - low) / rows, width)
    return Layout(len(case.bodies) - 1, first, r, z, low, high, spacing)


def _tile(rows: int, columns: int) -> npt.NDArray[np.int64]:
    return np.tile(np.arange(columns), rows)


class _Wall(NamedTuple):
    """Fields of the wall's particles, each of shape (rows, columns)."""

    r: FloatArray
    z: FloatArray
    u_z: FloatArray
    m: FloatArray
    damage: FloatArray


def measure_wall(
    layout: Layout, particles: Mapping[str, npt.NDArray[Any]], time: float
) -> WallRecord:
    """Measure the wall.

    Parameters
    ----------
    layout : Layout
    particles : mapping of str to ndarray, shape (n,)
        Fields ``id, body, m, r, z, u_z, damage``: all of the wall, and whatever of
        other bodies is behind its front face.
    time : float
        [s].
    """
    wall = _wall_of(layout, particles)
    main = _main_piece(layout, wall)
    columns: BoolArray = np.any(main, axis=0)
    front, rear = _faces(layout, wall, main)
    bulge = np.where(columns, rear - layout.rear, 0.0)
    depth = np.where(columns, front - layout.front - bulge, 0.0)
    deepest = max(0.0, float(depth.max(initial=0.0)))
    sound = column_sound(wall.damage, main)
    behind = _come_off(layout, particles, wall, main, rear)
    mass, momentum = _sums(particles, behind)
    return WallRecord(
        time=time,
        shear=shear(layout, rear, columns),
        ligament=ligament(_sound(wall.damage, main)),
        sound_share=float(sound.min()),
        hole=_hole(layout, wall, main),
        detached=mass,
        detached_velocity=momentum / mass if mass else 0.0,
        detached_momentum=momentum,
        bulge=max(0.0, float(bulge.max())),
        crater_depth=deepest,
        crater_diameter=_crater_diameter(layout, depth),
        velocity=_fastest(wall, main),
    )


def _wall_of(layout: Layout, particles: Mapping[str, npt.NDArray[Any]]) -> _Wall:
    shape = layout.z.size, layout.r.size
    mine = particles["body"] == layout.body
    order = np.argsort(particles["id"][mine])
    fields = {name: particles[name][mine][order] for name in _Wall._fields}
    # Of a run that breaks down: what has no number is lost.
    lost = ~np.all([np.isfinite(values) for values in fields.values()], axis=0)
    if lost.any():
        fields = {name: np.where(lost, 0.0, values) for name, values in fields.items()}
        fields["damage"][lost] = BROKEN
    return _Wall(*(values.reshape(shape) for values in fields.values()))


def _main_piece(layout: Layout, wall: _Wall) -> BoolArray:
    """Return which particles are sound and hold together with the sound rim.

    Returns
    -------
    ndarray of bool, shape (rows, columns)
    """
    sound = (wall.damage < BROKEN).ravel()
    points = np.column_stack([wall.r.ravel()[sound], wall.z.ravel()[sound]])
    main = np.zeros(sound.shape, dtype=bool)
    if len(points):
        pairs = cKDTree(points).query_pairs(
            BOND * layout.spacing, output_type="ndarray"
        )
        graph = coo_array(
            (np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(points),) * 2
        )
        labels = connected_components(graph, directed=False)[1]
        rim = np.zeros(wall.r.shape, dtype=bool)
        rim[:, -1] = True
        of_rim = labels[rim.ravel()[sound]]
        if of_rim.size:
            main[sound] = labels == np.bincount(of_rim).argmax()
    return main.reshape(wall.r.shape)


def _faces(
    layout: Layout, wall: _Wall, main: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Return the positions of both faces of what holds together, by column [m].

    A column without any has those of the nearest one outside.
    """
    half = layout.thickness / layout.z.size / 2
    low = np.where(main, wall.z, np.inf).min(axis=0) - half
    high = np.where(main, wall.z, -np.inf).max(axis=0) + half
    nearest = _nearest_columns(main)
    if nearest is None:
        n = layout.r.size
        return np.full(n, layout.front), np.full(n, layout.rear)
    return low[nearest], high[nearest]


def _nearest_columns(main: BoolArray) -> IntArray | None:
    """Return for each column the nearest one outside with any of what holds together.

    None where nothing holds.
    """
    there = np.flatnonzero(main.any(axis=0))
    if there.size == 0:
        return None
    order = np.searchsorted(there, np.arange(main.shape[1]))
    nearest: IntArray = there[np.minimum(order, there.size - 1)]
    return nearest


def shear(layout: Layout, rear: FloatArray, columns: BoolArray) -> float:
    """Return the largest tilt of the rear face along a way of one thickness.

    Parameters
    ----------
    layout : Layout
    rear : ndarray, shape (columns,)
        Axial position of the rear face [m].
    columns : ndarray of bool, shape (columns,)
        Which columns are there.
    """
    displacement = rear - layout.rear
    r, t = layout.r, layout.thickness
    inner = r + t <= r[-1]
    inner &= columns
    if not inner.any():
        return 0.0
    outer = np.interp(r[inner] + t, r, displacement)
    return float(np.abs(displacement[inner] - outer).max()) / t


def column_sound(damage: FloatArray, main: BoolArray) -> FloatArray:
    """Return the share of sound matter in each column.

    Parameters
    ----------
    damage : ndarray, shape (rows, columns)
    main : ndarray of bool, shape (rows, columns)
        What holds together; the rest counts as lost.
    """
    share: FloatArray = _sound(damage, main).mean(axis=0)
    return share


def _sound(damage: FloatArray, main: BoolArray) -> FloatArray:
    """Return how sound each particle is: 0 for what is lost."""
    return np.where(main, 1.0 - np.minimum(damage, 1.0), 0.0)


def ligament(sound: FloatArray) -> float:
    """Return the least sum of sound matter on any way from face to face, per row.

    A way goes from a row to the next one, in the same column or in one beside it: a
    crack may run obliquely.

    Parameters
    ----------
    sound : ndarray, shape (rows, columns)
        From 0 for lost to 1 for sound.
    """
    least = sound[0]
    for row in sound[1:]:
        padded = np.pad(least, 1, constant_values=np.inf)
        least = row + np.minimum(np.minimum(padded[:-2], padded[2:]), padded[1:-1])
    return float(least.min()) / len(sound)


def _hole(layout: Layout, wall: _Wall, main: BoolArray) -> float:
    """Return the diameter of the hole in what holds together [m]; 0 for none."""
    if not main.any():
        return float(2.0 * layout.r[-1])
    radius = float(wall.r[main].min())
    return 2.0 * radius if radius > BOND * layout.spacing else 0.0


def _come_off(
    layout: Layout,
    particles: Mapping[str, npt.NDArray[Any]],
    wall: _Wall,
    main: BoolArray,
    rear: FloatArray,
) -> BoolArray:
    """Return which particles have come off behind what holds together.

    Matter of the wall must have moved on from its place behind it: what is crushed may
    still be there.
    """
    r = np.maximum.accumulate(np.where(main, wall.r, 0.0).max(axis=0))
    gap = GAP * layout.spacing
    behind: BoolArray = particles["z"] > np.interp(particles["r"], r, rear) + gap
    # What flies past the rim has not come through the wall.
    behind &= particles["r"] < layout.r[-1] - layout.thickness
    moved = wall.z - layout.z[:, np.newaxis]
    nearest = _nearest_columns(main)
    along = np.zeros(r.size)
    if nearest is not None:
        along = np.where(main, moved, -np.inf).max(axis=0)[nearest]
    off = ~main & (moved > along + gap)
    mine = np.flatnonzero(particles["body"] == layout.body)
    behind[mine[np.argsort(particles["id"][mine])]] &= off.ravel()
    return behind


def _sums(
    particles: Mapping[str, npt.NDArray[Any]], which: BoolArray
) -> tuple[float, float]:
    """Return the mass [kg] and the axial momentum [kg m/s] of some particles."""
    m = particles["m"][which]
    return float(m.sum()), float((m * particles["u_z"][which]).sum())


def _crater_diameter(layout: Layout, depth: FloatArray) -> float:
    """Return the width of the crater around its deepest place [m].

    It ends where less than one row of particles is missing.
    """
    shallow = np.flatnonzero(depth < layout.spacing)
    outside = shallow[shallow > depth.argmax()]
    if depth.max(initial=0.0) < layout.spacing or not outside.size:
        return 0.0
    return float(2.0 * layout.r[outside[0]])


def _fastest(wall: _Wall, main: BoolArray) -> float:
    mass = np.where(main, wall.m, 0.0).sum(axis=0)
    momentum = np.where(main, wall.m * wall.u_z, 0.0).sum(axis=0)
    moving = mass > 0.0
    return float(np.abs(momentum[moving] / mass[moving]).max(initial=0.0))
