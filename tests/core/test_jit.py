"""Where compiled code is kept: no edit of any source may leave old code in use."""

import hashlib
import os
import pickle
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numba
import pytest

import mpisph
from mpisph.core import jit

PACKAGE = Path(mpisph.__file__).parent


@pytest.fixture
def package(tmp_path):
    """A copy of what the digest is of."""
    ignored = shutil.ignore_patterns("__pycache__", "*.toml")
    shutil.copytree(PACKAGE, tmp_path / "mpisph", ignore=ignored)
    return tmp_path / "mpisph"


def digest_of(package, monkeypatch):
    monkeypatch.setattr(jit, "__file__", str(package / "core" / "jit.py"))
    return jit.source_digest()


def test_the_digest_is_that_of_the_sources(package, monkeypatch):
    unchanged = jit.source_digest()
    assert digest_of(package, monkeypatch) == unchanged
    assert len(unchanged) == 16
    (package / "notes.txt").write_text("no source")
    assert digest_of(package, monkeypatch) == unchanged


@pytest.mark.parametrize(
    ("name", "counts"),
    [
        ("physics/kernel.py", True),
        ("core/jit.py", True),
        ("sph/pairs.py", True),
        ("case/model.py", False),
        ("report/page.py", False),
    ],
)
def test_the_digest_follows_the_numeric_sources(package, monkeypatch, name, counts):
    before = digest_of(package, monkeypatch)
    path = package / name
    path.write_text(path.read_text() + "\n")
    assert (digest_of(package, monkeypatch) != before) == counts


def test_all_that_is_compiled_lies_in_the_numeric_folders():
    folders = {
        path.relative_to(PACKAGE).parts[0]
        for path in PACKAGE.rglob("*.py")
        if re.search(r"\b(n?jit|jitted)\(|@jitable", path.read_text(encoding="utf-8"))
    }
    assert {"physics", "sph"} <= folders <= set(jit.NUMERIC_FOLDERS)


def test_all_that_is_compiled_is_linked_as_it_is():
    for path in PACKAGE.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        by_numba = r"\bn?jit\b\s*[(,]|import .*\bn?jit\b$|register_jitable|@overload"
        assert not re.search(by_numba, text, re.MULTILINE), path


def test_the_digest_follows_the_compiler(monkeypatch):
    before = jit.source_digest()
    monkeypatch.setattr(numba, "__version__", "0.0.1")
    assert jit.source_digest() != before


def test_the_folder_is_named_by_the_digest_and_used(tmp_path, monkeypatch):
    assert jit.source_digest() == jit.CACHE_FOLDER.name
    used = numba.config.CACHE_DIR
    try:
        monkeypatch.setenv("MPISPH_CACHE_DIR", str(tmp_path))
        assert jit.use_cache_folder() == tmp_path / jit.source_digest()
        assert str(tmp_path / jit.source_digest()) == numba.config.CACHE_DIR
        monkeypatch.delenv("MPISPH_CACHE_DIR")
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
        assert jit.use_cache_folder().parent == tmp_path / "xdg" / "mpisph"
        monkeypatch.delenv("XDG_CACHE_HOME")
        monkeypatch.setenv("HOME", str(tmp_path))
        assert jit.use_cache_folder().parent == tmp_path / ".cache" / "mpisph"
    finally:
        numba.config.CACHE_DIR = used


def test_compiled_code_lands_in_the_folder(tmp_path):
    """A process of its own: Numba reads the folder when a function is decorated."""
    code = "from mpisph.physics.stress import equivalent_stress as f; f(1.0, 2.0, 3.0)"
    subprocess.run(
        [sys.executable, "-c", code],
        check=True,
        cwd=PACKAGE.parent,
        env=os.environ | {"MPISPH_CACHE_DIR": str(tmp_path), "NUMBA_DISABLE_JIT": "0"},
    )
    assert [path.name for path in tmp_path.iterdir()] == [jit.source_digest()]
    assert list(tmp_path.rglob("stress.equivalent_stress*.nbi"))


LIGHT = """
import sys
from mpisph.core.particles import Particles
from mpisph.sph.integrator import kick
kick(Particles.zeros(2), 1.0)
assert "numba.np.arraymath" in sys.modules
assert "scipy.linalg" not in sys.modules
import scipy.linalg.cython_blas
"""


def test_compiled_code_runs_without_scipy_and_leaves_it_importable():
    subprocess.run([sys.executable, "-c", LIGHT], check=True, timeout=60)


@pytest.mark.parametrize("options", [jit.INLINE, jit.EXACT])
def test_options_keep_nan_and_infinity(options):
    assert options["error_model"] == "numpy"
    flags = options.get("fastmath", set())
    # True would be all flags, nnan and ninf among them.
    assert isinstance(flags, set)
    assert not flags & {"nnan", "ninf", "fast", "afn"}


def test_only_the_pair_loop_may_reorder_sums():
    assert "fastmath" not in jit.EXACT
    assert "reassoc" in jit.INLINE["fastmath"]
    assert jit.INLINE["forceinline"]


UNWRITABLE = """
from pathlib import Path
from mpisph.core import jit
assert jit.CACHE_FOLDER.is_dir()
assert not str(jit.CACHE_FOLDER).startswith("/proc")
print(jit.CACHE_FOLDER)
"""


def test_without_a_writable_folder_code_is_kept_for_the_process_alone():
    """Numba itself would fall back to folders whose stamps miss most edits."""
    done = subprocess.run(
        [sys.executable, "-c", UNWRITABLE],
        env={**os.environ, "MPISPH_CACHE_DIR": "/proc/nowhere"},
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    assert not Path(done.stdout.strip()).exists()


def test_only_the_folders_last_used_are_kept(tmp_path, monkeypatch):
    for age in range(12):
        folder = tmp_path / f"{age:016x}"
        folder.mkdir()
        os.utime(folder, (1e9 - age, 1e9 - age))
    (tmp_path / "something-else").mkdir()
    monkeypatch.setattr(jit, "CACHE_FOLDER", tmp_path / f"{11:016x}")
    jit.prune_cache(keep=8)
    kept = {path.name for path in tmp_path.iterdir()}
    assert kept == {*(f"{age:016x}" for age in [*range(8), 11]), "something-else"}


def test_folders_that_a_process_may_still_use_are_kept(tmp_path, monkeypatch):
    for days in range(12):
        folder = tmp_path / f"{days:016x}"
        folder.mkdir()
        begun = time.time() - 86400.0 * (days + 0.5)
        os.utime(folder, (begun, begun))
    monkeypatch.setattr(jit, "CACHE_FOLDER", tmp_path / f"{0:016x}")
    jit.prune_cache(keep=1)
    kept = {path.name for path in tmp_path.iterdir()}
    assert kept == {f"{days:016x}" for days in range(2)}


def test_the_stamp_follows_what_numba_looks_at(package, monkeypatch):
    """Numba compiles again where a file is newer or elsewhere, whatever it says."""
    monkeypatch.setattr(jit, "__file__", str(package / "core" / "jit.py"))
    here = jit.source_stamp()
    assert here == jit.source_stamp()
    os.utime(package / "physics" / "kernel.py", (1e9, 1e9))
    newer = jit.source_stamp()
    assert newer != here
    moved = package.with_name("moved")
    package.rename(moved)
    monkeypatch.setattr(jit, "__file__", str(moved / "core" / "jit.py"))
    assert jit.source_stamp() not in (here, newer)


def test_code_is_compiled_once_it_is_taken_down(tmp_path, monkeypatch):
    cleared = tmp_path / "by another process"
    monkeypatch.setattr(jit, "CACHE_FOLDER", cleared)
    assert not jit.is_compiled("one")
    monkeypatch.setattr(numba.config, "DISABLE_JIT", 1)
    jit.mark_compiled("one")
    assert not jit.is_compiled("one"), "nothing was compiled"
    monkeypatch.setattr(numba.config, "DISABLE_JIT", 0)
    jit.mark_compiled("one")
    assert jit.is_compiled("one")
    monkeypatch.setattr(jit, "source_stamp", lambda: "of other files")
    assert not jit.is_compiled("one")


def test_clearing_removes_compiled_code_alone(tmp_path, monkeypatch):
    for name in ("0" * 16, "f" * 16, "bench"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "file").write_bytes(b"12345")
    monkeypatch.setattr(jit, "CACHE_FOLDER", tmp_path / ("f" * 16))
    assert jit.cache_size() == 5
    jit.clear_cache()
    assert [path.name for path in tmp_path.iterdir()] == ["bench"]
    assert jit.cache_size() == 0


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """A cache folder of two functions, one of them compiled after all was marked."""
    source = tmp_path / "sources" / "sph" / "pairs.py"
    source.parent.mkdir(parents=True)
    source.write_text("")
    folder = tmp_path / "cache"
    hashed = hashlib.sha1(str(source.parent).encode()).hexdigest()
    files = folder / f"sph_{hashed}"
    files.mkdir(parents=True)
    monkeypatch.setattr(jit, "numeric_sources", lambda: [source])
    monkeypatch.setattr(jit, "CACHE_FOLDER", folder)
    code = pickle.dumps(("code", bytes(1000), {"name": 1.0}))
    index = pickle.dumps("0.1") + pickle.dumps(("stamp", {"key": "a.1.nbc"}))
    (files / "a.nbi").write_bytes(index)
    (files / "a.1.nbc").write_bytes(code)
    jit.mark_compiled("one")
    (files / "b.nbi").write_bytes(index)
    (files / "b.1.nbc").write_bytes(code)
    return files


def flip(path):
    content = bytearray(path.read_bytes())
    content[500] ^= 1
    path.write_bytes(content)


DAMAGES = {
    "cut": lambda path: os.truncate(path, 20),
    "empty": lambda path: os.truncate(path, 0),
    "garbage": lambda path: path.write_bytes(bytes(range(256)) * 4),
    "garbage at the end": lambda path: path.write_bytes(path.read_bytes() + b"xy"),
    "pipe": lambda path: (path.unlink(), os.mkfifo(path)),
    "folder": lambda path: (path.unlink(), path.mkdir()),
    "loop": lambda path: (path.unlink(), path.symlink_to(path)),
}


@pytest.mark.parametrize("name", ["a.nbi", "a.1.nbc", "b.nbi", "b.1.nbc"])
@pytest.mark.parametrize("damage", DAMAGES)
def test_what_is_damaged_is_removed_and_compiled_again(cache, name, damage):
    DAMAGES[damage](cache / name)
    assert jit.remove_damaged(cache.parent) == [cache / name]
    assert not os.path.lexists(cache / name)
    assert len(list(cache.iterdir())) == 3
    assert not jit.is_compiled("one")
    assert jit.remove_damaged(cache.parent) == []


def test_a_single_bit_of_the_code_counts(cache):
    flip(cache / "a.1.nbc")
    assert jit.remove_damaged(cache.parent) == [cache / "a.1.nbc"]


def test_a_file_that_is_missing_is_compiled_before_a_run(cache):
    (cache / "a.1.nbc").unlink()
    assert jit.remove_damaged(cache.parent) == []
    assert not jit.is_compiled("one")


def test_both_pair_forms_are_compiled_again_where_one_is_damaged(cache):
    jit.mark_compiled("other")
    flip(cache / "a.1.nbc")
    assert jit.remove_damaged(cache.parent) == [cache / "a.1.nbc"]
    assert not jit.is_compiled("one")
    assert not jit.is_compiled("other")


def test_what_was_compiled_since_is_no_damage(cache):
    """A function may be called with further types, also by another process."""
    more = pickle.dumps("0.1") + pickle.dumps(("stamp", {"key": "a.2.nbc"}))
    (cache / "a.nbi").write_bytes(more)
    assert jit.remove_damaged(cache.parent) == []
    assert jit.is_compiled("one")


@pytest.mark.parametrize("content", [b"", b"{", b"[1]", b"\xff"])
def test_a_damaged_mark_is_none(cache, content):
    (mark,) = cache.parent.glob("complete-*")
    mark.write_bytes(content)
    assert jit.remove_damaged(cache.parent) == []
    assert not jit.is_compiled("one")


def test_the_files_of_these_sources_are_looked_at():
    """That is, Numba names its folders as `jit` thinks it does."""
    from mpisph.physics.stress import equivalent_stress

    equivalent_stress(1.0, 2.0, 3.0)
    names = {name.rpartition("/")[2] for name in jit._compiled(jit.CACHE_FOLDER)}
    assert any(name.startswith("stress.equivalent_stress") for name in names)
