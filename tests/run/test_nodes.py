"""Runs on two nodes: two network namespaces, each with an address and a host name.

Messages between them go through TCP, and what asks for a node finds two.
"""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager, suppress

import pytest
from launch import CASES, MPISPH, call, environment

from mpisph.io.status import STATUS_FILE

SHOT = CASES / "piekutowski-4-1353.toml"
SMALL = ("--set", "resolution.npr=6", "--set", "output.figures=false")
SHORT = (*SMALL, "--set", "time.end=0.4 us")
ADDRESSES = {"a": "10.77.0.1", "b": "10.77.0.2"}
NETWORK = "10.77.0.0/24"


def ip(*words):
    return subprocess.run(
        ["ip", *words], capture_output=True, text=True, check=True, timeout=20
    ).stdout


class Nodes:
    """Two nodes, and the agent by which mpirun starts its daemon on the other."""

    def __init__(self, folder):
        self.name = f"mpisph{os.getpid()}"
        self.agent = folder / "agent"
        self.agent.write_text(
            "#!/bin/sh\nhost=$1\nshift\ncase $host in\n"
            + "".join(
                f'{address}) {self.within(node)} "$*";;\n'
                for node, address in ADDRESSES.items()
            )
            + "esac\n",
            encoding="ascii",
        )
        self.agent.chmod(0o755)

    def space(self, node):
        return f"{self.name}-{node}"

    def host(self, node):
        return f"node-{node}"

    def within(self, node):
        """A shell command that runs another, its argument, on a node."""
        named = f'hostname {self.host(node)}; eval "exec $1"'
        return f"exec ip netns exec {self.space(node)} unshare --uts sh -c '{named}' sh"

    def start(self):
        for node in ADDRESSES:
            ip("netns", "add", self.space(node))
        ends = [
            ("vetha", "netns", self.space("a")),
            ("vethb", "netns", self.space("b")),
        ]
        ip("link", "add", *ends[0], "type", "veth", "peer", "name", *ends[1])
        for node, address in ADDRESSES.items():
            inside = ("-n", self.space(node))
            ip(*inside, "addr", "add", f"{address}/24", "dev", f"veth{node}")
            for device in (f"veth{node}", "lo"):
                ip(*inside, "link", "set", device, "up")

    def remove(self):
        for node in ADDRESSES:
            subprocess.run(
                ["ip", "netns", "del", self.space(node)],
                capture_output=True,
                check=False,
            )

    @contextmanager
    def started(self, *command):
        """A command on one rank of each node; ended with the block."""
        hosts = ",".join(f"{address}:1" for address in ADDRESSES.values())
        words = [
            "mpirun", "-n", "2", "--host", hosts,
            "--mca", "plm_rsh_agent", self.agent,
            "--mca", "btl", "tcp,self",
            "--mca", "btl_tcp_if_include", NETWORK,
            "--mca", "oob_tcp_if_include", NETWORK,
            *command,
        ]  # fmt: skip
        line = " ".join(f'"{word}"' for word in words)
        with subprocess.Popen(
            ["sh", "-c", f'{self.within("a")} "$0"', line],
            env=environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        ) as process:
            try:
                yield process
            finally:
                for node in ADDRESSES:
                    self.signal(node, signal.SIGKILL)

    def signal(self, node, number):
        """Send a signal to all processes of a node."""
        for pid in ip("netns", "pids", self.space(node)).split():
            with suppress(ProcessLookupError):
                os.kill(int(pid), number)

    def launch(self, *command):
        with self.started(*command) as process:
            out, err = process.communicate(timeout=120)
        return subprocess.CompletedProcess(command, process.returncode, out, err)


@pytest.fixture(scope="module")
def nodes(tmp_path_factory):
    found = Nodes(tmp_path_factory.mktemp("nodes"))
    try:
        found.start()
    except (OSError, subprocess.SubprocessError) as error:
        found.remove()
        pytest.skip(f"no network namespaces here: {error}")
    yield found
    found.remove()


def snapshots(folder):
    return {p.name: p.read_bytes() for p in sorted(folder.glob("snapshots/*.vtkhdf"))}


def wait_for(condition, seconds=60.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "in vain"
        time.sleep(0.05)


def test_two_nodes_give_the_bits_of_one(nodes, tmp_path):
    there = nodes.launch(MPISPH, "run", SHOT, "-o", tmp_path / "two", *SHORT)
    assert there.returncode == 0, there.stderr
    assert call("run", SHOT, "-o", tmp_path / "one", *SHORT).returncode == 0
    assert snapshots(tmp_path / "two") == snapshots(tmp_path / "one")
    status = json.loads((tmp_path / "two" / STATUS_FILE).read_text())
    assert (status["state"], status["ranks"], status["host"]) == (
        "completed",
        2,
        nodes.host("a"),
    )


def test_a_lost_node_ends_the_run_and_what_is_resumed_has_the_same_bits(
    nodes, tmp_path
):
    folder, whole = tmp_path / "run", tmp_path / "whole"
    times = (*SMALL, "--set", "resolution.npr=12", "--set", "time.end=3 us")
    often = ("--set", "output.every=0.2 us", "--set", "checkpoints.interval=0.3 us")
    words = ("run", SHOT, *times, *often)
    with nodes.started(MPISPH, *words, "-o", folder) as process:
        wait_for(lambda: len(snapshots(folder)) >= 3 or process.poll() is not None)
        assert process.poll() is None, process.stderr.read()
        nodes.signal("b", signal.SIGSTOP)  # so that the run lasts
        second = call(*words, "-o", folder)
        nodes.signal("b", signal.SIGKILL)
        _, err = process.communicate(timeout=60)
    assert process.returncode != 0
    assert "lost" in err, err
    assert second.returncode != 0
    assert f"on {nodes.host('a')}" in second.stderr
    resumed = call("resume", folder)
    assert resumed.returncode == 0, resumed.stderr
    assert "no sound checkpoint" not in resumed.stderr
    assert call(*words, "-o", whole).returncode == 0
    assert snapshots(folder) == snapshots(whole)


MEMORY = """
import sys
from mpi4py import MPI
from mpisph.case import load_case
from mpisph.core.errors import MpisphError
from mpisph.solver import estimate
case = load_case(sys.argv[1])
whole = estimate.estimate(case, 2).memory
estimate.total_memory = lambda: 0.75 * whole
try:
    estimate.check_memory(case, MPI.COMM_WORLD)
    found = "enough"
except MpisphError:
    found = "too little"
if MPI.COMM_WORLD.rank == 0:
    print(found)
"""


def test_each_node_needs_memory_for_its_own_ranks_alone(nodes, tmp_path):
    script = tmp_path / "memory.py"
    script.write_text(MEMORY, encoding="ascii")
    there = nodes.launch(sys.executable, script, SHOT)
    assert there.stdout.strip() == "enough", there.stderr
    here = subprocess.run(
        ["mpirun", "--quiet", "-n", "2", sys.executable, script, SHOT],
        env=environment(),
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert here.stdout.strip() == "too little", here.stderr
