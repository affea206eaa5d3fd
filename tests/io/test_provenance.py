import importlib.metadata
import os
import subprocess
import sys

import pytest

from mpisph.io.provenance import UNKNOWN, cpu_model, git_revision, versions


def git(folder, *arguments):
    command = ["git", "-C", folder, "-c", "user.name=n", "-c", "user.email=e@x.org"]
    return subprocess.run(
        [*command, *arguments], check=True, capture_output=True, text=True
    ).stdout.strip()


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A checkout with one commit, apart from the user's configuration."""
    for name in [n for n in os.environ if n.startswith("GIT_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("GIT_CONFIG_GLOBAL", os.devnull)
    git(tmp_path, "init", "-q")
    (tmp_path / "__init__.py").write_text("")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-q", "-m", "first")
    return tmp_path


def test_versions_are_those_installed():
    found = versions()
    for name in ("numpy", "numba", "h5py", "mpi4py"):
        assert found[name] == importlib.metadata.version(name)
    assert found["python"].startswith(f"{sys.version_info[0]}.{sys.version_info[1]}.")
    assert set(found) == {
        *("mpisph", "python", "numpy", "numba", "h5py", "hdf5", "mpi4py", "mpi")
    }
    assert all(text and text.isprintable() for text in found.values())


def test_revision_of_a_clean_checkout(checkout):
    assert git_revision(checkout) == git(checkout, "rev-parse", "HEAD")


def test_a_changed_file_is_said(checkout):
    head = git(checkout, "rev-parse", "HEAD")
    (checkout / "untracked.txt").write_text("x")
    assert git_revision(checkout) == head
    (checkout / "__init__.py").write_text("x = 1")
    assert git_revision(checkout) == f"{head}-dirty"


def test_outside_of_a_checkout(tmp_path):
    assert git_revision(tmp_path) == UNKNOWN


def test_an_environment_below_a_checkout_is_not_the_checkout(checkout):
    package = checkout / ".venv" / "mpisph"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("")
    assert git_revision(package) == UNKNOWN


def test_without_git(checkout, monkeypatch):
    monkeypatch.setenv("PATH", "")
    assert git_revision(checkout) == UNKNOWN


def test_the_processor_has_a_name():
    name = cpu_model()
    assert name == name.strip() != ""
    assert name != UNKNOWN
