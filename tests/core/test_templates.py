"""Templates of pages: escaped, complete, and those of the first package first."""

import jinja2
import pytest

from mpisph.core.templates import templates_of


def test_text_is_escaped():
    made = templates_of("mpisph.report").from_string("{{ text }}")
    assert made.render(text="<b>") == "&lt;b&gt;"


def test_a_name_that_is_missing_is_an_error():
    made = templates_of("mpisph.report").from_string("{{ nothing }}")
    with pytest.raises(jinja2.UndefinedError, match="nothing"):
        made.render()


def test_all_packages_are_looked_in():
    both = templates_of("mpisph.report", "mpisph.viewer").list_templates()
    assert {"runs.html", "viewer.html"} <= set(both)
    assert "runs.html" not in templates_of("mpisph.viewer").list_templates()
