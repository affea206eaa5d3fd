"""Whatever stands in a case file, a sound case or an error for people comes of it.

Many more examples, which take some minutes::

    pytest -k fuzz --hypothesis-profile=soak -o faulthandler_timeout=0 tests/case
"""

import math
import re
import tomllib
from copy import deepcopy

import numpy as np
import pytest
import tomli_w
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from launch import CASES, MPISPH, launch
from shapes import example, lengths

from mpisph.case import case_schema, load_case
from mpisph.case.bodies import SHAPES, particle_count
from mpisph.case.discretise import discretise
from mpisph.case.shapes.rectangle import Rectangle
from mpisph.core.errors import CaseError
from mpisph.parallel.collectives import caught
from mpisph.solver.estimate import estimate

pytestmark = pytest.mark.slow

TEXTS = [path.read_text(encoding="utf-8") for path in sorted(CASES.glob("*.toml"))]

FEW = 20_000
"""Particles that are soon made."""

fuzz = settings(
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large]
)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return tmp_path_factory.mktemp("fuzz") / "case.toml"


# What is expected of every input


def check(path, content, overrides=()):
    """Load some bytes as a case file and judge what comes of it."""
    path.write_bytes(content)
    try:
        case = load_case(path, overrides)
    except CaseError as error:
        check_problems(error, path, content, overrides)
    else:
        check_case(case, path)


def check_problems(error, path, content, overrides):
    assert error.problems
    assert str(error)
    lines = content.count(b"\n") + 1
    for problem in error.problems:
        text = str(problem)
        assert text.isprintable() or "\n" not in text
        assert len(text) < 3000
        assert problem.expected
        if problem.line is not None:
            assert problem.file == str(path)
            assert 1 <= problem.line <= lines
        elif problem.file == str(path):
            assert is_about_the_whole_file(problem, content)
        else:
            assert overrides
            assert problem.file.startswith("--set ")


def is_about_the_whole_file(problem, content):
    """Say whether no line can be named: a key that is missing, or no TOML at all."""
    if not problem.key:
        return True
    keys = tomllib.loads(content.decode("utf-8-sig"))
    return problem.key.split(".")[0] not in keys


def check_case(case, path):
    path.write_text(case.to_toml(), encoding="utf-8")
    assert load_case(path) == case
    size = estimate(case, 2)
    assert all(math.isfinite(figure) and figure > 0 for figure in size)
    assert str(size.particles) in size.text()
    times = np.array([0.0, *case.output_times])
    assert np.isfinite(times).all()
    assert (np.diff(times) > 0.0).all()
    if particle_count(case.bodies, case.spacing) < FEW:
        check_particles(case)


def check_particles(case):
    found = []
    error = caught(lambda: found.append(discretise(case)))
    if error is not None:  # an expression has no value somewhere
        assert isinstance(error, CaseError)
        assert "expected" in error.problems[0].expected
        return
    p = found[0]
    counts = np.bincount(p.body, minlength=len(case.bodies))
    assert counts.min() > 0
    for body, count in zip(case.bodies, counts, strict=True):
        promised = particle_count([body], case.spacing)
        # Along the rims of a round section, cells are counted in part.
        rims = 0.0
        if not isinstance(body.section, Rectangle):
            inner, _ = body.section.radii(np.linspace(*body.section.ends, 101))
            rims = 2.0 + 4.0 * (inner.max() + body.section.widest) / case.spacing
        assert abs(int(count) - promised) <= rims
    for name, values in p.fields().items():
        assert np.isfinite(values).all(), name
    assert min(p.r.min(), p.m.min(), p.rho.min(), p.h.min()) > 0.0


# What is tried

EXTREMES = """
    0 -0.0 1 -1 +3 nan -nan inf -inf 1e400 -1e308 5e-324 1e-15 1e-9 1e-3 0.5 1e6 1e15
    1_000 0b1 0o7
""".split()
NUMBERS = st.one_of(
    st.sampled_from([*EXTREMES, "9" * 25, "9" * 5000, "0x" + "f" * 4000]),
    st.integers().map(str),
    st.integers(1, 100).map(str),
    st.floats().map(lambda x: repr(x).replace("+", "")),
    st.floats(1e-6, 1e3).map(repr),
)
LONG_EXPONENTS = st.sampled_from(["1e999999999", "1e-999999999", "1e" + "9" * 19])
UNITS = """
    m mm um km us ns s hour km/s m/s GPa kg/m3 g/cm^3 MJ/kg % inch psi kg K degC dB m**2
    m^-9 1/s parsec planck_length Ym ym furlongz m\u0663 \u33a1 c pi e nan
""".split()
QUANTITIES = st.builds(
    lambda number, space, unit: f"{number}{space}{unit}",
    NUMBERS | LONG_EXPONENTS,
    st.sampled_from(["", " ", "  "]),
    st.sampled_from([*UNITS, "", "m m m", "m*" * 40 + "m"]) | st.text(max_size=8),
)
EXPRESSIONS = [
    "3*s", "1e3*(1 - r**2)", "where(s < 0.01, 1e6, 0)", "1/(r - r)", "9**9**9**9*s",
    "where(r < 1, 2)", "x*2", "-" * 300 + "r", "(" * 200, "r if z else s", "r.real",
]  # fmt: skip
WORDS = """
    sphere plate cylinder spherical_shell ball wall al-lee2003 cu-ofhc al-6061-t6
    cu-ofch tillotson linear none fixed automatic clamp zero off classic printed z zr
    auto $x^{
""".split()
ODD = ["", " ", "x" * 300, "a\x1b[31m", "a\nb", "\u202e", "\U0001f600"]
STRINGS = st.one_of(
    QUANTITIES,
    st.sampled_from(EXPRESSIONS),
    st.sampled_from([*WORDS, *ODD]),
    st.text(max_size=12),
)
QUOTED = STRINGS.map(
    lambda text: tomli_w.dumps({"x": text}).partition(" = ")[2].strip()
)
OTHERS = """
    true false [] {} [[]] [1,2] {value=1,source='a'} 1979-05-27 07:32:00 0001-01-01
    1979-05-27T07:32:00Z \'\' \'\'\' == {a.b.c=1}
""".split()
LONG = ["[" * 60 + "]" * 60, "[" * 3000, "[" + "1," * 1500 + "]"]
VALUES = st.one_of(NUMBERS, QUOTED, st.sampled_from([*OTHERS, *LONG]))
LINE = re.compile(r"^(\s*[\w.-]+\s*=\s*)(.*)$")
KNOWN_KEYS = sorted(
    {"bodies", "value", "source", "al-lee2003", "cu-ofhc", "own", "al", ""}.union(
        *(part.get("properties", {}) for part in case_schema()["$defs"].values()),
        case_schema()["properties"],
    )
)


@st.composite
def mutated(draw):
    """A shipped file with some lines changed."""
    lines = draw(st.sampled_from(TEXTS)).splitlines()
    for _ in range(draw(st.integers(1, 6))):
        draw(st.sampled_from(MUTATIONS))(draw, lines)
    return "\n".join(lines) + draw(st.sampled_from(["", "\n", "\r\n"]))


def change_value(draw, lines):
    places = [i for i, line in enumerate(lines) if LINE.match(line)]
    if places:
        i = draw(st.sampled_from(places))
        lines[i] = LINE.match(lines[i])[1] + draw(VALUES)


def set_known_key(draw, lines):
    i = draw(st.integers(0, len(lines)))
    lines.insert(i, f"{draw(st.sampled_from(KNOWN_KEYS))} = {draw(VALUES)}")


def delete_line(draw, lines):
    if lines:
        del lines[draw(st.integers(0, len(lines) - 1))]


def copy_line(draw, lines):
    if lines:
        line = lines[draw(st.integers(0, len(lines) - 1))]
        lines.insert(draw(st.integers(0, len(lines))), line)


def swap_lines(draw, lines):
    if lines:
        i, j = (draw(st.integers(0, len(lines) - 1)) for _ in range(2))
        lines[i], lines[j] = lines[j], lines[i]


def truncate(draw, lines):
    del lines[draw(st.integers(0, len(lines))) :]
    if lines:
        lines[-1] = lines[-1][: draw(st.integers(0, len(lines[-1])))]


def insert_text(draw, lines):
    if lines:
        i = draw(st.integers(0, len(lines) - 1))
        j = draw(st.integers(0, len(lines[i])))
        lines[i] = lines[i][:j] + draw(st.text(max_size=4)) + lines[i][j:]


def splice(draw, lines):
    other = draw(st.sampled_from(TEXTS)).splitlines()
    lines[draw(st.integers(0, len(lines))) :] = other[
        draw(st.integers(0, len(other))) :
    ]


MUTATIONS = [
    change_value,
    change_value,
    set_known_key,
    delete_line,
    copy_line,
    swap_lines,
    truncate,
    insert_text,
    splice,
]

POOL = st.one_of(
    st.booleans(),
    st.integers(),
    st.integers(1, 50),
    st.floats(),
    st.sampled_from([1e-3, 5e-3, 1e-6, 0.5, 2.0, 1e6, math.nan, math.inf, -math.inf]),
    STRINGS,
    st.sampled_from(["5 mm", "1 cm", "6 km/s", "2 us", "0.1 us", "-5 mm", "2 GPa"]),
    st.dates(),
    st.times(),
)
KEYS = st.one_of(st.sampled_from(KNOWN_KEYS), st.text(max_size=6))
TREES = st.recursive(
    POOL,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4), st.dictionaries(KEYS, inner, max_size=5)
    ),
    max_leaves=12,
)


def table(name, /, **more):
    """A table with some of the keys that a part of the schema knows."""
    part = case_schema()["$defs"][name]
    fields = {key: plausible(key, field) for key, field in part["properties"].items()}
    required = {key: fields.pop(key) for key in part.get("required", [])}
    optional = {key: field for key, field in fields.items() if key not in more}
    return st.fixed_dictionaries({**required, **more}, optional=optional)


PLAUSIBLE = {
    "m": ["1 mm", "2 mm", "5 mm", 1e-3, 2e-2],
    "s": ["1 us", "0.3 us", 1e-6, 5e-6],
    "m/s": [0, "6 km/s", -1.0],
    "Pa": ["1 GPa", "20 GPa", 1e9],
    "kg/m^3": ["2.7 g/cm3", 1000],
    "J/kg": ["1 MJ/kg", 5e6, "1e6*s"],
    "name": ["b0", "b1"],
    "reference": ["b0", "b1"],
    "plate": ["b0", "b1"],
    "material": ["cu-ofhc", "al-lee2003", "al-6061-t6"],
    "title": ["a title"],
    "source": ["a source"],
    "description": ["words"],
    "sources": [{}, {"rho0": "a source"}],
    "times": [[], ["0.5 us"], [1e-6, 2e-6]],
    "npr": [3, 8],
    "nph": [1, 2],
    "tillotson": [{}],
    "exposures": [[]],
}


def plausible(key, field):
    """Values of which many are valid for a key."""
    choices = [c for o in [field, *field.get("anyOf", [])] for c in o.get("enum", [])]
    if "const" in field:
        choices = [field["const"]]
    if field.get("type") == "boolean":
        choices = [True, False]
    known = PLAUSIBLE.get(key) or PLAUSIBLE.get(field.get("unit"))
    return st.sampled_from(choices or known or [0.1, 0.9, 1, 2])


@st.composite
def bodies(draw):
    """Bodies of up to 2 cm, 5 cm apart."""
    shapes = draw(st.lists(st.sampled_from(SHAPES), min_size=1, max_size=4))
    return [
        draw(table(shape.__name__, name=st.just(f"b{i}"), position=st.just(0.05 * i)))
        for i, shape in enumerate(shapes)
    ]


@st.composite
def documents(draw):
    """A case with all kinds of keys, in which some values are then replaced."""
    parts = {
        "scheme": table(
            "Scheme",
            viscosity=table("Viscosity"),
            heat=table("Heat"),
            p_min=table(
                "MinimumPressure", value=st.sampled_from([0.0, "-inf", "-1 GPa"])
            ),
        ),
        "output": table("Output"),
        "measured": table(
            "Measured", exposures=st.lists(table("Exposure"), max_size=3)
        ),
        "limits": table("Limits"),
        "parallel": table("Parallel"),
        "materials": st.dictionaries(
            st.sampled_from(["cu-ofhc", "al-lee2003", "own"]), table("Material")
        ),
    }
    resolution = st.sampled_from([{"npr": 5, "reference": "b0"}, {"spacing": "1 mm"}])
    required = {
        "title": st.just("a title"),
        "bodies": bodies(),
        "resolution": resolution | table("Resolution"),
        "time": table("TimeStepping", end=st.just("20 us")),
    }
    # A copy, for what is sampled from a list is that list's own.
    data = deepcopy(draw(st.fixed_dictionaries(required, optional=parts)))
    for _ in range(draw(st.integers(0, 2))):
        replace_something(draw, data)
    return data


def replace_something(draw, data):
    """Replace, add or delete something at a random place."""
    places = list(containers(data))
    node = places[draw(st.integers(0, len(places) - 1))]
    keys = list(node) if isinstance(node, dict) else list(range(len(node)))
    if isinstance(node, dict) and draw(st.booleans()):
        node[draw(KEYS)] = draw(TREES)
    elif keys and draw(st.booleans()):
        node[draw(st.sampled_from(keys))] = draw(TREES)
    elif keys:
        del node[draw(st.sampled_from(keys))]


def containers(node):
    """The tables and arrays of nested data."""
    yield node
    for inner in node.values() if isinstance(node, dict) else node:
        if isinstance(inner, dict | list):
            yield from containers(inner)


def magnitude(low, high):
    """Numbers of all magnitudes between two powers of ten."""
    return st.builds(
        lambda exponent, digits: digits * 10.0**exponent,
        st.integers(low, high - 1),
        st.floats(1.0, 9.99),
    )


@st.composite
def sized_cases(draw):
    """Bodies of all sizes, one behind the other."""
    spacing = draw(magnitude(-9, 3))
    z = draw(st.just(0.0) | magnitude(-9, 6) | magnitude(-9, 6).map(lambda x: -x))
    size = st.floats(0.05, 400.0).map(lambda x: x * spacing)
    placed = []
    for i in range(draw(st.integers(1, 4))):
        shape, reached = draw(st.sampled_from(SHAPES)), 0.0
        body = {**example(shape), "name": f"b{i}", "material": "cu-ofhc"}
        for key in lengths(shape):
            # What is inside comes first, and what is around it must be larger.
            around = reached if "radius" in key else 0.0
            body[key] = reached = around + draw(size)
        if draw(st.booleans()) and "inner_radius" in body:
            body["inner_radius"] = 1e-9
        low, high = shape.model_construct(**body).section.ends
        placed.append({**body, "position": z - low})
        z += high - low
    duration = draw(st.floats(0.01, 1e4)) * spacing / 3940.0
    return {
        "title": "sizes",
        "bodies": placed,
        "resolution": {"spacing": spacing, "nph": draw(st.floats(0.5, 10.0))},
        "time": {"end": duration},
        "output": {
            "times": draw(st.lists(st.floats(1e-12, 1.0).map(lambda x: x * duration))),
            "every": draw(st.floats(1e-4, 2.0)) * duration,
        },
    }


OVERRIDDEN = """
    resolution.npr resolution.spacing time.end time.cfl output.every title bodies
    bodies.sphere.radius bodies.0.position bodies.1.radius bodies.plate.thickness
    scheme.viscosity.alpha scheme.p_min.value materials.al-lee2003.rho0
    measured.clock_offset measured.exposures.0.time
""".split()


PLAIN = st.sampled_from(["3", "0.5", "1 mm", "2 us", "1 GPa", "", "words"])


@st.composite
def override(draw):
    """A change from the command line; often of a key that is there."""
    key = draw(
        st.one_of(
            st.sampled_from(OVERRIDDEN),
            st.lists(st.one_of(KEYS, st.just("0")), max_size=4).map(".".join),
            st.text(max_size=10),
        )
    )
    return (
        key
        + draw(st.sampled_from(["=", " = ", ""]))
        + draw(st.one_of(VALUES, STRINGS, PLAIN))
    )


SOUND = st.sampled_from(
    [
        "title=words",
        "time.end=2 us",
        "time.cfl=0.1",
        "output.every=0.5us",
        "scheme.viscosity.alpha=1",
        "bodies.1.radius=3 cm",
        "bodies.0.velocity=1",
    ]
)
# Lone surrogates are what an argument becomes that is no UTF-8.
OVERRIDES = st.lists(
    SOUND | override() | st.text(st.characters(), max_size=8), min_size=1, max_size=4
)


@fuzz
@given(text=mutated())
def test_mutated_files(path, text):
    check(path, text.encode("utf-8", "surrogatepass"))


@fuzz
@given(data=documents())
def test_documents_with_the_keys_of_a_case(path, data):
    try:
        text = tomli_w.dumps(data)
    except UnicodeEncodeError:
        return
    check(path, text.encode("utf-8", "surrogatepass"))


@fuzz
@given(data=sized_cases())
def test_cases_of_all_sizes(path, data):
    check(path, tomli_w.dumps(data).encode())


@fuzz
@given(content=st.binary(max_size=200), text=st.sampled_from(["", *TEXTS]))
def test_bytes(path, content, text):
    check(path, text.encode()[: 3 * len(content)] + content)


@fuzz
@given(text=st.sampled_from(TEXTS), overrides=OVERRIDES)
def test_overrides(path, text, overrides):
    check(path, text.encode(), overrides)


ODD_VALUES = """
    [] {} true -1 0 nan 1e400 1979-05-27 "" "1_m" [[1],{}] {value=[],source={}}
    "1e999999999_m" "\\u001b" 9007199254740993
""".split()


@pytest.mark.parametrize(
    "odd", [*ODD_VALUES, pytest.param("0x" + "f" * 4000, id="0xf")]
)
def test_every_value_may_be_odd(path, odd):
    """Each value of a complete case in its turn."""
    lines = load_case(CASES / "piekutowski-4-1353.toml").to_toml().splitlines()
    places = [i for i, line in enumerate(lines) if LINE.match(line)]
    assert len(places) > 80
    for i in places:
        changed = [*lines[:i], LINE.match(lines[i])[1] + odd, *lines[i + 1 :]]
        check(path, "\n".join(changed).encode())


BROKEN = {
    "is larger than 1000000 bytes": b"\x00" * 2_000_000,
    "byte 0xff is no UTF-8": b"title = '\xff'",
    "nested too deeply": b"a = " + b"[" * 100_000,
    "beyond the 64 bits": b"a = " + b"9" * 5000,
    "found invalid character": b"title = 'x\x1b[31m'",
    'title = "": expected some text': b"title = ''",
    "expected at most 1e+09": TEXTS[0].replace("npr = 6", "npr = 99999").encode(),
}


def test_broken_files_end_the_program_with_code_2(tmp_path):
    paths = [tmp_path / f"{i}.toml" for i in range(len(BROKEN))]
    for path, content in zip(paths, BROKEN.values(), strict=True):
        path.write_bytes(content)
    done = launch(1, MPISPH, "run", *paths, "--dry-run")
    assert done.returncode == 2, done.stderr
    lines = done.stderr.splitlines()
    for path, message in zip(paths, BROKEN, strict=True):
        assert any(str(path) in line and message in line for line in lines), message
    assert "Traceback" not in done.stderr
