"""Cards of one's own, which bodies name by their files."""

import re

import pytest

from mpisph.case import case_from_dict, case_schema, load_case
from mpisph.case.identity import case_key
from mpisph.core.errors import CaseError

CARD = """description = "a steel"
rho0 = "7.85 g/cm3"

[mie-grueneisen]
c0 = "4.6 km/s"
slope = 1.49
gamma0 = 2.2

[elastic-plastic]
shear_modulus = "80 GPa"
yield_strength = "0.8 GPa"
"""


@pytest.fixture
def case_file(data, tmp_path):
    """A case whose sphere is of a card in a folder beside it."""
    text = case_from_dict(data).to_toml()
    text = text.replace('material = "al-lee2003"', 'material = "cards/steel.toml"')
    (tmp_path / "cards").mkdir()
    (tmp_path / "cards" / "steel.toml").write_text(CARD)
    path = tmp_path / "case.toml"
    path.write_text(text)
    return path


def test_the_case_holds_the_whole_card(case_file):
    case = load_case(case_file)
    assert case.bodies[0].material == "steel"
    steel = case.materials["steel"]
    assert (steel.rho0, steel.description) == (7850.0, "a steel")
    alone = case_file.with_name("alone.toml")
    alone.write_text(case.to_toml())
    (case_file.parent / "cards" / "steel.toml").unlink()
    assert load_case(alone) == case


def test_cases_are_the_same_by_the_cards_content(case_file):
    before = load_case(case_file)
    card = case_file.parent / "cards" / "steel.toml"
    card.rename(case_file.parent / "steel.toml")
    moved = load_case(case_file, ["bodies.0.material=steel.toml"])
    assert case_key(moved) == case_key(before)
    (case_file.parent / "steel.toml").write_text(CARD.replace("4.6", "4.7"))
    other = load_case(case_file, ["bodies.0.material=steel.toml"])
    assert case_key(other) != case_key(before)


def test_several_bodies_may_name_one_card(case_file):
    case = load_case(case_file, ["bodies.1.material=cards/steel.toml"])
    assert [body.material for body in case.bodies] == ["steel", "steel"]
    assert list(case.materials) == ["steel"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("4.6 km/s", "4.6 km", "cards/steel.toml:5: materials.steel.mie-grueneisen.c0"),
        ("slope", "slop", "cards/steel.toml:6: "),
        ("rho0 = ", "rho0 ", "cards/steel.toml:2: "),
        ('rho0 = "7.85 g/cm3"', "", "rho0 missing"),
    ],
)
def test_mistakes_in_a_card_have_its_file_and_line(case_file, old, new, message):
    card = case_file.parent / "cards" / "steel.toml"
    card.write_text(CARD.replace(old, new))
    with pytest.raises(CaseError) as raised:
        load_case(case_file)
    assert message in str(raised.value)
    assert str(case_file) not in str(raised.value)


def test_files_that_are_not_there_and_names_that_are_taken(case_file):
    card = case_file.parent / "cards" / "steel.toml"
    (case_file.parent / "steel.toml").write_text(CARD)
    with pytest.raises(CaseError, match=r"bodies\.\d\.material.*steel is taken"):
        load_case(case_file, ["bodies.1.material=steel.toml"])
    with pytest.raises(CaseError, match=r"the case has a table materials\.steel"):
        load_case(case_file, ["materials.steel.rho0=8000"])
    card.unlink()
    with pytest.raises(CaseError, match=r"cards/steel\.toml: no such file"):
        load_case(case_file)


def test_the_schema_lets_bodies_name_files():
    for body in ("Sphere", "Plate"):
        pattern = case_schema()["$defs"][body]["properties"]["material"]["pattern"]
        for material in ("cu-ofhc", "cards/my steel.toml"):
            assert re.search(pattern, material)
        assert not re.search(pattern, "cards/steel")


def test_a_card_with_the_name_of_a_shipped_one_changes_it(case_file):
    card = case_file.parent / "cards" / "cu-ofhc.toml"
    card.write_text('[elastic-plastic]\nyield_strength = "0.2 GPa"\n')
    own = ["materials.cu-ofhc=", "bodies.1.material=cards/cu-ofhc.toml"]
    case = load_case(case_file, own)
    copper = case.materials["cu-ofhc"]
    assert copper.constants("elastic-plastic").yield_strength == 2e8
    assert copper.rho0 == 8930.0
