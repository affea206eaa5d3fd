"""A case: everything that decides a run, checked and with all defaults filled in."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import tomli_w
from pydantic import Field, ValidationInfo, field_validator, model_validator

from mpisph.case.bodies import Body, Plate
from mpisph.case.checks import find_problems
from mpisph.case.partial_case import Parts, default_reference, find_spacing
from mpisph.case.sections import (
    Boundary,
    Checkpoints,
    Gauge,
    Initial,
    Limits,
    Measured,
    Output,
    Parallel,
    Resolution,
    Scheme,
    TimeStepping,
)
from mpisph.case.shield import HORIZON, Shield, default_end
from mpisph.case.target import default_plate
from mpisph.case.times import merge_times, periodic_times, requested_times
from mpisph.core.particles import FIELDS
from mpisph.inputs.quantities import FrozenModel, Identifier, Title
from mpisph.materials import Material, card_names
from mpisph.materials.choice import chosen_models
from mpisph.materials.library import card_data
from mpisph.materials.model import TABLES
from mpisph.physics.response import KINDS, MODEL_FIELDS, MaterialModels

__all__ = ["INITIAL_FILE", "MOST", "Case", "merge_materials"]

MOST = 100
"""Bodies of a case, and materials."""


LATER = 1.2
"""End of a shield's run over the time of the verdict that it must confirm."""

INITIAL_FILE = "initial.h5"
"""Copy of the particles that a run started from, in its folder."""


class Case(FrozenModel):
    """One run of the program.

    Build it with `load_case` or `case_from_dict`, whose errors are for people.
    A case is complete: references, the end of the run and the materials are
    resolved when it is made.
    """

    title: Title
    """What the case is, in one line."""
    shield: Shield | None = None
    """A shield, of which the bodies are made."""
    bodies: Annotated[tuple[Body, ...], Field(max_length=MOST)]
    """The bodies, in the order in which their particles are numbered."""
    resolution: Resolution
    """Particle spacing and smoothing length."""
    initial: Initial | None = None
    """Particles to start from, instead of those that fill the bodies."""
    boundary: Boundary = Boundary()
    """Rigid planes that the matter cannot pass."""
    scheme: Scheme = Scheme()
    """The equations and their switches."""
    output: Output = Output()
    """What is written, and when."""
    measured: Measured | None = None
    """Measurements to compare with."""
    time: TimeStepping = Field(default=TimeStepping(), validate_default=True)
    """Duration and time step."""
    gauges: Annotated[tuple[Gauge, ...], Field(max_length=MOST)] = ()
    """Places at which the state of the matter is followed."""
    limits: Limits = Limits()
    """Limits beyond which a run counts as unstable."""
    parallel: Parallel = Parallel()
    """How the particles are shared among the ranks."""
    checkpoints: Checkpoints = Checkpoints()
    """When a run writes checkpoints."""
    materials: dict[Identifier, Material] = Field(default_factory=dict, max_length=MOST)
    """Materials by name; a partial one takes the rest from the card of its name."""

    @model_validator(mode="before")
    @classmethod
    def _embed_cards(cls, data: Any) -> Any:
        """Put the cards that the bodies name beside the case's own materials."""
        if not isinstance(data, Mapping):
            return data
        return {**data, "materials": merge_materials(data)}

    @field_validator("resolution")
    @classmethod
    def _name_reference(cls, value: Resolution, info: ValidationInfo) -> Resolution:
        """Fill in the body whose radius `npr` divides."""
        if value.npr is None or value.reference is not None:
            return value
        name = default_reference(info.data.get("bodies", ()))
        return value.model_copy(update={"reference": name})

    @field_validator("measured")
    @classmethod
    def _name_plate(
        cls, value: Measured | None, info: ValidationInfo
    ) -> Measured | None:
        """Fill in the plate from which lengths count."""
        if value is None or value.plate is not None:
            return value
        plate = default_plate(info.data.get("bodies", ()))
        return value.model_copy(update={"plate": None if plate is None else plate.name})

    @field_validator("time")
    @classmethod
    def _fill_end(cls, value: TimeStepping, info: ValidationInfo) -> TimeStepping:
        """Let the run end with the last output time that is named."""
        if value.end is not None or not {"output", "measured"} <= info.data.keys():
            return value
        times = requested_times(info.data["output"], info.data["measured"])
        return value.model_copy(update={"end": max(times, default=None)})

    @field_validator("materials")
    @classmethod
    def _keep_used(
        cls, value: dict[str, Material], info: ValidationInfo
    ) -> dict[str, Material]:
        """Keep the materials of the bodies, in the order of their first use."""
        used = dict.fromkeys(body.material for body in info.data.get("bodies", ()))
        return {name: value[name] for name in used if name in value}

    @model_validator(mode="after")
    def _check_rules(self) -> Case:
        """Check the rules between the parts."""
        parts = Parts(
            names=[body.name for body in self.bodies],
            material_names=[body.material for body in self.bodies],
            bodies=self.bodies,
            resolution=self.resolution,
            boundary=self.boundary,
            scheme=self.scheme,
            output=self.output,
            measured=self.measured,
            gauge_names=[gauge.name for gauge in self.gauges],
            time=self.time,
            materials=self.materials,
        )
        findings = find_problems(parts)
        if findings:
            lines = (f"{'.'.join(map(str, f.key))}: {f.expected}" for f in findings)
            raise ValueError("\n".join(lines))
        return self

    @property
    def spacing(self) -> float:
        """Initial particle spacing dx [m]."""
        spacing = find_spacing(self.resolution, self.bodies)
        assert spacing is not None, "a checked case has a spacing"
        return spacing

    @property
    def smoothing_length(self) -> float:
        """Initial smoothing length h0 = nph dx [m]."""
        return self.resolution.nph * self.spacing

    @property
    def end_time(self) -> float:
        """Time at which the run ends [s]; the same as ``time.end``."""
        assert self.time.end is not None, "a checked case has an end"
        return self.time.end

    @property
    def output_times(self) -> tuple[float, ...]:
        """Times of all snapshots in (0, end] [s], sorted; the last is the end."""
        end = self.end_time
        times = requested_times(self.output, self.measured)
        if self.shield is not None:
            times.append(self.verdict_time)
        return merge_times(times + periodic_times(self.output.every, end), end)

    @property
    def verdict_time(self) -> float:
        """Time of the earlier of the two verdicts on a shield [s]."""
        return self.end_time / LATER

    @property
    def horizon(self) -> float:
        """Time by which matter must come to a shield's wall to count [s].

        It depends on no time that the case gives, so a run that is made longer has made
        the same steps.
        """
        assert self.shield is not None, "only shields have one"
        rho = [self.body_models(body).rest_density for body in self.bodies[:-1]]
        return HORIZON * default_end(self.shield, rho)

    @property
    def impact_velocity(self) -> float:
        """Largest difference between the velocities of two bodies [m/s]."""
        velocities = [body.velocity for body in self.bodies]
        return max(velocities, default=0.0) - min(velocities, default=0.0)

    @property
    def measured_plate(self) -> Plate | None:
        """Plate from whose rear face lengths count, if there are measurements."""
        name = self.measured.plate if self.measured else None
        plates = (body for body in self.bodies if isinstance(body, Plate))
        return next((plate for plate in plates if plate.name == name), None)

    @property
    def material_table(self) -> tuple[MaterialModels, ...]:
        """The materials with the models that the bodies use, in order of first use."""
        pairs = dict.fromkeys(self._material_key(body) for body in self.bodies)
        return tuple(
            chosen_models(self.materials[name], self.scheme, eos) for name, eos in pairs
        )

    @property
    def material_indices(self) -> tuple[int, ...]:
        """Index into `material_table` of every body."""
        keys = [self._material_key(body) for body in self.bodies]
        order = list(dict.fromkeys(keys))
        return tuple(order.index(key) for key in keys)

    @property
    def saved_fields(self) -> frozenset[str]:
        """Particle fields that snapshots carry: of models, those that a body uses."""
        given = frozenset[str]().union(*(m.fields for m in self.material_table))
        left_out = MODEL_FIELDS - given
        if self.shield is None:
            left_out |= {"retired"}
        return frozenset(f.name for f in FIELDS if f.saved) - left_out

    def body_models(self, body: Body) -> MaterialModels:
        """Return the models that a body's material is used with."""
        return chosen_models(self.body_material(body), self.scheme, body.eos)

    def body_material(self, body: Body) -> Material:
        """Return the material of a body."""
        return self.materials[body.material]

    def to_toml(self) -> str:
        """Return the case as TOML: every default written, SI, materials embedded.

        Loading the text gives an equal case. Particles of its own are named by
        `INITIAL_FILE`, which a run keeps beside it.
        """
        data = self.model_dump(exclude_none=True, by_alias=True)
        if self.initial is not None:
            data["initial"]["file"] = INITIAL_FILE
        if self.shield is not None:
            del data["bodies"]
        text = tomli_w.dumps(data)
        return f"# A complete case: SI units, every default written out.\n\n{text}"

    def _material_key(self, body: Body) -> tuple[str, str]:
        return body.material, self.body_models(body).names["eos"]


def merge_materials(data: Mapping[str, Any]) -> Any:
    """Return the raw materials of a case with the cards they rest on.

    Parameters
    ----------
    data : mapping
        The case as read from TOML, not yet checked.

    Returns
    -------
    dict
        Raw tables by name: cards that bodies name, and the case's own tables. A table
        that gives the density and all constants of an equation of state stands by
        itself; another one changes single constants of the card of its name. Models
        that the case's scheme names go before those of the cards that come with mpisph.
        What is malformed is left as it is, for the model to refuse.
    """
    own = data.get("materials", {})
    bodies = data.get("bodies", ())
    if not isinstance(own, Mapping):
        return own
    named = _named_kinds(data.get("scheme"))
    wanted = {_material_name(body) for body in _sequence(bodies)} - set(own)
    merged: dict[str, Any] = {
        name: _card(name, named) for name in card_names() if name in wanted
    }
    for name, table in own.items():
        merged[name] = _complete_table(name, table, named)
    return merged


def _named_kinds(scheme: Any) -> set[str]:
    """Return the kinds of models that a raw scheme names for all materials."""
    given = set(scheme) if isinstance(scheme, Mapping) else set()
    if isinstance(scheme, Scheme):
        given = scheme.model_fields_set
    # A minimum pressure is meant to act.
    return given & set(KINDS) | ({"failure"} if "p_min" in given else set())


def _card(name: str, named: set[str]) -> dict[str, Any]:
    """Return a card without the models of the kinds that the scheme names."""
    return {key: value for key, value in card_data(name).items() if key not in named}


def _complete_table(name: str, table: Any, named: set[str]) -> Any:
    if not isinstance(table, Mapping):
        return table
    if name not in card_names() or _stands_by_itself(table):
        return {**table, "name": name}
    card = _card(name, named)
    inner = {
        key: {**card[key], **entry}
        for key, entry in table.items()
        if key in TABLES and isinstance(entry, Mapping) and key in card
    }
    return {**card, **table, **inner}


def _stands_by_itself(table: Mapping[str, Any]) -> bool:
    """Say whether a table gives the density and one equation of state whole."""
    for model in KINDS["eos"]:
        given = table.get(model)
        fields = TABLES[model].model_fields.items()
        required = {key for key, field in fields if field.is_required()}
        if isinstance(given, Mapping) and required <= given.keys():
            return "rho0" in table
    return False


def _sequence(value: Any) -> list[Any] | tuple[Any, ...]:
    return value if isinstance(value, list | tuple) else ()


def _material_name(body: Any) -> str | None:
    name = body.get("material") if isinstance(body, Mapping) else None
    name = getattr(body, "material", name)
    return name if isinstance(name, str) else None
