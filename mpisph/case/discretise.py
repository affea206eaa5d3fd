"""The particles that fill the bodies of a case, each on its own lattice of rings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mpisph.case.model import Case
from mpisph.case.shapes.section import Lattice
from mpisph.core.particles import HISTORY

__all__ = ["InitialParticles", "discretise", "initial_count"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


class InitialParticles(NamedTuple):
    """Particles of a case at the start, in the order of their ids.

    Attributes
    ----------
    id : ndarray of int64, shape (n,)
        Those of all particles run from 0, body by body, along z, and within a row
        along r.
    body : ndarray of int64, shape (n,)
        Index in ``case.bodies``.
    material : ndarray of int64, shape (n,)
        Index in ``case.material_table``.
    m : ndarray, shape (n,)
        Mass of the whole ring [kg].
    r, z : ndarray, shape (n,)
        Position [m].
    u_z : ndarray, shape (n,)
        Axial velocity [m/s].
    rho : ndarray, shape (n,)
        Density [kg/m^3].
    h : ndarray, shape (n,)
        Smoothing length [m].
    u_r, E, S_rr, S_zz, S_rz : ndarray, shape (n,), or None
        Radial velocity [m/s], energy [J/kg] and stress [Pa]; None is zero, as at the
        start of every case.
    history : mapping of str to ndarray, shape (n,)
        Fields of `HISTORY`; those left out are zero.
    """

    id: IntArray
    body: IntArray
    material: IntArray
    m: FloatArray
    r: FloatArray
    z: FloatArray
    u_z: FloatArray
    rho: FloatArray
    h: FloatArray
    u_r: FloatArray | None = None
    E: FloatArray | None = None
    S_rr: FloatArray | None = None
    S_zz: FloatArray | None = None
    S_rz: FloatArray | None = None
    history: Mapping[str, FloatArray] = {}

    @classmethod
    def of(cls, fields: Mapping[str, npt.NDArray[Any]]) -> InitialParticles:
        """Make them of their fields by name."""
        history = {name: fields[name] for name in HISTORY if name in fields}
        others = {name: v for name, v in fields.items() if name not in HISTORY}
        return cls(**others, history=history)

    def fields(self) -> dict[str, npt.NDArray[Any]]:
        """Return the fields that are given, by name."""
        named = self._asdict() | dict(self.history)
        del named["history"]
        return {name: values for name, values in named.items() if values is not None}


class _Rows(NamedTuple):
    """All rows of particles of a case, in the order of the ids; shape (rows,).

    They are few beside the particles, so every rank can hold them all.
    """

    body: IntArray
    z: FloatArray
    first_column: IntArray
    first_id: IntArray
    end_id: IntArray


def initial_count(case: Case) -> int:
    """Return the exact number of particles at a case's start, without making them.

    Parameters
    ----------
    case : Case
    """
    if case.initial is not None:
        return case.initial.count
    return int(_rows(_lattices(case)).end_id[-1])


def discretise(
    case: Case, first_id: int = 0, end_id: int | None = None
) -> InitialParticles:
    """Fill the bodies with particles, or make a share of these.

    Each shape has its own lattice of rows along r (see `Section.lattice`).

    Parameters
    ----------
    case : Case
    first_id, end_id : int, optional
        The share: ids from the first one to before the end; by default all.

    Returns
    -------
    InitialParticles
        With the same bits whatever the share is. No others are made.
    """
    lattices = _lattices(case)
    rows = _rows(lattices)
    ids = np.arange(first_id, rows.end_id[-1] if end_id is None else end_id)
    row = np.searchsorted(rows.end_id, ids, side="right")
    body = rows.body[row]
    column = rows.first_column[row] + (ids - rows.first_id[row])
    inner, width, area = np.array([(x.inner, x.width, x.area) for x in lattices]).T
    r = inner[body] + (column + 0.5) * width[body]
    rho = np.array([case.body_material(each).rho0 for each in case.bodies])[body]
    return InitialParticles(
        id=ids,
        body=body,
        material=np.array(case.material_indices, dtype=np.int64)[body],
        m=2.0 * np.pi * r * rho * area[body],
        r=r + width[body] ** 2 / (24.0 * r),
        z=rows.z[row],
        u_z=np.array([each.velocity for each in case.bodies], dtype=np.float64)[body],
        rho=rho,
        h=np.full(ids.size, case.smoothing_length),
    )


def _lattices(case: Case) -> list[Lattice]:
    return [body.section.lattice(case.spacing) for body in case.bodies]


def _rows(lattices: Sequence[Lattice]) -> _Rows:
    length = np.concatenate([lattice.length for lattice in lattices])
    end = np.cumsum(length)
    return _Rows(
        body=np.repeat(np.arange(len(lattices)), [each.z.size for each in lattices]),
        z=np.concatenate([lattice.z for lattice in lattices]),
        first_column=np.concatenate([lattice.first for lattice in lattices]),
        first_id=end - length,
        end_id=end,
    )
