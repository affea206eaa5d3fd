"""What all shapes of bodies have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from importlib import import_module
from typing import ClassVar, get_args

from mpisph.case.shapes.section import SQUARE, Section
from mpisph.inputs.expressions import DensityProfile, EnergyProfile, VelocityProfile
from mpisph.inputs.quantities import FrozenModel, Identifier, Position, Velocity
from mpisph.materials.model import EquationOfState

__all__ = ["Shape", "inner_mistakes", "load_shapes", "millimetres"]


class Shape(FrozenModel, ABC):
    """A body: a solid of revolution, described by its r-z section.

    A subclass adds its sizes as fields, and its name as the field `shape`.
    """

    sets_spacing: ClassVar[bool] = False
    """Whether `npr` divides the first body of this shape where none is named."""

    name: Identifier
    """Name of the body, unique in the case."""
    material: Identifier
    """Material card, a name of the case's own materials, or a card file (.toml)."""
    velocity: Velocity = 0.0
    """Initial velocity along +z."""
    radial_velocity: VelocityProfile = 0.0
    """Added away from the centre of a sphere or shell, else away from the axis."""
    density: DensityProfile | None = None
    """Initial density; the reference density of the material, if left out."""
    energy: EnergyProfile = 0.0
    """Initial specific internal energy."""
    position: Position = 0.0
    """Axial position: the centre of a sphere or shell, else the lowest z."""
    eos: EquationOfState | None = None
    """Equation of state of this body; the scheme's, if left out."""
    shape: str
    """Shape of the body."""
    filling: str = SQUARE
    """How the particles are arranged."""

    @classmethod
    def label(cls) -> str:
        """Return the shape's name for people."""
        (name,) = get_args(cls.model_fields["shape"].annotation)
        return str(name).replace("_", " ")

    @property
    @abstractmethod
    def section(self) -> Section:
        """Section in the r-z plane."""

    @abstractmethod
    def describe(self) -> str:
        """Return the sizes, as they would be ordered from a workshop."""

    @property
    def reference_radius(self) -> float:
        """Radius that `npr` counts particles along [m]."""
        return self.section.widest

    def mistakes(self) -> Iterator[tuple[str, str]]:
        """Return keys of sizes that contradict others, each with what is expected."""
        yield from ()


def inner_mistakes(inner: float, **outer: float) -> Iterator[tuple[str, str]]:
    """Return what is wrong with an inner radius [m], as `Shape.mistakes`.

    Parameters
    ----------
    inner : float
    **outer : float
        The outer radius, by its key.
    """
    for key, radius in outer.items():
        if not inner < radius:
            yield "inner_radius", f"expected less than {key} = {radius:g} m"


def millimetres(length: float) -> str:
    """Return a length [m] for people."""
    return f"{1e3 * length:.4g} mm"


def load_shapes(modules: Sequence[str]) -> tuple[type[Shape], ...]:
    """Return the shapes of some files of this folder.

    Parameters
    ----------
    modules : sequence of str
        Each holds the class of its name: ``spherical_shell`` is `SphericalShell`.
    """
    package = __name__.rpartition(".")[0]
    names = {module: module.title().replace("_", "") for module in modules}
    return tuple(
        getattr(import_module(f"{package}.{module}"), name)
        for module, name in names.items()
    )
