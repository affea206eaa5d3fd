"""The fields that pictures can show, in one table: units, colours, limits.

It loads nothing that draws, so that the commands can list what there is.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mpisph.case import Case
from mpisph.core.errors import InputError
from mpisph.core.particles import FloatArray
from mpisph.core.words import counted
from mpisph.inputs.quantities import si_value
from mpisph.physics.response import MODEL_FIELDS

Arrays = Mapping[str, npt.NDArray[Any]]
"""As in `Snapshot.arrays`."""

MOST_FIELDS = 2
"""Of one picture: one above the axis, another below."""


class ShownField(NamedTuple):
    """A field as pictures show it, by colours along a scale or by those of names.

    Attributes
    ----------
    name : str
        As commands and files call it.
    label : str
        As colour bars and titles call it.
    unit : str
        Of the colour bar; empty for a pure number.
    si : str
        Its SI unit.
    scale : float
        One SI unit in `unit`.
    colours : str
        Colour map of matplotlib; empty where `names` says what the values are.
    needs : tuple of str
        Fields of a snapshot of which it is made.
    values : callable
        Returns it in SI, shape (n,), from the arrays of a snapshot.
    limits : tuple of float, optional
        Where its colours begin and end, in `unit`; by default where the run's values
        do.
    centred : bool, optional
        Whether the middle of its colours stands for zero.
    names : callable, optional
        Returns from a case what the values 0, 1, ... are.
    """

    name: str
    label: str
    unit: str
    si: str
    scale: float
    colours: str
    needs: tuple[str, ...]
    values: Callable[[Arrays], npt.NDArray[Any]]
    limits: tuple[float, float] | None = None
    centred: bool = False
    names: Callable[[Case], list[str]] | None = None

    @property
    def title(self) -> str:
        """Its label and unit."""
        return f"{self.label} [{self.unit}]" if self.unit else self.label

    def shown(self, arrays: Arrays, case: Case) -> FloatArray:
        """Return it in `unit`, shape (n,); NaN in bodies whose models do not give it.

        Parameters
        ----------
        arrays : mapping of str to ndarray
            As in `Snapshot.arrays`.
        case : Case
        """
        values = np.asarray(self.scale * self.values(arrays), np.float64)
        return np.where(np.array(self._given(case))[arrays["body"]], values, np.nan)

    def is_missing(self, case: Case) -> bool:
        """Say whether the models of a body do not give it."""
        return not all(self._given(case))

    def _given(self, case: Case) -> list[bool]:
        wanted = MODEL_FIELDS.intersection(self.needs)
        return [wanted <= case.body_models(body).fields for body in case.bodies]


class Chosen(NamedTuple):
    """A field to be shown.

    Attributes
    ----------
    field : ShownField
    limits : tuple of float or None
        Of its colours, in its `unit`; None for those that follow from the field.
    """

    field: ShownField
    limits: tuple[float, float] | None = None


def _of(name: str) -> Callable[[Arrays], npt.NDArray[Any]]:
    return lambda arrays: arrays[name]


def _speed(arrays: Arrays) -> FloatArray:
    return np.hypot(arrays["u_r"], arrays["u_z"])


def _body_names(case: Case) -> list[str]:
    return [body.name for body in case.bodies]


def _material_names(case: Case) -> list[str]:
    """Return the materials, with the equation of state where one has several."""
    names = [models.material for models in case.material_table]
    if len(set(names)) == len(names):
        return names
    return [f"{m.material}, {m.names['eos']}" for m in case.material_table]


_SHARE = (0.0, 1.0)

SHOWN_FIELDS: Mapping[str, ShownField] = {
    field.name: field
    for field in (
        ShownField(
            "pressure", "pressure", "GPa", "Pa", 1e-9, "berlin", ("P",), _of("P"),
            centred=True,
        ),
        ShownField(
            "density", "density", "g/cm³", "kg/m^3", 1e-3, "viridis", ("rho",),
            _of("rho"),
        ),
        ShownField(
            "speed", "speed", "km/s", "m/s", 1e-3, "viridis", ("u_r", "u_z"), _speed
        ),
        ShownField(
            "temperature", "temperature", "K", "K", 1.0, "inferno", ("T",), _of("T")
        ),
        ShownField(
            "energy", "internal energy", "MJ/kg", "J/kg", 1e-6, "magma", ("E",),
            _of("E"),
        ),
        ShownField(
            "damage", "damage", "", "", 1.0, "cividis", ("damage",), _of("damage"),
            limits=_SHARE,
        ),
        ShownField(
            "ductile-damage", "ductile damage", "", "", 1.0, "cividis",
            ("ductile_damage",), _of("ductile_damage"), limits=_SHARE,
        ),
        ShownField(
            "melt", "molten share", "", "", 1.0, "plasma", ("melt",), _of("melt"),
            limits=_SHARE,
        ),
        ShownField(
            "plastic-strain", "plastic strain", "", "", 1.0, "viridis",
            ("plastic_strain",), _of("plastic_strain"),
        ),
        ShownField(
            "distension", "distension", "", "", 1.0, "viridis", ("distension",),
            _of("distension"),
        ),
        ShownField(
            "h", "smoothing length", "mm", "m", 1e3, "cividis", ("h",), _of("h")
        ),
        ShownField(
            "body", "body", "", "", 1.0, "", ("body",), _of("body"), names=_body_names
        ),
        ShownField(
            "material", "material", "", "", 1.0, "", ("material",), _of("material"),
            names=_material_names,
        ),
    )
}  # fmt: skip
"""All, by their names."""

BODY = Chosen(SHOWN_FIELDS["body"])
"""What pictures show by default."""

_CONDITION = ("damage", "temperature")


def condition_fields(case: Case) -> tuple[Chosen, ...]:
    """Return what shows the condition of matter, as far as models of a case give it.

    That is damage, temperature, or both.
    """
    fields = (SHOWN_FIELDS[name] for name in _CONDITION)
    return tuple(Chosen(x) for x in fields if case.saved_fields.issuperset(x.needs))


def choose_fields(
    names: Sequence[str], ranges: Sequence[tuple[str, str]]
) -> tuple[Chosen, ...]:
    """Return the fields of a picture, the upper half's first.

    Parameters
    ----------
    names : sequence of str
        Of `SHOWN_FIELDS`.
    ranges : sequence of (str, str)
        Lower and upper limits of the first fields' colours, in SI or with units.

    Raises
    ------
    InputError
        If they are too many, or if a range is none.
    """
    if len(names) > MOST_FIELDS:
        raise InputError(
            f"--field: {len(names)} fields ({', '.join(names)}); a picture shows one, "
            "or two: one above the axis, another below"
        )
    if len(ranges) > len(names):
        times, fields = counted(len(ranges), "time"), counted(len(names), "field")
        raise InputError(f"--range: given {times} for {fields}")
    limits = [
        _range(SHOWN_FIELDS[name], *each)
        for name, each in zip(names, ranges, strict=False)
    ]
    limits += [None] * (len(names) - len(ranges))
    return tuple(
        Chosen(SHOWN_FIELDS[name], each)
        for name, each in zip(names, limits, strict=True)
    )


def _range(field: ShownField, *ends: str) -> tuple[float, float] | None:
    """Return the limits of a field's colours in its unit."""
    option = f"--range {' '.join(ends)}"
    if field.names is not None:
        raise InputError(f"{option}: {field.name} has names, and no range")
    try:
        low, high = (field.scale * si_value(_number(end), field.si) for end in ends)
    except ValueError as error:
        raise InputError(f"{option}: {field.name}: {error}") from None
    if low >= high:
        raise InputError(f"{option}: the first must be less than the second")
    return low, high


def _number(text: str) -> float | str:
    """Return a plain number as such; what has a unit is left as it is."""
    try:
        return float(text)
    except ValueError:
        return text


def require_fields(
    chosen: Sequence[Chosen], arrays: Mapping[str, object], where: object
) -> None:
    """Raise where a snapshot lacks what a field is made of.

    Parameters
    ----------
    chosen : sequence of Chosen
    arrays : mapping
        By the names of the snapshot's fields.
    where : object
        What the message names.

    Raises
    ------
    InputError
        With the fields that it has.
    """
    for field, _ in chosen:
        if not arrays.keys() >= set(field.needs):
            known = (f for f in SHOWN_FIELDS.values() if arrays.keys() >= {*f.needs})
            raise InputError(
                f"{where}: no {field.name}: no material has a model that gives it; "
                f"there are {', '.join(f.name for f in known)}"
            )
