import numpy as np
import pytest
from mpi4py import MPI

from mpisph.io.history import (
    COLUMNS,
    HEADER,
    HISTORY_FILE,
    History,
    begins_with,
    keep_rows,
    read_history,
)

SELF = MPI.COMM_SELF


def row(step):
    """A row with numbers that need all of their digits."""
    x = step / 3
    return dict(
        step=step,
        time=x * 1e-6,
        dt=np.float64(1e-9 / 7),
        mass=0.1 + 0.2,
        momentum_z=-x,
        kinetic_energy=1e300 / 3,
        internal_energy=5e-324,
        energy_min=-1e-17 / 7,
        energy_error=-1e-17 / 3,
        cloud_radius=0.0,
        cloud_length=np.nan,
        cloud_mass=0.001,
        cloud_arrived=1.0,
        imbalance=0.25,
        wall=x,
    )


def write(folder, steps):
    with History(folder, SELF) as history:
        for step in steps:
            history.add(row(step))
    return folder / HISTORY_FILE


def test_numbers_come_back_with_all_digits(tmp_path):
    got = read_history(write(tmp_path, range(5)))
    names = tuple(column.name for column in COLUMNS)
    assert got.dtype.names == names
    assert got["step"].dtype == np.int64
    for step, line in enumerate(got):
        want = row(step)
        np.testing.assert_array_equal(list(line), [want[name] for name in names])


def test_header_names_units(tmp_path):
    header = write(tmp_path, []).read_text()
    assert header == (
        "step,time_s,dt_s,mass_kg,momentum_z_kg_m_per_s,kinetic_energy_J,"
        "internal_energy_J,energy_min_J_per_kg,cloud_radius_m,cloud_length_m,"
        "cloud_mass_kg,cloud_arrived,energy_error,imbalance,wall_s\n"
    )


def test_numbers_are_plain(tmp_path):
    """Numpy's repr would write np.float64(...)."""
    line = write(tmp_path, [3]).read_text().splitlines()[1]
    assert line.split(",")[:4] == ["3", "1e-06", repr(1e-9 / 7), "0.30000000000000004"]


def test_an_empty_history_reads_as_no_lines(tmp_path):
    assert read_history(write(tmp_path, [])).shape == (0,)


def test_lines_can_be_read_while_the_run_goes_on(tmp_path):
    with History(tmp_path, SELF) as history:
        history.add(row(1))
        assert len(read_history(tmp_path / HISTORY_FILE)) == 1


def test_a_torn_last_line_is_left_out(tmp_path):
    path = write(tmp_path, range(3))
    text = path.read_text()
    path.write_text(text[:-4])
    assert read_history(path)["step"].tolist() == [0, 1]


def test_a_new_run_starts_anew(tmp_path):
    write(tmp_path, range(5))
    assert read_history(write(tmp_path, [7]))["step"].tolist() == [7]


def test_a_history_continues_where_it_was_cut(tmp_path):
    with History(tmp_path, SELF) as history:
        history.add(row(0))
        saved = history.saved()
        history.add(row(1))
    with History(tmp_path, SELF, saved.size) as history:
        assert history.saved() == saved
        history.add(row(2))
        again = history.saved()
    assert read_history(tmp_path / HISTORY_FILE)["step"].tolist() == [0, 2]
    assert begins_with(tmp_path / HISTORY_FILE, saved)
    assert begins_with(tmp_path / HISTORY_FILE, again)


DAMAGE = {
    "cut short": (lambda lines: [*lines[:4], lines[4][:30]], [0, 2, 4]),
    "without a header": (lambda lines: lines[1:], [0, 2, 4, 6, 8]),
    "a line that is none": (lambda lines: [*lines[:2], "x,y\0", *lines[3:]],
                            [0, 4, 6, 8]),
    "a word in a line": (lambda lines: [lines[0], lines[1].replace("5e-324", "no"),
                                        *lines[2:]], [2, 4, 6, 8]),
    "a line twice": (lambda lines: [*lines, lines[3]], [0, 2, 4, 6, 8]),
    "an altered step": (lambda lines: [*lines[:2], "6" + lines[2][1:], *lines[3:]],
                        [0, 4, 6, 8]),
    "another step": (lambda lines: [*lines[:2], "3" + lines[2][1:], *lines[3:]],
                     [0, 4, 6, 8]),
    "empty": (lambda _: [], []),
}  # fmt: skip


@pytest.mark.parametrize("damage", DAMAGE)
def test_rows_that_survive_are_kept(damage, tmp_path):
    path = write(tmp_path, range(0, 20, 2))
    sound = path.read_text().splitlines()
    change, kept = DAMAGE[damage]
    path.write_text("\n".join(change(sound)) + "\n")
    assert keep_rows(tmp_path / HISTORY_FILE, step=10, every=2) == (len(kept), 5)
    wanted = [",".join(HEADER), *(sound[1 + step // 2] for step in kept)]
    assert path.read_text().splitlines() == wanted


@pytest.mark.parametrize("kind", ["nothing", "folder", "bytes"])
def test_without_rows_the_history_starts_over(kind, tmp_path):
    path = tmp_path / HISTORY_FILE
    if kind == "folder":
        (path / "inside").mkdir(parents=True)
    elif kind == "bytes":
        path.write_bytes(bytes(range(256)) * 20)
    assert keep_rows(tmp_path / HISTORY_FILE, step=10, every=2) == (0, 5)
    assert read_history(path).shape == (0,)


@pytest.mark.parametrize("text", ["", "a,b\n1,2\n"])
def test_another_file_is_refused(tmp_path, text):
    path = tmp_path / "x.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match="not a history"):
        read_history(path)


@pytest.mark.mpi(min_size=1)
def test_only_rank_0_writes(mpi_tmp_path):
    comm = MPI.COMM_WORLD
    with History(mpi_tmp_path, comm) as history:
        history.add(row(comm.rank + 5))
    comm.barrier()
    got = read_history(mpi_tmp_path / HISTORY_FILE)
    assert got["step"].tolist() == [5]
