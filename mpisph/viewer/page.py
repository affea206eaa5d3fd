"""The page that plays runs: one file that fetches nothing."""

from __future__ import annotations

import base64
import importlib.util
import zlib
from collections.abc import Sequence
from functools import cache, partial
from pathlib import Path
from typing import NamedTuple

from markupsafe import Markup

from mpisph.case.contact import time_origin
from mpisph.core.errors import InputError, MpisphError
from mpisph.core.templates import templates_of
from mpisph.figures.cloud import draw_cloud
from mpisph.figures.dots import find_shadings
from mpisph.figures.embed import Picture, embed
from mpisph.figures.fields import BODY, Chosen, require_fields
from mpisph.figures.view import common_view, exposure_at
from mpisph.io import stored_run
from mpisph.io.files import write_text
from mpisph.io.snapshot import read_snapshot
from mpisph.io.stored_run import StoredRun
from mpisph.viewer.data import MOST_PARTICLES, Frame, Shown, choose_sample, describe_run

VIEW_FILE = "view.html"

_LIBRARY = "nbextension/static/index.js"
# deck.gl as the Python package pydeck brings it.

_PICTURES = 4
# Still pictures for a browser that cannot play the run.


class Still(NamedTuple):
    """A picture for a browser that cannot play the run.

    Attributes
    ----------
    title : str
        What it shows.
    picture : Picture
    """

    title: str
    picture: Picture


class EmbeddedRun(NamedTuple):
    """A run as it lies within a page.

    Attributes
    ----------
    number : int
        From 0.
    json : Markup
        What a browser must know besides the particles.
    fixed : str
    frames : list of str
        Packed codes as base64.
    """

    number: int
    json: Markup
    fixed: str
    frames: list[str]


class View(NamedTuple):
    """What the template shows.

    Attributes
    ----------
    above, below : str
        Fields of both halves at first.
    runs : list of EmbeddedRun
        None where a program serves them.
    pictures : list of Still
    served, within : bool
        Whether a program serves the page; whether it lies within another page.
    """

    above: str
    below: str
    runs: list[EmbeddedRun]
    pictures: list[Still]
    served: bool = False
    within: bool = False


def write_view(
    folders: Sequence[Path],
    out: Path,
    chosen: Sequence[Chosen] = (),
    most: int = MOST_PARTICLES,
) -> list[str]:
    """Write one HTML page that plays runs, on one clock.

    Parameters
    ----------
    folders : sequence of Path
        Folders of runs, in any state, each with a snapshot.
    out : Path
        The page; its folder is made where missing.
    chosen : sequence of Chosen, optional
        The fields shown at first, above and below the axis; their limits.
    most : int, optional
        Particles of a run that are shown at most.

    Returns
    -------
    list of str
        What of each run is left out, in words.

    Raises
    ------
    InputError
        If a folder holds no run, or one without snapshots or without a field.
    MpisphError
        If a file of a run cannot be understood; if the library is not installed.
    OSError
        If a file cannot be read or written.
    """
    runs = read_runs(folders, chosen)
    shown = [shown_run(run, chosen, most, 1.0 / len(runs)) for run in runs]
    view = make_view(runs, shown, chosen)
    out.parent.mkdir(parents=True, exist_ok=True)
    write_text(out, page(runs, view))
    notes = [
        (run.name, each.description["note"])
        for run, each in zip(runs, shown, strict=True)
    ]
    return [f"{name}: {note}" for name, note in notes if note]


def read_runs(folders: Sequence[Path], chosen: Sequence[Chosen]) -> list[StoredRun]:
    """Read the runs of a page.

    Raises
    ------
    InputError
        If a folder holds no run, or one without snapshots or without a field.
    """
    runs = stored_run.read_runs(folders)
    for run in runs:
        if not run.snapshots:
            raise InputError(f"{run.folder}: no snapshots yet")
        first = read_snapshot(run.snapshots[0][0])
        require_fields(chosen, first.arrays, run.folder)
    return runs


def shown_run(
    run: StoredRun,
    chosen: Sequence[Chosen] = (),
    most: int = MOST_PARTICLES,
    share: float = 1.0,
    kept: dict[tuple[Path, int], Frame] | None = None,
) -> Shown:
    """Return what a page shows of a run; see `choose_sample` and `describe_run`."""
    return describe_run(run, choose_sample(run, most, share), chosen, kept)


def make_view(
    runs: Sequence[StoredRun],
    shown: Sequence[Shown],
    chosen: Sequence[Chosen] = (),
    *,
    served: bool = False,
    within: bool = False,
) -> View:
    """Return what the template shows.

    Parameters
    ----------
    runs : sequence of StoredRun
    shown : sequence of Shown
        As many; none where a program serves them.
    chosen : sequence of Chosen, optional
        Fields above and below the axis; by default the bodies.
    served, within : bool, optional
        See `View`; another page has pictures of its own.
    """
    names = [each.field.name for each in chosen] or [BODY.field.name]
    stills = max(_PICTURES // len(runs), 1)
    return View(
        above=names[0],
        below=names[-1],
        runs=[_embedded(number, each) for number, each in enumerate(shown)],
        pictures=[]
        if within
        else [still for run in runs for still in _stills(run, chosen, stills)],
        served=served,
        within=within,
    )


def page(runs: Sequence[StoredRun], view: View) -> str:
    """Return the page of a view as HTML."""
    title = runs[0].case.title if len(runs) == 1 else f"{len(runs)} runs of mpisph"
    environment = templates_of("mpisph.viewer")
    return environment.get_template("page.html").render(
        title=title, v=view, library=library()
    )


def _embedded(number: int, shown: Shown) -> EmbeddedRun:
    # As JSON may write them, signs that HTML could take for the end of the script.
    text = shown.json
    for sign in "<>&":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return EmbeddedRun(
        number, Markup(text), _letters(shown.fixed), [_letters(x) for x in shown.frames]
    )


def _letters(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


@cache
def library() -> str:
    """Return the library that draws, packed as fields are.

    Raises
    ------
    MpisphError
        If it is not installed.
    """
    found = importlib.util.find_spec("pydeck")
    if found is None or found.origin is None:
        raise MpisphError("pydeck is not installed, which brings the library deck.gl")
    path = Path(found.origin).parent / _LIBRARY
    return _letters(zlib.compress(path.read_bytes(), 9))


def _stills(run: StoredRun, chosen: Sequence[Chosen], most: int) -> list[Still]:
    """Return pictures of the exposures, or else of times at even distances."""
    case = run.case
    exposed = [item for item in run.snapshots if exposure_at(case, item[1])]
    candidates = exposed or run.snapshots[1:] or run.snapshots
    first = len(candidates) - 1
    indices = sorted({round(first * (k + 1) / most) for k in range(most)})
    paths = [candidates[k] for k in indices]
    view = common_view([path for path, _ in paths], case)
    snapshots = (read_snapshot(path) for path, _ in paths)
    shadings = find_shadings(chosen or (BODY,), snapshots, view, case)
    stills = []
    for path, time in paths:
        exposure = exposure_at(case, time)
        draw = partial(
            draw_cloud, path, case, exposure=exposure, view=view, shadings=shadings
        )
        when = f"t = {1e6 * time:.4g} µs {time_origin(case.bodies, case.boundary)}"
        stills.append(Still(f"{run.name}, {when}", embed(draw)))
    return stills
