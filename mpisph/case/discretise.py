"""The particles that fill the bodies of a case, each with rings of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mpisph.case.model import Case
from mpisph.case.profiles import starting_state
from mpisph.case.shapes.section import Filling, Rings
from mpisph.core.particles import HISTORY

__all__ = ["InitialParticles", "discretise", "initial_count"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


class InitialParticles(NamedTuple):
    """Particles of a case at the start, in the order of their ids.

    Attributes
    ----------
    id : ndarray of int64, shape (n,)
        Those of all particles run from 0, body by body and row by row.
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
        Radial velocity [m/s], energy [J/kg] and stress [Pa]; None is zero.
    history : mapping of str to ndarray, shape (n,)
        Fields of `HISTORY`; those left out are zero, the distension one.
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


def initial_count(case: Case) -> int:
    """Return the exact number of particles at a case's start, without making them.

    Parameters
    ----------
    case : Case
    """
    if case.initial is not None:
        return case.initial.count
    return int(_ends(_fillings(case))[-1])


def discretise(
    case: Case, first_id: int = 0, end_id: int | None = None
) -> InitialParticles:
    """Fill the bodies with particles, or make a share of these.

    Parameters
    ----------
    case : Case
    first_id, end_id : int, optional
        The share: ids from the first one to before the end; by default all.

    Returns
    -------
    InitialParticles
        With the same bits whatever the share is. No others are made.

    Raises
    ------
    CaseError
        If an expression of a body has no sound value at a particle of the share.
    """
    fillings = _fillings(case)
    ends = _ends(fillings)
    end_id = int(ends[-1]) if end_id is None else end_id
    parts = []
    for which, filling in enumerate(fillings):
        begin = int(ends[which] - filling.length.sum())
        own = np.arange(max(first_id, begin), min(end_id, int(ends[which])))
        parts.append(_body_particles(case, which, _rings(filling, own - begin)))
    fields = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    for key, name in (("radial_velocity", "u_r"), ("energy", "E")):
        if all(getattr(body, key) == 0.0 for body in case.bodies):
            del fields[name]
    if all(case.body_models(body).initial_distension == 1.0 for body in case.bodies):
        del fields["distension"]
    return InitialParticles.of({"id": np.arange(first_id, end_id), **fields})


def _fillings(case: Case) -> list[Filling]:
    return [body.section.fill(case.spacing, body.filling) for body in case.bodies]


def _ends(fillings: Sequence[Filling]) -> IntArray:
    """Return the id after the last one of each body."""
    return np.cumsum([filling.length.sum() for filling in fillings])


def _rings(filling: Filling, numbers: IntArray) -> Rings:
    """Return the particles of a body by their numbers, which run row by row.

    Rows are few beside the particles, so every rank can know them all.
    """
    end = np.cumsum(filling.length)
    row = np.searchsorted(end, numbers, side="right")
    return filling.rings(row, numbers - (end - filling.length)[row])


def _body_particles(case: Case, which: int, rings: Rings) -> dict[str, Any]:
    """Return the fields of some particles of a body, without their ids."""
    body = case.bodies[which]
    models = case.body_models(body)
    state = starting_state(body, models.rest_density, rings.r, rings.z)
    n = rings.r.size
    return {
        "body": np.full(n, which, np.int64),
        "material": np.full(n, case.material_indices[which], np.int64),
        "m": 2.0 * np.pi * rings.mean * state.rho * rings.area,
        "r": rings.r,
        "z": rings.z,
        "h": case.resolution.nph * rings.spacing,
        "distension": np.full(n, models.initial_distension),
        **state._asdict(),
    }
