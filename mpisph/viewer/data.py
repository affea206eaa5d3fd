"""What a page shows of a run: its particles at some times, and what surrounds them."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from matplotlib.colors import to_hex

from mpisph.case import Case
from mpisph.case.contact import time_origin
from mpisph.core.words import grouped
from mpisph.diagnostics.cloud import cloud_definition, place_of
from mpisph.figures.dots import Shading, find_shadings
from mpisph.figures.fields import SHOWN_FIELDS, Chosen, ShownField
from mpisph.figures.sections import rest_densities
from mpisph.figures.style import BODY_COLOURS, body_colour
from mpisph.figures.view import (
    View,
    common_view,
    exposure_at,
    measure_cloud,
    only_finite,
    rear_faces,
)
from mpisph.io.snapshot import Snapshot, read_snapshot
from mpisph.io.stored_run import StoredRun
from mpisph.viewer.packing import Codes, pack, quantise

IntArray = npt.NDArray[np.int64]

MOST_PARTICLES = 100_000
"""Particles that a page shows of a run, at any time, unless more are asked for."""

MOST_FRAMES = 60
"""Times that a page shows of a run."""

MOST_VALUES = 29_000_000
"""Numbers that a page holds of all runs: some 27 MB, for each takes up to 0.7 bytes,
and a third more as letters."""

_SHADES = 64
# Colours of a scale; steps between them cannot be seen.


class Sample(NamedTuple):
    """Which particles and times of a run are shown.

    Attributes
    ----------
    ids : ndarray of int64, shape (n,)
        Particles, rising.
    of : int
        How many particles there are.
    snapshots : list of (Path, float)
        With their times [s].
    of_snapshots : int
        How many snapshots there are.
    """

    ids: IntArray
    of: int
    snapshots: list[tuple[Path, float]]
    of_snapshots: int

    @property
    def text(self) -> str:
        """What is left out, in words; empty where all is shown."""
        parts = []
        if self.ids.size < self.of:
            parts.append(f"{grouped(self.ids.size)} of {grouped(self.of)} particles")
        if len(self.snapshots) < self.of_snapshots:
            parts.append(f"{len(self.snapshots)} of {self.of_snapshots} snapshots")
        return f"{' at '.join(parts)} are shown" if parts else ""


class Frame(NamedTuple):
    """A time of a run as a page shows it.

    Attributes
    ----------
    description : dict
        Its time, the ranges of its columns, and sizes of the cloud.
    packed : bytes
        Codes: axial positions, radii, and each field.
    """

    description: dict[str, Any]
    packed: bytes


class Shown(NamedTuple):
    """A run as a page shows it.

    Attributes
    ----------
    description : dict
        What a browser must know besides the particles, in the terms of JSON; lengths in
        mm, times in us.
    fixed : bytes
        Packed codes of what does not change: body, material, strength of the ring, and
        the lower and the higher half of the id.
    frames : list of bytes
        Packed codes at each time, see `Frame`.
    keys : list of str
        Names of the snapshots.
    """

    description: dict[str, Any]
    fixed: bytes
    frames: list[bytes]
    keys: list[str]

    @property
    def json(self) -> str:
        """The description as text."""
        return json.dumps(self.description, ensure_ascii=False, allow_nan=False)


def shown_fields(case: Case, arrays: Sequence[str]) -> list[ShownField]:
    """Return the fields with a scale that the snapshots of a run have."""
    return [
        field
        for field in SHOWN_FIELDS.values()
        if field.names is None and set(field.needs) <= set(arrays)
    ]


def choose_sample(
    run: StoredRun, most: int = MOST_PARTICLES, share: float = 1.0
) -> Sample:
    """Choose which particles and times of a run are shown.

    Parameters
    ----------
    run : StoredRun
        With a snapshot at least.
    most : int, optional
        Particles at most.
    share : float, optional
        The run's share of what a page may hold.

    Returns
    -------
    Sample
        Times at even distances, the last one among them; particles by chance, but
        always the same of a run, for every n-th would leave stripes of the lattice.
    """
    arrays = read_snapshot(run.snapshots[0][0]).arrays
    total, of_snapshots = len(arrays["id"]), len(run.snapshots)
    chosen = np.arange(of_snapshots)
    if of_snapshots > MOST_FRAMES:
        chosen = np.rint(np.linspace(0, of_snapshots - 1, MOST_FRAMES)).astype(int)
    columns = 2 + len(shown_fields(run.case, list(arrays)))
    room = int(share * MOST_VALUES / (columns * len(chosen)))
    count = min(total, most, max(room, 1))
    ids = np.arange(total)
    if count < total:
        ids = np.sort(np.random.default_rng(0).permutation(total)[:count])
    return Sample(ids, total, [run.snapshots[k] for k in chosen], of_snapshots)


def describe_run(
    run: StoredRun,
    sample: Sample,
    chosen: Sequence[Chosen] = (),
    kept: dict[tuple[Path, int], Frame] | None = None,
) -> Shown:
    """Return what a page shows of a run.

    Parameters
    ----------
    run : StoredRun
        With a snapshot at least.
    sample : Sample
    chosen : sequence of Chosen, optional
        Fields whose colours have limits of their own.
    kept : dict, optional
        Frames of an earlier call by snapshot and number of particles; new ones are
        added.

    Raises
    ------
    OSError
        If a snapshot cannot be read.
    """
    case, kept = run.case, {} if kept is None else kept
    paths = [path for path, _ in sample.snapshots]

    def read(path: Path) -> Snapshot:
        return _only(read_snapshot(path), sample.ids)

    first = read(paths[0])
    fields = shown_fields(case, list(first.arrays))
    view = common_view(paths, case)
    limits = {each.field.name: each.limits for each in chosen}
    asked = [Chosen(field, limits.get(field.name)) for field in fields]
    shadings = find_shadings(asked, map(read, paths), view, case)
    frames = []
    for path in paths:
        key = path, sample.ids.size
        if key not in kept:
            kept[key] = _frame(read(path), case, fields)
        frames.append(kept[key])
    fixed, ranges = _fixed(first, case, sample)
    description = {
        "name": run.name,
        "title": case.title,
        "note": sample.text,
        "origin": time_origin(case.bodies, case.boundary),
        "particles": int(sample.ids.size),
        "fixed": ranges,
        "view": _numbers(view),
        "bodies": [
            {"name": body.name, "colour": body_colour(index)}
            for index, body in enumerate(case.bodies)
        ],
        "palette": list(BODY_COLOURS),
        "materials": SHOWN_FIELDS["material"].names(case),  # type: ignore[misc]
        "faces": [1e3 * face for face in rear_faces(case)],
        "planes": [
            1e3 * plane if math.isfinite(plane) else None
            for plane in case.boundary.planes
        ],
        "fields": [_scale(shading, case) for shading in shadings],
        "frames": [frame.description for frame in frames],
    }
    packed = [frame.packed for frame in frames]
    return Shown(description, fixed, packed, [path.stem for path in paths])


def _only(snapshot: Snapshot, ids: IntArray) -> Snapshot:
    """Return a snapshot with some of its particles, which lie in order of their ids."""
    order = np.argsort(snapshot.arrays["id"])[ids]
    arrays = {name: values[order] for name, values in snapshot.arrays.items()}
    return snapshot._replace(arrays=arrays)


def _fixed(
    snapshot: Snapshot, case: Case, sample: Sample
) -> tuple[bytes, dict[str, Any]]:
    """Return what does not change of the particles, packed, and the ranges of it.

    A ring of mass m at a radius r has the section ``m / (2 pi r rho)``. That of matter
    at rest density is taken: blown-up matter would hide what lies behind it.
    """
    a = snapshot.arrays
    rest = rest_densities(case)[a["body"]]
    ring = 1e9 * a["m"] / (2.0 * math.pi * rest)  # [mm^3]
    ring *= sample.of / sample.ids.size  # those left out are covered by the others
    codes, low, high = quantise(ring)
    columns: list[Codes] = [a[name].astype(np.uint16) for name in ("body", "material")]
    number = sample.ids.astype(np.uint32)
    halves = [(number & 0xFFFF).astype(np.uint16), (number >> 16).astype(np.uint16)]
    return pack([*columns, codes, *halves]), {"ring": [low, high]}


def _frame(snapshot: Snapshot, case: Case, fields: Sequence[ShownField]) -> Frame:
    """Return a time of a run."""
    a = snapshot.arrays
    places = [1e3 * a["z"], 1e3 * a["r"]]
    values = [field.shown(a, case) for field in fields]
    columns = [quantise(np.asarray(x, np.float64)) for x in (*places, *values)]
    description = {
        "time": 1e6 * snapshot.time,
        "ranges": [[low, high] for _, low, high in columns],
        "lines": _lines(snapshot, case),
    }
    return Frame(description, pack([codes for codes, _, _ in columns]))


def _lines(snapshot: Snapshot, case: Case) -> list[dict[str, Any]]:
    """Return R_b and L_b, computed and measured, with where they are drawn [mm]."""
    definition = cloud_definition(case)
    exposure = exposure_at(case, snapshot.time)
    if case.measured is None:
        return []
    measure = measure_cloud(only_finite(snapshot), case)
    found: list[tuple[str, float | None, float | None]] = []
    if math.isfinite(measure.mass) and measure.mass > 0.0:
        found.append(("computed", measure.radius, measure.length))
    if exposure is not None:
        found.append(("measured", exposure.radius, exposure.length))
    return [
        {
            "kind": kind,
            "radius": None if radius is None else 1e3 * radius,
            "length": None if length is None else 1e3 * length,
            "rear": 1e3 * definition.rear,
            "front": 1e3 * place_of(length or 0.0, definition),
        }
        for kind, radius, length in found
    ]


def _scale(shading: Shading, case: Case) -> dict[str, Any]:
    """Return a field with its scale of colours."""
    field = shading.field
    shades = shading.colour_map(np.linspace(0.0, 1.0, _SHADES))
    return {
        "name": field.name,
        "label": field.label,
        "unit": field.unit,
        "low": shading.low,
        "high": shading.high,
        "colours": "".join(to_hex(shade)[1:] for shade in shades),
        "missing": field.is_missing(case),
    }


def _numbers(view: View) -> dict[str, float]:
    return {name: float(value) for name, value in view._asdict().items()}
