"""Expressions in a case file: what they may be, and how a mistake is told."""

import math

import numpy as np
import pytest
from pydantic import BaseModel, ValidationError

from mpisph.inputs.expressions import FUNCTIONS, EnergyProfile, evaluate

PLACES = {
    "r": np.array([0.5, 1.0, 2.0]),
    "z": np.array([-1.0, 0.0, 4.0]),
    "s": np.array([0.3, 0.6, 0.9]),
}


class Own(BaseModel):
    E: EnergyProfile


def read(text):
    return Own(E=text).E


def message(text):
    with pytest.raises(ValidationError) as caught:
        read(text)
    (error,) = caught.value.errors()
    return error["msg"]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("2*r + z", [0.0, 2.0, 8.0]),
        (" -r**2 ", [-0.25, -1.0, -4.0]),
        ("+2**-1 + 0*s", [0.5, 0.5, 0.5]),
        ("(r*3 - 1)/2", [0.25, 1.0, 2.5]),
        ("2 * 3", [6.0, 6.0, 6.0]),
        ("where(s < 0.5, 7, 1e3)", [7.0, 1e3, 1e3]),
        ("0.5 < s <= 0.9", [0.0, 1.0, 1.0]),
        ("s >= 0.6 and z > 0 or r < 0.6", [1.0, 0.0, 1.0]),
        ("not s > 0.5", [1.0, 0.0, 0.0]),
        ("1_000*r", [500.0, 1000.0, 2000.0]),
        ("7/2 + 0*r", [3.5, 3.5, 3.5]),
        ("max(min(r, 1), 0.7)", [0.7, 1.0, 1.0]),
        ("pi*r", [math.pi / 2, math.pi, 2 * math.pi]),
    ],
)
def test_values_by_hand(text, expected):
    assert read(text) == text
    values = evaluate(text, PLACES)
    assert values.dtype == np.float64
    assert values.tolist() == expected


def test_every_function_is_that_of_its_name():
    given = {"abs": [-1.5], "atan2": [1.0, -2.0], "min": [1.0, 2.0], "max": [1.0, 2.0]}
    python = {"abs": abs, "min": min, "max": max}
    for name, (_, count) in FUNCTIONS.items():
        values = given.get(name, [0.7] * count)
        if name != "where":
            function = python.get(name) or getattr(math, name)
            found = evaluate(f"{name}({', '.join(map(str, values))})", PLACES)
            assert found == pytest.approx(function(*values), rel=1e-15)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("2*q", "no name q at character 3 (there are r, z, s, pi): expected"),
        ("2*sqr(r)", "no function sqr at character 3 (did you mean sqrt?)"),
        ("  2*(r", "'(' was never closed at character 5"),
        ("2*r**2 +", "invalid syntax at character 8"),
        ("r^2", "an unknown operator at character 1 (a power is written **)"),
        ("1 if r else 2", "write where(condition, value, other value)"),
        ("r == 1", "compare with <, <=, > or >="),
        ("where(r < 1, 2)", "where takes 3, not 2 values at character 1"),
        ("sqrt(x=r)", "an argument with a name"),
        ("3*max(*r)", "max takes 2, not 1 values at character 3"),
        ("r.real", "no part of an expression at character 1"),
        ("r[0]", "no part of an expression"),
        ("'a'*3", "'a' is no number"),
        ("r*1j", "1j is no number at character 3"),
        ("True", "True is no number"),
        ("r % 2", "an unknown operator at character 1"),
        ("r // 2", "an unknown operator at character 1"),
        ("r*(z:=2)", "no part of an expression"),
        ("lambda: 1", "no part of an expression"),
        ("[r for r in s]", "no part of an expression"),
        ("f'{r}'*r", "no part of an expression"),
        ("__import__('os').system('true')", "no function __import__('os').system"),
        ("().__class__*r", "no part of an expression"),
        ("r = 2", "invalid syntax"),
        ("r; z", "invalid syntax"),
        ("6,7 km/s", "invalid syntax"),
        ("r\n", "one line"),
        ("r*1e400", "a number too large at character 3"),
        ("r*" + "9" * 400, "a number too large"),
        ("r*9" * 200, "600 characters, of 500 at most"),
        ("(" * 250 + "r" + ")" * 249, "character"),
        ("-" * 300 + "r", "nested too deeply at character 101"),
        ("r²", "invalid character"),
        ("ß*1e-3 + r", "no name ß"),
        ("r + ß*1e-3 + q", "no name ß at character 5 (there"),
        ("", "expected a quantity, or an expression in r, z, s (m)"),
        ("  ", "expected a quantity, or an expression in r, z, s (m)"),
    ],
)
def test_a_mistake_is_told_with_its_place(text, words):
    assert words in message(text)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("6 km/s", "'km/s' is of another dimension"),
        ("6", "the unit is missing"),
        ("6 MJ/kgs", "unknown unit"),
        ("nan", "must be finite"),
        (-1.0, "greater than or equal to 0"),
        (True, "expected a specific energy"),
        (None, "expected a specific energy"),
    ],
)
def test_a_quantity_stays_one(text, words):
    assert words in message(text)


def test_quantities_are_converted_and_expressions_kept():
    assert read("2 MJ/kg") == 2e6
    assert read(3) == 3.0
    assert Own.model_validate(Own(E="r**2").model_dump()).E == "r**2"
    assert Own(E="1e3*r").model_dump_json() == '{"E":"1e3*r"}'


@pytest.mark.parametrize("text", ["9**9**9**9**9", "9**r**9**9", "exp(exp(9*r))"])
def test_a_huge_power_is_infinite_at_once(text):
    assert evaluate(read(text), PLACES)[2] == math.inf


def test_what_cannot_be_computed_is_no_number():
    values = evaluate(read("sqrt(z) + 1/(r - 1)"), PLACES)
    assert math.isnan(values[0])
    assert np.isinf(values[1])


def test_a_share_of_the_places_has_the_same_bits():
    """Vectorised functions treat the end of an array as its middle."""
    rng = np.random.default_rng(2)
    places = {name: rng.random(1003) for name in PLACES}
    one_each = [f"{name}(s)" for name, (_, count) in FUNCTIONS.items() if count == 1]
    text = " + ".join([*one_each, "r**z", "atan2(r, z)", "s**2"])
    whole = evaluate(read(text), places)
    for begin, end in [(0, 1), (3, 8), (501, 502), (990, 1003)]:
        share = {name: values[begin:end].copy() for name, values in places.items()}
        assert evaluate(text, share).tobytes() == whole[begin:end].tobytes()
