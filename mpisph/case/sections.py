"""The sections of a case beside its bodies: numbers, switches and limits."""

from __future__ import annotations

import math
from typing import Annotated, Literal, get_args

from pydantic import AfterValidator, Field, Strict

from mpisph.inputs.quantities import (
    Count,
    Flag,
    Fraction,
    FrozenModel,
    Identifier,
    NonNegative,
    NonNegativeLength,
    NonNegativeRatio,
    Position,
    PositiveLength,
    PositiveRatio,
    PositiveTime,
    Quantity,
    Source,
    TimeOffset,
    one_line,
)
from mpisph.materials.model import (
    Ductile,
    EquationOfState,
    Failure,
    Porosity,
    Strength,
    Thermal,
)
from mpisph.physics.failure.minimum_pressure import MinimumPressure

__all__ = [
    "Boundary",
    "Checkpoints",
    "Exposure",
    "Gauge",
    "Heat",
    "Initial",
    "Limits",
    "Measured",
    "Output",
    "Parallel",
    "Resolution",
    "Scheme",
    "TimeStepping",
    "Viscosity",
]


PairForm = Literal["consistent", "lee2003"]
PAIR_FORMS: tuple[PairForm, ...] = get_args(PairForm)


class Resolution(FrozenModel):
    """Particle spacing and smoothing length; give either `npr` or `spacing`."""

    npr: Annotated[int, Strict(), Field(ge=1, le=1_000_000)] | None = None
    """Number of particles along the radius of the reference body."""
    reference: Identifier | None = None
    """Body whose radius npr divides; by default the first sphere or shell."""
    spacing: PositiveLength | None = None
    """Particle spacing, instead of npr."""
    nph: Annotated[float, Field(ge=0.5, le=10), Quantity("")] = 1.5
    """Initial smoothing length over particle spacing."""


class Initial(FrozenModel):
    """Particles that a run starts from, in place of those that fill the bodies."""

    file: Annotated[str, Field(min_length=1, max_length=4000), AfterValidator(one_line)]
    """HDF5 file of them, or a snapshot; relative to the case file."""
    digest: Annotated[str, Field(pattern="^[0-9a-f]+$", max_length=64)] | None = None
    """SHA-256 of their fields; filled in when the file is read."""
    particles: Count | None = None
    """Number of them; filled in when the file is read."""

    @property
    def count(self) -> int:
        """Number of the particles of a case that has been loaded."""
        assert self.particles is not None, "loading a case has filled it in"
        return self.particles


class Viscosity(FrozenModel):
    """Artificial viscosity (R5)."""

    alpha: NonNegative = 1.5
    """Coefficient of the term linear in velocity."""
    beta: NonNegative = 2.0
    """Coefficient of the term quadratic in velocity."""
    epsilon: Fraction = 0.001
    """Fraction of h^2 that keeps the denominator from vanishing."""
    form: Literal["derived", "printed"] = "derived"
    """Ring-averaged form, or eq (12) as the source paper prints it."""


class Heat(FrozenModel):
    """Artificial heat conduction (R6)."""

    enabled: Flag = True
    """Whether to conduct artificial heat."""
    g1: NonNegative = 0.0
    """Coefficient of the term with the sound speed, which conducts everywhere."""
    g2: NonNegative = 1.0
    """Coefficient of the term with the rate of compression."""


class Boundary(FrozenModel):
    """Rigid, frictionless planes across the axis, between which the matter stays."""

    z_min: Position | None = None
    """Axial position of the lower plane."""
    z_max: Position | None = None
    """Axial position of the upper plane."""

    @property
    def exists(self) -> bool:
        """Whether there is any plane."""
        return self.z_min is not None or self.z_max is not None

    @property
    def planes(self) -> tuple[float, float]:
        """The positions of the planes [m], infinite where there is none."""
        low = -math.inf if self.z_min is None else self.z_min
        return low, math.inf if self.z_max is None else self.z_max


class Scheme(FrozenModel):
    """The equations and their switches."""

    self_term: Flag = True
    """Whether a ring interacts with itself (R1)."""
    pair_form: PairForm = "consistent"
    """Forces that match the continuity equation, or those of eqs (5), (6) (R3, R4)."""
    kappa: Annotated[float, Field(gt=1, le=4), Quantity("")] = 3.0
    """Cut-off radius of the kernel over the smoothing length (R1)."""
    eos: EquationOfState = "mie-grueneisen"
    """Equation of state (R8) of all bodies and materials that name none."""
    porosity: Porosity = "none"
    """Porosity model (R19) of all materials that name none."""
    thermal: Thermal = "none"
    """Thermal model (R13) of all materials that name none."""
    strength: Strength = "elastic-plastic"
    """Strength model (R7, R14, R15) of all materials that name none."""
    failure: Failure = "minimum-pressure"
    """Model of failure in tension (R9, R16, R17) of all materials that name none."""
    ductile: Ductile = "none"
    """Model of ductile failure (R18) of all materials that name none."""
    viscosity: Viscosity = Viscosity()
    """Artificial viscosity (R5)."""
    artificial_stress: NonNegative = 0.1
    """Share of a tension that holds neighbours apart, in the consistent form (R21)."""
    heat: Heat = Heat()
    """Artificial heat conduction (R6)."""
    p_min: MinimumPressure = MinimumPressure()
    """Minimum tensile pressure (R9) of all materials that give none."""
    smoothing: Literal["axisymmetric", "classic", "fixed", "printed"] = "axisymmetric"
    """Evolution of the smoothing length; `printed` is eq (21) to the letter (R10)."""
    sound_speed_floor: Fraction = 0.01
    """Lowest sound speed, as a fraction of the bulk sound speed (R8)."""


class TimeStepping(FrozenModel):
    """Duration and time step (R11)."""

    end: PositiveTime | None = None
    """Time at which the run ends; by default the last requested output time."""
    step: Literal["automatic", "fixed"] = "automatic"
    """Step from the stability limits, or always `dt`."""
    cfl: Annotated[float, Field(ge=1e-4, le=1), Quantity("")] = 0.3
    """Fraction of the stability limits that an automatic step takes."""
    dt: PositiveTime | None = None
    """The fixed step; with automatic steps an upper limit."""
    order: Annotated[int, Strict(), Field(ge=1, le=2)] = 2
    """Order of the stepping; the first conserves no energy and is there to compare."""


class Output(FrozenModel):
    """What is written, and when."""

    times: Annotated[tuple[PositiveTime, ...], Field(max_length=1000)] = ()
    """Times of snapshots."""
    every: PositiveTime | None = None
    """Interval of further snapshots."""
    history_every: Count = 1
    """Steps between two lines of the history."""
    figures: Flag = True
    """Whether to draw figures."""


class Gauge(FrozenModel):
    """A place at which the state of the matter is written with the history."""

    name: Identifier
    """Name of the gauge, unique in the case."""
    kind: Literal["fixed", "moving"] = "fixed"
    """Stays in space, or moves with the particle that is nearest at the start."""
    z: Position
    """Axial position."""
    r: NonNegativeLength = 0.0
    """Radius."""


class Exposure(FrozenModel):
    """One exposure of an experiment's debris cloud."""

    time: PositiveTime
    """Nominal time of the exposure."""
    radius: PositiveLength | None = None
    """Measured largest radius R_b of the cloud."""
    length: PositiveLength | None = None
    """Measured length L_b of the cloud, from the plate's original rear face."""
    source: Source
    """Where the measurement comes from."""


class Measured(FrozenModel):
    """Measurements to compare with, and how the cloud is measured (R12)."""

    clock_offset: TimeOffset = 0.0
    """Time to add to the nominal exposure times, counted from first contact."""
    plate: Identifier | None = None
    """Plate whose rear face L_b counts from; by default the first that is hit."""
    min_velocity_fraction: Annotated[float, Field(ge=0, le=1), Quantity("")] = 0.1
    """Debris is what moves faster along z than this fraction of the impact velocity."""
    quantile: Fraction = 0.99
    """Mass quantile of the robust measures, which a stray particle does not set."""
    exposures: Annotated[tuple[Exposure, ...], Field(max_length=100)] = ()
    """The exposures."""


class Limits(FrozenModel):
    """Limits beyond which a run counts as unstable."""

    energy_drift: PositiveRatio = 0.05
    """Change of the total energy, relative to its initial value."""
    density_ratio_max: Annotated[float, Field(gt=1, le=1e9), Quantity("")] = 20.0
    """Largest density over the reference density."""
    density_ratio_min: Annotated[float, Field(gt=0, lt=1), Quantity("")] = 1e-9
    """Smallest density over the reference density."""
    energy_ratio_max: PositiveRatio = 50.0
    """Specific internal energy over the largest initial specific kinetic energy."""
    energy_ratio_min: PositiveRatio = 0.2
    """How far below zero it may fall, in the same unit."""
    kernel_ratio_max: Annotated[float, Field(gt=1, le=1e9), Quantity("")] = 10.0
    """Largest kernel sum over the density that continuity gives."""
    smoothing_ratio_max: Annotated[float, Field(gt=1, le=1e6), Quantity("")] = 1e3
    """Largest factor by which a smoothing length may grow or shrink."""
    step_ratio_min: Fraction = 1e-4
    """Smallest time step over the first one."""


class Parallel(FrozenModel):
    """How the particles are shared among the ranks."""

    cut: Literal["auto", "z", "r"] = "auto"
    """Into slabs along z, columns along r, or by default where each cut costs least."""
    rebalance_every: Count = 5
    """Steps between two looks at the load."""
    imbalance_threshold: NonNegativeRatio = 0.05
    """Excess of the largest load over the mean that calls for a new cut."""


class Checkpoints(FrozenModel):
    """When a run writes checkpoints, from which it can be resumed."""

    wall_interval: PositiveTime = 600.0
    """Interval of wall-clock time."""
    interval: PositiveTime | None = None
    """Interval of simulated time; none, if left out."""
