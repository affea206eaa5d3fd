"""The examples in the documents work, and the tables agree with the program."""

import copy
import re
import subprocess
import sys
import tomllib
from typing import get_args

import pytest
from documents import (
    NAMES,
    example_case,
    fences,
    join,
    table_rows,
    text_of,
)
from launch import CASES, TOP, environment
from pydantic import BaseModel

from mpisph.case import Case, case_from_dict
from mpisph.case.bodies import Body
from mpisph.case.discretise import discretise
from mpisph.figures.fields import SHOWN_FIELDS
from mpisph.inputs.quantities import si_value
from mpisph.io.initial_file import write_initial
from mpisph.io.snapshot import SAVED
from mpisph.materials import Material, card_names
from mpisph.physics.response import MODEL_FIELDS
from mpisph.study.columns import quantities
from mpisph.study.model import load_study

CASES_PAGE = text_of("cases/README.md")
STUDIES_PAGE = text_of("cases/studies/README.md")
BODIES = get_args(get_args(Body)[0])


def test_the_case_on_the_front_page_is_complete():
    case = case_from_dict(example_case())
    assert [body.name for body in case.bodies] == ["rod", "plate"]
    assert case.bodies[0].velocity == 4e3
    assert case.spacing == pytest.approx(3e-3 / 8)


@pytest.mark.parametrize("number", range(len(fences(CASES_PAGE, "toml"))))
def test_pieces_of_a_case_fit_into_it(number, tmp_path, monkeypatch):
    piece = tomllib.loads(fences(CASES_PAGE, "toml")[number])
    plain = example_case()
    monkeypatch.chdir(tmp_path)
    if "initial" in piece:
        particles = discretise(case_from_dict(plain))
        write_initial(tmp_path, particles).rename(piece["initial"]["file"])
    for material in piece.get("materials", {}).values():
        if "table" in material:
            (text,) = fences(CASES_PAGE, "csv")
            (tmp_path / material["table"]["file"]).write_text(text)
    if "shield" in piece:  # in place of the bodies, and complete
        assert case_from_dict(piece).shield is not None
        return
    changed = join(copy.deepcopy(plain), piece)
    assert case_from_dict(changed) != case_from_dict(plain)


def test_the_study_is_complete(tmp_path):
    text, _ = fences(STUDIES_PAGE, "toml")
    (tmp_path / "study.toml").write_text(text)
    (tmp_path / "cases").symlink_to(CASES)
    study = load_study(tmp_path / "study.toml")
    assert len(study.cases) == 9
    viscosities = [c.case.scheme.viscosity for c in study.cases]
    assert all(v.alpha == v.beta for v in viscosities)


def test_the_study_of_own_designs_is_complete(tmp_path):
    _, text = fences(STUDIES_PAGE, "toml")
    (rows,) = fences(STUDIES_PAGE, "text")
    (tmp_path / "study.toml").write_text(text)
    (tmp_path / "designs.csv").write_text(rows)
    (case,) = fences(text_of("README.md"), "toml")
    (tmp_path / "rod.toml").write_text(case)
    study = load_study(tmp_path / "study.toml")
    assert [c.case.bodies[0].velocity for c in study.cases] == [4e3, 5e3, 6e3]
    assert study.drawn == ("hole_mm", "kinetic_energy_plate_3us_J")


def test_the_columns_are_those_of_a_study():
    named = set()
    for cell, _ in table_rows(STUDIES_PAGE, "| column | is |"):
        named |= set(re.findall(r"`(\w+)`", cell))
    found = {part for pair in quantities(["NAME"]) for part in pair}
    assert named == found


def test_there_are_no_other_examples():
    """What is not run here would go stale."""
    blocks = {(n, kind) for n in NAMES for kind in ("toml", "python")}
    found = {(n, kind) for n, kind in blocks if fences(text_of(n), kind)}
    assert found == {
        ("README.md", "toml"),
        ("cases/README.md", "toml"),
        ("cases/studies/README.md", "toml"),
        ("mpisph/README.md", "python"),
    }


def test_the_python_examples_run_one_after_the_other(tmp_path):
    code = "\n".join(fences(text_of("mpisph/README.md"), "python"))
    short = code.replace(
        '["resolution.npr=6"]',
        '["resolution.npr=4", "time.end=1e-7", "output.figures=false"]',
    )
    short = short.replace('at("6 us")', 'at("0.1 us")')
    short = short.replace('"runs/', f'"{tmp_path}/')
    assert short.count("npr=4") == short.count("0.1 us") == 1
    assert "runs/" not in short
    done = subprocess.run(
        [sys.executable, "-c", short],
        cwd=TOP,
        env=environment(),
        check=True,
        timeout=120,
        capture_output=True,
        text=True,
    )
    assert "completed" in done.stdout
    assert {"coarse", "warm"} == {path.name for path in tmp_path.iterdir()}


def test_the_cases_are_those_shipped():
    rows = table_rows(CASES_PAGE, "| case | what it is |")
    listed = re.findall(r"`([\w-]+)`", " ".join(row[0] for row in rows))
    assert sorted(listed) == sorted(path.stem for path in CASES.glob("*.toml"))


def test_the_studies_and_their_sizes_are_those_shipped():
    listed = {}
    for names, sizes, _ in table_rows(STUDIES_PAGE, "| study | runs | what it is |"):
        found = re.findall(r"`([\w-]+)`", names)
        numbers = list(map(int, re.findall(r"\d+", sizes)))
        listed |= dict(zip(found, numbers * (len(found) // len(numbers)), strict=True))
    files = {path.stem: path for path in (CASES / "studies").glob("*.toml")}
    del files["claims"]
    sizes = {name: len(load_study(path).cases) for name, path in files.items()}
    assert listed == sizes


def test_the_claims_are_those_of_their_file():
    block = STUDIES_PAGE.partition("<!-- claims -->")[2]
    block = block.partition("<!-- end of claims -->")[0]
    text = (CASES / "studies/claims.toml").read_text(encoding="utf-8")
    claims = tomllib.loads(text)["claims"]
    findings = [f"- {c['number']}: {c['finding']}" for c in claims if "finding" in c]
    for claim in claims:
        number, tries = claim["number"], claim["tries"]
        assert f"| {number}. {claim['text']} | {tries[0]['name']}: **" in block
        assert all(f"| {attempt['name']}: **" in block for attempt in tries)
    assert re.findall(r"^- .+$", block, re.M) == findings
    assert block.count("**") == 2 * sum(len(claim["tries"]) for claim in claims)


def test_the_cards_are_those_shipped():
    rows = table_rows(CASES_PAGE, "| cards | what they are |")
    listed = [name for row in rows for name in re.findall(r"`([\w-]+)`", row[0])]
    assert sorted(listed) == sorted(card_names())


def test_the_fields_are_those_of_snapshots_and_of_pictures():
    listed = {"always": set(), "with models": set()}
    for names, _, where in table_rows(CASES_PAGE, "| field | is | where |"):
        kind = where if where == "always" else "with models"
        listed[kind] |= set(re.findall(r"`(\w+)`", names))
    sometimes = MODEL_FIELDS | {"retired"}  # of shields
    assert listed["with models"] == sometimes
    saved = {"r", "z", "u", *SAVED} - {"u_r", "u_z"}
    assert listed["always"] == saved - sometimes
    shown = table_rows(CASES_PAGE, "| `--field` | shows | unit |")
    names = [name for row in shown for name in re.findall(r"`([\w-]+)`", row[0])]
    assert sorted(names) == sorted(SHOWN_FIELDS)


def test_the_shapes_and_their_keys_are_those_of_a_case():
    keys = {}
    for shape, own, _ in table_rows(CASES_PAGE, "| shape | its own keys |"):
        keys[shape.strip("`")] = set(re.findall(r"`([a-z_]+)`", own))
    common = set.intersection(*(set(body.model_fields) for body in BODIES))
    shapes = {get_args(b.model_fields["shape"].annotation)[0]: b for b in BODIES}
    assert keys == {name: set(b.model_fields) - common for name, b in shapes.items()}
    sentence = re.search(r"Common to all shapes\s(.+?)\.\sBodies", CASES_PAGE, re.S)[1]
    assert set(re.findall(r"`([a-z_]+)`", sentence)) == common - {"shape"}


def test_the_constants_are_those_of_a_material():
    listed = {}
    for names, meaning in table_rows(CASES_PAGE, "| constant | meaning |"):
        listed |= dict.fromkeys(re.findall(r"`([\w-]+)`", names), meaning)
    fields = {f.alias or n: f for n, f in Material.model_fields.items()}
    assert sorted(listed) == sorted(fields)
    for name, field in fields.items():
        if (table := inner_model(field)) is not None:
            constants = set(re.findall(r"`(\w+)`", listed[name]))
            assert constants == set(table.model_fields) - {"sources"}


def inner_model(field):
    """The model of a table that a field holds, None for a plain value."""
    kinds = [field.annotation, *get_args(field.annotation)]
    models = [k for k in kinds if isinstance(k, type) and issubclass(k, BaseModel)]
    return models[0] if models else None


def settings(model, prefix=""):
    """Every key below a model with its field, except of what the user names."""
    for name, field in model.model_fields.items():
        named_by_user = name in {"title", "bodies", "materials"} and model is Case
        if named_by_user or name == "sources":
            continue
        inner = inner_model(field)
        many = "[]" if "tuple" in str(field.annotation) else ""
        if inner is None:
            yield f"{prefix}{name}", field
        else:
            yield from settings(inner, f"{prefix}{name}{many}.")


def default_in(cell):
    """The default that a cell of the table names."""
    if cell == "none":
        return None
    value = tomllib.loads(f"x = {cell.strip('`')}")["x"]
    if isinstance(value, str) and value[0].isdigit():
        return si_value(value, "s")
    return tuple(value) if isinstance(value, list) else value


def test_the_settings_and_their_defaults_are_those_of_a_case():
    rows = table_rows(CASES_PAGE, "| key | default | meaning |")
    listed = {key.strip("`"): (default, meaning) for key, default, meaning in rows}
    fields = dict(settings(Case))
    assert sorted(listed) == sorted(fields)
    for key, field in fields.items():
        default, meaning = listed[key]
        if field.is_required():
            assert default == "required", key
        else:
            assert default_in(default) == field.default, key
        for choice in get_args(field.annotation):
            if isinstance(choice, str):
                assert f"`{choice}`" in meaning, f"{key}: {choice}"
