"""A run's results for programs and notebooks: ``mpisph.open("runs/x")``.

Everything is in SI units, and is read when it is first asked for.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from markupsafe import Markup

from mpisph.analysis.fragments import CONTACT, Fragments, find_fragments
from mpisph.analysis.hole import Hole, measure_hole
from mpisph.analysis.spray import BINS, Spray, measure_spray
from mpisph.case import Case
from mpisph.case.times import same_time
from mpisph.core.errors import MpisphError
from mpisph.diagnostics.cloud import CloudMeasure, cloud_definition, measure_arrays
from mpisph.inputs.quantities import si_value
from mpisph.io.probe_files import BODIES_FILE, GAUGES_FILE
from mpisph.io.result import CloudRecord, Comparison, Result
from mpisph.io.run_folder import case_in
from mpisph.io.snapshot import read_series, read_snapshot
from mpisph.io.stored_run import StoredRun, read_run

if TYPE_CHECKING:
    import pyvista

_SHOWN_TIMES = 12
# Times that a message lists, and rows of a notebook's table.


class OpenedSnapshot(Mapping[str, npt.NDArray[Any]]):
    """The particles of a run at one time: arrays by the names of their fields.

    ``snapshot["rho"]`` is the density of all particles, in the order of their ids; the
    page of the cases lists the fields. Velocities are ``u_z`` and ``u_r``.

    Parameters
    ----------
    path : Path
        The file.
    time : float
        [s].
    case : Case
        The run's.
    """

    def __init__(self, path: Path, time: float, case: Case) -> None:
        self.path = path
        self.time = time
        self.case = case

    @cached_property
    def arrays(self) -> dict[str, npt.NDArray[Any]]:
        """All fields by name, each of shape (n,).

        Raises
        ------
        OSError, ValueError
            If the file is missing or damaged.
        """
        return read_snapshot(self.path).arrays

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        """Return a field, shape (n,)."""
        return self.arrays[name]

    def __iter__(self) -> Iterator[str]:
        """Go through the names of the fields."""
        return iter(self.arrays)

    def __len__(self) -> int:
        """Return the number of fields."""
        return len(self.arrays)

    def body(self, name: str) -> npt.NDArray[np.bool_]:
        """Return which particles are of a body, shape (n,).

        Raises
        ------
        MpisphError
            If the case has no body of this name.
        """
        names = [body.name for body in self.case.bodies]
        if name not in names:
            raise MpisphError(f"no body {name!r}; there are {', '.join(names)}")
        chosen: npt.NDArray[np.bool_] = self["body"] == names.index(name)
        return chosen

    def mesh(self) -> "pyvista.PolyData":
        """Return the particles as points (z, r, 0) of pyvista, one cell each.

        Its point data are the fields, and the vector ``u`` = (u_z, u_r, 0).

        Raises
        ------
        MpisphError
            If pyvista is not installed.
        """
        try:
            import pyvista
        except ImportError:
            text = "a mesh needs pyvista: pip install 'mpisph[pyvista]'"
            raise MpisphError(text) from None
        still = np.zeros(len(self["id"]))
        mesh = pyvista.PolyData(np.column_stack([self["z"], self["r"], still]))
        for name, values in self.items():
            mesh.point_data[name] = values
        mesh.point_data["u"] = np.column_stack([self["u_z"], self["u_r"], still])
        return mesh

    def cloud(self) -> CloudMeasure:
        """Measure the debris cloud: R_b, L_b, front velocity, mass.

        All is NaN once the cloud has come to the next body.
        """
        return measure_arrays(self.arrays, cloud_definition(self.case))

    def hole(self) -> Hole:
        """Measure the hole in the target plate."""
        return measure_hole(self.arrays, self.case)

    def fragments(self, factor: float = CONTACT) -> Fragments:
        """Find the clusters of touching particles in the cloud.

        Parameters
        ----------
        factor : float, optional
            Distance within which particles touch, in their sizes.
        """
        return find_fragments(self.arrays, cloud_definition(self.case), factor)

    def spray(self, bins: int = BINS) -> Spray:
        """Sum mass and momentum of what moves over the directions of its velocity.

        Parameters
        ----------
        bins : int, optional
            Number of equal bins from 0 to 180 degrees.
        """
        return measure_spray(self.arrays, cloud_definition(self.case), bins)

    def __repr__(self) -> str:
        """Return file and time."""
        return f"<snapshot {self.path}, {_microseconds(self.time)}>"

    def _repr_html_(self) -> str:
        """Return a table of the fields with their ranges, for notebooks."""
        rows = [
            (name, f"{values.min():.6g}", f"{values.max():.6g}")
            for name, values in self.items()
            if values.size
        ]
        caption = f"{len(self['id'])} particles at {_microseconds(self.time)} (SI)"
        return _html_table(caption, ("field", "least", "largest"), rows)


class OpenedRun:
    """A run in its folder, whether it has ended or not.

    Parameters
    ----------
    folder : Path

    Attributes
    ----------
    folder : Path
    case : Case
    snapshots : tuple of OpenedSnapshot
        In order of time; of a run at work, those that it had written.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.case = case_in(folder)
        self.snapshots = tuple(
            OpenedSnapshot(path, time, self.case)
            for path, time in read_series(folder)
            if path.exists()
        )

    @cached_property
    def _stored(self) -> StoredRun:
        return read_run(self.folder)

    @property
    def state(self) -> str:
        """How the run stands: completed, unstable, stopped, failed, killed, running."""
        return self._stored.state

    @property
    def result(self) -> Result | None:
        """What is in ``result.json``; None where the run has not ended."""
        return self._stored.result

    @property
    def history(self) -> npt.NDArray[Any]:
        """The history, a structured array with a row for each line, in SI units.

        ``pandas.DataFrame(run.history)`` makes a data frame of it.
        """
        return self._stored.history

    @property
    def bodies(self) -> npt.NDArray[Any]:
        """Mass, momentum, energies and peak pressure of each body over time.

        A structured array with the columns of ``bodies.csv``.
        """
        return self._stored.probes[BODIES_FILE]

    @property
    def gauges(self) -> npt.NDArray[Any]:
        """What the gauges have read, with the columns of ``gauges.csv``.

        Empty where the case has no gauges.
        """
        return self._stored.probes.get(GAUGES_FILE, np.array([]))

    @property
    def clouds(self) -> tuple[CloudRecord, ...]:
        """The debris cloud at each output time that was reached."""
        return self._stored.clouds

    @property
    def comparisons(self) -> tuple[Comparison, ...]:
        """The cloud beside each measured exposure."""
        return self._stored.comparisons

    def at(self, time: float | str) -> OpenedSnapshot:
        """Return the snapshot at a time.

        Parameters
        ----------
        time : float or str
            [s], or with its unit, such as ``"6 us"``.

        Raises
        ------
        MpisphError
            If there is no snapshot at this time; with the times there are.
        """
        try:
            wanted = si_value(time, "s")
        except ValueError as error:
            raise MpisphError(f"{time!r}: {error}") from None
        for snapshot in self.snapshots:
            if same_time(snapshot.time, wanted):
                return snapshot
        raise MpisphError(
            f"{self.folder}: no snapshot at {_microseconds(wanted)}; there are "
            f"{self._times_near(wanted)}"
        )

    def _times_near(self, wanted: float) -> str:
        times = sorted((s.time for s in self.snapshots), key=lambda t: abs(t - wanted))
        near = [_microseconds(time) for time in sorted(times[:_SHOWN_TIMES])]
        more = len(times) - len(near)
        return (", ".join(near) or "none") + f" and {more} more" * (more > 0)

    def __repr__(self) -> str:
        """Return folder, title and state."""
        return f"<run {self.folder}: {self.case.title}, {self.state}>"

    def _repr_html_(self) -> str:
        """Return the clouds as a table, for notebooks."""
        header = ("t [µs]", "R_b [mm]", "L_b [mm]", "front [km/s]", "mass [g]")
        rows = [
            (
                f"{1e6 * cloud.time:.6g}",
                _number(1e3 * cloud.radius, ".2f"),
                _number(1e3 * cloud.length, ".2f"),
                _number(1e-3 * cloud.front_velocity, ".3f"),
                _number(1e3 * cloud.mass, ".4g"),
            )
            for cloud in _spread(self.clouds)
        ]
        n = self._stored.particles
        size = "" if n is None else f", {n} particles"
        caption = (
            f"{self.case.title}: {self.state}{size}, {len(self.snapshots)} snapshots "
            f"in {self.folder}"
        )
        return _html_table(caption, header, rows)


def open_run(folder: str | PathLike[str]) -> OpenedRun:
    """Open the folder of a run.

    Parameters
    ----------
    folder : path

    Returns
    -------
    OpenedRun
        Case, result, history and snapshots, read when they are asked for.

    Raises
    ------
    MpisphError
        If the folder holds no run, or what it holds cannot be understood.
    OSError
        If a file cannot be read.
    """
    return OpenedRun(Path(folder))


def _spread(clouds: tuple[CloudRecord, ...]) -> list[CloudRecord]:
    """Return a table's worth of clouds from the first to the last."""
    step = max(1, math.ceil(len(clouds) / _SHOWN_TIMES))
    return list(clouds[::-1][::step][::-1])


def _number(value: float, form: str) -> str:
    """Return a number, or a dash where there is no measure."""
    return f"{value:{form}}" if math.isfinite(value) else "\u2013"


def _microseconds(time: float) -> str:
    return f"{1e6 * time:.6g} us"


def _html_table(
    caption: str, header: Iterable[str], rows: Iterable[Iterable[str]]
) -> str:
    """Return a table; texts are escaped."""
    head = Markup("").join(Markup("<th>{}</th>").format(cell) for cell in header)
    body = Markup("").join(
        Markup("<tr>{}</tr>").format(
            Markup("").join(Markup("<td>{}</td>").format(cell) for cell in row)
        )
        for row in rows
    )
    return str(
        Markup("<table><caption>{}</caption><tr>{}</tr>{}</table>").format(
            caption, head, body
        )
    )
