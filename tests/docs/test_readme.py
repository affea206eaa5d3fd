"""The README says only what is true: its equation table and its commands."""

import ast
import importlib
import re
import subprocess
import sys

import pytest
from launch import TOP, environment

from mpisph.case import load_case
from mpisph.cli.main import cli
from mpisph.study.model import load_study

README = (TOP / "README.md").read_text(encoding="utf-8")
ROW = re.compile(
    r"^\| (R\d+) \| .+ \| `(\w+)\.(\w+)` \| `([\w/.]+)::(\w+)` \| (.+) \|$"
)
ROWS = [m.groups() for m in map(ROW.match, README.splitlines()) if m]
EQUATION_MODULES = (
    "kernel",
    "viscosity",
    "heat",
    "strength",
    "eos",
    "smoothing",
    "timestep",
)


def test_the_table_has_every_equation_of_the_theory():
    assert {row[0] for row in ROWS} == {f"R{n}" for n in range(1, 13)}


@pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row[0]}-{row[2]}")
def test_function_and_test_of_a_row_exist(row):
    equation, module, function, test_file, test, source = row
    found = getattr(importlib.import_module(f"mpisph.{module}"), function)
    assert re.search(rf"\b{equation}\b", found.__doc__), "its docstring has the id"
    tree = ast.parse((TOP / "tests" / test_file).read_text(encoding="utf-8"))
    assert test in {n.name for n in tree.body if isinstance(n, ast.FunctionDef)}
    assert source


def test_every_equation_function_is_in_the_table():
    listed = {(module, function) for _, module, function, *_ in ROWS}
    # Polynomials and dispatch that the listed functions are made of.
    parts = {"i0_far", "ratio_far", "i0_near", "i1_near", "pressure"}
    for module in EQUATION_MODULES:
        tree = ast.parse((TOP / "mpisph" / f"{module}.py").read_text(encoding="utf-8"))
        for node in tree.body:
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                text = ast.get_docstring(node) or ""
                if re.search(r"\(R\d+", text) and node.name not in parts:
                    compiled = bool(node.decorator_list)
                    assert (module, node.name) in listed or not compiled, node.name


def test_commands_and_options_exist():
    commands = set(re.findall(r"\bmpisph ([a-z]+)\b(?= (?:CASE|RUN|cases)|  )", README))
    assert {"run", "schema", "figures", "clock", "bench"} <= commands
    assert commands <= set(cli.commands)
    for group in ("cache", "study"):
        named = set(re.findall(rf"\bmpisph {group} ([a-z]+)", README))
        assert named
        assert named <= set(cli.commands[group].commands)
    every = [*cli.commands.values()]
    every += [c for group in every for c in getattr(group, "commands", {}).values()]
    options = {o for c in every for p in c.params for o in p.opts}
    foreign = {"--array", "--kill-on-bad-exit"}  # of sbatch and srun
    assert set(re.findall(r"(?<=\s)--[a-z-]+", README)) <= options | foreign


def test_files_that_the_readme_names_exist():
    for path in re.findall(r"\b(?:scripts|cases)/[\w.-]+", README):
        assert (TOP / path).exists(), path
    for name in ("piekutowski-4-1283", "paper-base-case", "plate-impact"):
        assert (TOP / "cases" / f"{name}.toml").exists()


def test_the_example_case_is_whole(tmp_path):
    section, _, text = re.findall(r"```toml\n(.*?)```", README, re.S)
    path = tmp_path / "case.toml"
    path.write_text(text)
    case = load_case(path, ["bodies.rod.velocity=5 km/s"])
    assert [body.name for body in case.bodies] == ["rod", "plate"]
    assert case.bodies[0].velocity == 5e3
    assert case.spacing == pytest.approx(3e-3 / 8)
    path.write_text(text + section)
    checkpoints = load_case(path).checkpoints
    assert (checkpoints.wall_interval, checkpoints.interval) == (1800.0, 1e-6)


def test_the_example_study_is_whole(tmp_path):
    _, text, _ = re.findall(r"```toml\n(.*?)```", README, re.S)
    path = tmp_path / "study.toml"
    path.write_text(text.replace('"cases/', f'"{TOP}/cases/'))
    study = load_study(path)
    assert len(study.cases) == 9
    viscosities = [c.case.scheme.viscosity for c in study.cases]
    assert all(v.alpha == v.beta for v in viscosities)


def test_the_studies_and_their_sizes_are_those_shipped():
    rows = re.findall(r"^\| (`[a-z0-9`, -]+) \| ([\d, each]+) \|", README, re.M)
    named = {}
    for names, sizes in rows:
        found = re.findall(r"`([\w-]+)`", names)
        numbers = list(map(int, re.findall(r"\d+", sizes)))
        named |= dict(zip(found, numbers * (len(found) // len(numbers)), strict=True))
    files = {p.stem: p for p in (TOP / "cases/studies").glob("*.toml")}
    del files["claims"]
    assert named == {name: len(load_study(path).cases) for name, path in files.items()}


def test_the_python_example_runs(tmp_path):
    (code,) = re.findall(r"```python\n(.*?)```", README, re.S)
    short = code.replace(
        '["resolution.npr=6"]', '["resolution.npr=4", "time.end=1e-7"]'
    )
    short = short.replace('Path("runs/coarse")', f'Path("{tmp_path}")')
    assert short.count("npr=4") == short.count(str(tmp_path)) == 1
    subprocess.run(
        [sys.executable, "-c", short],
        cwd=TOP,
        env=environment(),
        check=True,
        timeout=120,
    )
    assert (tmp_path / "result.json").exists()
