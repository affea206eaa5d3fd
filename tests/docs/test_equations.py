"""The table of equations: every equation has its function, test and source."""

import ast
import re

import pytest
from documents import table_rows, text_of
from launch import TOP

PAGE = text_of("mpisph/physics/README.md")
ROWS = table_rows(PAGE, "| id | what | function | test | source |")

# Where equations stand: every module below the first, and the others.
SOURCES = [
    *sorted((TOP / "mpisph/physics").rglob("*.py")),
    TOP / "mpisph/sph/gradient.py",
    TOP / "mpisph/sph/rates.py",
    TOP / "mpisph/sph/timestep.py",
]


def definitions(path):
    """The functions of a module, as they are written."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return {n.name: n for n in tree.body if isinstance(n, ast.FunctionDef)}


def source_of(module):
    """The file of a module, by its full name."""
    path = TOP.joinpath(*module.split("."))
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def test_every_equation_of_the_theory_has_a_row_and_a_section():
    ids = {f"R{n}" for n in range(1, 22)}
    assert {row[0] for row in ROWS} == ids
    assert set(re.findall(r"^## (R\d+) ", PAGE, re.M)) == ids
    assert all(len(row) == 5 for row in ROWS)
    assert all(row[1] and row[4] for row in ROWS)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row[0]}-{row[2]}")
def test_function_and_test_of_a_row_exist(row):
    equation, _, function, test, _ = row
    module, _, name = function.strip("`").rpartition(".")
    found = definitions(source_of(module)).get(name)
    assert found is not None, function
    documented = ast.get_docstring(found) or ""
    assert re.search(rf"\b{equation}\b", documented), "its docstring has the id"
    path, _, test_name = test.strip("`").partition("::")
    assert test_name in definitions(TOP / path)
    assert equation.lower() in test_name.split("_"), "the test's name has the id"


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(TOP)))
def test_every_equation_function_is_in_the_table(path):
    listed = {row[2].strip("`") for row in ROWS}
    module = ".".join(path.relative_to(TOP).with_suffix("").parts)
    module = module.removesuffix(".__init__")
    for name, node in definitions(path).items():
        equation = re.search(r"\(R\d+", ast.get_docstring(node) or "")
        if equation and node.decorator_list and not name.startswith("_"):
            assert f"{module}.{name}" in listed


def test_the_equations_are_found_where_they_are_looked_for():
    names = {name for path in SOURCES for name in definitions(path)}
    assert {"ring_averages", "hoop_approach", "heat_flow", "signal_limit"} <= names
