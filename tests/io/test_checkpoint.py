"""Checkpoints: what comes back, and what is noticed."""

import os
import random
import resource

import h5py
import numpy as np
import pytest
from mpi4py import MPI
from oracles import agree, numbered, share

import mpisph.io.checkpoint
import mpisph.io.particle_file
from mpisph.core.errors import MpisphError
from mpisph.core.particles import Particles
from mpisph.io.checkpoint import (
    DamagedError,
    find_checkpoints,
    keep_last_checkpoint,
    read_checkpoint,
    read_state,
    remove_checkpoints,
    write_checkpoint,
)
from mpisph.io.files import set_aside

SELF = MPI.COMM_SELF
N = 60
STATE = '{"title": "Größe"}'


def odd(ids):
    """Particles with bits of all sorts."""
    p = numbered(ids)
    p.values[3] = np.where(p.id % 5 == 0, np.nan, 5e-324)
    return p


def write(comm, folder, step=7, n=N, state=STATE):
    return write_checkpoint(comm, folder, step, odd(share(comm, n)), n, state)


def same(p, q):
    return np.array_equal(p.pack().view(np.int64), q.pack().view(np.int64))


@pytest.mark.mpi(min_size=1)
@pytest.mark.parametrize("n", [1, 3, N])
def test_any_ranks_read_the_bits_that_any_ranks_wrote(mpi_tmp_path, monkeypatch, n):
    monkeypatch.setattr(mpisph.io.checkpoint, "_CHUNK", 4096)  # several for each rank
    world = MPI.COMM_WORLD
    path = write(world, mpi_tmp_path, n=n)
    problems = []
    for size in range(1, world.size + 1):
        part = world.Split(0 if world.rank < size else 1, world.rank)
        got = read_checkpoint(part, path)
        everyone = Particles.unpack(part.allgather(got.particles.pack()))
        if (got.n_total, got.state) != (n, STATE) or not same(everyone, odd(range(n))):
            problems.append(size)
        part.Free()
    agree(world, problems)


@pytest.mark.mpi(min_size=2)
def test_the_file_does_not_depend_on_the_number_of_ranks(mpi_tmp_path):
    world = MPI.COMM_WORLD
    if world.rank == 0:
        for name in ("one", "all"):
            (mpi_tmp_path / name).mkdir()
        one = write(SELF, mpi_tmp_path / "one")
    world.Barrier()
    path = write(world, mpi_tmp_path / "all")
    differ = world.rank == 0 and path.read_bytes() != one.read_bytes()
    agree(world, ["they differ"] if differ else [])


@pytest.mark.mpi(min_size=1)
def test_damage_is_noticed_on_all_ranks(mpi_tmp_path):
    world = MPI.COMM_WORLD
    path = write(world, mpi_tmp_path)
    if world.rank == 0:
        path.write_bytes(path.read_bytes()[:-1])
    world.Barrier()
    with pytest.raises(DamagedError, match=r"checkpoint_000000007\.h5: damaged"):
        read_checkpoint(world, path)


def test_a_changed_bit_anywhere_is_noticed(tmp_path, monkeypatch):
    monkeypatch.setattr(mpisph.io.checkpoint, "_CHUNK", 4096)  # several of them
    path = write(SELF, tmp_path)
    sound = path.read_bytes()
    rng = random.Random(4)
    places = {0, 511, 512, 4607, 4608, len(sound) - 1}
    places |= {rng.randrange(512) for _ in range(50)}
    places |= {rng.randrange(len(sound)) for _ in range(500)}
    for place in places:
        content = bytearray(sound)
        content[place] ^= 1 << rng.randrange(8)
        path.write_bytes(content)
        with pytest.raises(DamagedError):
            read_checkpoint(SELF, path)
    path.write_bytes(sound)
    assert read_checkpoint(SELF, path).state == STATE


@pytest.mark.parametrize("size", [0, 1, 511, 512, 513, 5000, -1, -4096])
def test_a_file_cut_short_is_noticed(tmp_path, size):
    path = write(SELF, tmp_path)
    path.write_bytes(path.read_bytes()[:size])
    with pytest.raises(DamagedError):
        read_checkpoint(SELF, path)


def test_exchanged_chunks_and_bytes_at_the_end_are_noticed(tmp_path, monkeypatch):
    monkeypatch.setattr(mpisph.io.checkpoint, "_CHUNK", 4096)
    path = write(SELF, tmp_path)
    sound = path.read_bytes()
    a, b = sound[512:4608], sound[4608:8704]
    assert a != b
    for content in (sound[:512] + b + a + sound[8704:], sound + b"\0"):
        path.write_bytes(content)
        with pytest.raises(DamagedError):
            read_checkpoint(SELF, path)


def test_the_state_may_be_long(tmp_path):
    state = "é" * 200_000
    assert read_checkpoint(SELF, write(SELF, tmp_path, state=state)).state == state


def test_the_last_two_are_kept(tmp_path):
    paths = [write(SELF, tmp_path, step) for step in (5, 20, 1000, 999_999_999)]
    assert find_checkpoints(tmp_path) == [paths[3], paths[2]]
    assert sorted((tmp_path / "checkpoints").iterdir()) == sorted(paths[2:])


def test_one_that_cannot_be_read_is_not_kept_instead_of_new_ones(tmp_path):
    late = write(SELF, tmp_path, 100)
    paths = [write(SELF, tmp_path, step) for step in (1, 2, 3)]
    assert find_checkpoints(tmp_path) == [late, paths[2], paths[1]]


def test_a_damaged_one_set_aside_is_not_found_again(tmp_path):
    first, second = write(SELF, tmp_path, 1), write(SELF, tmp_path, 2)
    aside = set_aside(second)
    assert aside.exists()
    assert find_checkpoints(tmp_path) == [first]


@pytest.mark.parametrize("kind", ["folder", "pipe", "link"])
def test_what_is_no_file_is_damaged(kind, tmp_path):
    """A pipe would keep its reader for ever."""
    path = write(SELF, tmp_path)
    path.unlink()
    if kind == "folder":
        (path / "inside").mkdir(parents=True)
    elif kind == "pipe":
        os.mkfifo(path)
    else:
        path.symlink_to(tmp_path / "nowhere")
    for read in (lambda: read_checkpoint(SELF, path), lambda: read_state(path)):
        with pytest.raises(DamagedError, match="is no file"):
            read()
    for _ in range(2):  # the name may be taken
        aside = set_aside(path)
        assert aside.is_symlink() or aside.exists()
        path.mkdir()
    assert find_checkpoints(tmp_path) == [path]
    remove_checkpoints(tmp_path)


def test_the_state_alone_can_be_read(tmp_path):
    path = write(SELF, tmp_path)
    assert read_state(path) == STATE
    with h5py.File(path, "r+") as file:
        del file["state"]
    with pytest.raises(DamagedError, match="no checkpoint"):
        read_state(path)


def test_all_but_the_last_are_removed(tmp_path):
    first, last = write(SELF, tmp_path, 1), write(SELF, tmp_path, 2)
    set_aside(first)
    write(SELF, tmp_path, 1)
    (tmp_path / "checkpoints/checkpoint_000000003.h5").mkdir()
    keep_last_checkpoint(tmp_path)
    kept = sorted((tmp_path / "checkpoints").iterdir())
    assert kept[0] == last
    assert [path.is_dir() for path in kept] == [False, True]


def test_no_room_leaves_the_earlier_ones(tmp_path):
    path = write(SELF, tmp_path, 1)
    sound = path.read_bytes()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, limits[1]))
    try:
        with pytest.raises(OSError, match=r"for a checkpoint of \d+ bytes: "):
            write(SELF, tmp_path, 2)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert [p.name for p in path.parent.iterdir()] == [path.name]
    assert path.read_bytes() == sound


def test_no_folder_is_made_for_a_run_that_is_gone(tmp_path):
    with pytest.raises(OSError, match="No such file or directory"):
        write(SELF, tmp_path / "gone")
    assert not (tmp_path / "gone").exists()


def test_file_modes_follow_the_umask(tmp_path):
    modes = ((0o022, 0o644), (0o077, 0o600), (0o002, 0o664))
    for step, (mask, mode) in enumerate(modes):
        before = os.umask(mask)
        try:
            path = write(SELF, tmp_path, step)
        finally:
            os.umask(before)
        assert path.stat().st_mode & 0o777 == mode


def test_a_link_in_the_way_is_not_followed(tmp_path, monkeypatch):
    monkeypatch.setattr(mpisph.io.particle_file.secrets, "token_hex", lambda _: "0")
    (tmp_path / "checkpoints").mkdir()
    (tmp_path / "precious").write_text("mine")
    link = tmp_path / "checkpoints" / "checkpoint_000000007.0.part"
    link.symlink_to(tmp_path / "precious")
    with pytest.raises(OSError, match="File exists"):
        write(SELF, tmp_path)
    assert (tmp_path / "precious").read_text() == "mine"


def reseal(path):
    """Make a file that was changed on purpose look sound."""
    mpisph.io.checkpoint._seal(SELF, path)


@pytest.mark.parametrize("change", ["no state", "no density", "short", "not HDF5"])
def test_a_sound_file_of_another_kind_is_refused(tmp_path, change):
    path = write(SELF, tmp_path)
    if change == "not HDF5":
        path.write_bytes(b"\0" * 5000)
    else:
        with h5py.File(path, "r+") as file:
            if change == "no state":
                del file["state"]
            else:
                del file["particles/rho"]
            if change == "short":
                file["particles/rho"] = np.zeros(3)
    reseal(path)
    expected = OSError if change == "not HDF5" else MpisphError
    with pytest.raises(expected) as caught:
        read_checkpoint(SELF, path)
    assert not isinstance(caught.value, DamagedError)


def test_particles_out_of_order_are_refused(tmp_path):
    path = write(SELF, tmp_path)
    with h5py.File(path, "r+") as file:
        file["particles/id"][:2] = [1, 0]
    reseal(path)
    with pytest.raises(MpisphError, match="not in the order of their ids"):
        read_checkpoint(SELF, path)
