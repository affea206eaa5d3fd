"""Numbers with units: what a case file may write where a quantity is expected.

A plain number is taken in SI. A string carries a unit, ``"6.72 km/s"``, and is
converted; a unit of the wrong dimension is refused. Inside the program every
quantity is a float in SI.
"""

from __future__ import annotations

import math
import re
import unicodedata
from contextlib import suppress
from dataclasses import dataclass
from decimal import Decimal
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any, get_args

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    GetJsonSchemaHandler,
    Strict,
)
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

if TYPE_CHECKING:
    import pint


_LONGEST = 100
"""Characters of a quantity; pint takes a units' product apart recursively."""

_NUMBER = re.compile(r"[+-]?([0-9](_?[0-9])*\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
_NOT_FINITE = {"-inf", "inf", "+inf", "nan"}
_UNIT_NAME = r"(?:[^\W\d_]+|%)"
_UNIT_FACTOR = rf"{_UNIT_NAME}(?:(?:\*\*|\^)?-?[0-9])?"
# A product or quotient of named units with small powers, as in "kg/m3". Keeping
# to this form keeps pint from evaluating arbitrary expressions.
_UNIT = re.compile(rf"{_UNIT_FACTOR}(?:\s*[*/·]\s*{_UNIT_FACTOR}|\s+{_UNIT_FACTOR})*")
_POWER = re.compile(r"(?<=[^\W\d_])(?:\*\*|\^)?(-?[0-9])")

_DIMENSION_NAMES = {
    "": "a number without a unit",
    "m": "a length",
    "s": "a time",
    "m/s": "a velocity",
    "Pa": "a pressure",
    "kg/m^3": "a density",
    "J/kg": "a specific energy",
    "K": "a temperature",
    "J/kg/K": "a specific heat",
    "J/m^2": "an energy per area",
}


class FrozenModel(BaseModel):
    """Base of every part of a case: immutable, and no unknown keys."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", use_attribute_docstrings=True
    )


COMMON_UNITS = """
nano- = 1e-9 = n-
micro- = 1e-6 = µ- = μ- = u-
milli- = 1e-3 = m-
centi- = 1e-2 = c-
kilo- = 1e3 = k-
mega- = 1e6 = M-
giga- = 1e9 = G-
meter = [length] = m
second = [time] = s
gram = [mass] = g
newton = kilogram * meter / second ** 2 = N
pascal = newton / meter ** 2 = Pa
joule = newton * meter = J
kelvin = [temperature] = K
"""
"""Units of nearly every case, in pint's language. To read all that pint knows takes
0.15 s, at every start; so that is a second resort."""


@lru_cache(maxsize=2)
def _registry(common: bool) -> pint.UnitRegistry[Any]:
    """Return the registry of `COMMON_UNITS`, or of all units that pint knows."""
    import pint  # here: only the rank that reads the case file needs it, and it is slow

    # Decimals make "9.53 mm" the double nearest to 0.00953: a product of two
    # doubles can miss it by a rounding, and the file could not be written back.
    if common:
        return pint.UnitRegistry(COMMON_UNITS.splitlines(), non_int_type=Decimal)
    return pint.UnitRegistry(non_int_type=Decimal)


@lru_cache(maxsize=256)
def conversion_factor(unit: str, si_unit: str, common: bool) -> Decimal:
    """Return the factor from `unit` to `si_unit`, or raise a pint error.

    Parameters
    ----------
    unit, si_unit : str
    common : bool
        Whether to know `COMMON_UNITS` only.
    """
    import pint

    registry = _registry(common)
    spelled = _POWER.sub(r"**\1", unit.replace("·", "*"))
    units = registry.parse_units(spelled)
    wanted = registry.parse_units(_POWER.sub(r"**\1", si_unit))
    if registry.Quantity(Decimal(0), units).to(wanted).magnitude != 0:
        raise pint.OffsetUnitCalculusError(unit)
    return Decimal(registry.Quantity(Decimal(1), units).to(wanted).magnitude)


def _checked_factor(unit: str, si_unit: str) -> Decimal:
    """Return the factor from `unit` to `si_unit`, or say why there is none."""
    import pint

    try:
        with suppress(pint.UndefinedUnitError):
            return conversion_factor(unit, si_unit, common=True)
        return conversion_factor(unit, si_unit, common=False)
    except pint.UndefinedUnitError:
        raise _failure(f"unknown unit {unit!r}", si_unit) from None
    except pint.DimensionalityError:
        raise _failure(f"{unit!r} is of another dimension", si_unit) from None
    except pint.OffsetUnitCalculusError:
        raise _failure(f"{unit!r} counts from another zero", si_unit) from None
    except (pint.PintError, ArithmeticError, ValueError, TypeError):
        raise _failure(f"cannot convert the unit {unit!r}", si_unit) from None


def _failure(problem: str, si_unit: str) -> PydanticCustomError:
    name = _DIMENSION_NAMES.get(si_unit, "a quantity")
    expected = f"{name} in {si_unit}" if si_unit else name
    # Passed as context, because the template must be a literal string.
    return PydanticCustomError(
        "quantity",
        "{problem}expected {expected}",
        {"problem": f"{problem}: " if problem else "", "expected": expected},
    )


@lru_cache(maxsize=4096)
def _parse(text: str, si_unit: str) -> float:
    """Return the SI value of a string such as ``"6.72 km/s"``."""
    if len(text) > _LONGEST:
        raise _failure(f"a string of {len(text)} characters", si_unit)
    text = text.strip()
    if text in _NOT_FINITE:
        return float(text)
    number = _NUMBER.match(text)
    if number is None:
        raise _failure("no number in the string", si_unit)
    unit = text[number.end() :].strip()
    if not unit and si_unit:
        raise _failure("the unit is missing", si_unit)
    if unit and _UNIT.fullmatch(unit) is None:
        raise _failure(f"cannot read the unit {unit!r}", si_unit)
    factor = _checked_factor(unit, si_unit) if unit else Decimal(1)
    try:
        return float(Decimal(number.group().replace("_", "")) * factor)
    except ArithmeticError:  # the exponent is beyond what Decimal takes
        raise _failure(f"cannot read the number {number.group()}", si_unit) from None


def is_quantity(text: str) -> bool:
    """Say whether a string is written as a number, with or without a unit."""
    text = text.strip()
    number = _NUMBER.match(text)
    if number is None:
        return text in _NOT_FINITE
    unit = text[number.end() :].strip()
    return not unit or _UNIT.fullmatch(unit) is not None


def si_value(value: object, si_unit: str, *, minus_infinity: bool = False) -> float:
    """Return a quantity as a float in SI.

    Parameters
    ----------
    value : object
        A number (taken in SI) or a string with a unit.
    si_unit : str
        The SI unit, such as ``"m/s"``; empty for a pure number.
    minus_infinity : bool
        Whether minus infinity is a legal value.

    Returns
    -------
    float
        The value in `si_unit`.

    Raises
    ------
    PydanticCustomError
        For anything else than a finite number of the right dimension; a
        ``ValueError`` that names the expected unit.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise _failure("", si_unit)
    try:
        number = _parse(value, si_unit) if isinstance(value, str) else float(value)
    except OverflowError:
        number = math.inf
    if math.isfinite(number) or (minus_infinity and number == -math.inf):
        return number
    raise _failure("must be finite", si_unit)


@dataclass(frozen=True)
class Quantity:
    """Annotation that makes a float field accept numbers and unit strings.

    Attributes
    ----------
    unit : str
        SI unit of the field; empty for a pure number.
    minus_infinity : bool
        Whether minus infinity is a legal value.
    """

    unit: str
    minus_infinity: bool = False

    def __get_pydantic_core_schema__(
        self, source: Any, handler: Any
    ) -> core_schema.CoreSchema:
        """Convert to SI before the float's own checks."""

        def convert(value: object) -> float:
            return si_value(value, self.unit, minus_infinity=self.minus_infinity)

        return core_schema.no_info_before_validator_function(convert, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Describe both forms, and the unit of the plain number."""
        number = dict(handler(schema))
        return {"anyOf": [number, {"type": "string"}], "unit": self.unit or "1"}


def check_melting(melting: float, reference: float) -> None:
    """Require matter that is solid at its reference temperature [K].

    Raises
    ------
    ValueError
    """
    if melting <= reference:
        raise ValueError(
            f"melting_temperature must exceed reference_temperature = {reference:g} K, "
            f"got {melting:g}"
        )


def one_line(text: str) -> str:
    """Return a text unchanged, or refuse line breaks and control characters.

    Titles and sources go to terminals, figures and files. Controls of the direction of
    writing, which show a text in another order than it has, are among those refused;
    the joiners that some scripts need are not.
    """
    for c in text if not text.isprintable() else "":
        if unicodedata.category(c) in _CONTROLS and c not in "\u200c\u200d":
            raise PydanticCustomError(
                "one_line", "expected one line without control characters"
            )
    return text


_CONTROLS = {"Cc", "Cf", "Cs", "Zl", "Zp"}
# Unicode's categories: control, format, surrogate, line and paragraph separators.


def not_blank(text: str) -> str:
    """Return a text unchanged, or refuse one without a visible character."""
    if not text.strip():
        raise PydanticCustomError("blank", "expected some text")
    return text


PROSE = "prose"
"""Marks texts for people: no part of what a case computes, nor of which case it is."""


def is_prose(field: FieldInfo) -> bool:
    """Say whether a field is a text for people, or a table of such."""
    inner = [getattr(part, "__metadata__", ()) for part in get_args(field.annotation)]
    return any(PROSE in marks for marks in (field.metadata, *inner))


# The bounds leave room for anything that is made of matter, and keep out slips of
# units and what arithmetic could not bear.
Flag = Annotated[bool, Strict()]
Count = Annotated[int, Strict(), Field(ge=1, le=1_000_000_000)]
IDENTIFIER_RULE = "expected letters, digits, - and _, beginning with a letter"
"""What a message says of a name that is no `Identifier`."""

Identifier = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]*$", max_length=80)]
Description = Annotated[str, Field(max_length=500), AfterValidator(one_line), PROSE]
Source = Annotated[Description, AfterValidator(not_blank)]
Title = Annotated[
    str,
    Field(max_length=200),
    AfterValidator(one_line),
    AfterValidator(not_blank),
    PROSE,
]

Positive = Annotated[float, Field(gt=0, le=100), Quantity("")]
NonNegative = Annotated[float, Field(ge=0, le=100), Quantity("")]
Fraction = Annotated[float, Field(gt=0, le=1), Quantity("")]
Elongation = Annotated[float, Field(gt=0, le=100), Quantity(""), PROSE]
"""No motion depends on it, so it is no part of which case it is."""
PositiveRatio = Annotated[float, Field(gt=0, le=1e9), Quantity("")]
NonNegativeRatio = Annotated[float, Field(ge=0, le=1e9), Quantity("")]
Position = Annotated[float, Field(ge=-1e6, le=1e6), Quantity("m")]
PositiveLength = Annotated[float, Field(ge=1e-9, le=1e6), Quantity("m")]
NonNegativeLength = Annotated[float, Field(ge=0, le=1e6), Quantity("m")]
PositiveTime = Annotated[float, Field(ge=1e-15, le=1e6), Quantity("s")]
NonNegativeTime = Annotated[float, Field(ge=0, le=1e6), Quantity("s")]
TimeOffset = Annotated[float, Field(ge=-1, le=1), Quantity("s")]
Velocity = Annotated[float, Field(ge=-1e6, le=1e6), Quantity("m/s")]
SoundSpeed = Annotated[float, Field(ge=1, le=1e6), Quantity("m/s")]
Pressure = Annotated[float, Field(ge=-1e15, le=1e15), Quantity("Pa")]
PositivePressure = Annotated[float, Field(ge=1, le=1e15), Quantity("Pa")]
NonNegativePressure = Annotated[float, Field(ge=0, le=1e15), Quantity("Pa")]
TensionLimit = Annotated[float, Field(le=0), Quantity("Pa", minus_infinity=True)]
Density = Annotated[float, Field(ge=1e-3, le=1e6), Quantity("kg/m^3")]
NonNegativeEnergy = Annotated[float, Field(ge=0, le=1e15), Quantity("J/kg")]
Temperature = Annotated[float, Field(ge=0, le=1e7), Quantity("K")]
HeatCapacity = Annotated[float, Field(ge=1, le=1e6), Quantity("J/kg/K")]
CrackEnergy = Annotated[float, Field(ge=0, le=1e9), Quantity("J/m^2")]
SpecificEnergy = Annotated[float, Field(ge=1, le=1e15), Quantity("J/kg")]
