"""Files of published tests: what is read from them, and what is refused."""

import csv

import pytest
from launch import CASES

from mpisph.core.errors import CaseError
from mpisph.study.assess.published import chosen_tests, read_tests

SHIPPED = CASES / "studies" / "whipple-tests.csv"

HEAD = (
    "row,source,shotID,proj_mat,proj_density,proj_diam,velocity,bumper_mat,"
    "bumper_density,bumper_thick,standoff,wall_mat,wall_density,wall_yield,wall_thick,"
    "result"
)
GOOD = (
    "7,Report,A-1,AA2017-T4,2.8,0.3175,6.5,AA6061-T6,2.7,0.0787,5.08,AA6061-T6,2.7,40,"
    "0.318,P"
)


@pytest.fixture
def read(tmp_path):
    def read(*lines):
        path = tmp_path / "tests.csv"
        path.write_text("\n".join(lines) + "\n")
        return read_tests(path)

    return read


def problems(read, *lines):
    """The problems of a file, by line and column."""
    with pytest.raises(CaseError) as caught:
        read(*lines)
    return {(p.line, p.key): p for p in caught.value.problems}


def changed(**cells):
    """The good row with some cells changed."""
    row = dict(zip(HEAD.split(","), GOOD.split(","), strict=True))
    assert row.keys() >= cells.keys()
    return ",".join((row | cells).values())


def test_units_without_a_word_on_them(read):
    (test,) = read(HEAD, GOOD)
    assert (test.row, test.source, test.shot) == ("7", "Report", "A-1")
    assert test.diameter == pytest.approx(3.175e-3, rel=1e-12)
    assert test.velocity == pytest.approx(6500.0, rel=1e-12)
    assert test.shield == pytest.approx(
        (0.787e-3, 2700.0, 50.8e-3, 3.18e-3, 40 * 6.894757e6, 2800.0), rel=1e-7
    )
    assert test.failed
    assert (test.projectile.card, test.wall.card) == ("al-2017-t4", "al-6061-t6")


def test_units_of_the_head_and_of_a_cell(read):
    head = HEAD.replace("proj_diam", "Proj_Diam [mm]").replace(
        "velocity", "velocity [m/s]"
    )
    (test,) = read(head, changed(proj_diam="3.175", velocity="6.5 km/s"))
    (plain,) = read(HEAD, GOOD)
    assert test.diameter == pytest.approx(plain.diameter, rel=1e-12)
    assert test.velocity == pytest.approx(plain.velocity, rel=1e-12)


def test_what_may_be_left_out(read):
    (test,) = read(
        "proj_mat;proj_diam;velocity;bumper_mat;bumper_thick;standoff;wall_mat;"
        "wall_thick;result;remark",
        "al-2017-t4;0.3175;6.5;6061-T6;0.0787;5.08;AA7075-T6;0.318;np;a, remark",
    )
    assert (test.row, test.name, test.failed) == ("1", "1", False)
    assert test.shield.wall_yield == pytest.approx(73 * 6.894757e6)
    assert test.shield.projectile_density == 2790.0  # of the card


def test_all_mistakes_are_named_at_once(read):
    found = problems(
        read,
        HEAD,
        changed(proj_mat="AA6061-T7", velocity="6500", wall_thick="x"),
        changed(row="8", result="?", standoff="-5", proj_diam="nan"),
        changed(row="8", bumper_mat="Nextel AF62", wall_yield=""),
        GOOD + ",more",
        changed(row="9", bumper_density="7.8"),
    )
    assert found.keys() == {
        (2, "proj_mat"), (2, "velocity"), (2, "wall_thick"),
        (3, "result"), (3, "standoff"), (3, "proj_diam"),
        (4, "bumper_mat"), (4, "row"), (5, ""), (6, "bumper_density"), (None, ""),
    }  # fmt: skip
    assert found[2, "proj_mat"].suggestion == "AA6061-T6"
    assert "is the unit km/s?" in found[2, "velocity"].expected
    assert "fabrics" in found[4, "bumper_mat"].expected
    assert "AA2219-T87" in found[None, ""].expected
    assert "line 3 has the same number" in found[4, "row"].expected


def test_oblique_impacts_and_second_bumpers_are_refused(read):
    head = f"{HEAD},angle,bumper2_thick"
    assert len(read(head, f"{GOOD},0,")) == 1
    assert len(read(head, f"{GOOD},,0.0")) == 1
    found = problems(read, head, f"{GOOD},45,0.1")
    assert found.keys() == {(2, "angle"), (2, "bumper2_thick")}


def test_columns_must_be_there_once_with_units_that_fit(read):
    with pytest.raises(CaseError, match="expected a column standoff"):
        read(HEAD.replace("standoff", "spacing"), GOOD)
    with pytest.raises(CaseError, match="expected a length"):
        read(HEAD.replace("standoff", "standoff [s]"), GOOD)
    with pytest.raises(CaseError, match="stands there twice"):
        read(f"{HEAD},velocity", f"{GOOD},6")
    with pytest.raises(CaseError, match="expected a line of names and tests"):
        read(HEAD)


def test_what_steers_a_terminal_is_shown_as_text(read):
    (test,) = read(HEAD, changed(source="\x1b[31mred"))
    assert test.name == "\\x1b[31mred A-1"


def test_rows_are_chosen_by_number(read):
    tests = read(HEAD, *(changed(row=str(n)) for n in (2, 4, 13, 14)))
    assert [t.row for t in chosen_tests(tests, None)] == ["2", "4", "13", "14"]
    assert [t.row for t in chosen_tests(tests, "13, 2")] == ["2", "13"]
    assert [t.row for t in chosen_tests(tests, "3-13,14")] == ["4", "13", "14"]
    for bad in ("3", "5-12", "2,x", ""):
        with pytest.raises(CaseError, match="such as 2,4"):
            chosen_tests(tests, bad)


def test_the_shipped_tests_are_a_hundred_of_all_kinds():
    tests = read_tests(SHIPPED)
    assert len(tests) == 100
    assert len({test.source for test in tests}) > 10
    for low, high in ((0, 3e3), (3e3, 6e3), (6e3, 20e3)):
        inside = [t for t in tests if low <= t.velocity < high]
        assert {t.failed for t in inside} == {True, False}
        assert len(inside) >= 10


def test_the_shipped_tests_are_read_as_they_stand():
    lines = [s for s in SHIPPED.read_text().splitlines() if not s.startswith("#")]
    for test, cells in zip(read_tests(SHIPPED), csv.DictReader(lines), strict=True):
        assert test.row == cells["row"]
        assert test.diameter == pytest.approx(1e-2 * float(cells["proj_diam [cm]"]))
        assert test.failed == (cells["result"] == "P")


def test_the_equation_is_right_on_the_shipped_tests_as_often_as_counted_apart():
    """The equation in cm, g/cm3, ksi and km/s, as the literature gives it."""
    lines = [s for s in SHIPPED.read_text().splitlines() if not s.startswith("#")]
    for test, cells in zip(read_tests(SHIPPED), csv.DictReader(lines), strict=True):
        c = {k.split()[0]: v for k, v in cells.items()}
        d, v, t_b, s, t_w, y, r_p, r_b = (
            float(c[k])
            for k in ("proj_diam", "velocity", "bumper_thick", "standoff",
                      "wall_thick", "wall_yield", "proj_density", "bumper_density")
        )  # fmt: skip
        slow = ((t_w * (y / 40) ** 0.5 + t_b) / (0.6 * r_p**0.5)) ** (18 / 19)
        fast = 3.918 * t_w ** (2 / 3) * (s * y / 70 / r_p) ** (1 / 3) / r_b ** (1 / 9)
        if v <= 3:
            limit = slow * v ** (-12 / 19)
        elif v >= 7:
            limit = fast * v ** (-2 / 3)
        else:
            ends = slow * 3 ** (-12 / 19), fast * 7 ** (-2 / 3)
            limit = ends[0] + (v - 3) / 4 * (ends[1] - ends[0])
        assert test.ratio == pytest.approx(d / limit, rel=1e-6)
