"""When to write a checkpoint, and when to stop."""

import errno
from types import SimpleNamespace

import pytest

import mpisph.run.checkpointing
from mpisph.core.errors import CollectiveError
from mpisph.run.checkpointing import (
    LATENCY,
    MARGIN,
    POLL,
    CheckpointPolicy,
    StopRequested,
)
from mpisph.run.signals import StopRequest

N = 1000


class RunOutput:
    """Remembers what it is asked for; a checkpoint takes `cost` on the clock."""

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


class SignalHandler:
    def __init__(self):
        self.request = StopRequest.NOTHING
        self.left = float("inf")

    def signal_request(self):
        return self.request

    def time_left(self):
        return self.left


class Scene:
    """A policy among stand-ins, with a clock that is set by hand."""

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
        self.output = RunOutput(tmp_path, self)
        self.status, self.signals = Status(), SignalHandler()
        self.policy = CheckpointPolicy(self.sim, self.output, self.status, self.signals)

    def step(self, duration=0.1, time=1e-9):
        """Make a step and return the request after it."""
        self.now += duration
        self.sim.step += 1
        self.sim.time += time
        return self.policy.request(self.sim)


@pytest.fixture
def scene(tmp_path, monkeypatch):
    return Scene(tmp_path, monkeypatch)


def test_checkpoints_are_due_after_an_interval_on_the_wall(scene):
    assert scene.policy.request(scene.sim) == StopRequest.NOTHING
    assert scene.step(59.9) == StopRequest.NOTHING
    assert scene.step(0.2) == StopRequest.CHECKPOINT
    scene.policy.carry_out(scene.sim, StopRequest.CHECKPOINT)
    assert scene.output.saved == [2]
    assert scene.status.refreshed[-1] == 2
    assert scene.step(59.9) == StopRequest.NOTHING
    assert scene.step(0.2) == StopRequest.CHECKPOINT


def test_checkpoints_are_due_after_an_interval_of_simulated_time(tmp_path, monkeypatch):
    scene = Scene(tmp_path, monkeypatch, interval=1e-6)
    assert scene.step(time=0.9e-6) == StopRequest.NOTHING
    assert scene.step(time=0.2e-6) == StopRequest.CHECKPOINT
    scene.policy.carry_out(scene.sim, StopRequest.CHECKPOINT)
    assert scene.step(time=0.8e-6) == StopRequest.NOTHING
    assert scene.step(time=0.2e-6) == StopRequest.CHECKPOINT


def test_the_stop_file_is_seen_within_a_moment(scene, tmp_path):
    assert scene.policy.request(scene.sim) == StopRequest.NOTHING
    (tmp_path / "stop").touch()
    assert scene.step(0.5 * POLL) == StopRequest.NOTHING
    assert scene.step(POLL) == StopRequest.STOP_FILE


def test_the_limit_leaves_time_for_a_step_and_a_checkpoint(scene):
    scene.policy.request(scene.sim)
    scene.step(3.0)
    # Nothing is known yet of what a checkpoint costs.
    scene.signals.left = MARGIN * (3.0 + LATENCY) - 0.1
    assert scene.step() == StopRequest.WALL_TIME
    scene.signals.left = 1e9
    scene.output.cost = 0.2
    scene.policy.carry_out(scene.sim, StopRequest.CHECKPOINT)
    scene.signals.left = MARGIN * (3.0 + 0.2) + 0.01
    assert scene.step() == StopRequest.NOTHING
    scene.signals.left = MARGIN * (3.0 + 0.2) - 0.01
    assert scene.step() == StopRequest.WALL_TIME
    # A checkpoint does not count as a part of a step; the slowest one counts.
    scene.output.cost = 5.0
    scene.policy.carry_out(scene.sim, StopRequest.CHECKPOINT)
    scene.output.cost = 0.1
    scene.policy.carry_out(scene.sim, StopRequest.CHECKPOINT)
    scene.signals.left = MARGIN * (3.0 + 5.0) + 0.01
    assert scene.step() == StopRequest.NOTHING
    scene.signals.left = MARGIN * (3.0 + 5.0) - 0.01
    assert scene.step() == StopRequest.WALL_TIME


def test_a_large_first_checkpoint_is_given_more_time(tmp_path, monkeypatch):
    scene = Scene(tmp_path, monkeypatch)
    scene.sim.n_total = 10**7
    policy = CheckpointPolicy(scene.sim, scene.output, scene.status, scene.signals)
    scene.signals.left = MARGIN * 20.0  # 2.2 GB at 100 MB/s take 22 s
    assert policy.request(scene.sim) == StopRequest.WALL_TIME


def test_other_ranks_bring_signals_alone(tmp_path, monkeypatch):
    scene = Scene(tmp_path, monkeypatch, rank=1)
    (tmp_path / "stop").touch()
    scene.signals.left = 0.0
    assert scene.step(100.0) == StopRequest.NOTHING
    scene.signals.request = 115
    assert scene.step() == 115


@pytest.mark.parametrize(
    ("what", "text"),
    [
        (StopRequest.STOP_FILE, "file stop"),
        (StopRequest.WALL_TIME, "wall-time limit"),
        (115, "signal SIGTERM"),
    ],
)
def test_a_request_to_stop_is_met_with_a_checkpoint(scene, what, text):
    scene.step()
    with pytest.raises(StopRequested, match=text):
        scene.policy.carry_out(scene.sim, what)
    assert scene.output.saved == [1]


def test_no_request_costs_nothing(scene):
    scene.policy.carry_out(scene.sim, StopRequest.NOTHING)
    assert scene.output.saved == []


def test_a_full_disk_is_no_reason_to_stop(scene):
    scene.step()
    scene.output.error = CollectiveError(errno.ENOSPC, "No space left on device")
    scene.policy.carry_out(scene.sim, StopRequest.CHECKPOINT)
    assert len(scene.output.warnings) == 1
    assert "no checkpoint at step 1: " in scene.output.warnings[0]
    assert scene.step(59.0) == StopRequest.NOTHING
    assert scene.step(2.0) == StopRequest.CHECKPOINT


@pytest.mark.parametrize("error", [errno.EIO, errno.ENOENT, errno.EROFS])
def test_a_broken_disk_is(scene, error):
    scene.step()
    scene.output.error = CollectiveError(error, "broken")
    with pytest.raises(OSError, match="broken"):
        scene.policy.carry_out(scene.sim, StopRequest.CHECKPOINT)


def test_a_run_that_must_stop_needs_its_checkpoint(scene):
    scene.step()
    scene.output.error = CollectiveError(errno.ENOSPC, "No space left on device")
    with pytest.raises(OSError, match="No space"):
        scene.policy.carry_out(scene.sim, StopRequest.WALL_TIME)


@pytest.mark.parametrize("what", [StopRequest.WALL_TIME, StopRequest.STOP_FILE, 110])
def test_before_the_first_step_there_is_nothing_to_save(scene, what):
    with pytest.raises(StopRequested, match=", before any step"):
        scene.policy.carry_out(scene.sim, what)
    assert scene.output.saved == []


def test_an_error_of_one_rank_alone_is_no_full_disk_for_all(scene):
    """The others know nothing of it, and would wait for this rank."""
    scene.step()
    scene.output.error = OSError(errno.ENOSPC, "No space left on device")
    with pytest.raises(OSError, match="No space"):
        scene.policy.carry_out(scene.sim, StopRequest.CHECKPOINT)


def test_a_failed_checkpoint_says_nothing_of_what_one_costs(scene):
    scene.policy.request(scene.sim)
    scene.step(0.0)
    scene.output.cost = 0.001
    scene.output.error = CollectiveError(errno.ENOSPC, "No space left on device")
    scene.policy.carry_out(scene.sim, StopRequest.CHECKPOINT)
    scene.signals.left = MARGIN * LATENCY - 0.01
    assert scene.step(0.0) == StopRequest.WALL_TIME


def test_the_status_is_brought_up_to_date_now_and_then(scene):
    for _ in range(250):
        scene.step(0.1)
    assert len(scene.status.refreshed) == 2
