"""Particles of one's own, from which a run starts in place of the bodies' lattices.

They come from a program, from an HDF5 file with a dataset for each field, or from a
snapshot. What is not given has the value that it has at the start of every case. The
digest of them all is part of what makes two cases differ.
"""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from mpisph.case.discretise import InitialParticles
from mpisph.case.profiles import StartingState, starting_state
from mpisph.case.sections import Initial
from mpisph.case.shield import expand_shield
from mpisph.case.size_checks import FARTHEST
from mpisph.core.errors import CaseError, Problem
from mpisph.core.particles import FIELDS, HISTORY, INITIAL, LABELS
from mpisph.inputs.findings import Finding
from mpisph.inputs.spelling import nearest

if TYPE_CHECKING:
    from mpisph.case.model import Case

Fields = dict[str, npt.NDArray[Any]]

__all__ = ["complete_particles", "digest_of", "read_initial", "with_particles"]

REQUIRED = ("body", "m", "r", "z")
"""Fields that have no default."""

_POSITIVE = ("m", "r", "rho", "h")
_LEAST = dict.fromkeys(HISTORY, 0) | {"distension": 1}
_MOST = {"damage": 1, "opening": 1}
_FOLLOWING = {field.name for field in FIELDS} - set(INITIAL)
# What snapshots hold besides: it follows from the rest.

_SNAPSHOT_GROUP = "VTKHDF/PointData"


def with_particles(case: Case, particles: InitialParticles, file: Path) -> Case:
    """Return a case that starts from given particles.

    Parameters
    ----------
    case : Case
    particles : InitialParticles
        All of them, from `complete_particles`.
    file : Path
        Where they lie, or will.
    """
    digest = digest_of(particles)
    initial = Initial(file=str(file), digest=digest, particles=particles.id.size)
    return case.model_copy(update={"initial": initial})


def read_initial(case: Case) -> InitialParticles:
    """Read and check the particles that a case starts from.

    Parameters
    ----------
    case : Case
        With ``initial``.

    Raises
    ------
    CaseError
        If the file cannot be read, or holds no sound particles of this case, or others
        than when the case was made.
    """
    assert case.initial is not None, "the case starts from particles of its own"
    file = case.initial.file
    particles = complete_particles(case, _read_fields(case, Path(file)), file)
    if case.initial.digest not in {None, digest_of(particles)}:
        text = "holds other particles than those of this case (initial.digest)"
        raise CaseError([Problem(text, file=file)])
    return particles


def digest_of(particles: InitialParticles) -> str:
    """Return the SHA-256 of particles, the same wherever they come from."""
    digest = hashlib.sha256()
    for name, values in sorted(particles.fields().items()):
        digest.update(f"{name} {values.dtype.str} {values.size}\n".encode())
        digest.update(np.ascontiguousarray(values).data)
    return digest.hexdigest()


def complete_particles(
    case: Case, given: Mapping[str, npt.ArrayLike], source: str
) -> InitialParticles:
    """Check particles, and give what is missing its value at the start of a case.

    Parameters
    ----------
    case : Case
    given : mapping of str to array_like, shape (n,)
        `REQUIRED` fields and any other of `INITIAL`; what follows from them, such as
        the pressure, is left out.
    source : str
        What messages call them: a file, or ``particles``.

    Returns
    -------
    InitialParticles
        With all fields, by id. By default ids follow the order given; material,
        density, velocity and energy are the body's, ``h`` is the case's smoothing
        length, and everything else is zero.

    Raises
    ------
    CaseError
        With all that is wrong.
    """
    _refuse(source, _name_findings(given))
    fields = {name: _array(given[name]) for name in INITIAL if name in given}
    _refuse(source, _array_findings(fields))
    kinds = {name: np.int64 if name in LABELS else np.float64 for name in fields}
    fields = {name: values.astype(kinds[name]) for name, values in fields.items()}
    n = fields["r"].size
    fields.setdefault("id", np.arange(n))
    _refuse(source, _label_findings(case, fields))
    _refuse(source, _value_findings(case, fields))
    _add_defaults(case, fields)
    order = np.argsort(fields["id"])
    return InitialParticles.of({name: fields[name][order] for name in INITIAL})


def _refuse(source: str, findings: Iterable[Finding]) -> None:
    """Raise all findings, if there are any."""
    problems = [
        Problem(f.expected, source, key=str(f.key[0]), suggestion=f.suggestion)
        for f in findings
    ]
    if problems:
        raise CaseError(problems)


def _name_findings(given: Mapping[str, npt.ArrayLike]) -> Iterator[Finding]:
    """Require known names, and what has no default."""
    for name in given:
        if name not in INITIAL and name not in _FOLLOWING:
            yield Finding((name,), "no field of particles", nearest(name, INITIAL))
    for name in REQUIRED:
        if name not in given:
            (field,) = (field for field in FIELDS if field.name == name)
            yield Finding((name,), f"required: {field.meaning} [{field.unit}]")


def _array(given: npt.ArrayLike) -> npt.NDArray[Any]:
    try:
        return np.asarray(given)
    except ValueError:  # lists of different lengths
        return np.array(None)


def _array_findings(fields: Fields) -> Iterator[Finding]:
    """Require numbers, as many in each field."""
    n = fields["r"].size
    if n == 0:
        yield Finding(("r",), "expected at least one particle")
    for name, values in fields.items():
        kinds, what = ("iu", "whole numbers") if name in LABELS else ("iuf", "numbers")
        if values.dtype.kind not in kinds:
            yield Finding((name,), f"expected {what}, found {values.dtype}")
        elif values.shape != (n,):
            text = f"expected {n} values, as of r; found the shape {values.shape}"
            yield Finding((name,), text)


def _label_findings(case: Case, fields: Fields) -> Iterator[Finding]:
    """Require each id once, and bodies and materials of the case."""
    n = fields["r"].size
    each_once = f"expected 0 to {n - 1}, each once; found"
    unique, counts = np.unique(fields["id"], return_counts=True)
    outside = unique[(unique < 0) | (unique >= n)]
    if outside.size:
        yield Finding(("id",), f"{each_once} {outside[0]}")
    elif unique.size < n:
        yield Finding(("id",), f"{each_once} {unique[counts > 1][0]} twice")
    sizes = {"body": len(case.bodies), "material": len(case.material_table)}
    for name in sizes.keys() & fields.keys():
        labels, end = fields[name], sizes[name]
        rows = np.flatnonzero((labels < 0) | (labels >= end))
        if rows.size:
            text = f"expected 0 to {end - 1}, the place in the case; found"
            yield Finding((name,), f"{text} {labels[rows[0]]} in row {rows[0]}")


def _add_defaults(case: Case, fields: Fields) -> None:
    """Fill in what is not given."""
    body, n = fields["body"], fields["r"].size
    indices = np.array(case.material_indices, dtype=np.int64)
    material = fields.setdefault("material", indices[body])
    rest = np.array([entry.rest_density for entry in case.material_table])
    pores = np.array([entry.initial_distension for entry in case.material_table])
    starts = {name: np.zeros(n) for name in StartingState._fields}
    for which, each in enumerate(case.bodies):
        mine = body == which
        r, z, reference = fields["r"][mine], fields["z"][mine], rest[material[mine]]
        state = starting_state(each, reference, r, z)
        for name, values in state._asdict().items():
            starts[name][mine] = values
    for name, values in starts.items():
        fields.setdefault(name, values)
    fields.setdefault("distension", pores[material])
    fields.setdefault("h", np.full(n, case.smoothing_length))
    for name in INITIAL:
        fields.setdefault(name, np.zeros(n))


def _value_findings(case: Case, fields: Fields) -> Iterator[Finding]:
    """Require numbers that a step can work with."""
    farthest = FARTHEST * case.spacing
    for name, values in fields.items():
        rules = [(np.isfinite(values), "a finite number")]
        if name in _POSITIVE:
            rules.append((values > 0.0, "more than 0"))
        if name in _LEAST:
            rules.append((values >= _LEAST[name], f"at least {_LEAST[name]}"))
        if name in _MOST:
            rules.append((values <= _MOST[name], f"at most {_MOST[name]}"))
        if name in {"r", "z"}:
            rules.append((np.abs(values) <= farthest, f"at most {farthest:g} m"))
        if name == "z" and (low := case.boundary.z_min) is not None:
            rules.append((values >= low, f"at least boundary.z_min = {low:g} m"))
        if name == "z" and (high := case.boundary.z_max) is not None:
            rules.append((values <= high, f"at most boundary.z_max = {high:g} m"))
        for sound, expected in rules:
            rows = np.flatnonzero(~sound)
            if rows.size:
                more = f" and {rows.size - 1} more" * (rows.size > 1)
                found = f"found {values[rows[0]]:g} in row {rows[0]}{more}"
                yield Finding((name,), f"expected {expected}; {found}")
                break


def _read_fields(case: Case, path: Path) -> dict[str, npt.NDArray[Any]]:
    """Return the fields in a file, or in a snapshot.

    Raises
    ------
    CaseError
        If it cannot be read, or if the snapshot is of other bodies.
    """
    import h5py

    if not path.is_file():
        what = "is no file" if path.exists() else "no such file"
        raise CaseError([Problem(what, file=str(path), key="initial.file")])
    try:
        with h5py.File(path, "r") as file:
            snapshot = _SNAPSHOT_GROUP in file
            group = file[_SNAPSHOT_GROUP] if snapshot else file
            found = {
                name: data[...]
                for name, data in group.items()
                if isinstance(data, h5py.Dataset)
            }
            text = bytes(file["mpisph/case"][()]).decode() if snapshot else ""
    except (OSError, RuntimeError, KeyError) as error:
        text = f"cannot be read as HDF5: {error}"
        raise CaseError([Problem(text, file=str(path))]) from None
    if snapshot:
        velocity = found.pop("u")
        found["u_z"], found["u_r"] = velocity[:, 0], velocity[:, 1]
        _refuse_other_bodies(case, text, path)
    return found


def _refuse_other_bodies(case: Case, text: str, path: Path) -> None:
    """Raise where a snapshot is of other bodies, which have the same numbers.

    Parameters
    ----------
    case : Case
    text : str
        The case in the snapshot.
    path : Path
        The snapshot.
    """
    stored = expand_shield(tomllib.loads(text))
    theirs = [(b["name"], b["material"]) for b in stored["bodies"]]
    ours = [(body.name, body.material) for body in case.bodies]
    if theirs != ours:
        first, second = (", ".join(f"{n} of {m}" for n, m in x) for x in (theirs, ours))
        expected = (
            f"the snapshot is of the bodies {first}; the case has {second}. Particles "
            "of other bodies can be given as a file with a dataset for each field"
        )
        raise CaseError([Problem(expected, file=str(path), key="initial.file")])
