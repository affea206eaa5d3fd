"""The documents name only what exists, and each fact in one place."""

import importlib
import re
import shlex
import tomllib

import click
import pytest
from documents import (
    NAMES,
    anchors,
    code_lines,
    folder_of,
    links,
    prose,
    spans,
    table_rows,
    text_of,
)
from launch import TOP

from mpisph import __version__
from mpisph.cli.main import cli
from mpisph.io.checkpoint import PARTICLE_BYTES

EVERY_DOCUMENT = pytest.mark.parametrize("name", NAMES)
SCRIPTS = [p for p in (TOP / "scripts").iterdir() if p.suffix in {"", ".sh"}]
SCRIPTS_TEXT = "\n".join(path.read_text(encoding="utf-8") for path in SCRIPTS)

FOREIGN = {
    "--allow-run-as-root", "--oversubscribe",  # mpirun
    "--array", "--kill-on-bad-exit",  # sbatch, srun
    "--no-build-isolation", "--no-cache-dir",  # pip
    "--with-mpi", "--killed-runs", "--damaged-files", "--hypothesis-profile",  # pytest
}  # fmt: skip
"""Options of other programs, and of the plugins of pytest."""


def test_every_part_has_its_document():
    wanted = {"", "mpisph", "mpisph/physics", "mpisph/materials", "cases", "tests"}
    wanted |= {"cases/studies"}
    here = {str(folder_of(name).relative_to(TOP)) for name in NAMES}
    assert {folder or "." for folder in wanted | {"scripts"}} <= here
    read_on = text_of("README.md")
    for name in NAMES:
        assert name == "README.md" or f"]({name})" in read_on, name


def test_the_front_page_is_short_and_begins_with_picture_and_commands():
    lines = text_of("README.md").splitlines()
    assert len(lines) <= 150
    first_screen = "\n".join(lines[:30])
    assert "<img src=" in first_screen
    assert "scripts/run cases/" in first_screen
    assert "scripts/test" in first_screen


@EVERY_DOCUMENT
def test_links_lead_somewhere(name):
    for link in links(text_of(name)):
        path, _, anchor = link.partition("#")
        target = folder_of(name) / path if path else TOP / name
        assert target.exists(), link
        if anchor:
            headings = anchors(target.read_text(encoding="utf-8"))
            assert headings.count(anchor) == 1, link


@EVERY_DOCUMENT
def test_paths_exist(name):
    parts = r"(?<![\w/.<>*-])(?:scripts|cases|mpisph|tests)/[\w./-]+"
    for path in re.findall(parts, text_of(name)):
        assert (TOP / path.rstrip(".")).exists(), path


@EVERY_DOCUMENT
def test_modules_and_functions_exist(name):
    for span in spans(text_of(name)):
        if re.fullmatch(r"mpisph(\.\w+)+", span):
            resolve(span)


def resolve(dotted):
    """Return what a full name such as ``mpisph.case.load_case`` stands for."""
    try:
        return importlib.import_module(dotted)
    except ModuleNotFoundError:
        module, _, attribute = dotted.rpartition(".")
        return getattr(importlib.import_module(module), attribute)


@EVERY_DOCUMENT
def test_commands_can_be_given_so(name):
    for line in code_lines(text_of(name)):
        found = re.search(r"(?:^|[\s`])mpisph ([a-z].*)", line)
        if found:
            words = shlex.split(re.split(r" [>|] ", found[1])[0])
            parse(cli, [word.strip("[]") for word in words], line)


def parse(command, words, line):
    """Have click read a command, with the options that are given."""
    while isinstance(command, click.Group) and words:
        assert words[0] in command.commands, line
        command, words = command.commands[words[0]], words[1:]
    command.make_parser(click.Context(command)).parse_args(words)


def test_a_wrong_command_is_noticed():
    with pytest.raises(AssertionError):
        parse(cli, ["walk", "CASE"], "")
    with pytest.raises(click.NoSuchOption):
        parse(cli, ["study", "run", "STUDY", "--rank", "3"], "")


def test_every_command_is_on_the_front_page():
    for name in cli.commands:
        assert f"mpisph {name}" in text_of("README.md"), name


@EVERY_DOCUMENT
def test_options_exist(name):
    commands = [*cli.commands.values()]
    commands += [c for g in commands for c in getattr(g, "commands", {}).values()]
    options = {o for c in commands for p in c.params for o in p.opts} | {"--help"}
    options |= set(re.findall(r"(?m)^ *(--[a-z]+)(?: +|\))", SCRIPTS_TEXT)) | FOREIGN
    lines = "\n".join(code_lines(text_of(name)))
    assert set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", lines)) <= options


@EVERY_DOCUMENT
def test_environment_variables_are_read_somewhere(name):
    sources = SCRIPTS_TEXT + (TOP / "mpisph/core/jit.py").read_text(encoding="utf-8")
    for variable in re.findall(r"\bMPISPH_[A-Z]+(?:_[A-Z]+)*", text_of(name)):
        assert re.search(rf"\b{variable}\b", sources), variable


def test_nothing_is_said_twice():
    """No sentence and no row of a table stands in two places."""
    seen = {}
    for name in NAMES:
        body = re.sub(r"^\|[-|: ]+$", "", prose(text_of(name)), flags=re.M)
        rows = re.findall(r"^\|.+$", body, re.M)
        words = re.sub(r"\s+", " ", re.sub(r"^\|.+$", "", body, flags=re.M))
        for piece in [*rows, *re.split(r"(?<=[.:;]) ", words)]:
            if len(piece) > 50:
                assert piece not in seen, f"{name} and {seen[piece]}: {piece}"
                seen[piece] = name


def test_the_folders_are_listed_as_they_lie_upon_each_other():
    settings = tomllib.loads(text_of("pyproject.toml"))
    (contract,) = settings["tool"]["importlinter"]["contracts"]
    layers = [re.findall(r"\w+", layer) for layer in contract["layers"]]
    rows = table_rows(text_of("mpisph/README.md"), "| folder | holds |")
    listed = [row[0].strip("`/") for row in rows]
    assert listed == [name for layer in layers for name in layer]


def test_the_helpers_of_the_tests_are_listed():
    rows = table_rows(text_of("tests/README.md"), "| module | gives |")
    listed = re.findall(r"`(\w+\.py)`", " ".join(row[0] for row in rows))
    assert sorted(listed) == sorted(p.name for p in (TOP / "tests").glob("*.py"))


def test_the_scripts_are_listed():
    rows = table_rows(text_of("scripts/README.md"), "| script | does |")
    listed = re.findall(r"\]\(([\w.]+)\)", " ".join(row[0] for row in rows))
    there = {p.name for p in (TOP / "scripts").iterdir() if p.suffix != ".md"}
    assert set(listed) == there


def test_the_size_of_a_checkpoint_is_what_a_particle_takes_there():
    said = re.search(r"A million particles take (\d+) MB", text_of("cases/README.md"))
    assert int(said.group(1)) == PARTICLE_BYTES


def test_the_citation_and_the_changelog_are_of_this_version():
    assert f"\nversion: {__version__}\n" in text_of("CITATION.cff")
    changes = text_of("CHANGELOG.md")
    versions = re.findall(r"^## \[(.+?)\]", changes, re.M)
    assert versions[0] == "Unreleased" or versions[0] == __version__
    assert __version__ in versions
