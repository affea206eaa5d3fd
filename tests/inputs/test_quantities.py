"""Numbers with units."""

import re

import pint
import pytest

from mpisph.inputs.quantities import COMMON_UNITS, conversion_factor, si_value


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [
        ("6.72 km/s", "m/s", 6720.0),
        ("0.968 mm", "m", 0.000968),
        ("9.53mm", "m", 0.00953),
        ("1 ns", "s", 1e-9),
        ("1.05 \u00b5s", "s", 1.05e-6),
        ("1.05 \u03bcs", "s", 1.05e-6),
        ("-1.2 GPa", "Pa", -1.2e9),
        ("2710 kg/m3", "kg/m^3", 2710.0),
        ("2.71 g/cm**3", "kg/m^3", 2710.0),
        ("2.71e0 g cm^-3", "kg/m^3", 2710.0),
        ("0.05 Mbar cm3/g", "J/kg", 5e6),
        ("14.1 MJ/kg", "J/kg", 1.41e7),
        ("885 J/kg/degC", "J/kg/K", 885.0),
        ("6.16e-4 degC^-1", "1/K", 6.16e-4),
        ("5 %", "", 0.05),
        ("5", "", 5.0),
        (3, "m", 3.0),
        (0.25, "", 0.25),
    ],
)
def test_quantities_become_the_nearest_double_in_si(text, unit, expected):
    assert si_value(text, unit) == expected


@pytest.mark.parametrize(
    ("value", "unit", "message"),
    [
        ("6 kg", "m", "'kg' is of another dimension: expected a length in m"),
        ("6", "m", "the unit is missing: expected a length in m"),
        ("6 furlongz", "m", "unknown unit"),
        ("", "m", "no number"),
        ("652 degC", "K", "'degC' counts from another zero: expected a temperature"),
        ("1205 degF", "K", "'degF' counts from another zero: expected a temperature"),
        ("fast", "m/s", "expected a velocity in m/s"),
        ("1 m", "", "expected a number without a unit"),
        ("9 m**9**9**9", "m", "cannot read the unit"),
        ("2 * 3 m", "m", "cannot read the unit"),
        ("1e999 m", "m", "must be finite"),
        ("1e999999999 km", "m", "cannot read the number"),
        ("1e99999999999999999999 m", "m", "cannot read the number"),
        ("1__0 m", "m", "cannot read the unit"),
        ("\u0661 m", "m", "no number"),
        ("1 m\u0663", "m", "cannot read the unit"),
        ("1 " + "m*" * 400 + "m", "m", "a string of 803 characters"),
        (float("nan"), "m", "must be finite"),
        (float("-inf"), "m", "must be finite"),
        (10**400, "m", "must be finite"),
        (True, "m", "expected a length in m"),
        (None, "m", "expected a length in m"),
        ([1], "m", "expected a length in m"),
    ],
)
def test_bad_quantities_name_the_expected_unit(value, unit, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        si_value(value, unit)


def test_minus_infinity_only_where_it_is_meant():
    assert si_value("-inf", "Pa", minus_infinity=True) == float("-inf")
    with pytest.raises(ValueError, match="finite"):
        si_value("inf", "Pa", minus_infinity=True)


def test_common_units_are_those_of_pint():
    """The short table must give nothing that the whole one does not."""
    rows = [line.split(" = ") for line in COMMON_UNITS.split("\n") if line]
    prefixes = [p.strip("-") for row in rows if row[0][-1] == "-" for p in row[2:]]
    symbols = [row[-1] for row in rows if row[0][-1] != "-"]
    assert {"m", "\u00b5", "G"} <= set(prefixes)
    assert {"m", "s", "g", "Pa"} <= set(symbols)
    for symbol in symbols:
        si = "kg" if symbol == "g" else symbol
        for unit in (f"{p}{symbol}" for p in ("", *prefixes)):
            factor = conversion_factor(unit, si, common=True)
            assert factor == conversion_factor(unit, si, common=False), unit


@pytest.mark.parametrize(("unit", "si"), [("inch", "m"), ("psi", "Pa"), ("min", "s")])
def test_rarer_units_are_pints_own(unit, si):
    with pytest.raises(pint.UndefinedUnitError):
        conversion_factor(unit, si, common=True)
    expected = conversion_factor(unit, si, common=False)
    assert si_value(f"1 {unit}", si) == float(expected)
