"""The particles of one rank and the table of their fields.

One table drives allocation, packing, migration, the halo and the files: a new field is
one line of `FIELDS`.
"""

import collections
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

Role = Literal["label", "state", "history", "rate", "derived"]


class Field(NamedTuple):
    """One particle field.

    Attributes
    ----------
    name : str
        Attribute name on `Particles`.
    symbol : str
        Symbol in the equations.
    unit : str
        SI unit.
    meaning : str
        One line for people and for the files.
    role : {"label", "state", "history", "rate", "derived"}
        Labels are integers that never change; states are integrated, and rates are
        their time derivatives; history is what material models carry on from step to
        step; derived fields follow from the others.
    exchanged : bool
        True where a ghost needs the field.
    saved : bool
        True where snapshots carry the field, if it means something with the models of
        the case.
    """

    name: str
    symbol: str
    unit: str
    meaning: str
    role: Role
    exchanged: bool
    saved: bool


FIELDS = (
    Field("id", "id", "1", "global number of the particle", "label", True, True),
    Field("body", "body", "1", "index of the body in the case", "label", False, True),
    Field("material", "mat", "1", "index of the material", "label", True, True),
    Field("m", "m", "kg", "mass of the ring", "state", True, True),
    Field("r", "r", "m", "radius", "state", True, False),
    Field("z", "z", "m", "axial position", "state", True, False),
    Field("u_r", "u_r", "m/s", "radial velocity", "state", True, True),
    Field("u_z", "u_z", "m/s", "axial velocity", "state", True, True),
    Field("rho", "rho", "kg/m3", "density", "state", True, True),
    Field("E", "E", "J/kg", "specific internal energy", "state", True, True),
    Field("S_rr", "S_rr", "Pa", "deviatoric stress rr", "state", True, True),
    Field("S_zz", "S_zz", "Pa", "deviatoric stress zz", "state", True, True),
    Field("S_rz", "S_rz", "Pa", "deviatoric stress rz", "state", True, True),
    Field("h", "h", "m", "smoothing length", "state", True, True),
    Field(
        "plastic_strain",
        "eps_p",
        "1",
        "equivalent plastic strain",
        "history",
        False,
        True,
    ),
    Field("plastic_work", "w_p", "J/kg", "plastic work", "history", False, True),
    Field(
        "ductile_damage",
        "D_d",
        "1",
        "share of the strain to fracture used up",
        "history",
        False,
        True,
    ),
    Field(
        "damage", "D", "1", "lost share of tension and shear", "history", False, True
    ),
    Field(
        "opening", "o", "1", "share of a crack's last opening", "history", False, True
    ),
    Field(
        "distension",
        "alpha",
        "1",
        "volume with pores over that of the solid",
        "history",
        False,
        True,
    ),
    Field("du_r", "du_r/dt", "m/s2", "radial acceleration", "rate", False, False),
    Field("du_z", "du_z/dt", "m/s2", "axial acceleration", "rate", False, False),
    Field("drho", "drho/dt", "kg/m3/s", "rate of density", "rate", False, False),
    Field("dE", "dE/dt", "W/kg", "rate of internal energy", "rate", False, False),
    Field("dS_rr", "dS_rr/dt", "Pa/s", "rate of S_rr", "rate", False, False),
    Field("dS_zz", "dS_zz/dt", "Pa/s", "rate of S_zz", "rate", False, False),
    Field("dS_rz", "dS_rz/dt", "Pa/s", "rate of S_rz", "rate", False, False),
    Field("dh", "dh/dt", "m/s", "rate of smoothing length", "rate", False, False),
    Field("div", "div u", "1/s", "velocity divergence", "derived", True, False),
    Field("ddiv", "d(div u)/dt", "1/s2", "rate of div u", "derived", False, False),
    Field("P", "P", "Pa", "pressure", "derived", True, True),
    Field("c", "c", "m/s", "sound speed", "derived", True, False),
    Field("G", "G", "Pa", "shear modulus", "derived", False, False),
    Field("plastic", "plastic", "1", "1 while yielding", "derived", False, True),
    Field("T", "T", "K", "temperature", "derived", False, True),
    Field("melt", "f_m", "1", "molten share of the mass", "derived", False, True),
    Field("w_r", "w_r", "m/s", "u_r that the rates hold for", "derived", False, False),
    Field("w_z", "w_z", "m/s", "u_z that the rates hold for", "derived", False, False),
    Field("B_rr", "B_rr", "1", "correction of the gradient rr", "derived", True, False),
    Field("B_tt", "B_tt", "1", "correction of the gradient tt", "derived", True, False),
    Field("B_rz", "B_rz", "1", "correction of the gradient rz", "derived", True, False),
    Field("B_zz", "B_zz", "1", "correction of the gradient zz", "derived", True, False),
    Field("dB_rr", "dB_rr/dt", "1/s", "rate of B_rr", "derived", False, False),
    Field("dB_tt", "dB_tt/dt", "1/s", "rate of B_tt", "derived", False, False),
    Field("dB_rz", "dB_rz/dt", "1/s", "rate of B_rz", "derived", False, False),
    Field("dB_zz", "dB_zz/dt", "1/s", "rate of B_zz", "derived", False, False),
    Field("damping", "v", "m/s", "viscous signal speed", "derived", False, False),
    Field("crowding", "w", "1", "kernel sum over density", "derived", False, True),
    Field("retired", "x", "1", "1 once it has left the game", "derived", False, True),
    Field("neighbours", "N", "1", "number of neighbours", "derived", False, False),
)

LABELS = tuple(f.name for f in FIELDS if f.role == "label")
VALUES = tuple(f.name for f in FIELDS if f.role != "label")

_namedtuple: Any = collections.namedtuple  # of fields that follow the table

LABEL: Any = _namedtuple("LABEL", LABELS)(*range(len(LABELS)))
"""Row of each label in `Particles.labels`, by its name."""

VALUE: Any = _namedtuple("VALUE", VALUES)(*range(len(VALUES)))
"""Row of each other field in `Particles.values`, by its name. A jitted function that is
given the two arrays is called in 1 us, one that is given thirty rows in 8."""

INTEGRATED = ("u_r", "u_z", "rho", "E", "S_rr", "S_zz", "S_rz", "h")
"""Fields that have a rate; `FIELDS` lists them, and their rates, in this order."""

_INTEGRATED = slice(VALUE.u_r, VALUE.h + 1)
_RATES = slice(VALUE.du_r, VALUE.dh + 1)
HISTORY = tuple(f.name for f in FIELDS if f.role == "history")

INITIAL = tuple(f.name for f in FIELDS if f.role in {"label", "state", "history"})
"""Fields that a run starts from; all others follow from them."""

_RATE_NAMES = tuple(f.name for f in FIELDS if f.role == "rate")
RATE: Any = _namedtuple("RATE", _RATE_NAMES)(*range(len(_RATE_NAMES)))
"""Row of each rate, by its name; that of an integrated field is the same."""

RESPONSE = ("P", "c", "G", "plastic", "T", "melt")
"""Derived fields that material models set."""

_GIVEN = ("id", "material", "m", "r")

MaterialState: Any = _namedtuple(
    "MaterialState", (*_GIVEN, *INTEGRATED, *HISTORY, *RESPONSE)
)
"""What material models read and set of particles, each of shape (n,)."""

CORRECTION = ("B_rr", "B_tt", "B_rz", "B_zz")
"""Correction of the gradient (R3); `FIELDS` lists it in this order."""

_CORRECTION = slice(VALUE.B_rr, VALUE.B_zz + 1)
_CORRECTION_RATES = slice(VALUE.dB_rr, VALUE.dB_zz + 1)
_STRESS = slice(VALUE.S_rr, VALUE.S_rz + 1)


class Particles:
    """The particles that one rank owns, as a struct of arrays.

    Each field of `FIELDS` is an attribute, a contiguous row view of `labels` (int64) or
    of `values` (float64).

    Parameters
    ----------
    labels : ndarray of int64, shape (len(LABELS), n)
    values : ndarray of float64, shape (len(VALUES), n)
    """

    # By their names, for those who read the code; `FIELDS` is what counts.
    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Return a field; `labels` are int64, `values` float64."""

    def __init__(self, labels: IntArray, values: FloatArray) -> None:
        self.labels = labels
        self.values = values
        for row, name in enumerate(LABELS):
            setattr(self, name, labels[row])
        for row, name in enumerate(VALUES):
            setattr(self, name, values[row])

    @classmethod
    def zeros(cls, n: int) -> "Particles":
        """Make `n` particles with all fields zero."""
        return cls(np.zeros((len(LABELS), n), np.int64), np.zeros((len(VALUES), n)))

    @property
    def n(self) -> int:
        """Number of particles owned."""
        return int(self.labels.shape[1])

    @property
    def integrated(self) -> FloatArray:
        """The fields of `INTEGRATED` as one view, shape (8, n)."""
        return self.values[_INTEGRATED]

    @property
    def rates(self) -> FloatArray:
        """The rates of `integrated`, shape (8, n)."""
        return self.values[_RATES]

    def material_state(self) -> Any:
        """Return the `MaterialState` of these particles."""
        return MaterialState(*(getattr(self, n) for n in MaterialState._fields))

    @property
    def correction(self) -> FloatArray:
        """B_rr, B_tt, B_rz, B_zz as one view, shape (4, n)."""
        return self.values[_CORRECTION]

    @property
    def correction_rates(self) -> FloatArray:
        """The rates of `correction`, shape (4, n)."""
        return self.values[_CORRECTION_RATES]

    @property
    def stress(self) -> FloatArray:
        """S_rr, S_zz, S_rz as one view, shape (3, n)."""
        return self.values[_STRESS]

    def take(self, index: npt.NDArray[np.intp] | npt.NDArray[np.bool_]) -> "Particles":
        """Return the particles at `index` (positions or a mask), copied."""
        if index.dtype == np.bool_:
            index = np.flatnonzero(index)
        # Indexed as an array, each would be copied twice.
        return Particles(
            self.labels.take(index, axis=1), self.values.take(index, axis=1)
        )

    def reorder(self, order: npt.NDArray[np.intp]) -> None:
        """Put the particles into another order, in place: row by row, to save room."""
        for rows in (self.labels, self.values):
            for row in rows:
                row[:] = row[order]

    def pack(self) -> FloatArray:
        """Return all fields as one float64 array, shape (fields, n).

        Labels keep their bits (they are viewed as float64, not converted), so
        that one message carries everything.
        """
        return np.concatenate([self.labels.view(np.float64), self.values])

    @classmethod
    def unpack(cls, packed: Iterable[FloatArray]) -> "Particles":
        """Join arrays made by `pack`, in the order given."""
        joined = np.concatenate(list(packed), axis=1)
        k = len(LABELS)
        return cls(joined[:k].view(np.int64), joined[k:])
