"""A shield: what a case with a table ``[shield]`` is made of.

The program chooses the bodies, the spacing, the times and the radii of the plates;
each may still be given.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from pathlib import PurePath
from typing import Annotated, Any, NamedTuple

from pydantic import Field, ValidationError

from mpisph.case.sections import TimeStepping
from mpisph.inputs.findings import Finding, Key
from mpisph.inputs.quantities import FrozenModel, Identifier, PositiveLength, Quantity
from mpisph.materials.library import card_data, card_names

__all__ = [
    "BLOCK",
    "CFL",
    "Bumper",
    "Flight",
    "Projectile",
    "RearWall",
    "Shield",
    "default_end",
    "default_npr",
    "default_radii",
    "expand_shield",
    "flights_of",
    "is_block",
    "name_materials",
    "of_shield",
    "shield_doubts",
    "shield_findings",
]

USUAL_NPR, FINEST_NPR, COARSEST_NPR = 8, 12, 4
"""Particles along the projectile's radius: as usual, and the bounds between which the
number goes with the wall's thickness."""

WALL_ROWS, MOST_ROWS = 5, 64
"""Rows of particles that a wall should have at least, and at most: a sheet of fewer
does not bend, a block of more costs without gain."""

BLOCK = 1.5
"""Thickness over the projectile's diameter from which a wall is a block, which is
cratered rather than bent."""

CFL = 0.6
"""Courant factor. The damage of walls is within 1 % of that at half of it."""

BUMPER_RADIUS = 4.0
"""In diameters of the projectile; the hole is at most two wide."""

SPREAD, WALL_MARGIN = 0.45, 3.0
"""Radius of what a cloud hits: the share of the distance flown by which the cloud
spreads, and diameters of the projectile beside it."""

BLOCK_SPREAD = 0.25
"""The same of a block: what is sent off the axis makes shallow pits in it alone."""

RESPONSE_SPEED = 125.0
"""Thickness of wall or projectile over the time that a wall takes to respond [m/s]:
8 us for each mm."""

RESPONDING = 3.0
"""Diameters of the projectile behind which a block does not respond: its crater is at
most one or two deep."""

LATE = 1.1
"""Flight of the cloud in units of that of its centre of mass: the slower half."""

HALF_WAY, PASSED = 0.5, 4.0
"""When matter of a bumper may leave the game: share of the standoff that the projectile
would have flown, and at least so many times the way through the bumper."""

HORIZON = 2.0
"""Time by which matter must come to the wall to count, in default ends of the run."""

SNAPSHOTS = 12
"""Written during a run. A run ends 1.2 times later than the second but last."""

HISTORY_EVERY = 10
"""Steps between two lines of the history."""


class Projectile(FrozenModel):
    """A sphere that hits the first bumper at normal incidence."""

    diameter: PositiveLength
    """Diameter."""
    velocity: Annotated[float, Field(gt=0, le=1e6), Quantity("m/s")]
    """Impact velocity."""
    material: Identifier
    """Material card, or a name in [materials]."""


class Bumper(FrozenModel):
    """A plate before the wall."""

    thickness: PositiveLength
    """Thickness along z."""
    standoff: PositiveLength
    """From its rear face to the front face of what stands behind it."""
    material: Identifier
    """Material card, or a name in [materials]."""
    radius: PositiveLength | None = None
    """Radius of the round plate; chosen by the program where it is left out."""


class RearWall(FrozenModel):
    """The plate that is to hold."""

    thickness: PositiveLength
    """Thickness along z."""
    material: Identifier
    """Material card, or a name in [materials]."""
    radius: PositiveLength | None = None
    """Radius of the round plate; chosen by the program where it is left out."""


class Shield(FrozenModel):
    """A projectile, bumpers and a rear wall."""

    projectile: Projectile
    """What hits the shield."""
    bumpers: Annotated[tuple[Bumper, ...], Field(min_length=1, max_length=20)]
    """The bumpers, in the order in which they are hit."""
    wall: RearWall
    """The rear wall."""

    @property
    def layers(self) -> tuple[Bumper | RearWall, ...]:
        """The plates, in the order in which they are hit."""
        return (*self.bumpers, self.wall)

    @property
    def fronts(self) -> tuple[float, ...]:
        """Axial positions of the layers' front faces [m]; the first is at zero."""
        positions = [0.0]
        for bumper in self.bumpers:
            positions.append(positions[-1] + bumper.thickness + bumper.standoff)
        return tuple(positions)

    @property
    def spread_distances(self) -> tuple[float, ...]:
        """Distance from the first bumper's rear face to each layer [m]; 0 at first."""
        rear = self.bumpers[0].thickness
        return tuple(max(0.0, front - rear) for front in self.fronts)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the bodies: the projectile, the bumpers, the wall."""
        many = len(self.bumpers) > 1
        bumpers = [f"bumper-{i + 1}" if many else "bumper" for i in _range(self)]
        return ("projectile", *bumpers, "wall")


def _range(shield: Shield) -> range:
    return range(len(shield.bumpers))


def is_block(shield: Shield) -> bool:
    """Say whether the wall is a block: `BLOCK` diameters thick, or more."""
    return shield.wall.thickness >= BLOCK * shield.projectile.diameter


def default_radii(shield: Shield) -> tuple[float, ...]:
    """Return the radii of the layers, where none is given [m].

    The first bumper's rim does not matter; what the cloud hits is as wide as that.
    """
    d = shield.projectile.diameter
    spread = BLOCK_SPREAD if is_block(shield) else SPREAD
    radii = [BUMPER_RADIUS * d]
    for distance in shield.spread_distances[1:-1]:
        radii.append(SPREAD * distance + WALL_MARGIN * d)
    wall = spread * shield.spread_distances[-1] + WALL_MARGIN * d
    return (*radii, max(wall, 2.0 * _responding(shield)))


def _responding(shield: Shield) -> float:
    """Return the thickness of the wall that responds [m]."""
    return min(shield.wall.thickness, RESPONDING * shield.projectile.diameter)


def default_npr(shield: Shield) -> int:
    """Return the particles along the projectile's radius, where none are given.

    As usual, but more for a wall of too few rows and fewer for one of too many.
    """
    rows_of_one = 2.0 * shield.wall.thickness / shield.projectile.diameter
    least = math.ceil(WALL_ROWS / rows_of_one - 1e-9)
    most = math.floor(MOST_ROWS / rows_of_one + 1e-9)
    return min(max(USUAL_NPR, least), max(most, COARSEST_NPR), FINEST_NPR)


def default_end(shield: Shield, densities: Sequence[float] | None = None) -> float:
    """Return the time at which the wall has responded [s].

    The cloud's flight at the velocity of its centre of mass, projectile and what of the
    bumpers lies before it, and the response of the wall.

    Parameters
    ----------
    shield : Shield
    densities : sequence of float, optional
        Of the projectile and the bumpers [kg/m^3]; by default all are alike.
    """
    projectile = shield.projectile
    d = projectile.diameter
    rho = densities or [1.0] * (1 + len(shield.bumpers))
    mass = momentum = rho[0] * d / 1.5  # per area of the projectile's disc
    time = d / projectile.velocity
    for bumper, density in zip(shield.bumpers, rho[1:], strict=True):
        mass += density * bumper.thickness
        way = bumper.thickness + bumper.standoff
        time += LATE * way / (projectile.velocity * momentum / mass)
    return time + max(_responding(shield), d) / RESPONSE_SPEED


class Flight(NamedTuple):
    """When matter of a body no longer matters to the wall.

    Attributes
    ----------
    reach : float
        Axial position that it must be able to come to [m].
    after : float
        Time from which that counts [s].
    """

    reach: float
    after: float


def flights_of(shield: Shield) -> tuple[Flight, ...]:
    """Return when the matter of each body leaves the game.

    Matter of a bumper must be able to come to what stands behind it, once the
    projectile would have flown half of the way there; the projectile's to the wall,
    once the last bumper's has to. What is thrown back leaves a diameter before a face.

    Parameters
    ----------
    shield : Shield
    """
    d, v = shield.projectile.diameter, shield.projectile.velocity
    flights = []
    for front, bumper, next_front in zip(
        shield.fronts, shield.bumpers, shield.fronts[1:], strict=False
    ):
        impact = PASSED * (d + bumper.thickness)
        way = front + max(impact, bumper.thickness + HALF_WAY * bumper.standoff)
        flights.append(Flight(next_front - d, way / v))
    wall = Flight(shield.fronts[-1] - d, 0.0)
    return (Flight(wall.reach, flights[-1].after), *flights, wall)


def expand_shield(data: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a raw case with the bodies and the defaults that its shield stands for.

    Parameters
    ----------
    data : mapping
        The case as read from TOML; it is not changed. Without a sound ``[shield]`` it
        is returned as it is, for the model to refuse.
    """
    shield = _shield_of(data)
    if shield is None or "bodies" in data:
        return data
    radii = [
        given.radius or chosen
        for given, chosen in zip(shield.layers, default_radii(shield), strict=True)
    ]
    full = {**data, "shield": _with_radii(data["shield"], radii)}
    full["bodies"] = _bodies(shield, radii, data["shield"])
    end = _round_up(default_end(shield, _densities(shield, data)))
    _fill(full, "resolution", {"npr": default_npr(shield)}, unless={"spacing"})
    _fill(full, "time", {"cfl": CFL})
    _fill(full, "output", {"history_every": HISTORY_EVERY})
    if not _given(full, "output", "times"):
        _fill(full, "time", {"end": end})
        end = _seconds(full["time"], "end") or end
        _fill(full, "output", {"every": end / SNAPSHOTS}, unless={"times"})
    return full


def _fill(
    data: dict[str, Any],
    name: str,
    defaults: Mapping[str, Any],
    unless: AbstractSet[str] = frozenset(),
) -> None:
    """Put defaults into a table of a raw case; what is no table stays as it is."""
    given = data.get(name, {})
    if isinstance(given, Mapping) and not given.keys() & unless:
        data[name] = {**defaults, **given}


def _given(data: Mapping[str, Any], name: str, key: str) -> bool:
    table = data.get(name)
    return isinstance(table, Mapping) and bool(table.get(key))


def _seconds(table: Any, key: str) -> float | None:
    """Return a time of a raw table [s]; None where it is none."""
    try:
        return TimeStepping.model_validate({key: table[key]}).end
    except (ValidationError, TypeError, KeyError):
        return None


def _shield_of(data: Mapping[str, Any]) -> Shield | None:
    """Return the shield of a raw case; None where it is not sound.

    Files stand for the materials in them.
    """
    try:
        return Shield.model_validate(_with_names(data.get("shield")))
    except ValidationError:
        return None


def _with_names(table: Any) -> Any:
    """Return a raw table with the stems of all files named as materials."""
    if isinstance(table, list | tuple):
        return [_with_names(entry) for entry in table]
    if not isinstance(table, Mapping):
        return table
    named = {key: _with_names(value) for key, value in table.items()}
    material = named.get("material")
    if isinstance(material, str):
        named["material"] = PurePath(material).name.removesuffix(".toml")
    return named


def _with_radii(table: Any, radii: Sequence[float]) -> dict[str, Any]:
    """Return a raw shield with the radii of its layers."""
    bumpers = [
        {**bumper, "radius": radius}
        for bumper, radius in zip(table["bumpers"], radii, strict=False)
    ]
    return {**table, "bumpers": bumpers, "wall": {**table["wall"], "radius": radii[-1]}}


def _bodies(shield: Shield, radii: Sequence[float], raw: Any) -> list[dict[str, Any]]:
    projectile = shield.projectile
    sphere = {
        "name": "projectile",
        "shape": "sphere",
        "radius": projectile.diameter / 2,
        "position": -projectile.diameter / 2,
        "velocity": projectile.velocity,
        "material": raw["projectile"]["material"],
    }
    parts = [*raw["bumpers"], raw["wall"]]
    plates = [
        {
            "name": name,
            "shape": "plate",
            "thickness": layer.thickness,
            "radius": radius,
            "position": front,
            "material": part["material"],
        }
        for name, layer, part, radius, front in zip(
            shield.names[1:], shield.layers, parts, radii, shield.fronts, strict=True
        )
    ]
    return [sphere, *plates]


def _densities(shield: Shield, data: Mapping[str, Any]) -> list[float] | None:
    """Return the densities of projectile and bumpers; None where one is not known."""
    found = []
    names = [shield.projectile.material, *(b.material for b in shield.bumpers)]
    for name in names:
        own = data.get("materials", {})
        table = own.get(name) if isinstance(own, Mapping) else None
        value = table.get("rho0") if isinstance(table, Mapping) else None
        if value is None and name in card_names():
            value = card_data(name).get("rho0")
        if isinstance(value, Mapping):
            value = value.get("value")
        if isinstance(value, bool) or not isinstance(value, int | float) or value <= 0:
            return None
        found.append(float(value))
    return found


def _round_up(value: float) -> float:
    """Return a value of three digits that is not less."""
    digits = 10.0 ** (math.floor(math.log10(value)) - 2)
    return float(f"{math.ceil(value / digits - 1e-9) * digits:.6g}")


def name_materials(data: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a raw case whose shield has the materials that its bodies have by now.

    A material that is named by its file has got a name of its own.
    """
    shield, bodies = data.get("shield"), data.get("bodies")
    if not isinstance(shield, Mapping) or _shield_of(data) is None:
        return data
    if not isinstance(bodies, list) or len(bodies) != len(shield["bumpers"]) + 2:
        return data  # not those of the shield, for which they are refused
    names = [
        body.get("material") if isinstance(body, Mapping) else None for body in bodies
    ]
    first, *bumpers, last = names
    named = {
        **shield,
        "projectile": {**shield["projectile"], "material": first},
        "bumpers": [
            {**bumper, "material": name}
            for bumper, name in zip(shield["bumpers"], bumpers, strict=True)
        ],
        "wall": {**shield["wall"], "material": last},
    }
    return {**data, "shield": named}


def of_shield(findings: Sequence[Finding], data: Mapping[str, Any]) -> list[Finding]:
    """Return findings about the bodies of a raw case as such about its shield.

    Parameters
    ----------
    findings : sequence of Finding
    data : mapping
        The case, with a table ``shield``.
    """
    bodies = data.get("bodies")
    if isinstance(bodies, list | tuple):
        bumpers = len(bodies) - 2
        named = [f._replace(key=_shield_key(f.key, bumpers)) for f in findings]
        return list({f.key: f for f in named[::-1]}.values())[::-1]
    # The shield itself is to blame for what could not be made of it.
    made = ("bodies", "resolution", "time")
    return [f for f in findings if f.key[:1] == ("shield",) or f.key[0] not in made]


def _shield_key(key: Key, bumpers: int) -> Key:
    """Return the key of a shield that a key of its bodies stands for."""
    if key[:1] != ("bodies",):
        return key
    if len(key) < 2 or not isinstance(key[1], int):
        return ("shield",)
    part: Key = ("projectile",)
    if key[1] > 0:
        part = ("wall",) if key[1] > bumpers else ("bumpers", key[1] - 1)
    names = {"radius": "diameter"} if key[1] == 0 else {"position": "standoff"}
    rest = tuple(names.get(str(step), step) for step in key[2:])
    return ("shield", *part, *rest)


def shield_findings(data: Mapping[str, Any]) -> list[Finding]:
    """Return what is wrong with a raw case that has a shield, beside single fields.

    Parameters
    ----------
    data : mapping
        The case as read from TOML.
    """
    findings = []
    if "bodies" in data and "shield" in data:
        text = "a case with a [shield] has the bodies of that; leave one of them out"
        findings.append(Finding(("bodies",), text))
    shield = _shield_of(data)
    if shield is None:
        return findings
    d = shield.projectile.diameter
    for which, layer in enumerate(shield.layers):
        key: Key = ("wall",) if layer is shield.wall else ("bumpers", which)
        if layer.radius is not None and layer.radius <= d / 2:
            text = f"expected more than the projectile's radius, {d / 2:g} m"
            findings.append(Finding(("shield", *key, "radius"), text))
    return findings


def shield_doubts(shield: Shield, rows: Sequence[float]) -> list[str]:
    """Return what makes a shield's verdict doubtful, each with what to do.

    Parameters
    ----------
    shield : Shield
    rows : sequence of float
        Rows of particles in each layer.
    """
    texts, d = [], shield.projectile.diameter
    for which, (layer, chosen, count) in enumerate(
        zip(shield.layers, default_radii(shield), rows, strict=True)
    ):
        key = "wall" if layer is shield.wall else f"bumpers.{which}"
        if isinstance(layer, Bumper) and layer.standoff < d:
            texts.append(
                f"shield.{key}.standoff: {1e3 * layer.standoff:g} mm, less than the "
                f"projectile's diameter of {1e3 * d:g} mm: plates so near act as one, "
                "for no cloud forms between them"
            )
        if layer.radius is not None and layer.radius < 0.7 * chosen:
            texts.append(
                f"shield.{key}.radius: {1e3 * layer.radius:g} mm, where the cloud and "
                f"its waves ask for {1e3 * chosen:.3g} mm: the rim may matter"
            )
        if layer is shield.wall and round(count) < WALL_ROWS - 1:
            texts.append(
                f"shield.{key}: {count:.2g} rows of particles, too few to bend and "
                f"tear as a wall; a resolution of {WALL_ROWS / count:.2g} times as "
                f"many particles gives it {WALL_ROWS}"
            )
    total = sum(bumper.thickness for bumper in shield.bumpers)
    if total > d:
        texts.append(
            "shield.bumpers: thicker together than the projectile: nothing may come "
            "through to the wall"
        )
    return texts
