"""When to write a checkpoint, and when to stop."""

import errno
from types import SimpleNamespace

import pytest

import mpisph.run.checkpointing
from mpisph.core.errors import CollectiveError
from mpisph.run.checkpointing import LATENCY, MARGIN, POLL, Keeper, StopRequested
from mpisph.run.signals import Wish

N = 1000


class Recorder:
    """Takes down what it is asked for; a checkpoint takes `cost` on the clock."""

    def __init__(self, folder, clock):
        self.folder = folder
        self.clock = clock
        self.saved = []
        self.warnings = []
        self.cost = 0.25
        self.error = None

    def save_checkpoint(self, sim):
        self.clock.now += self.cost
        if self.error is not None:
            raise self.error
        self.saved.append(sim.step)

    def warn(self, text):
        self.warnings.append(text)


class Status:
    def __init__(self):
        self.refreshed = []

    def refresh(self, step, time):
        self.refreshed.append(step)


class Guard:
    def __init__(self):
        self.wish = Wish.NOTHING
        self.left = float("inf")

    def signal_wish(self):
        return self.wish

    def time_left(self):
        return self.left


class Scene:
    """A keeper among stand-ins, with a clock that is set by hand."""

    def __init__(self, tmp_path, monkeypatch, rank=0, wall=60.0, interval=None):
        self.now = 1000.0
        monkeypatch.setattr(
            mpisph.run.checkpointing.time, "monotonic", lambda: self.now
        )
        settings = SimpleNamespace(wall_interval=wall, interval=interval)
        self.sim = SimpleNamespace(
            step=0,
            time=0.0,
            n_total=N,
            comm=SimpleNamespace(rank=rank),
            case=SimpleNamespace(checkpoints=settings),
        )
        self.recorder = Recorder(tmp_path, self)
        self.status, self.guard = Status(), Guard()
        self.keeper = Keeper(self.sim, self.recorder, self.status, self.guard)

    def step(self, duration=0.1, time=1e-9):
        """Make a step and return what is wished for after it."""
        self.now += duration
        self.sim.step += 1
        self.sim.time += time
        return self.keeper.wish(self.sim)


@pytest.fixture
def scene(tmp_path, monkeypatch):
    return Scene(tmp_path, monkeypatch)


def test_checkpoints_are_due_after_an_interval_on_the_wall(scene):
    assert scene.keeper.wish(scene.sim) == Wish.NOTHING
    assert scene.step(59.9) == Wish.NOTHING
    assert scene.step(0.2) == Wish.CHECKPOINT
    scene.keeper.heed(scene.sim, Wish.CHECKPOINT)
    assert scene.recorder.saved == [2]
    assert scene.status.refreshed[-1] == 2
    assert scene.step(59.9) == Wish.NOTHING
    assert scene.step(0.2) == Wish.CHECKPOINT


def test_checkpoints_are_due_after_an_interval_of_simulated_time(tmp_path, monkeypatch):
    scene = Scene(tmp_path, monkeypatch, interval=1e-6)
    assert scene.step(time=0.9e-6) == Wish.NOTHING
    assert scene.step(time=0.2e-6) == Wish.CHECKPOINT
    scene.keeper.heed(scene.sim, Wish.CHECKPOINT)
    assert scene.step(time=0.8e-6) == Wish.NOTHING
    assert scene.step(time=0.2e-6) == Wish.CHECKPOINT


def test_the_stop_file_is_seen_within_a_moment(scene, tmp_path):
    assert scene.keeper.wish(scene.sim) == Wish.NOTHING
    (tmp_path / "stop").touch()
    assert scene.step(0.5 * POLL) == Wish.NOTHING
    assert scene.step(POLL) == Wish.STOP_FILE


def test_the_limit_leaves_time_for_a_step_and_a_checkpoint(scene):
    scene.keeper.wish(scene.sim)
    scene.step(3.0)
    # Nothing is known yet of what a checkpoint costs.
    scene.guard.left = MARGIN * (3.0 + LATENCY) - 0.1
    assert scene.step() == Wish.WALL_TIME
    scene.guard.left = 1e9
    scene.recorder.cost = 0.2
    scene.keeper.heed(scene.sim, Wish.CHECKPOINT)
    scene.guard.left = MARGIN * (3.0 + 0.2) + 0.01
    assert scene.step() == Wish.NOTHING
    scene.guard.left = MARGIN * (3.0 + 0.2) - 0.01
    assert scene.step() == Wish.WALL_TIME
    # A checkpoint does not count as a part of a step; the slowest one counts.
    scene.recorder.cost = 5.0
    scene.keeper.heed(scene.sim, Wish.CHECKPOINT)
    scene.recorder.cost = 0.1
    scene.keeper.heed(scene.sim, Wish.CHECKPOINT)
    scene.guard.left = MARGIN * (3.0 + 5.0) + 0.01
    assert scene.step() == Wish.NOTHING
    scene.guard.left = MARGIN * (3.0 + 5.0) - 0.01
    assert scene.step() == Wish.WALL_TIME


def test_a_large_first_checkpoint_is_given_more_time(tmp_path, monkeypatch):
    scene = Scene(tmp_path, monkeypatch)
    scene.sim.n_total = 10**7
    keeper = Keeper(scene.sim, scene.recorder, scene.status, scene.guard)
    scene.guard.left = MARGIN * 20.0  # 2.2 GB at 100 MB/s take 22 s
    assert keeper.wish(scene.sim) == Wish.WALL_TIME


def test_other_ranks_bring_signals_alone(tmp_path, monkeypatch):
    scene = Scene(tmp_path, monkeypatch, rank=1)
    (tmp_path / "stop").touch()
    scene.guard.left = 0.0
    assert scene.step(100.0) == Wish.NOTHING
    scene.guard.wish = 115
    assert scene.step() == 115


@pytest.mark.parametrize(
    ("wish", "text"),
    [
        (Wish.STOP_FILE, "file stop"),
        (Wish.WALL_TIME, "wall-time limit"),
        (115, "signal SIGTERM"),
    ],
)
def test_a_wish_to_stop_is_met_with_a_checkpoint(scene, wish, text):
    scene.step()
    with pytest.raises(StopRequested, match=text):
        scene.keeper.heed(scene.sim, wish)
    assert scene.recorder.saved == [1]


def test_no_wish_costs_nothing(scene):
    scene.keeper.heed(scene.sim, Wish.NOTHING)
    assert scene.recorder.saved == []


def test_a_full_disk_is_no_reason_to_stop(scene):
    scene.step()
    scene.recorder.error = CollectiveError(errno.ENOSPC, "No space left on device")
    scene.keeper.heed(scene.sim, Wish.CHECKPOINT)
    assert len(scene.recorder.warnings) == 1
    assert "no checkpoint at step 1: " in scene.recorder.warnings[0]
    assert scene.step(59.0) == Wish.NOTHING
    assert scene.step(2.0) == Wish.CHECKPOINT


@pytest.mark.parametrize("error", [errno.EIO, errno.ENOENT, errno.EROFS])
def test_a_broken_disk_is(scene, error):
    scene.step()
    scene.recorder.error = CollectiveError(error, "broken")
    with pytest.raises(OSError, match="broken"):
        scene.keeper.heed(scene.sim, Wish.CHECKPOINT)


def test_a_run_that_must_stop_needs_its_checkpoint(scene):
    scene.step()
    scene.recorder.error = CollectiveError(errno.ENOSPC, "No space left on device")
    with pytest.raises(OSError, match="No space"):
        scene.keeper.heed(scene.sim, Wish.WALL_TIME)


@pytest.mark.parametrize("wish", [Wish.WALL_TIME, Wish.STOP_FILE, 110])
def test_before_the_first_step_there_is_nothing_to_save(scene, wish):
    with pytest.raises(StopRequested, match=", before any step"):
        scene.keeper.heed(scene.sim, wish)
    assert scene.recorder.saved == []


def test_an_error_of_one_rank_alone_is_no_full_disk_for_all(scene):
    """The others know nothing of it, and would wait for this rank."""
    scene.step()
    scene.recorder.error = OSError(errno.ENOSPC, "No space left on device")
    with pytest.raises(OSError, match="No space"):
        scene.keeper.heed(scene.sim, Wish.CHECKPOINT)


def test_a_failed_checkpoint_says_nothing_of_what_one_costs(scene):
    scene.keeper.wish(scene.sim)
    scene.step(0.0)
    scene.recorder.cost = 0.001
    scene.recorder.error = CollectiveError(errno.ENOSPC, "No space left on device")
    scene.keeper.heed(scene.sim, Wish.CHECKPOINT)
    scene.guard.left = MARGIN * LATENCY - 0.01
    assert scene.step(0.0) == Wish.WALL_TIME


def test_the_status_is_brought_up_to_date_now_and_then(scene):
    for _ in range(250):
        scene.step(0.1)
    assert len(scene.status.refreshed) == 2
