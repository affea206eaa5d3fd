"""Files of tabulated equations of state: what is read, and what is refused."""

import os

import numpy as np
import pytest
import tables

from mpisph.case import case_from_dict, load_case
from mpisph.case.identity import case_key, differences
from mpisph.case.plausibility import find_warnings
from mpisph.core.errors import CaseError
from mpisph.materials import read_card
from mpisph.materials.table_files import read_table

GAS = tables.ideal_gas()


def read(tmp_path, text):
    path = tmp_path / "eos.txt"
    path.write_text(text)
    return read_table(path)


def refusal(tmp_path, text):
    """The only problem of a file: its line, and what is said."""
    with pytest.raises(CaseError) as caught:
        read(tmp_path, text)
    (problem,) = caught.value.problems
    assert problem.file == str(tmp_path / "eos.txt")
    return problem.line, problem.expected


def assert_alike(found, states, rel):
    for values, want in zip(found, states, strict=True):
        np.testing.assert_allclose(values, want, rtol=rel)


def test_csv_keeps_every_bit(tmp_path):
    solid = tables.mie_grueneisen()
    found = read(tmp_path, "# made of closed forms\n\n" + tables.as_csv(solid))
    for values, want in zip(found, solid, strict=True):
        np.testing.assert_array_equal(values, want)


def test_csv_takes_units_and_columns_in_any_order(tmp_path):
    header = "Energy [MJ/kg], pressure (GPa),temperature,density [g/cm3]"
    rows = ["1,2,300,2.7", "2,3,400,2.7", "1.5,4,300,3", "2.5,5,400,3"]
    found = read(tmp_path, "\n".join([header, *rows]))
    np.testing.assert_allclose(found.density, [2700.0, 3000.0])
    np.testing.assert_allclose(found.temperature, [300.0, 400.0])
    np.testing.assert_allclose(found.pressure, [[2e9, 3e9], [4e9, 5e9]])
    np.testing.assert_allclose(found.energy, [[1e6, 2e6], [1.5e6, 2.5e6]])


@pytest.mark.parametrize("flags", [True, False])
@pytest.mark.parametrize("header", ["", " RECORD     TYPE =  301     NWDS =   64"])
def test_sesame_with_and_without_flags_and_headers(tmp_path, flags, header):
    text = tables.as_sesame(tables.mie_grueneisen(), flags, header)
    assert_alike(read(tmp_path, text), tables.mie_grueneisen(), 1e-8)


def test_sesame_of_other_records_and_free_energies(tmp_path):
    """Material 3720 has records 101, 201, 301 and 304: one of them is read."""
    own = tables.as_sesame(GAS)
    other = " 0  3720   201     5   r 1\n" + "".join(f"{x:15.8E}" for x in range(5))
    other += "11111\n"
    free = "".join(
        "".join(f"{x:15.8E}" for x in range(5)) + "11111\n" for _ in range(5)
    )
    # 62 words end with two on a line; the free energies follow on new lines.
    last = other.replace(" 201 ", " 304 ")
    whole = " 0  3720   101    80   r 1\n aluminium. z=13.0\n" + other + own + last
    assert_alike(read(tmp_path, whole), GAS, 1e-8)
    assert_alike(read(tmp_path, other + own + free + last), GAS, 1e-8)


def test_fortran_exponents_are_understood(tmp_path):
    text = tables.as_sesame(GAS, header="").replace("E+", "D+")
    assert_alike(read(tmp_path, text), GAS, 1e-8)


CSV = tables.as_csv(GAS).splitlines()
SESAME = tables.as_sesame(GAS).splitlines()


def csv(*changes, drop=()):
    """The gas as CSV, with fields changed, (row, column, text), and rows left out."""
    rows = [line.split(",") for line in CSV]
    for row, column, text in changes:
        rows[row][column] = text
    kept = [",".join(row) for i, row in enumerate(rows) if i not in drop]
    return "\n".join(kept)


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("", None, "holds no table"),
        (csv(drop=range(1, 26)), 1, "no rows below the header"),
        (csv((0, 3, "enthalpy")), 1, "expected the columns density [kg/m^3]"),
        (csv((0, 3, "energy [Pa]")), 1, "expected a specific energy"),
        (csv((4, 2, "much")), 5, "expected a number, found 'much'"),
        (csv((4, 2, "nan")), 5, "pressure: no finite number"),
        (csv((4, 3, "inf")), 5, "energy: no finite number"),
        (csv((4, 2, "1,2")), 5, "expected 4 numbers with commas, found 5"),
        (csv(drop=[8]), 9, "hole: at 0.1 kg/m3 expected 1000 K, found 3000 K"),
        (csv(drop=[10]), 11, "hole: at 0.1 kg/m3 expected 100000 K, found another"),
        (csv(drop=[25]), 25, "hole: at 20 kg/m3 expected 100000 K, found another"),
        (csv((3, 3, "2e5")), 4, "energy: at 0.001 kg/m3 it does not rise from 300 K"),
        (
            csv(*((row, 0, "0.05") for row in range(11, 16))),
            12,
            "density: 0.05 follows 0.1; expected rising values",
        ),
        (
            csv(*((row, 1, "250.0") for row in range(3, 26, 5))),
            4,
            "temperature: 250 follows 300; expected rising values",
        ),
        (csv(drop=range(6, 26)), None, "1 values of density; expected 2 to 256"),
        ("\n".join(SESAME[:-2]), 12, "take 62 words, or 87 with free energies; found"),
        ("\n".join([SESAME[0], "5.5 5.0"]), 2, "expected the numbers of densities"),
        (
            "\n".join([*SESAME[:5], SESAME[5].replace("E", "*", 1), *SESAME[6:]]),
            6,
            "expected decimal numbers, found '*",
        ),
        (
            "\n".join([*SESAME[:5], " NaN".ljust(75) + "11111", *SESAME[6:]]),
            6,
            "expected numbers",
        ),
    ],
)
def test_a_faulty_table_is_refused_with_line_and_reason(tmp_path, text, line, message):
    found, said = refusal(tmp_path, text)
    assert message in said
    assert found == line


@pytest.mark.parametrize("kind", ["missing", "folder", "pipe"])
def test_what_cannot_be_read_is_refused(tmp_path, kind):
    path = tmp_path / "eos.txt"
    if kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    with pytest.raises(CaseError, match=r"cannot be read|holds no table"):
        read_table(path)


@pytest.fixture
def folder(tmp_path, data):
    """A folder with a card and its table; the case's plate is of it."""
    (tmp_path / "cards").mkdir()
    (tmp_path / "cards/solid.toml").write_text(tables.SOLID_CARD)
    text = tables.as_csv(tables.mie_grueneisen())
    (tmp_path / "cards/solid.csv").write_text(text)
    data["bodies"][1]["material"] = "cards/solid.toml"
    return tmp_path


def test_a_card_names_its_table_beside_it(folder, data):
    case = case_from_dict(data, folder)
    models = case.body_models(case.bodies[1])
    assert models.names["eos"] == "table"
    assert models.bulk_sound_speed == pytest.approx(tables.C0, rel=0.02)
    assert models.constants["table"].sources == {"digest": "solid.csv"}
    card = read_card(folder / "cards/solid.toml")
    assert card.table.digest == models.constants["table"].digest


def test_a_case_keeps_its_table(folder, data):
    """Its text needs no file: it is what a run's folder and its snapshots hold."""
    case = case_from_dict(data, folder)
    (folder / "cards/solid.csv").unlink()
    (folder / "case.toml").write_text(case.to_toml())
    again = load_case(folder / "case.toml")
    assert again == case
    assert case_key(again) == case_key(case)


def test_the_numbers_of_a_table_tell_cases_apart_and_its_place_does_not(folder, data):
    case = case_from_dict(data, folder)
    data["bodies"][1]["material"] = "solid"
    table = {"rho0": 2703.0, "eos": "table", "strength": "none"}
    data["materials"] = {"solid": table | {"table": {"file": "cards/solid.csv"}}}
    same = case_from_dict(data, folder)
    assert differences(case, same) == []
    assert case_key(case) == case_key(same)
    states = tables.mie_grueneisen()
    other = states._replace(pressure=states.pressure * (1.0 + 1e-15))
    (folder / "cards/solid.csv").write_text(tables.as_csv(other))
    changed = case_from_dict(data, folder)
    keys = [line.partition(":")[0] for line in differences(case, changed)]
    assert "materials.solid.table.digest" in keys
    assert "materials.solid.table.content" not in keys
    assert case_key(case) != case_key(changed)


def test_another_table_may_be_named_for_a_case_that_holds_one(folder, data):
    case = case_from_dict(data, folder)
    (folder / "case.toml").write_text(case.to_toml())
    states = tables.mie_grueneisen(40)
    (folder / "other.csv").write_text(tables.as_csv(states))
    name = "materials.solid.table.file=other.csv"
    changed = load_case(folder / "case.toml", [name])
    assert changed.materials["solid"].table.digest == states.digest()


def test_a_reference_density_that_is_not_the_tables_is_warned_of(folder, data):
    assert find_warnings(case_from_dict(data, folder)) == []
    (folder / "cards/solid.toml").write_text(tables.SOLID_CARD.replace("2703", "2730"))
    (text,) = find_warnings(case_from_dict(data, folder))
    assert text.startswith("bodies.wall.material: solid has a pressure of 7.")
    assert "is that the density of the table?" in text


def test_a_table_of_a_gas_makes_a_gas(folder, data):
    (folder / "cards/solid.csv").write_text(tables.as_csv(GAS))
    card = tables.SOLID_CARD.replace("2703", "1.2")
    (folder / "cards/solid.toml").write_text(card)
    case = case_from_dict(data, folder)
    assert case.material_table[1].gas
    assert not case.material_table[0].gas
    assert not [text for text in find_warnings(case) if "without energy" in text]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"rho0": 9e3}, "rho0 = 9000 kg/m3 is no state of it: the table has"),
        (
            {"table": {"reference_temperature": "1e6 K"}},
            "reference_temperature = 1e+06 K is no state of it",
        ),
        ({"table": {"file": "none.csv"}}, "cannot be read: No such file"),
        ({"table": {"file": ""}}, "at least 1 character"),
    ],
)
def test_a_table_without_the_reference_state_is_refused(folder, data, changes, message):
    data["bodies"][1]["material"] = "solid"
    table = {"file": "cards/solid.csv"} | changes.pop("table", {})
    material = {"rho0": 2703.0, "eos": "table", "strength": "none", "table": table}
    data["materials"] = {"solid": material | changes}
    with pytest.raises(CaseError) as caught:
        case_from_dict(data, folder)
    assert message in "\n".join(problem.expected for problem in caught.value.problems)
