"""What every material model is made of: constants, equations, and a place in a table.

A model is one file in the folder of its kind. It holds its constants, which are a table
of the same name in cards and cases, its equations, and a `Model` that names them; its
folder's ``MODELS`` lists it. All that depends on which models there are follows:
choices, schema, messages, the table of constants, and the calls.

Each equation of a model is a jitted function of ``(x, k, mat)`` and what its folder
names besides: the arrays of `particles.MaterialState`, the index of a particle, and its
row of the table of constants, in which ``mat.NAME`` are the model's own. Equations of
state take ``(rho, E, mat)``, for they are evaluated at other states too.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import Any, Literal, NamedTuple, get_args, get_origin

import numpy as np
import numpy.typing as npt
from pydantic.fields import FieldInfo

from mpisph.core.jitted import jitable
from mpisph.inputs.quantities import Quantity, is_prose
from mpisph.inputs.sourced import Sourced

Equation = Callable[..., Any]
Record = npt.NDArray[np.void]


class Model(NamedTuple):
    """A material model.

    Attributes
    ----------
    name : str
        As cases and cards choose it.
    label : str
        As reports call it.
    constants : type or None
        The model of its constants; None for a model without any.
    equations : mapping of str to callable
        Its jitted functions; which there are is up to the folder.
    fields : tuple of str, optional
        Particle fields that mean something with such a model alone. Snapshots carry
        them where a material uses one that names them.
    """

    name: str
    label: str
    constants: type[Sourced] | None
    equations: Mapping[str, Equation]
    fields: tuple[str, ...] = ()

    @property
    def attribute(self) -> str:
        """The name as an identifier: the column of the table of constants."""
        return self.name.replace("-", "_")


def load_models(package: str, modules: Sequence[str]) -> dict[str, Model]:
    """Return the models of a folder by their names.

    Parameters
    ----------
    package : str
        Dotted name of the folder.
    modules : sequence of str
        Its files, each with a ``MODEL``.
    """
    models = (import_module(f"{package}.{module}").MODEL for module in modules)
    return {model.name: model for model in models}


def choose(kind: str, equation: str, models: Mapping[str, Model]) -> Equation:
    """Return a function that calls an equation of the model that a material has chosen.

    It may be called from Python and from jitted functions, into which it is compiled as
    comparisons with the model's number; 2 ns a call with three models. Its third
    argument is the material's row.

    Parameters
    ----------
    kind : str
        Column of the table of constants that holds the number of the model.
    equation : str
        Key of `Model.equations`.
    models : mapping of str to Model
        All models of that kind, in the order of their numbers.
    """
    functions = [model.equations[equation] for model in models.values()]

    def chosen(x, k, mat, *more):
        return functions[getattr(mat, kind)](x, k, mat, *more)

    # Compiled functions cannot be taken from a list, so this is written out. Its name
    # is its own: Numba tells functions of a module apart by it. And of a module it must
    # be, or what is compiled cannot be kept.
    name = f"{kind}_{equation}"
    first, second, _, *more = inspect.signature(functions[0]).parameters
    given = ", ".join((first, second, "mat", *more))
    *others, last = range(len(functions))
    lines = [f"    if mat.{kind} == {n}: return of_{n}({given})\n" for n in others]
    text = f"def {name}({given}):\n{''.join(lines)}    return of_{last}({given})\n"
    names: dict[str, Any] = {f"of_{n}": each for n, each in enumerate(functions)}
    names["__name__"] = __name__
    exec(text, names)  # noqa: S102
    return jitable(chosen, names[name])


class Constant(NamedTuple):
    """One constant of a model.

    Attributes
    ----------
    name : str
    value : float or str
        In SI; some are words.
    unit : str
    """

    name: str
    value: float | str
    unit: str


def described(constants: Sourced) -> list[Constant]:
    """Return the constants of a model with their units."""
    found = []
    for name, field in _fields(type(constants)).items():
        units = [q.unit for q in field.metadata if isinstance(q, Quantity)]
        found.append(Constant(name, getattr(constants, name), *(units or [""])))
    return found


def record_type(constants: type[Sourced]) -> np.dtype[Any]:
    """Return the structured type of a model's constants; words go by their number."""
    kinds = [
        (name, np.int64 if _words(field) or field.annotation is int else np.float64)
        for name, field in _numbers(constants).items()
    ]
    kinds += [(name, np.float64) for name in constants.DERIVED]
    arrays = [(name, np.float64, shape) for name, shape in constants.ARRAYS.items()]
    return np.dtype((np.record, [*kinds, *arrays]))


def record(constants: Sourced, rho0: float = 0.0) -> tuple[Any, ...]:
    """Return constants in the order of `record_type`.

    Parameters
    ----------
    constants : Sourced
    rho0 : float
        Reference density of the material [kg/m3], on which arrays alone depend.
    """
    fields = _numbers(type(constants))
    values = ((getattr(constants, name), _words(fields[name])) for name in fields)
    given = tuple(words.index(v) if words else v for v, words in values)
    derived = tuple(getattr(constants, name) for name in constants.DERIVED)
    return given + derived + tuple(constants.arrays(rho0).values())


def _fields(constants: type[Sourced]) -> dict[str, FieldInfo]:
    """Return the fields that are constants, and no prose."""
    fields = constants.model_fields.items()
    return {name: x for name, x in fields if name != "sources" and not is_prose(x)}


def _numbers(constants: type[Sourced]) -> dict[str, FieldInfo]:
    """Return the constants with which one calculates."""
    fields = _fields(constants).items()
    return {name: field for name, field in fields if field.annotation is not str}


def _words(field: FieldInfo) -> tuple[str, ...]:
    """Return the words that a field may be, none for a number."""
    kind = field.annotation
    return get_args(kind) if get_origin(kind) is Literal else ()
