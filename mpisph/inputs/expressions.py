"""Numbers that differ from particle to particle: expressions in a case file.

An expression is checked in full when a file is read: every name, function and number of
arguments, each fault with its place in the text. simpleeval then evaluates it, on whole
arrays; of Python it is left with arithmetic, comparisons and the functions below.
Everything is a double: a power too large is infinite at once, and is refused with the
particle that has it.
"""

from __future__ import annotations

import ast
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache, reduce
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, NoReturn

import numpy as np
import numpy.typing as npt
from pydantic import GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from mpisph.inputs.quantities import is_quantity, one_line, si_value
from mpisph.inputs.spelling import nearest

if TYPE_CHECKING:
    from simpleeval import SimpleEval

__all__ = ["FUNCTIONS", "VARIABLES", "Profile", "evaluate"]

FloatArray = npt.NDArray[np.float64]

VARIABLES = {
    "r": "distance from the axis",
    "z": "axial position",
    "s": "distance from the centre of the body",
}
"""What an expression may depend on, in metres."""

CONSTANTS = {"pi": np.pi}

FUNCTIONS: Mapping[str, tuple[Callable[..., Any], int]] = {
    "abs": (np.abs, 1),
    "sqrt": (np.sqrt, 1),
    "exp": (np.exp, 1),
    "log": (np.log, 1),
    "sin": (np.sin, 1),
    "cos": (np.cos, 1),
    "tan": (np.tan, 1),
    "sinh": (np.sinh, 1),
    "cosh": (np.cosh, 1),
    "tanh": (np.tanh, 1),
    "atan2": (np.arctan2, 2),
    "min": (np.minimum, 2),
    "max": (np.maximum, 2),
    "where": (np.where, 3),
}
"""Functions of an expression, each with its number of arguments."""

_OPERATORS: Mapping[type[ast.AST], Callable[..., Any]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Pow: np.power,
    ast.UAdd: np.positive,
    ast.USub: np.negative,
    ast.Not: np.logical_not,
    ast.And: np.logical_and,
    ast.Or: np.logical_or,
    ast.Lt: np.less,
    ast.LtE: np.less_equal,
    ast.Gt: np.greater,
    ast.GtE: np.greater_equal,
}

_LONGEST = 500
"""Characters of an expression."""

_DEEPEST = 100
"""Levels of an expression, which are taken apart by functions that call themselves."""

_HINTS: Mapping[type[ast.AST], str] = {
    ast.BitXor: "a power is written **",
    ast.IfExp: "write where(condition, value, other value)",
    ast.Eq: "compare with <, <=, > or >=",
    ast.NotEq: "compare with <, <=, > or >=",
}


def evaluate(text: str, variables: Mapping[str, FloatArray]) -> FloatArray:
    """Return the values of an expression that has been read with a `Profile`.

    Parameters
    ----------
    text : str
    variables : mapping of str to ndarray, shape (n,)
        `VARIABLES` by their names [m].

    Returns
    -------
    ndarray, shape (n,)
        What arithmetic makes of it; it may be infinite, or no number.
    """
    (n,) = {values.size for values in variables.values()}
    with np.errstate(all="ignore"):
        value = _evaluator(variables).eval(text, _parse(text))
    return np.array(np.broadcast_to(np.asarray(value, np.float64), (n,)))


def _evaluator(variables: Mapping[str, FloatArray]) -> SimpleEval:
    """Return what evaluates the nodes that `_check` lets pass, and no others."""
    from simpleeval import SimpleEval  # here: most cases have no expression

    functions = {name: function for name, (function, _) in FUNCTIONS.items()}
    names = {**variables, **CONSTANTS}
    evaluator = SimpleEval(dict(_OPERATORS), functions, names)

    def comparison(node: ast.Compare) -> Any:
        sides = [evaluator._eval(side) for side in (node.left, *node.comparators)]
        pairs = zip(node.ops, sides, sides[1:], strict=False)
        found = [_OPERATORS[type(op)](one, other) for op, one, other in pairs]
        return reduce(np.logical_and, found)

    def combination(node: ast.BoolOp) -> Any:
        return reduce(_OPERATORS[type(node.op)], map(evaluator._eval, node.values))

    own: dict[type[ast.AST], Callable[..., Any]] = {
        ast.Constant: lambda node: np.float64(node.value),
        ast.Compare: comparison,
        ast.BoolOp: combination,
    }
    kept = (ast.Name, ast.UnaryOp, ast.BinOp, ast.Call)
    evaluator.nodes = {**{kind: evaluator.nodes[kind] for kind in kept}, **own}
    return evaluator


@lru_cache(maxsize=256)
def _parse(text: str) -> ast.expr:
    """Return the tree of a sound expression, or raise what is wrong and where."""
    if len(text) > _LONGEST:
        _refuse(f"{len(text)} characters, of {_LONGEST} at most")
    body = text.lstrip()
    before = len(text) - len(body)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(body, mode="eval").body
    except SyntaxError as error:
        place = before + error.offset if error.offset else len(text)  # 0 is the end
        _refuse(f"{error.msg} at character {place}")
    except (MemoryError, RecursionError, ValueError):
        _refuse("it cannot be taken apart")
    for node, depth in sorted(_nodes(tree), key=lambda found: found[0].col_offset):
        fault = _Fault("nested too deeply") if depth > _DEEPEST else _fault(node)
        if fault is not None:
            line = body.encode()[: node.col_offset]
            place = before + len(line.decode(errors="replace")) + 1
            hint = f" ({fault.hint})" if fault.hint else ""
            _refuse(f"{fault.what} at character {place}{hint}")
    return tree


class _Fault(NamedTuple):
    """What is wrong with a part of an expression, and what to do."""

    what: str
    hint: str = ""


def _nodes(tree: ast.expr) -> Iterator[tuple[ast.expr, int]]:
    """Yield all expressions within one, and itself, with their depths."""
    waiting = [(tree, 1)]
    while waiting:
        node, depth = waiting.pop(0)
        yield node, depth
        waiting += [
            (child, depth + 1)
            for child in ast.iter_child_nodes(node)
            if isinstance(child, ast.expr) and not _is_function(node, child)
        ]


def _is_function(node: ast.AST, child: ast.AST) -> bool:
    """Say whether a child is the function that a node calls, which has no value."""
    return isinstance(node, ast.Call) and child is node.func


def _fault(node: ast.expr) -> _Fault | None:
    """Return what is wrong with an expression, apart from those within it."""
    match node:
        case ast.Constant(value=bool() | complex() | str() | bytes() | None):
            return _Fault(f"{node.value!r} is no number")
        case ast.Constant(value=int() | float() as value):
            return None if _is_finite(value) else _Fault("a number too large")
        case ast.Name(id=name):
            known = [*VARIABLES, *CONSTANTS]
            return None if name in known else _unknown("name", name, known)
        case ast.Call():
            return _fault_of_call(node)
        case ast.UnaryOp(op=op) | ast.BinOp(op=op) | ast.BoolOp(op=op):
            return _fault_of_operators(op)
        case ast.Compare(ops=ops):
            return _fault_of_operators(*ops)
    return _Fault("no part of an expression", _HINTS.get(type(node), ""))


def _fault_of_call(node: ast.Call) -> _Fault | None:
    if not isinstance(node.func, ast.Name) or node.func.id not in FUNCTIONS:
        return _unknown("function", ast.unparse(node.func), list(FUNCTIONS))
    if node.keywords:
        return _Fault("an argument with a name")
    _, wanted = FUNCTIONS[node.func.id]
    if len(node.args) != wanted:
        return _Fault(f"{node.func.id} takes {wanted}, not {len(node.args)} values")
    return None


def _fault_of_operators(*operators: ast.AST) -> _Fault | None:
    for operator in operators:
        if type(operator) not in _OPERATORS:
            hint = _HINTS.get(type(operator), "there are + - * / ** < <= > >=")
            return _Fault("an unknown operator", hint)
    return None


def _is_finite(value: float) -> bool:
    try:
        return bool(np.isfinite(float(value)))
    except OverflowError:
        return False


def _unknown(what: str, name: str, known: list[str]) -> _Fault:
    """Return that there is no such name or function, and which there are."""
    guess = nearest(name, known)
    hint = f"did you mean {guess}?" if guess else f"there are {', '.join(known)}"
    return _Fault(f"no {what} {name}", hint)


def _refuse(problem: str) -> NoReturn:
    raise PydanticCustomError(
        "expression",
        "{problem}: expected a quantity, or an expression in {names} (m)",
        {"problem": problem, "names": ", ".join(VARIABLES)},
    )


@dataclass(frozen=True)
class Profile:
    """Annotation of a quantity that may be an expression, in SI units throughout.

    Attributes
    ----------
    unit : str
        SI unit of the value.
    low, high : float
        Bounds of a number, and of an expression at every particle.
    """

    unit: str
    low: float
    high: float

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        """Take a string that is no quantity for an expression, and check it."""

        def read(value: object, number: Any) -> float | str:
            if isinstance(value, str) and not is_quantity(value):
                _parse(one_line(value))
                return value
            return float(number(si_value(value, self.unit)))

        return core_schema.no_info_wrap_validator_function(
            read,
            core_schema.float_schema(ge=self.low, le=self.high),
            serialization=core_schema.plain_serializer_function_ser_schema(
                lambda value: value
            ),
        )

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Describe both forms, and the unit of both."""
        number = {"type": "number", "minimum": self.low, "maximum": self.high}
        string = {"type": "string", "maxLength": _LONGEST}
        return {"anyOf": [number, string], "unit": self.unit}


VELOCITIES = Profile("m/s", -1e6, 1e6)
DENSITIES = Profile("kg/m^3", 1e-3, 1e6)
ENERGIES = Profile("J/kg", 0.0, 1e15)

VelocityProfile = Annotated[float | str, VELOCITIES]
DensityProfile = Annotated[float | str, DENSITIES]
EnergyProfile = Annotated[float | str, ENERGIES]
