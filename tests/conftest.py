"""What every test shares: how pytest behaves under mpirun."""

import sys

import hypothesis
import pytest

# Compiling takes long, and all ranks must draw the same examples.
hypothesis.settings.register_profile("mpisph", deadline=None, derandomize=True)
# Looks for new mistakes: --hypothesis-profile=soak
hypothesis.settings.register_profile(
    "soak", deadline=None, derandomize=False, max_examples=3000
)
hypothesis.settings.load_profile("mpisph")


def pytest_addoption(parser):
    text = "how many runs to kill at random moments, four times each"
    parser.addoption("--killed-runs", type=int, default=1, help=text)
    text = "how many commands to try on runs with a damaged file"
    parser.addoption("--damaged-files", type=int, default=10, help=text)


def pytest_ignore_collect(collection_path, config):
    """Under mpirun, leave out the modules without a parallel test.

    Each rank would import them all, which takes longer than many tests.
    """
    if config.getoption("--with-mpi") and collection_path.suffix == ".py":
        return "pytest.mark.mpi" not in collection_path.read_text("utf-8") or None
    return None


STARTING = {"scripts", "study", "run", "cli", "bench"}
"""Folders whose tests start programs."""


def pytest_generate_tests(metafunc):
    if "killed_run" in metafunc.fixturenames:
        count = metafunc.config.getoption("--killed-runs")
        metafunc.parametrize("killed_run", range(count))


@pytest.fixture
def data():
    """A sphere that touches a plate, as tomllib would read it."""
    return {
        "title": "test",
        "bodies": [
            {
                "shape": "sphere",
                "name": "ball",
                "radius": "5 mm",
                "position": "-5 mm",
                "velocity": "6 km/s",
                "material": "al-lee2003",
            },
            {
                "shape": "plate",
                "name": "wall",
                "thickness": "2 mm",
                "radius": "20 mm",
                "material": "cu-ofhc",
            },
        ],
        "resolution": {"npr": 10},
        "time": {"end": "2 us"},
    }


@pytest.fixture(scope="session")
def finished(tmp_path_factory):
    """The folder of a small completed run; not to be written into."""
    from small_runs import EXPOSED, small_run  # starts MPI

    folder = tmp_path_factory.mktemp("runs") / "finished"
    small_run(folder, *EXPOSED)
    return folder


@pytest.fixture(scope="session")
def judged(tmp_path_factory):
    """Likewise, of a shield whose wall is torn."""
    from mpi4py import MPI
    from rich.console import Console
    from shields import coarse

    from mpisph.run.session import run

    folder = tmp_path_factory.mktemp("runs") / "judged"
    run(coarse(), MPI.COMM_SELF, folder, Console(quiet=True))
    return folder


@pytest.fixture(scope="session")
def breaking(tmp_path_factory):
    """Likewise, of matter that melts and breaks."""
    from small_runs import BREAKING, small_run

    folder = tmp_path_factory.mktemp("runs") / "breaking"
    small_run(folder, *BREAKING)
    return folder


@pytest.hookimpl(trylast=True)
def pytest_configure(config):
    if not config.getoption("--with-mpi"):
        return
    from mpi4py import MPI  # starts MPI, which the serial tests do without

    from mpisph.solver.warmup import warm_up

    warm_up(MPI.COMM_WORLD)  # ranks that compile at once can spoil numba's cache
    config.pluginmanager.register(RankReports(MPI.COMM_WORLD))
    if MPI.COMM_WORLD.rank > 0:
        config.pluginmanager.unregister(name="terminalreporter")
    for plugin in config.pluginmanager.get_plugins():
        if type(plugin).__name__ == "MPIPlugin":
            plugin._is_testing_mpi = False  # only drops its 30-line summary


def smallest_size(item):
    """Return the number of ranks from which on a test marked mpi is to run."""
    marks = list(item.iter_markers("mpi"))
    for mark in marks:
        # pytest-mpi ignores an unknown word such as minsize: nothing would be skipped.
        if mark.args or set(mark.kwargs) - {"min_size"}:
            raise pytest.UsageError(f"{item.nodeid}: only mpi(min_size=N) is known")
    return max((mark.kwargs.get("min_size", 1) for mark in marks), default=1)


def pytest_collection_modifyitems(config, items):
    """Check the marks, and begin with the files that take long.

    Those are of tests that start programs, or marked slow. Files are shared out to all
    cores in this order; a slow one that came last would leave the others idle.
    """
    for item in items:
        smallest_size(item)
    tests = config.rootpath / "tests"
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    slow |= {i.path for i in items if i.path.relative_to(tests).parts[0] in STARTING}
    items.sort(key=lambda item: item.path not in slow)


class RankReports:
    """One report and one exit code from all ranks.

    Rank 0 prints pytest's report; each rank prints its failures at once, for after a
    failure on one rank the others may wait for it until the timeout ends them all.
    """

    def __init__(self, world):
        # Its own messages must not be taken for those of a test that failed half-way.
        self.comm = world.Dup()
        self.statuses = []

    def say(self, outcome, report):
        # One write: several would tear between the ranks.
        sys.stderr.write(
            f"\n[rank {self.comm.rank}] {outcome} {report.nodeid}\n"
            f"{report.longreprtext}\n"
        )
        sys.stderr.flush()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self, item):
        """Fail a test that was skipped on a number of ranks it is meant for."""
        report = yield
        meant = self.comm.size >= smallest_size(item)
        if report.skipped and meant and not hasattr(report, "wasxfail"):
            report.outcome = "failed"
            report.longrepr = f"meant for {self.comm.size} ranks, yet {report.longrepr}"
        return report

    def pytest_runtest_logreport(self, report):
        if report.failed:
            self.say("FAILED", report)

    def pytest_collectreport(self, report):
        if report.failed:
            self.say("ERROR", report)

    def pytest_collection_finish(self, session):
        """Stop where the ranks would wait for each other in different tests."""
        mine = [item.nodeid for item in session.items]
        if any(theirs != mine for theirs in self.comm.allgather(mine)):
            pytest.exit("the ranks collected different tests", returncode=1)

    @pytest.hookimpl(tryfirst=True)
    def pytest_sessionfinish(self, session, exitstatus):
        """Fail everywhere where one rank has failed."""
        session.config.option.tbstyle = "no"  # the tracebacks are printed already
        self.statuses = self.comm.allgather(int(exitstatus))
        session.exitstatus = max(self.statuses)

    def pytest_terminal_summary(self, terminalreporter):
        failing = [str(rank) for rank, status in enumerate(self.statuses) if status]
        if failing and max(self.statuses) != pytest.ExitCode.NO_TESTS_COLLECTED:
            terminalreporter.write_line(f"not passed on rank {', '.join(failing)}")
