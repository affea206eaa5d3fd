"""Runs that are resumed in a damaged folder, and runs that are made longer."""

import errno
import json
import os
import shutil

import pytest
from launch import CASES, call
from mpi4py import MPI
from oracles import agree
from run_folders import differences, outcome, status
from small_runs import MODELS, StopAt

import mpisph.io.checkpoint
from mpisph.case import load_case
from mpisph.core.errors import CaseError, CollectiveError, MpisphError
from mpisph.io.checkpoint import find_checkpoints
from mpisph.io.history import read_history
from mpisph.io.run_folder import known_case
from mpisph.io.snapshot import read_series, read_snapshot, snapshot_path
from mpisph.io.stored_run import read_run
from mpisph.run.session import resume, run

SELF = MPI.COMM_SELF
SETTINGS = (
    "resolution.npr=4",
    "time.end=0.4us",
    "output.every=0.05us",
    "output.figures=false",
    "checkpoints.interval=0.05us",
)


def short_case(*more):
    return load_case(CASES / "piekutowski-4-1353.toml", (*SETTINGS, *more))


@pytest.fixture(scope="module")
def once(tmp_path_factory):
    """The folder of a run that nothing has interrupted; not to be written into."""
    folder = tmp_path_factory.mktemp("runs") / "once"
    run(short_case(), SELF, folder)
    return folder


@pytest.fixture(scope="module")
def halfway(tmp_path_factory):
    """The folder of a run that was stopped, with checkpoints of the last two steps."""
    folder = tmp_path_factory.mktemp("runs") / "halfway"
    run(short_case(), SELF, folder, signals=StopAt(14))
    assert len(find_checkpoints(folder)) == 2
    return folder


@pytest.fixture
def stopped(halfway, tmp_path):
    return shutil.copytree(halfway, tmp_path / "stopped", symlinks=True)


@pytest.fixture
def ended(once, tmp_path):
    return shutil.copytree(once, tmp_path / "ended")


def check_whole(folder, once):
    """Check that a run has come to the same as the one that nothing interrupted."""
    assert differences(folder, once) == []
    assert json.loads((folder / "result.json").read_text())["damage"] == []


def test_matter_that_has_hardened_and_broken_goes_on_so(tmp_path):
    """History of all models comes from the checkpoint, half way into the fracture."""
    case = short_case(*MODELS, "time.end=1.6us", "output.every=0.4us")
    run(case, SELF, tmp_path / "once")
    run(case, SELF, tmp_path / "stopped", signals=StopAt(54))
    before = read_snapshot(snapshot_path(tmp_path / "stopped", 3)).arrays["damage"]
    resume(SELF, tmp_path / "stopped")
    assert differences(tmp_path / "stopped", tmp_path / "once") == []
    after = read_snapshot(snapshot_path(tmp_path / "once", 4)).arrays["damage"]
    assert 0.0 < before.mean() < after.mean()


# ---- damaged snapshots and histories


@pytest.mark.parametrize("damage", ["missing", "cut short"])
def test_a_damaged_snapshot_is_said_and_taken_off_the_list(
    damage, stopped, once, capsys
):
    path = snapshot_path(stopped, 1)
    content = path.read_bytes()
    path.unlink()
    if damage == "cut short":
        path.write_bytes(content[:-1000])
    result = resume(SELF, stopped)
    assert result.status == "completed"
    (text,) = result.damage
    assert text.startswith("snapshots/snapshot_00001.vtkhdf: is ")
    assert ("kept as snapshot_00001.vtkhdf.damaged" in text) == (damage != "missing")
    said = text.replace(": is", " is")
    assert f"warning: {said}" in capsys.readouterr().err
    assert read_run(stopped).warnings == [said]
    assert [p.name for p, _ in read_series(stopped)] == [
        f"snapshot_{k:05d}.vtkhdf" for k in range(9) if k != 1
    ]
    for p, _ in read_series(stopped):
        read_snapshot(p)
    # All else is as in the run without interruption.
    got, want = outcome(stopped), outcome(once)
    assert [name for name in want if got[name] != want[name]] == ["series", "snapshots"]


def test_an_altered_snapshot_is_said_and_kept(stopped, capsys):
    path = snapshot_path(stopped, 1)
    content = bytearray(path.read_bytes())
    content[-100] ^= 1
    path.write_bytes(content)
    result = resume(SELF, stopped)
    assert result.damage == (
        "snapshots/snapshot_00001.vtkhdf: is not what was written",
    )
    assert len(read_series(stopped)) == 9
    # It is said whenever somebody asks for the run.
    capsys.readouterr()
    done = call("resume", stopped)
    assert done.returncode == 0
    assert "snapshot_00001.vtkhdf: is not what was written" in done.stderr


def step_of(folder, index):
    """The step of a snapshot."""
    return read_snapshot(snapshot_path(folder, index)).step


@pytest.mark.parametrize("what", ["snapshot", "rows"])
def test_the_checkpoint_before_the_damage_is_taken(what, tmp_path, once, capsys):
    folder, spare = tmp_path / "run", tmp_path / "spare"
    case = short_case()
    run(case, SELF, folder, signals=StopAt(1 + step_of(once, 3)))
    shutil.copytree(folder, spare)
    earlier = find_checkpoints(spare)[0]
    resume(SELF, folder, signals=StopAt(6))
    last = find_checkpoints(folder)[0]
    find_checkpoints(folder)[1].unlink()
    shutil.copy(earlier, last.parent)
    if what == "snapshot":
        snapshot_path(folder, 3).write_bytes(b"")
    else:
        text = (folder / "history.csv").read_text()
        (folder / "history.csv").write_text(text[:-50])
    capsys.readouterr()
    resume(SELF, folder)
    err = capsys.readouterr().err
    assert f"continuing from {earlier.name}" in err
    assert "; it is written again" in err
    check_whole(folder, once)


@pytest.mark.parametrize("damage", ["missing", "cut short", "altered"])
def test_of_a_damaged_history_the_rows_are_kept(damage, stopped, once):
    path = stopped / "history.csv"
    lines = path.read_text().splitlines()
    if damage == "missing":
        path.unlink()
    elif damage == "cut short":
        path.write_text("\n".join(lines[:6]) + "\n" + lines[6][:20])
    else:
        path.write_text("\n".join([*lines[:6], lines[6][:-1] + "x", *lines[7:]]) + "\n")
    result = resume(SELF, stopped)
    step = status(stopped)["step"]
    rows = {"missing": 0, "cut short": 5, "altered": 12}[damage]
    text = "is missing" if damage == "missing" else "is not what was written"
    assert result.damage == (f"history.csv: {text}; {rows} of 13 rows kept",)
    steps = read_history(path)["step"].tolist()
    lost = {"missing": range(13), "cut short": range(5, 13), "altered": [5]}[damage]
    assert steps == [k for k in range(step + 1) if k not in lost]
    got, want = outcome(stopped), outcome(once)
    assert [name for name in want if got[name] != want[name]] == ["history"]
    assert len(read_run(stopped).warnings) == 1


def test_damage_is_remembered_over_several_starts(stopped):
    (stopped / "history.csv").unlink()
    snapshot_path(stopped, 0).unlink()
    snapshot_path(stopped, 2).write_bytes(b"")
    first = resume(SELF, stopped, signals=StopAt(4))
    assert len(first.damage) == 3
    snapshot_path(stopped, 0).write_bytes(b"")  # moved back, so to speak
    result = resume(SELF, stopped)
    assert len(result.damage) == 3
    assert set(first.damage) - set(result.damage) <= {
        "snapshots/snapshot_00000.vtkhdf: is missing"
    }


@pytest.mark.parametrize("damage", ["missing", "{}"])
def test_a_damaged_list_of_snapshots_is_made_anew(damage, stopped, once):
    break_file(stopped / "snapshots.vtkhdf.series", damage)
    resume(SELF, stopped)
    check_whole(stopped, once)


# ---- damaged checkpoints, status, case, result


@pytest.mark.parametrize("kind", ["pipe", "link", "cut short"])
def test_what_is_no_checkpoint_is_set_aside(kind, stopped, once, capsys):
    last, before = find_checkpoints(stopped)
    content = last.read_bytes()
    last.unlink()
    if kind == "pipe":
        os.mkfifo(last)
    elif kind == "link":
        last.symlink_to("nowhere")
    else:
        last.write_bytes(content[:-1])
    resume(SELF, stopped, signals=StopAt(3))
    err = capsys.readouterr().err
    assert f"kept as {last.name}.damaged" in err
    assert f"continuing from {before.name}" in err
    resume(SELF, stopped)
    check_whole(stopped, once)


def test_without_a_sound_checkpoint_a_run_begins_again(stopped, once, capsys):
    for path in find_checkpoints(stopped):
        path.write_bytes(path.read_bytes()[:-1])
    resume(SELF, stopped)
    err = capsys.readouterr().err
    assert err.count(": damaged") == 2
    assert "no sound checkpoint; starting from the beginning" in err
    check_whole(stopped, once)


def test_a_checkpoint_that_cannot_be_read_is_left_for_the_one_before(
    stopped, once, capsys, monkeypatch
):
    last, before = find_checkpoints(stopped)

    def digest(comm, path, original=mpisph.io.checkpoint._digest):
        if path in unreadable:
            raise CollectiveError(errno.EIO, f"Input/output error: {path}")
        return original(comm, path)

    monkeypatch.setattr(mpisph.io.checkpoint, "_digest", digest)
    unreadable = {last, before}
    with pytest.raises(OSError, match="Input/output error"):  # another time it may be
        resume(SELF, stopped)
    assert find_checkpoints(stopped) == [last, before]
    unreadable = {last}
    resume(SELF, stopped)
    err = capsys.readouterr().err
    assert f"Input/output error: {last}" in err
    assert f"continuing from {before.name}" in err
    check_whole(stopped, once)


def break_file(path, damage):
    path.unlink()
    if damage == "folder":
        path.mkdir()
    elif damage == "pipe":
        os.mkfifo(path)
    elif damage != "missing":
        path.write_text(damage, encoding="latin-1")


DAMAGES = ["missing", "", "{}", "pipe"]


@pytest.mark.parametrize("damage", DAMAGES)
def test_how_a_run_stands_is_known_without_its_status(damage, stopped, ended):
    step = status(stopped)["step"]
    for folder in (stopped, ended):
        break_file(folder / "status.json", damage)
    out = call("status", stopped, ended).stdout
    word = "missing" if damage == "missing" else "damaged"
    assert f"{stopped}: failed (status.json was {word}), step {step}, t = 0.2" in out
    assert f"{ended}: completed, step 24, t = 0.4000 of 0.4000 us" in out


@pytest.mark.parametrize("how", ["run", "resume"])
def test_a_run_continues_without_its_status(how, stopped, once):
    (stopped / "status.json").write_text("{")
    result = run(short_case(), SELF, stopped) if how == "run" else resume(SELF, stopped)
    assert result.status == "completed"
    check_whole(stopped, once)


def test_a_run_that_has_ended_stays_so_without_its_status(ended, once):
    (ended / "status.json").write_text("{")
    before = snapshot_path(ended, 8).stat().st_mtime_ns
    assert resume(SELF, ended).status == "completed"
    assert snapshot_path(ended, 8).stat().st_mtime_ns == before
    check_whole(ended, once)


def test_a_run_killed_before_anything_else_was_written_begins_anew(tmp_path, once):
    (tmp_path / "status.json").write_text("")
    (tmp_path / "case.toml").write_text(short_case().to_toml())
    assert resume(SELF, tmp_path).status == "completed"
    check_whole(tmp_path, once)


@pytest.mark.parametrize("damage", ["missing", "title = ", "pipe", "folder", "\xff"])
def test_the_case_of_a_checkpoint_stands_in(damage, stopped):
    case = load_case(stopped / "case.toml")
    break_file(stopped / "case.toml", damage)
    found, note = known_case(stopped)
    assert found == case
    assert f"{stopped / 'case.toml'}" in note
    assert "; the case is taken from checkpoint_" in note


@pytest.mark.parametrize("how", ["run", "resume"])
def test_a_run_continues_without_its_case(how, stopped, once, capsys):
    (stopped / "case.toml").unlink()
    result = run(short_case(), SELF, stopped) if how == "run" else resume(SELF, stopped)
    assert result.status == "completed"
    check_whole(stopped, once)
    if how == "resume":
        assert "the case is taken from checkpoint_" in capsys.readouterr().err
    assert load_case(stopped / "case.toml") == short_case()


def test_a_case_that_was_changed_is_refused_with_a_way_out(stopped, once):
    text = (stopped / "case.toml").read_text()
    (stopped / "case.toml").write_text(text.replace("npr = 4", "npr = 5"))
    with pytest.raises(MpisphError, match="Without it, the case in the checkpoint"):
        resume(SELF, stopped)
    (stopped / "case.toml").unlink()
    resume(SELF, stopped)
    check_whole(stopped, once)


@pytest.mark.parametrize(
    ("what", "damage"),
    [
        ("result.json", "missing"),
        ("result.json", "pipe"),
        ("snapshots/snapshot_00008.vtkhdf", "{}"),
    ],
)
def test_what_a_run_ended_with_is_written_again(what, damage, ended, once, capsys):
    break_file(ended / what, damage)
    assert resume(SELF, ended).status == "completed"
    assert f"{what}: missing or damaged; it is written again" in capsys.readouterr().err
    check_whole(ended, once)


def test_a_lost_result_without_a_checkpoint_is_an_error(ended):
    (ended / "result.json").unlink()
    shutil.rmtree(ended / "checkpoints")
    with pytest.raises(MpisphError, match="missing or damaged, although"):
        resume(SELF, ended)
    assert status(ended)["state"] == "completed"


def test_a_failure_of_an_earlier_start_is_forgotten_at_once(stopped, monkeypatch):
    """Else a rank that fails before the first step would keep silent about it."""
    path = stopped / "status.json"
    path.write_text(path.read_text().replace('"stopped"', '"failed"'))
    seen = []

    def fail(*_):
        seen.append((status(stopped)["state"], status(stopped)["step"]))
        raise MpisphError("on purpose")

    step = status(stopped)["step"]
    monkeypatch.setattr("mpisph.run.session.load_last_state", fail)
    with pytest.raises(MpisphError, match="on purpose"):
        resume(SELF, stopped)
    assert seen == [("running", step)]
    assert status(stopped)["reason"] == "on purpose"


# ---- longer runs


def fields(folder):
    """What the snapshots of a run hold, without the case."""
    return [
        (s.time, s.step, {name: a.tobytes() for name, a in s.arrays.items()})
        for s in (read_snapshot(path) for path, _ in read_series(folder))
    ]


def compare_longer(folder, reference, first):
    """What differs between a run made longer and one made in one go.

    The snapshots before the `first` hold the case of their time.
    """
    got, want = outcome(folder), outcome(reference)
    for found in (got, want):
        names = sorted(found["snapshots"])
        found["snapshots"] = {n: found["snapshots"][n] for n in names[first:]}
    found = [name for name in want if got[name] != want[name]]
    return found if fields(folder) == fields(reference) else [*found, "fields"]


@pytest.mark.mpi(min_size=1)
def test_a_longer_run_is_the_one_made_in_one_go(mpi_tmp_path):
    """Also where the first end is no time of output by itself, on other ranks."""
    world = MPI.COMM_WORLD
    every = ("output.every=0.1us", "output.history_every=3")
    longer, whole = mpi_tmp_path / "longer", mpi_tmp_path / "whole"
    run(short_case("time.end=0.33us", *every), world, longer)
    part = world.Split(world.rank == 0, world.rank)
    if world.rank > 0 or world.size == 1:
        overrides = ["time.end=0.52us", "output.times=[0.45e-6]"]
        resume(part, longer, overrides=overrides)
    part.Free()
    world.Barrier()
    run(load_case(longer / "case.toml"), world, whole)
    problems = []
    if world.rank == 0:
        problems = compare_longer(longer, whole, first=4)
        times = [time for _, time in read_series(longer)]
        if times != [0.0, 1e-7, 2e-7, 3e-7, 3.3e-7, 4e-7, 4.5e-7, 5e-7, 5.2e-7]:
            problems.append(times)
    agree(world, problems)


def test_an_end_that_is_a_time_of_output_leaves_no_trace(ended, once, tmp_path):
    """The longer run is that of the longer case, and nothing else."""
    whole = tmp_path / "whole"
    longer = short_case("time.end=0.5us")
    run(longer, SELF, whole)
    result = resume(SELF, ended, overrides=["time.end=0.5us"])
    assert (result.status, result.time) == ("completed", 5e-7)
    assert load_case(ended / "case.toml") == longer
    assert compare_longer(ended, whole, first=8) == []
    now = status(ended)
    assert (now["state"], now["end_time"], now["starts"]) == ("completed", 5e-7, 2)
    assert {p.name for p in ended.rglob("*")} == {p.name for p in whole.rglob("*")}
    # Again, in two steps.
    resume(SELF, ended, overrides=["time.end=0.6us"], signals=StopAt(3))
    assert status(ended)["state"] == "stopped"
    resume(SELF, ended, overrides=["time.end=0.7us"])
    run(short_case("time.end=0.7us"), SELF, whole, force=True)
    assert compare_longer(ended, whole, first=11) == []


def test_a_longer_run_that_was_stopped_has_not_ended(ended):
    result = resume(SELF, ended, overrides=["time.end=0.6us"], signals=StopAt(9))
    assert result.status == "stopped"
    # The result of the shorter one is not lost, and not taken for that of the longer.
    assert json.loads((ended / "result.json").read_text())["time"] == 4e-7
    stored = read_run(ended)
    assert (stored.state, stored.result, len(stored.snapshots)) == ("stopped", None, 11)
    assert len(stored.clouds) == 10
    break_file(ended / "status.json", "")
    assert "failed (status.json was damaged)" in call("status", ended).stdout
    assert resume(SELF, ended).time == 6e-7


@pytest.mark.parametrize("lost", ["removed", "damaged"])
def test_without_its_last_checkpoint_a_run_cannot_be_made_longer(lost, ended, once):
    (path,) = find_checkpoints(ended)
    if lost == "removed":
        shutil.rmtree(path.parent)
    else:
        path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(
        MpisphError, match="no sound checkpoint from the end of the run"
    ):
        resume(SELF, ended, overrides=["time.end=0.5us"])
    check_whole(ended, once)
    assert (ended / "case.toml").read_bytes() == (once / "case.toml").read_bytes()


@pytest.mark.parametrize("moment", ["write_text", "History", "make_step", "conclude"])
def test_a_failure_on_the_way_loses_nothing(moment, ended, tmp_path, monkeypatch):
    """Whenever it comes."""
    places = {
        "write_text": "mpisph.run.session.write_text",
        "History": "mpisph.run.session.History",
        "make_step": "mpisph.run.loop.make_step",
        "conclude": "mpisph.run.output.RunOutput.conclude",
    }

    def fail(*_, **__):
        raise MpisphError("on purpose")

    with monkeypatch.context() as patch:
        patch.setattr(places[moment], fail)
        with pytest.raises(MpisphError, match="on purpose"):
            resume(SELF, ended, overrides=["time.end=0.5us"])
    assert status(ended)["state"] == "failed"
    assert json.loads((ended / "result.json").read_text())["time"] == 4e-7
    result = resume(SELF, ended)
    # Before the longer case was written, it is the shorter run that continues.
    assert result.time == (4e-7 if moment == "write_text" else 5e-7)
    assert result.damage == ()
    resume(SELF, ended, overrides=["time.end=0.5us"])
    run(short_case("time.end=0.5us"), SELF, tmp_path / "whole")
    assert compare_longer(ended, tmp_path / "whole", first=8) == []


def test_an_unstable_run_stays_as_it_is(tmp_path):
    case = short_case("limits.energy_drift=1e-18")
    assert run(case, SELF, tmp_path).status == "unstable"
    before = status(tmp_path)
    with pytest.raises(MpisphError, match="an unstable run cannot be extended"):
        resume(SELF, tmp_path, overrides=["time.end=0.5us"])
    assert status(tmp_path) == before


@pytest.mark.parametrize(
    ("override", "text"),
    [
        ("resolution.npr=5", "cannot change in a run that is extended"),
        ("time.end=0.3us", "can only be made longer"),
        ("time.until=0.5us", "time.until"),
        ("output.every=0.03us", "no snapshot can be added at 3e-08 s"),
    ],
)
def test_what_may_not_change_is_named_and_nothing_is_touched(
    override, text, ended, once
):
    done = call("resume", ended, "--set", override)
    assert done.returncode == 2
    assert text in done.stderr
    check_whole(ended, once)


def test_run_names_the_way_to_a_longer_run(ended):
    with pytest.raises(CaseError, match=r"`mpisph resume .* --set KEY=VALUE` extends"):
        run(short_case("time.end=0.5us"), SELF, ended)
    with pytest.raises(CaseError) as error:
        run(short_case("time.end=0.5us", "resolution.npr=5"), SELF, ended)
    assert "extends" not in str(error.value)


def test_a_run_that_has_not_ended_can_be_made_longer_too(stopped, tmp_path):
    resume(SELF, stopped, overrides=["time.end=0.5us"])
    run(short_case("time.end=0.5us"), SELF, tmp_path / "whole")
    index = len([t for _, t in read_series(stopped) if t < 2.5e-7])
    assert compare_longer(stopped, tmp_path / "whole", first=index) == []


def test_the_last_checkpoint_is_that_of_the_end(once):
    (path,) = find_checkpoints(once)
    assert path.name == f"checkpoint_{status(once)['step']:09d}.h5"


@pytest.mark.parametrize("obstacle", ["file", "link"])
def test_a_run_ends_well_without_its_last_checkpoint(obstacle, tmp_path, capsys):
    place = tmp_path / "checkpoints"
    if obstacle == "file":
        place.touch()
    else:
        place.symlink_to("nowhere")
    case = short_case("checkpoints.interval=", "time.end=0.1us")
    assert run(case, SELF, tmp_path).status == "completed"
    assert "warning: no checkpoint at step" in capsys.readouterr().err
    assert "checkpoints" in read_run(tmp_path).warnings[0]
    with pytest.raises(MpisphError, match="no sound checkpoint from the end"):
        resume(SELF, tmp_path, overrides=["time.end=0.2us"])
