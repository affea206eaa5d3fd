import pytest

from mpisph.inputs.toml_lines import deep_line, line_numbers

DOCUMENT = """\
title = "x"
a.b."c d" = 3

[[bodies]]
name = "s"
q = { x = 1, y = { z = 2 } }
[[bodies]] # the second
ex = [ { time = 1 },

  { time = 2 } ]
[bodies.sub]
k = [
  # a comment
  1,
  2,
]
[[bodies.rings]]
r = 1
[[bodies.rings]]
r = 2
["quoted \\u00fc".'k.v']
p = 1
"""


def test_every_form_of_key():
    lines = line_numbers(DOCUMENT)
    assert lines["title",] == 1
    assert lines["a", "b", "c d"] == 2
    assert lines["a", "b"] == 2
    assert lines["bodies",] == 4
    assert lines["bodies", 0] == 4
    assert lines["bodies", 0, "q", "y", "z"] == 6
    assert lines["bodies", 1] == 7
    assert lines["bodies", 1, "ex", 0, "time"] == 8
    assert lines["bodies", 1, "ex", 1, "time"] == 10
    assert lines["bodies", 1, "sub", "k", 0] == 14
    assert lines["bodies", 1, "sub", "k", 1] == 15
    assert lines["bodies", 1, "rings", 1, "r"] == 20
    assert lines["quoted \u00fc", "k.v", "p"] == 22


def test_empty_document():
    assert line_numbers("") == {}


@pytest.mark.parametrize(
    "deep",
    [
        "a = " + "[" * 200 + "]" * 200,
        "a = " + "{a=" * 200 + "1" + "}" * 200,
        ".".join("a" * 200) + " = 1",
        "[" + ".".join("a" * 200) + "]",
        ".".join("a" * 300_000) + " = 1",
    ],
)
def test_deep_nesting_has_a_line(deep):
    assert deep_line(f"{DOCUMENT}{deep}\n{DOCUMENT}") == DOCUMENT.count("\n") + 1


def test_documents_of_any_length_are_not_deep():
    assert deep_line(DOCUMENT) is None
    assert deep_line("[[a]]\nb = [[1, 2], [{c.d = 3}]]\n" * 10_000) is None
    assert deep_line("]]}} [ = {") is None
