"""The commands before a run: materials, init, schema."""

import json
import sys
import tomllib
from pathlib import Path
from typing import Any

import click
from mpi4py import MPI
from rich.table import Table

from mpisph.case import case_from_dict, case_schema
from mpisph.case.card_files import ENDING
from mpisph.case.draft import Draft, draft_case, draft_shield
from mpisph.cli.options import OutputPath
from mpisph.core.console import open_console
from mpisph.core.errors import CaseError, Problem
from mpisph.inputs.folder_name import folder_name
from mpisph.inputs.quantities import si_value
from mpisph.io.files import write_text
from mpisph.materials import Material, card_names, load_card, read_card
from mpisph.materials.doubts import card_doubts
from mpisph.materials.model import TABLES
from mpisph.parallel.collectives import from_root, on_root
from mpisph.physics.models import described
from mpisph.physics.response import KINDS
from mpisph.solver.estimate import Estimate, estimate


@click.command("schema")
def schema_command() -> None:
    """Print the JSON schema of the case file."""
    click.echo(json.dumps(case_schema(), indent=2))


@click.command("materials")
@click.argument("names", metavar="[CARD]...", nargs=-1)
@click.option(
    "--plot",
    "figure",
    metavar="FILE",
    type=OutputPath(path_type=Path, dir_okay=False),
    help="Draw the curves of one CARD into FILE: shocks, isentrope, melting, yield.",
)
def materials_command(names: tuple[str, ...], figure: Path | None) -> None:
    """List the material cards, or print each CARD wholly.

    CARD is the name of a card that comes with mpisph, or a file of your own, which a
    body may name as its material too. Constants that no matter has are warned of.
    """
    if figure is not None and len(names) != 1:
        raise click.UsageError("--plot draws one CARD")
    comm = MPI.COMM_WORLD
    cards = from_root(comm, lambda: [_card(name) for name in names])
    if comm.rank == 0:
        console = open_console(stderr=False)
        for table in map(_card_table, cards) if names else [_list_of_cards()]:
            console.print(table)
        for card in cards:
            for text in card_doubts(card):
                click.echo(f"warning: {text}")
    if figure is not None:
        on_root(comm, lambda: _draw_card(cards[0], figure))
        click.echo(f"curves in {figure}")


def _draw_card(card: Material, figure: Path) -> None:
    from mpisph.figures.material import draw_material

    draw_material(card, figure)


def _card(name: str) -> Material:
    return read_card(Path(name)) if name.endswith(ENDING) else load_card(name)


def _list_of_cards() -> Table:
    table = Table("card", "what it is", "rho0, kg/m3", "models")
    for card in map(load_card, card_names()):
        models = ", ".join(card.given)
        table.add_row(card.name, card.description, f"{card.rho0:g}", models)
    return table


def _card_table(card: Material) -> Table:
    title = f"{card.name}: {card.description}" if card.description else card.name
    table = Table("model", "constant", "value", "source", title=title)
    table.add_row("", "rho0", f"{card.rho0:g} kg/m3", card.sources.get("rho0", ""))
    if card.elongation is not None:
        source = card.sources.get("elongation", "")
        table.add_row("", "elongation", f"{card.elongation:g}", source)
    for kind in KINDS:
        if getattr(card, kind) is not None:
            table.add_row("", kind, getattr(card, kind), "")
    for model in TABLES:
        constants = card.constants(model)
        for name, value, unit in described(constants) if constants else ():
            number = value if isinstance(value, str) else f"{value:.6g}"
            source = constants.sources.get(name, "")
            if name not in constants.model_fields_set:
                source = "default"
            table.add_row(model, name, f"{number} {unit}".strip(), source)
            model = ""
    return table


class _Quantity(click.ParamType):  # type: ignore[type-arg]  # not of old clicks
    """A positive quantity with its unit, in SI."""

    def __init__(self, unit: str, example: str) -> None:
        self.unit, self.name = unit, example

    def convert(
        self,
        value: Any,
        param: click.Parameter | None,
        ctx: click.Context | None,
    ) -> float:
        """Return the quantity, or say what was expected."""
        try:
            number = si_value(value, self.unit)
        except ValueError as error:
            self.fail(f"{value!r}: {error}", param, ctx)
        if number <= 0.0:
            self.fail(f"{value!r}: expected more than 0", param, ctx)
        return number


_LENGTH = _Quantity("m", "LENGTH")
_SPEED = _Quantity("m/s", "VELOCITY")
_TIME = _Quantity("s", "TIME")


@click.command("init")
@click.argument(
    "file",
    metavar="[FILE]",
    default="case.toml",
    type=click.Path(path_type=Path, dir_okay=False),
)
@click.option("--sphere", "diameter", type=_LENGTH, help="Its diameter, such as 3.2mm.")
@click.option("--plate", "thickness", type=_LENGTH, help="Its thickness.")
@click.option("--velocity", type=_SPEED, help="Of the sphere, such as 6.7km/s.")
@click.option(
    "--plate-radius", type=_LENGTH, help="[default: four diameters of the sphere]"
)
@click.option("--wall", type=_LENGTH, help="Distance to a rear wall.  [default: none]")
@click.option(
    "--wall-thickness", type=_LENGTH, help="[default: three times the plate's]"
)
@click.option(
    "--shield",
    is_flag=True,
    help="A shield, judged by whether its wall holds: the plate is its bumper.",
)
@click.option("--material", help="Card of all bodies; see `mpisph materials`.")
@click.option("--sphere-material", help="[default: al-2017-t4]")
@click.option("--plate-material", help="[default: al-6061-t6]")
@click.option("--wall-material", help="[default: the plate's]")
@click.option(
    "--npr",
    type=click.IntRange(1, 1_000_000),
    help="Particles along the sphere's radius.  [default: 10 to 40]",
)
@click.option(
    "--end", type=_TIME, help="End of the run.  [default: when the cloud has formed]"
)
def init_command(
    file: Path,
    diameter: float | None,
    thickness: float | None,
    velocity: float | None,
    plate_radius: float | None,
    wall: float | None,
    wall_thickness: float | None,
    shield: bool,
    material: str | None,
    sphere_material: str | None,
    plate_material: str | None,
    wall_material: str | None,
    npr: int | None,
    end: float | None,
) -> None:
    """Write a case with comments into FILE: a sphere on a plate, or on a shield.

    FILE is case.toml by default, and must not be there yet. On a terminal the program
    asks for a size or velocity that is not given.
    """
    for option, value in (
        ("--wall-thickness", wall_thickness),
        ("--wall-material", wall_material),
    ):
        if value is not None and wall is None and not shield:
            raise click.UsageError(f"{option} without --wall")
    given = {"--sphere": diameter, "--plate": thickness, "--velocity": velocity}
    if shield:
        given["--wall"] = wall
    size, depth, speed, *behind = _asked(given)
    draft = Draft(
        size,
        depth,
        speed,
        sphere_material or material or "al-2017-t4",
        plate_material or material or "al-6061-t6",
        plate_radius,
        behind[0] if shield else wall,
        wall_thickness,
        npr,
        end,
        wall_material,
    )
    write = draft_shield if shield else draft_case
    if not file.parent.is_dir():
        raise click.UsageError(f"there is no folder {file.parent}")
    comm = MPI.COMM_WORLD
    run = from_root(comm, lambda: _write_case(file, write(draft), comm.size))
    click.echo(f"{run.text()}\nwritten to {file}; `mpisph run {file}` runs it")


_QUESTIONS = {
    "--sphere": ("diameter of the sphere, such as 3.2mm", _LENGTH),
    "--plate": ("thickness of the plate, such as 1mm", _LENGTH),
    "--wall": ("distance from plate to wall, such as 50mm", _LENGTH),
    "--velocity": ("velocity of the sphere, such as 6.7km/s", _SPEED),
}


def _asked(given: dict[str, float | None]) -> list[float]:
    """Return what is given; ask for the rest on a terminal, or say what is missing."""
    missing = [option for option, value in given.items() if value is None]
    if missing and not _on_terminal():
        raise click.UsageError(f"expected {', '.join(missing)}")
    return [
        _ask(*_QUESTIONS[option]) if value is None else value
        for option, value in given.items()
    ]


def _on_terminal() -> bool:
    """Say whether there is somebody to ask, by this rank alone."""
    return MPI.COMM_WORLD.size == 1 and sys.stdin.isatty()


def _ask(question: str, kind: _Quantity) -> float:
    answer: float = click.prompt(question, type=kind)
    return answer


def _write_case(path: Path, text: str, ranks: int) -> Estimate:
    """Check a case and write it; return its size."""
    if path.exists() or path.is_symlink():
        problem = Problem("is there already; name another file", file=str(path))
        raise CaseError([problem])
    folder_name(path)
    case = case_from_dict(tomllib.loads(text), path.parent)
    write_text(path, text)
    return estimate(case, ranks)
