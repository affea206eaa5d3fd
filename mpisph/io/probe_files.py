"""Tables of what is followed besides the whole: ``bodies.csv`` and ``gauges.csv``."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict

from mpisph.case import Case
from mpisph.diagnostics.probes import body_columns, gauge_columns
from mpisph.io.history import Beginning, complete_lines

BODIES_FILE = "bodies.csv"
GAUGES_FILE = "gauges.csv"


class ProbeState(BaseModel):
    """What the probes of a run need to go on."""

    model_config = ConfigDict(frozen=True, extra="forbid", ser_json_inf_nan="constants")

    followed: dict[str, int]
    """Particle of each moving gauge."""
    peaks: tuple[float, ...]
    """Largest pressure so far of each body [Pa]."""
    tables: dict[str, Beginning]
    """What has been written."""


def probe_headers(case: Case) -> dict[str, list[str]]:
    """Return the names of the columns of each table that a run of the case writes."""
    bodies = body_columns([body.name for body in case.bodies])
    headers = {BODIES_FILE: ["step", "time_s", *bodies]}
    if case.gauges:
        gauges = gauge_columns([gauge.name for gauge in case.gauges])
        headers[GAUGES_FILE] = ["step", "time_s", *gauges]
    return headers


def probe_cells(step: int, time: float, values: npt.NDArray[Any]) -> list[str]:
    """Return a line; numbers keep all of their digits."""
    return [repr(step), repr(time), *map(repr, values.ravel().tolist())]


def read_probes_file(path: Path, header: Sequence[str]) -> npt.NDArray[Any]:
    """Read a table of probes.

    Parameters
    ----------
    path : Path
    header : sequence of str
        Of `probe_headers`.

    Returns
    -------
    structured ndarray, shape (lines,)
        A last line that was cut short by the end of the run is left out. Empty where
        there is no such file, as of runs that wrote none.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it is another table.
    """
    kinds = [(name, "i8" if name == "step" else "f8") for name in header]
    try:
        rows = complete_lines(path)
    except FileNotFoundError:
        return np.array([], dtype=kinds)
    if not rows or rows[0] != list(header):
        raise ValueError(f"{path}: its columns are not those of the case")
    return np.array([tuple(row) for row in rows[1:]], dtype=kinds)
