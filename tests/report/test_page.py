"""What every page shares: escaping, tables, links."""

import jinja2
import pytest
from report_pages import Page

from mpisph.figures.embed import Picture
from mpisph.report.page import (
    Figure,
    Link,
    Notice,
    Table,
    environment,
    symbols,
)

NASTY = """<script>alert("1")</script> & 'x' $R_b$"""


def made(call, **context):
    """The HTML of one of the parts of pages."""
    source = '{% import "parts.html" as parts %}{{ parts.' + call + " }}"
    return environment().from_string(source).render(context)


def test_tables_have_heads_rows_links_and_a_caption():
    rows = [(Link("first", "run-1"), "1.5"), ("second", "R_b 2")]
    html = made("table(t)", t=Table("Sizes", ("run", "R_b"), rows, "in mm", True))
    page = Page(html)
    assert page.tables == [[["run", "Rb"], ["first", "1.5"], ["second", "Rb 2"]]]
    assert page.all("a", "href") == ["#run-1"]
    assert page.all("th", "scope") == ["col", "col", "row", "row"]
    assert page.headings == ["Sizes"]
    assert "in mm" in page.text
    assert "numbers" in html


def test_a_list_of_names_and_values_has_no_head():
    page = Page(made("table(t)", t=Table("", ("", ""), [("name", "value")])))
    assert page.tables == [[["name", "value"]]]
    assert "thead" not in page.tags


def test_a_table_without_rows_is_left_out():
    assert made("table(t)", t=Table("none", ("a", "b"), [])).strip() == ""


@pytest.mark.parametrize(
    "html",
    [
        made("table(t)", t=Table(NASTY, (NASTY, "b"), [(NASTY, NASTY)], NASTY)),
        made("table(t)", t=Table("", ("a",), [(Link(NASTY, NASTY),)])),
        made("figure(f)", f=Figure(NASTY, Picture("data:,", 1, 1), NASTY)),
        made("notices(n)", n=[Notice("bad", NASTY)]),
        str(symbols(NASTY)),
    ],
)
def test_all_text_is_escaped(html):
    page = Page(html)
    assert "script" not in page.tags
    assert """<script>alert("1")</script> & 'x' $Rb$""" in page.text
    assert "<script" not in html


def test_letters_of_the_cloud_are_set_lower_and_no_others():
    assert symbols("R_b and L_b") == "R<sub>b</sub> and L<sub>b</sub>"
    assert symbols("u_z and u_r") == "u<sub>z</sub> and u<sub>r</sub>"
    assert symbols("R_body X_b MR_b") == "R_body X_b MR_b"


def test_a_name_that_the_template_lacks_is_an_error():
    with pytest.raises(jinja2.UndefinedError):
        environment().get_template("base.html").render()
