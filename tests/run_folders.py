"""Folders of runs, and what is in them."""

import json
import shutil

from mpisph.io.snapshot import SERIES_FILE


def status(folder):
    """What status.json says."""
    return json.loads((folder / "status.json").read_text())


def outcome(folder):
    """All that a finished run has computed, bit by bit."""
    lines = (folder / "history.csv").read_text().splitlines()
    result = json.loads((folder / "result.json").read_text())
    snapshots = sorted(p for p in (folder / "snapshots").iterdir() if p.is_file())
    names = ("status", "step", "clouds", "comparisons", "conservation", "bodies")
    return {
        # Imbalance and wall time are of the machine.
        "history": [line.split(",")[:-2] for line in lines],
        "probes": {p.name: p.read_bytes() for p in folder.glob("[bg]*.csv")},
        "series": (folder / "snapshots.vtkhdf.series").read_bytes(),
        "snapshots": {p.name: p.read_bytes() for p in snapshots},
        **{name: result[name] for name in names},
    }


def differences(folder, reference):
    """The names of what differs between the outcomes of two finished runs."""
    got, want = outcome(folder), outcome(reference)
    found = [name for name in want if got[name] != want[name]]
    states = [status(path)["state"] for path in (folder, reference)]
    return found if states == [want["status"]] * 2 else [*found, states]


def assert_same(folder, reference):
    """Check that two runs have computed the same, and left the same files."""
    found = differences(folder, reference)
    assert not found, found
    assert len(outcome(reference)["snapshots"]) > 2
    left, there = ({path.name for path in f.rglob("*")} for f in (folder, reference))
    assert left == there, left ^ there


def run_underway(finished, folder):
    """Copy a run of which the last two snapshots are still to come.

    Returns the folder, and what brings them.
    """
    shutil.copytree(finished, folder)
    series, state = folder / SERIES_FILE, folder / "status.json"
    whole, ended = series.read_text(), state.read_text()
    listed = json.loads(whole)
    listed["files"] = listed["files"][:-2]
    series.write_text(json.dumps(listed))
    state.write_text(ended.replace('"completed"', '"running"'))

    def go_on():
        series.write_text(whole)
        state.write_text(ended)

    return folder, go_on


def slow_steps(folder, seconds=0.025):
    """Make each step take some time more, where this folder is on PYTHONPATH.

    So that a run takes longer than its start, however fast the machine.
    """
    (folder / "sitecustomize.py").write_text(
        "import os, time\n"
        "if 'OMPI_COMM_WORLD_RANK' in os.environ:\n"
        "    from mpisph.run.checkpointing import CheckpointPolicy\n"
        "    ask = CheckpointPolicy.request\n"
        "    CheckpointPolicy.request = (\n"
        f"        lambda policy, sim: time.sleep({seconds}) or ask(policy, sim))\n"
    )
    return folder


def short_starts(folder, count):
    """Let a run's time be up after some steps of each start, however long they take.

    Where this folder is on PYTHONPATH.
    """
    (folder / "sitecustomize.py").write_text(
        "import os\n"
        "if 'OMPI_COMM_WORLD_RANK' in os.environ:\n"
        "    from mpisph.run.signals import SignalHandler\n"
        "    from mpisph.run.checkpointing import CheckpointPolicy\n"
        "    ask, made = CheckpointPolicy.request, []\n"
        "    CheckpointPolicy.request = (\n"
        "        lambda policy, sim: made.append(1) or ask(policy, sim))\n"
        f"    SignalHandler.time_left = lambda _: 0.0 if len(made) > {count} else 1e6\n"
    )
    return folder
