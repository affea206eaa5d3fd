"""Two programs, or two settings of one, timed in turns: the ratio of their speeds.

Timings of one machine drift within minutes by more than most changes gain. So both are
started in turns, the one that begins changes with each pair, and the ratio is taken
within a pair.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from io import BytesIO
from pathlib import Path
from typing import NamedTuple
from zipfile import ZipFile

import mpisph
from mpisph.bench import PARTS, SCENES
from mpisph.bench.record import BenchRecord, Comparison, Measurement, Spread, read_bench
from mpisph.bench.startup import launched, mpirun, on_all_cores
from mpisph.core.errors import InputError, MpisphError
from mpisph.core.jit import CACHE_FOLDER

SOURCES = Path(mpisph.__file__).parents[1]
"""Folder of this package."""


class Side(NamedTuple):
    """One of the two that are compared.

    Attributes
    ----------
    name : str
        What it is called.
    sources : Path
        Folder of its package.
    overrides : tuple of str
        Changes ``key=value`` of the case.
    cache : Path or None
        Of its compiled code; None for that of this program.
    """

    name: str
    sources: Path
    overrides: tuple[str, ...] = ()
    cache: Path | None = None


def other_side(against: str, store: Path) -> Side:
    """Return what this program is compared with.

    Parameters
    ----------
    against : str
        A setting ``key=value``, a folder of sources, or a revision of these sources.
    store : Path
        Folder where sources of revisions are kept, with their compiled code.

    Raises
    ------
    InputError
        If it is none of these.
    """
    if "=" in against:
        return Side(against, SOURCES, (against,))
    folder = Path(against)
    if folder.is_dir():
        return _side_of(against, folder.resolve(), store / "folder")
    commit = _git("rev-parse", "--verify", "--quiet", f"{against}^{{commit}}")
    if commit is None:
        raise InputError(
            f"--against {against}: neither a setting key=value, nor a folder of "
            f"sources, nor a revision of {SOURCES}"
        )
    name = commit.decode().strip()
    place = store / "revisions" / name
    if not place.exists():
        _unpack(name, place)
    return _side_of(against, place, place)


def _side_of(name: str, sources: Path, place: Path) -> Side:
    if not (sources / "mpisph" / "__init__.py").exists():
        raise InputError(f"--against {name}: no package mpisph in {sources}")
    return Side(name, sources, cache=place / "cache")


def _git(*arguments: str) -> bytes | None:
    """Return what git says of these sources; None where it fails."""
    command = ["git", "-C", str(SOURCES), *arguments]
    try:
        return subprocess.run(command, check=True, capture_output=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return None


def _unpack(commit: str, place: Path) -> None:
    """Write the package of a commit into a folder that appears when it is whole."""
    packed = _git("archive", "--format=zip", commit, "mpisph")
    if packed is None:
        raise InputError(f"--against {commit}: it has no package mpisph")
    place.parent.mkdir(parents=True, exist_ok=True)
    part = Path(tempfile.mkdtemp(dir=place.parent, prefix="part"))
    with ZipFile(BytesIO(packed)) as archive:
        archive.extractall(part)
    try:
        part.rename(place)
    except OSError:  # another process was faster
        shutil.rmtree(part)


def compare(
    sides: tuple[Side, Side],
    command: Sequence[str],
    ranks: int,
    pairs: int,
    scenes: Sequence[str] = SCENES,
) -> list[Comparison]:
    """Time both sides in turns; call it on one rank.

    Parameters
    ----------
    sides : tuple of Side
        This program and what it is compared with.
    command : sequence of str
        Case and options of ``mpisph bench``.
    ranks : int
    pairs : int
        How often each is started.
    scenes : sequence of str, optional
        Those to time; one that a program does not know is left out for both.

    Returns
    -------
    list of Comparison
        For each scene and number of ranks.

    Raises
    ------
    MpisphError
        If one of them fails.
    """
    found: list[tuple[BenchRecord, BenchRecord]] = []
    with on_all_cores(), tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bench.json"
        parts = [_parts_of(side) for side in sides]
        known = [scene for scene in scenes if all(scene in each for each in parts)]
        if not known:
            raise MpisphError(f"{sides[1].name}: knows no scene of {', '.join(scenes)}")
        whole = [*command, *_each("--only", known), "-o", str(path)]
        once = [*whole, "--repeats", "1", "--steps", "1"]
        for side in sides:  # compiles, and runs shots to their late times
            _measure(side, once, ranks, path)
        for pair in range(pairs):
            order = (0, 1) if pair % 2 == 0 else (1, 0)
            records = {k: _measure(sides[k], whole, ranks, path) for k in order}
            found.append((records[0], records[1]))
    return _comparisons(found)


def _each(option: str, values: Sequence[str]) -> Iterator[str]:
    for value in values:
        yield from (option, value)


def _parts_of(side: Side) -> list[str]:
    """Return what a program can measure; older ones know less."""
    if side.sources == SOURCES:
        return list(PARTS)
    done = _start(side, ["--help"], 1)
    found = re.search(r"--only \[([\w|-]+)\]", done.stdout)
    return found.group(1).split("|") if found else []


def _measure(
    side: Side, arguments: Sequence[str], ranks: int, path: Path
) -> BenchRecord:
    done = _start(side, [*arguments, *_each("--set", side.overrides)], ranks)
    if done.returncode != 0:
        raise MpisphError(f"{side.name}: its bench failed:\n{done.stderr.strip()}")
    return read_bench(path)


def _start(
    side: Side, arguments: Sequence[str], ranks: int
) -> "subprocess.CompletedProcess[str]":
    """Run ``mpisph bench`` of a side."""
    command = [sys.executable, "-m", "mpisph", "bench", *arguments]
    if ranks > 1:
        command = [mpirun(), "-n", str(ranks), *command]
    before = os.environ.get("PYTHONPATH")
    paths = [str(side.sources), *([before] if before else [])]
    cache = side.cache or CACHE_FOLDER.parent
    return launched(
        command,
        PYTHONPATH=os.pathsep.join(paths),
        MPISPH_CACHE_DIR=str(cache),
    )


def _comparisons(
    found: Sequence[tuple[BenchRecord, BenchRecord]],
) -> list[Comparison]:
    """Return the ratios of all scenes, each within its pair."""
    comparisons = []
    for index, first in enumerate(found[0][0].measurements):
        mine, theirs = (
            [_same(pair[side], first, index) for pair in found] for side in (0, 1)
        )
        ratios = [
            a.step_ms.median / b.step_ms.median
            for a, b in zip(mine, theirs, strict=True)
        ]
        comparisons.append(
            Comparison(
                scene=first.scene,
                scaling=first.scaling,
                ranks=first.ranks,
                particles=first.particles,
                step_ms=Spread.of([m.step_ms.median for m in mine]),
                other_step_ms=Spread.of([m.step_ms.median for m in theirs]),
                ratio=Spread.of(ratios),
            )
        )
    return comparisons


def _same(record: BenchRecord, wanted: Measurement, index: int) -> Measurement:
    """Return a measurement of a record, which must be of the same scene."""
    found = record.measurements[index]
    keys = ("scene", "scaling", "ranks", "npr")
    assert all(getattr(found, k) == getattr(wanted, k) for k in keys), "same options"
    return found
