"""All measurements of ``mpisph bench``, one after the other."""

import os
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from mpi4py import MPI
from rich.console import Console

from mpisph.bench import PARTS, SCENES, SMALL_NPR
from mpisph.bench.against import SOURCES, Side, compare, other_side
from mpisph.bench.flops import measure_arithmetic
from mpisph.bench.measure import measure, on_ranks, peak_memory, reset_peak
from mpisph.bench.record import BenchRecord, Comparison, Machine, Measurement, Scaling
from mpisph.bench.scenes import (
    Scene,
    keep_late_start,
    scaled_npr,
    start_block,
    start_late,
)
from mpisph.bench.startup import measure_start_up
from mpisph.case import Case, load_case
from mpisph.case.sections import PAIR_FORMS
from mpisph.core.errors import InputError
from mpisph.io.provenance import cpu_model, git_revision, versions
from mpisph.parallel.collectives import from_root
from mpisph.solver.start import start
from mpisph.solver.warmup import run_tiny_case, warm_up


class Options(NamedTuple):
    """What to measure, and how often.

    Attributes
    ----------
    npr : int
        Resolution on one rank, and of strong scaling on all.
    late : float
        The late time [s].
    store : Path
        Folder that keeps the state at the late time.
    steps : int
        Steps of one repeat.
    repeats : int
    parts : sequence of str
        Of `PARTS`.
    overrides : tuple of str
        Changes ``key=value`` of the shot.
    """

    npr: int
    late: float
    store: Path
    steps: int
    repeats: int
    parts: tuple[str, ...] = PARTS
    overrides: tuple[str, ...] = ()


class _Job(NamedTuple):
    """A measurement to make."""

    scaling: Scaling
    ranks: int
    scene: Scene


def bench(
    case_file: Path, comm: MPI.Intracomm, options: Options, console: Console
) -> BenchRecord:
    """Measure the program; collective.

    Parameters
    ----------
    case_file : Path
        The shot.
    comm : MPI.Intracomm
        All is measured on one rank and on more, up to all of these.
    options : Options
    console : rich.console.Console
        For progress, on rank 0.

    Returns
    -------
    BenchRecord
        On all ranks.

    Raises
    ------
    CaseError, MpisphError, OSError
        On all ranks.
    """
    machine = comm.bcast(_machine())
    title = _load(case_file, comm, options, options.npr).title
    _say(comm, console, "compiling where needed")
    warm_up(comm)
    for form in PAIR_FORMS:  # loads all compiled code: it is no memory of particles
        run_tiny_case(form)
    reset_peak()
    idle_memory = peak_memory()
    measurements: list[Measurement] = []
    for job in _jobs(case_file, comm, options, console):
        _say(
            comm, console, f"{job.scene.name}, npr {job.scene.npr}, ranks: {job.ranks}"
        )
        action = partial(_measure_job, job, options, idle_memory)
        measurements.append(on_ranks(comm, job.ranks, action))
    start_up = None
    if "start-up" in options.parts:
        _say(comm, console, "start-up: compiles once more")
        start_up = on_ranks(
            comm,
            1,
            lambda _: measure_start_up(case_file, comm.size, options.repeats),
        )
    arithmetic = None
    if measurements:
        _say(comm, console, "arithmetic of an interaction, and of the machine")
        arithmetic = on_ranks(comm, 1, lambda _: measure_arithmetic())
    return _record(
        comm,
        case=title,
        measurements=tuple(measurements),
        start_up=start_up,
        machine=machine,
        arithmetic=arithmetic,
    )


def bench_against(
    case_file: Path,
    comm: MPI.Intracomm,
    options: Options,
    console: Console,
    against: str,
    pairs: int,
) -> BenchRecord:
    """Compare this program with another, or with another setting; collective.

    Parameters
    ----------
    case_file, comm, options, console
        See `bench`; the start-up is not compared.
    against : str
        See `against.other_side`.
    pairs : int
        How often each is started.

    Returns
    -------
    BenchRecord
        On all ranks.

    Raises
    ------
    CaseError, MpisphError, OSError
        On all ranks.
    """
    title = _load(case_file, comm, options, options.npr).title
    _say(comm, console, f"in turns with {against}, {pairs} times each")
    # The block is no case, and knows of no setting.
    left_out = {"block"} if "=" in against else set()
    scenes = [s for s in SCENES if s in options.parts and s not in left_out]
    if not scenes:
        raise InputError(f"--against {against}: there is no scene to time with it")
    command = [str(case_file.resolve()), "--npr", f"{options.npr}"]
    command += ["--late", f"{options.late!r}s", "--steps", f"{options.steps}"]
    # Both begin late scenes from the same particles.
    store = options.store.resolve()
    command += ["--repeats", f"{options.repeats}", "--store", str(store)]

    def compare_here() -> list[Comparison]:
        other = other_side(against, store)
        overrides = options.overrides
        this = Side("this program", SOURCES, overrides)
        other = other._replace(overrides=(*overrides, *other.overrides))
        return compare((this, other), command, comm.size, pairs, scenes)

    machine = comm.bcast(_machine())
    return _record(
        comm,
        case=title,
        measurements=(),
        start_up=None,
        machine=machine,
        against=against,
        comparisons=tuple(on_ranks(comm, 1, lambda _: compare_here())),
    )


def _record(comm: MPI.Intracomm, **found: Any) -> BenchRecord:
    """Return what was found, with the program that found it; collective."""
    revision = comm.bcast(git_revision() if comm.rank == 0 else "")
    return BenchRecord(versions=versions(), revision=revision, **found)


def _measure_job(
    job: _Job, options: Options, idle_memory: int, comm: MPI.Intracomm
) -> Measurement:
    return measure(
        job.scene, job.scaling, comm, options.steps, options.repeats, idle_memory
    )


def _jobs(
    case_file: Path, comm: MPI.Intracomm, options: Options, console: Console
) -> list[_Job]:
    """Return what to measure; runs cases to their late time where that is new.

    The particles of a rank grow from job to job: what a process has once taken from
    the system it may keep, and the next peak would show it.
    """
    base = _scenes(case_file, comm, options, options.npr, console)
    jobs = []
    if "small" in options.parts:
        case = _load(case_file, comm, options, SMALL_NPR)
        scene = Scene("small", SMALL_NPR, partial(start, case))
        jobs = [_Job("strong", ranks, scene) for ranks in rank_counts(comm.size)]
    jobs += [
        _Job("strong", ranks, scene)
        for ranks in reversed(rank_counts(comm.size))
        for scene in base
    ]
    for ranks in rank_counts(comm.size)[1:]:
        npr = scaled_npr(options.npr, ranks)
        scaled = _scenes(case_file, comm, options, npr, console)
        jobs += [_Job("weak", ranks, scene) for scene in scaled]
    return jobs


def _scenes(
    case_file: Path, comm: MPI.Intracomm, options: Options, npr: int, console: Console
) -> list[Scene]:
    """Return the scenes of one resolution."""
    case = _load(case_file, comm, options, npr)
    scenes = []
    if "block" in options.parts:
        scenes.append(Scene("block", npr, partial(start_block, npr)))
    if "impact" in options.parts:
        scenes.append(Scene("impact", npr, partial(start, case)))
    if "late" in options.parts:
        _say(comm, console, f"at npr {npr}, to the late time unless that is stored")
        path = keep_late_start(case, comm, options.late, options.store)
        scenes.append(Scene("late", npr, partial(start_late, case, path)))
    return scenes


def _load(case_file: Path, comm: MPI.Intracomm, options: Options, npr: int) -> Case:
    """Read the case on rank 0, for all ranks."""
    overrides = [*options.overrides, f"resolution.npr={npr}"]
    return from_root(comm, lambda: load_case(case_file, overrides))


def rank_counts(size: int) -> list[int]:
    """Return the numbers of ranks to measure on: powers of two up to `size`, and it."""
    return sorted({2**k for k in range(size.bit_length())} | {size})


def _machine() -> Machine:
    return Machine(cpu=cpu_model(), cores=os.cpu_count() or 1, load=os.getloadavg())


def _say(comm: MPI.Intracomm, console: Console, text: str) -> None:
    if comm.rank == 0:
        console.print(text, highlight=False)
