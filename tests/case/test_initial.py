"""Initial particles of one's own: what is refused, and what missing fields become."""

import h5py
import numpy as np
import pytest

from mpisph.case import case_from_dict, load_case
from mpisph.case.discretise import discretise, initial_count
from mpisph.case.identity import case_key, differences
from mpisph.case.initial import complete_particles, digest_of, read_initial
from mpisph.core.errors import CaseError
from mpisph.core.particles import INITIAL


@pytest.fixture
def case(data):
    data["resolution"]["npr"] = 2
    return case_from_dict(data)


def three(**changes):
    """Two particles of the sphere and one of the plate."""
    given = {"body": [0, 0, 1], "m": [1e-6, 2e-6, 3e-6]}
    given |= {"r": [1e-3, 2e-3, 1e-3], "z": [-4e-3, -4e-3, 1e-3]}
    return {k: v for k, v in {**given, **changes}.items() if v is not None}


def test_what_is_not_given_is_as_at_the_start_of_a_case(case):
    got = complete_particles(case, three(), "particles").fields()
    assert set(got) == set(INITIAL)
    assert got["id"].tolist() == [0, 1, 2]
    assert got["material"].tolist() == [0, 0, 1]
    assert got["u_z"].tolist() == [6e3, 6e3, 0.0]
    rho0 = [entry.rho0 for entry in case.material_table]
    assert got["rho"].tolist() == [rho0[0], rho0[0], rho0[1]]
    assert got["h"].tolist() == [case.smoothing_length] * 3
    assert got["distension"].tolist() == [1.0] * 3
    for name in ("u_r", "E", "S_rr", "S_zz", "S_rz", "plastic_strain"):
        assert not got[name].any()


def test_a_case_given_its_own_particles_has_the_same(case):
    own = discretise(case).fields()
    few = {name: own[name] for name in ("body", "m", "r", "z")}
    got = complete_particles(case, few, "particles").fields()
    for name, values in own.items():
        np.testing.assert_array_equal(got[name], values)


def test_particles_are_put_in_the_order_of_their_ids(case):
    got = complete_particles(case, three(id=[2, 0, 1]), "particles")
    assert got.id.tolist() == [0, 1, 2]
    assert got.m.tolist() == [2e-6, 3e-6, 1e-6]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"r": None}, "particles: r: required: radius [m]"),
        ({"mass": [1, 2, 3]}, "particles: mass: no field of particles"),
        ({"rh0": [1, 2, 3]}, "did you mean rho?"),
        ({"m": [1.0, 2.0]}, "particles: m: expected 3 values, as of r"),
        ({"m": [[1.0], [2.0], [3.0]]}, "found the shape (3, 1)"),
        ({"m": ["a", "b", "c"]}, "particles: m: expected numbers"),
        ({"E": [[1.0], [2.0, 3.0]]}, "particles: E: expected numbers"),
        ({"m": 1.0}, "particles: m: expected 3 values"),
        ({"E": [1j, 0, 0]}, "particles: E: expected numbers"),
        ({"body": [0.0, 0.0, 1.0]}, "particles: body: expected whole numbers"),
        ({"body": [0, 0, 2]}, "body: expected 0 to 1, the place in the case; found 2"),
        ({"material": [0, -1, 1]}, "material: expected 0 to 1"),
        ({"id": [0, 1, 1]}, "id: expected 0 to 2, each once; found 1 twice"),
        ({"id": [0, 1, 3]}, "id: expected 0 to 2, each once; found 3"),
        ({"u_r": [0.0, np.nan, 0.0]}, "u_r: expected a finite number; found nan in"),
        ({"r": [1e-3, 0.0, -1e-3]}, "r: expected more than 0; found 0 in row 1 and 1"),
        ({"m": [1.0, 1.0, 0.0]}, "m: expected more than 0; found 0 in row 2"),
        ({"rho": [1.0, -1.0, 1.0]}, "rho: expected more than 0"),
        ({"h": [1.0, 0.0, 1.0]}, "h: expected more than 0"),
        ({"plastic_strain": [0.0, -1.0, 0.0]}, "plastic_strain: expected at least 0"),
        ({"damage": [0.0, 1.5, -1.0]}, "damage: expected at least 0"),
        ({"damage": [0.0, 1.5, 1.0]}, "damage: expected at most 1; found 1.5 in row 1"),
        ({"z": [0.0, 1e9, 0.0]}, "z: expected at most 2500 m"),
        (dict.fromkeys(("r", "z", "m", "body"), np.zeros(0, int)), "at least one"),
    ],
)
def test_what_cannot_be_is_refused(case, changes, message):
    with pytest.raises(CaseError) as raised:
        complete_particles(case, three(**changes), "particles")
    assert message in str(raised.value)


def test_all_that_is_wrong_is_said_at_once(case):
    with pytest.raises(CaseError) as raised:
        complete_particles(case, three(m=[0.0] * 3, r=[-1.0] * 3), "particles")
    assert len(raised.value.problems) == 2


def write_case(folder, data, **fields):
    """A case file that starts from state.h5 beside it."""
    with h5py.File(folder / "state.h5", "w") as file:
        for name, values in fields.items():
            file[name] = values
    path = folder / "case.toml"
    case = case_from_dict(data)
    text = case.to_toml() + '[initial]\nfile = "state.h5"\n'
    path.write_text(text)
    return path


def test_a_file_is_the_same_as_a_program(data, case, tmp_path):
    path = write_case(tmp_path, data, **three(id=[2, 0, 1]))
    loaded = load_case(path)
    assert loaded.initial.file == str(tmp_path / "state.h5")
    assert initial_count(loaded) == 3
    given = complete_particles(case, three(id=[2, 0, 1]), "particles")
    assert loaded.initial.digest == digest_of(given)
    assert digest_of(read_initial(loaded)) == digest_of(given)


def test_cases_differ_by_their_particles_not_by_where_they_lie(data, tmp_path):
    cases = []
    for name, mass in (("a", 1e-6), ("b", 1e-6), ("c", 2e-6)):
        (tmp_path / name).mkdir()
        path = write_case(tmp_path / name, data, **three(m=[mass] * 3))
        cases.append(load_case(path))
    assert not differences(*cases[:2])
    assert case_key(cases[0]) == case_key(cases[1]) != case_key(cases[2])
    (difference,) = differences(*cases[1:])
    assert difference.startswith("initial.digest: ")


def test_a_case_written_out_is_read_without_the_file(data, tmp_path):
    """But not run: the digest is compared at the start."""
    loaded = load_case(write_case(tmp_path, data, **three()))
    text = loaded.to_toml()
    assert 'file = "initial.h5"' in text
    (tmp_path / "again.toml").write_text(text)
    again = load_case(tmp_path / "again.toml")
    assert not differences(again, loaded)
    with pytest.raises(CaseError, match=r"initial\.h5: initial\.file: no such file"):
        read_initial(again)
    with h5py.File(tmp_path / "initial.h5", "w") as file:
        for name, values in three(m=[1e-6] * 3).items():
            file[name] = values
    with pytest.raises(CaseError, match="other particles than those of this case"):
        read_initial(again)


def test_what_is_no_file_of_particles_is_named(data, tmp_path):
    path = write_case(tmp_path, data, x=[1.0])
    with pytest.raises(CaseError, match=r"state\.h5: x: no field of particles"):
        load_case(path)
    (tmp_path / "state.h5").write_text("text")
    with pytest.raises(CaseError, match=r"state\.h5: cannot be read as HDF5"):
        load_case(path)
    (tmp_path / "state.h5").unlink()
    (tmp_path / "state.h5").mkdir()
    with pytest.raises(CaseError, match=r"state\.h5: initial\.file: is no file"):
        load_case(path)


def test_a_snapshot_of_other_bodies_is_refused(finished):
    path = sorted((finished / "snapshots").iterdir())[0]
    here = f"initial.file={path}"
    own = load_case(finished / "case.toml", [here])
    assert read_initial(own).id.size == initial_count(own)
    with pytest.raises(CaseError, match="the snapshot is of the bodies sphere of"):
        load_case(finished / "case.toml", [here, "bodies.sphere.material=cu-ofhc"])
