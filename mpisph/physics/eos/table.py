"""A tabulated equation of state (R20): pressure and energy by density, temperature.

It is read at the densities of the table, over the energy above its lowest isotherm.
Cubics that never overshoot (Fritsch and Carlson) join the densities, and straight lines
the energies, so that the pressure rises wherever that of the table does.

References
----------
Fritsch, Carlson (1980), SIAM Journal on Numerical Analysis 17, 238.
Lyon, Johnson (1992), LANL report LA-UR-92-3407: the SESAME tables.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import json
import math
import zlib
from collections.abc import Mapping
from functools import lru_cache
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator

from mpisph.core.jit import ENTRY, EXACT
from mpisph.core.jitted import jitted
from mpisph.inputs.quantities import PROSE, Temperature
from mpisph.inputs.sourced import Sourced
from mpisph.physics.models import Model, record_type

FloatArray = npt.NDArray[np.float64]

MOST = 256
"""Densities or temperatures of a table."""

ENERGIES = 96
"""Energies at which a table is read."""

LARGEST_CONTENT = 400_000
"""Characters of a packed table."""

_DIGITS = 16
_NEAREST = 1e-6
# Least energy above the lowest isotherm, of the largest one, that is told apart.

_GAS = 0.1
# Of the bulk modulus at the reference state: matter of more pressure is a gas.


class States(NamedTuple):
    """What a table holds, in SI.

    Attributes
    ----------
    density : ndarray, shape (n,)
        Rising [kg/m3].
    temperature : ndarray, shape (m,)
        Rising [K].
    pressure, energy : ndarray, shape (n, m)
        [Pa] and [J/kg]; the energy rises with temperature.
    """

    density: FloatArray
    temperature: FloatArray
    pressure: FloatArray
    energy: FloatArray

    def packed(self) -> str:
        """Return the table as a short text, which keeps every bit."""
        text = json.dumps([values.tolist() for values in self], separators=(",", ":"))
        return base64.b64encode(zlib.compress(text.encode(), 9)).decode()

    def digest(self) -> str:
        """Return what tells tables with different numbers apart."""
        whole = hashlib.sha256()
        for values in self:
            whole.update(np.ascontiguousarray(values, np.float64).tobytes())
        return whole.hexdigest()[:_DIGITS]

    def mistake(self) -> tuple[str, tuple[int, ...]] | None:
        """Return what makes the table useless, and the indices of the place."""
        for name in ("density", "temperature"):
            axis = getattr(self, name)
            if np.count_nonzero(axis) < 2 or axis.size > MOST:
                return f"{axis.size} values of {name}; expected 2 to {MOST}", ()
        for name, values in self._asdict().items():
            wrong = np.argwhere(~np.isfinite(values))
            if wrong.size:
                return f"{name}: no finite number", tuple(wrong[0].tolist())
        for name, least in (("density", 0.0), ("temperature", 0.0)):
            axis = getattr(self, name)
            fall = np.flatnonzero(np.diff(axis) <= 0.0)
            if fall.size:
                text = f"{name}: {axis[fall[0] + 1]:g} follows {axis[fall[0]]:g}"
                return f"{text}; expected rising values", (int(fall[0]) + 1,)
            if axis[0] < least:
                return f"{name}: expected at least 0, found {axis[0]:g}", (0,)
        fall2 = np.argwhere(np.diff(self.energy, axis=1) <= 0.0)
        if fall2.size:
            i, j = fall2[0].tolist()
            text = (
                f"energy: at {self.density[i]:g} kg/m3 it does not rise from "
                f"{self.temperature[j]:g} K to {self.temperature[j + 1]:g} K"
            )
            return f"{text}; expected a positive heat capacity", (i, j + 1)
        return None


def unpacked(content: str) -> States:
    """Return the table that `States.packed` has packed.

    Raises
    ------
    ValueError
        If it is none.
    """
    try:
        text = zlib.decompress(base64.b64decode(content, validate=True))
        states = States(*(np.array(part, np.float64) for part in json.loads(text)))
        shape = (states.density.size, states.temperature.size)
        sound = states.pressure.shape == states.energy.shape == shape
    except (binascii.Error, zlib.error, ValueError, TypeError, RecursionError):
        sound = False
    if not sound:
        raise ValueError("content: it is no packed table")
    mistake = states.mistake()
    if mistake is not None:
        raise ValueError(f"content: {mistake[0]}")
    return states


class Tabulated(Sourced):
    """Constants of a tabulated equation of state (R20)."""

    file: Annotated[str, Field(min_length=1, max_length=4000), PROSE] | None = None
    """File of the table; it is read with the case and kept as `content`."""
    reference_temperature: Temperature = 300.0
    """Temperature of the state of zero energy, at the reference density."""
    digest: Annotated[str, Field(pattern="^[0-9a-f]*$", max_length=_DIGITS)] = ""
    """Of the numbers of the table; filled in."""
    content: Annotated[str, Field(max_length=LARGEST_CONTENT), PROSE] = ""
    """The numbers of the table, packed; filled in."""

    DERIVED: ClassVar[tuple[str, ...]] = ("cells",)
    ARRAYS: ClassVar[Mapping[str, tuple[int, ...]]] = {
        "density": (MOST,),
        "cold": (MOST,),
        "cold_slope": (MOST,),
        "least": (1,),
        "energy": (ENERGIES,),
        "pressure": (MOST, ENERGIES),
        "slope": (MOST, ENERGIES),
    }

    @model_validator(mode="before")
    @classmethod
    def _fill_digest(cls, data: Any) -> Any:
        """Check the table, and name it by its numbers."""
        if not isinstance(data, Mapping) or not isinstance(data.get("content"), str):
            return data
        digest = unpacked(data["content"]).digest()
        if data.get("digest", digest) != digest:
            raise ValueError("content: its numbers are not those of the digest")
        return {**data, "digest": digest}

    @model_validator(mode="after")
    def _check_content(self) -> Tabulated:
        """Require the table, which the reader of a card puts in the place of a file."""
        if not self.content:
            raise ValueError("file: required, the file of the table")
        return self

    @property
    def states(self) -> States:
        """The numbers of the table."""
        return unpacked(self.content)

    @property
    def cells(self) -> float:
        """Intervals between densities that are not zero."""
        density = self.states.density
        return float(np.count_nonzero(density) - 1)

    def mistake(self, rho0: float) -> str | None:
        """Return why the table has no reference state; None where it has."""
        states = self.states
        T = self.reference_temperature
        for name, value, axis, unit in (
            ("rho0", rho0, states.density, "kg/m3"),
            ("reference_temperature", T, states.temperature, "K"),
        ):
            if not axis[0] <= value <= axis[-1]:
                text = f"the table has {axis[0]:g} to {axis[-1]:g} {unit}"
                return f"{name} = {value:g} {unit} is no state of it: {text}"
        if not self._stiffness(rho0) > 0.0:
            return f"its pressure falls with density at rho0 = {rho0:g} kg/m3"
        return None

    def bulk_sound_speed(self, rho0: float) -> float:
        """Return the sound speed at the reference state [m/s]."""
        return math.sqrt(max(self._stiffness(rho0), 1.0))

    def reference_pressure(self, rho0: float) -> float:
        """Return the pressure at the reference state [Pa]."""
        return float(self._at_rest(rho0)[0])

    def is_gas(self, rho0: float) -> bool:
        """Say whether the matter expands from its reference state by itself."""
        return self.reference_pressure(rho0) > _GAS * rho0 * self._stiffness(rho0)

    def arrays(self, rho0: float) -> dict[str, FloatArray]:
        """Return the table as it is looked up, with zero energy at the reference."""
        return _arrays(self.content, self.reference_temperature, rho0)

    def _stiffness(self, rho0: float) -> float:
        """Return the square of the sound speed at the reference state [m2/s2]."""
        P, dP_drho, dP_dE = self._at_rest(rho0)
        return float(dP_drho + P / rho0**2 * dP_dE)

    def _at_rest(self, rho0: float) -> tuple[float, float, float]:
        row = np.zeros(1, record_type(type(self)))[0]
        row["cells"] = self.cells
        for name, values in self.arrays(rho0).items():
            row[name][...] = values
        P, dP_drho, dP_dE = tabulated(rho0, 0.0, row)
        return float(P), float(dP_drho), float(dP_dE)


@lru_cache(maxsize=16)
def _arrays(content: str, T_ref: float, rho0: float) -> dict[str, FloatArray]:
    """Return a table by density and by energy above its lowest isotherm."""
    from scipy.interpolate import PchipInterpolator

    states = unpacked(content)
    first = int(states.density[0] == 0.0)  # matter of no density has no pressure
    density, temperature, pressure, energy = states
    density, pressure, energy = density[first:], pressure[first:], energy[first:]
    cold, above = energy[:, 0], energy - energy[:, :1]
    # Close where the isotherms are, and up to the hottest of them.
    nearest = min(above[:, 1].min(), above.max() / ENERGIES)
    nearest = max(nearest, _NEAREST * above.max())
    nodes = np.geomspace(nearest, above.max(), ENERGIES - 1)
    nodes = np.concatenate([[0.0], nodes])
    resampled = np.empty((density.size, ENERGIES))
    for i, (E, P) in enumerate(zip(above, pressure, strict=True)):
        last = (P[-1] - P[-2]) / (E[-1] - E[-2])
        # Straight lines keep the order of pressures at two densities, cubics do not.
        resampled[i] = np.interp(nodes, E, P) + last * np.maximum(nodes - E[-1], 0.0)
    slopes = PchipInterpolator(density, resampled).derivative()(density)
    cold_curve = PchipInterpolator(density, cold)
    T_energies = PchipInterpolator(temperature, energy, axis=1)(T_ref)
    reference = float(PchipInterpolator(density, T_energies)(rho0))
    n = density.size
    found = {name: np.zeros(shape) for name, shape in Tabulated.ARRAYS.items()}
    found["density"][:n] = density
    found["cold"][:n] = cold - reference
    found["cold_slope"][:n] = cold_curve.derivative()(density)
    found["least"][0] = min(pressure.min(), 0.0)
    found["energy"][:] = nodes
    found["pressure"][:n] = resampled
    found["slope"][:n] = slopes
    return found


@jitted(**EXACT)
def cell_of(x, axis, cells):
    """Return the interval of a rising axis in which x lies, the nearest outside."""
    low, high = 0, cells
    while high - low > 1:
        middle = (low + high) // 2
        if axis[middle] <= x:
            low = middle
        else:
            high = middle
    return low


@jitted(**EXACT)
def cubic(s, width, a, b, da, db):
    """Return a cubic, and its derivative, by values and slopes at both ends (R20).

    Parameters
    ----------
    s : float
        From 0 to 1 between the ends.
    width : float
        Of the interval.
    a, b, da, db : float
        Values, and slopes with the variable.
    """
    da, db = da * width, db * width
    rise = b - a
    third = da + db - 2.0 * rise
    second = 3.0 * rise - 2.0 * da - db
    value = a + s * (da + s * (second + s * third))
    return value, (da + s * (2.0 * second + 3.0 * s * third)) / width


@jitted(**EXACT)
def tabulated(rho, E, table):
    """Return P, dP/drho, dP/dE of a table (R20).

    Below its densities the pressure is in proportion to the density, above them it goes
    on along its tangent; colder matter has the pressure of the lowest isotherm, and in
    hotter matter the pressure goes on along its last rise with energy. It is never
    below the least pressure of the table.
    """
    cells = int(table.cells)
    lowest, highest = table.density[0], table.density[cells]
    x = min(max(rho, lowest), highest)
    i = cell_of(x, table.density, cells)
    width = table.density[i + 1] - table.density[i]
    s = (x - table.density[i]) / width
    cold, cold_slope = cubic(
        s, width, table.cold[i], table.cold[i + 1],
        table.cold_slope[i], table.cold_slope[i + 1],
    )  # fmt: skip
    cold += cold_slope * max(rho - highest, 0.0)
    above = max(E - cold, 0.0)
    j = cell_of(above, table.energy, table.energy.size - 1)
    step = table.energy[j + 1] - table.energy[j]
    t = (above - table.energy[j]) / step
    low, low_slope = cubic(
        s, width, table.pressure[i, j], table.pressure[i + 1, j],
        table.slope[i, j], table.slope[i + 1, j],
    )  # fmt: skip
    high, high_slope = cubic(
        s, width, table.pressure[i, j + 1], table.pressure[i + 1, j + 1],
        table.slope[i, j + 1], table.slope[i + 1, j + 1],
    )  # fmt: skip
    low += low_slope * max(rho - highest, 0.0)
    high += high_slope * max(rho - highest, 0.0)
    P = low + t * (high - low)
    dP_drho = low_slope + t * (high_slope - low_slope)
    dP_dE = (high - low) / step
    if E < cold:
        dP_dE = 0.0
    if rho < lowest:
        dP_drho = P / lowest
        P, dP_dE = P * rho / lowest, dP_dE * rho / lowest
    else:
        dP_drho -= dP_dE * cold_slope
    if P < table.least[0]:
        return table.least[0], 0.0, 0.0
    return P, dP_drho, dP_dE


@jitted(**ENTRY)
def _pressure(rho, E, mat):
    return tabulated(rho, E, mat.table)


MODEL = Model("table", "table", Tabulated, {"pressure": _pressure})
