"""What every page shares: templates, tables, pictures that lie within the page.

A page is one file. It fetches nothing, neither scripts nor letters nor pictures.
"""

import re
from typing import Any, NamedTuple

import jinja2
from markupsafe import Markup, escape

from mpisph.core.templates import templates_of
from mpisph.figures.embed import Picture

NONE = "–"
"""What a cell says that has nothing to say."""

_SYMBOL = re.compile(r"\b([RLu])_([brz])\b")


class Figure(NamedTuple):
    """A picture with what people need to read it.

    Attributes
    ----------
    title : str
        What it shows; also said in place of the picture where that cannot be seen.
    picture : Picture
    caption : str, optional
        What its lines, dots and colours are.
    """

    title: str
    picture: Picture
    caption: str = ""


class Link(NamedTuple):
    """A cell that leads to a place of the page.

    Attributes
    ----------
    text : str
    target : str
        Id of the place.
    """

    text: str
    target: str


class Table(NamedTuple):
    """A table.

    Attributes
    ----------
    title : str
        Empty where the heading above says it.
    columns : tuple of str
        Their heads; all empty for a list of names and values.
    rows : list of tuple of str or Link
        As many cells as there are columns; the first names the row.
    caption : str, optional
        What must be known to read it.
    numbers : bool, optional
        Whether all columns but the first hold numbers, which stand at the right.
    words : tuple of int, optional
        Columns that hold words nevertheless.
    """

    title: str
    columns: tuple[str, ...]
    rows: list[tuple[str | Link, ...]]
    caption: str = ""
    numbers: bool = False
    words: tuple[int, ...] = ()


class Notice(NamedTuple):
    """Something that a reader must not miss.

    Attributes
    ----------
    kind : str
        ``bad``, ``warn`` or ``info``.
    text : str
    """

    kind: str
    text: str


def render(template: str, package: str = "mpisph.report", **context: Any) -> str:
    """Return a page.

    Parameters
    ----------
    template : str
        Name of a file in the package's ``templates``.
    package : str, optional
        Its templates may use those of this one.
    **context
        What the template asks for; all text is escaped.

    Returns
    -------
    str
        HTML.
    """
    return environment(package).get_template(template).render(context)


def environment(package: str = "mpisph.report") -> jinja2.Environment:
    """Return the templates of a package; a name that is missing is an error."""
    packages = dict.fromkeys((package, "mpisph.report", "mpisph.viewer"))
    made = templates_of(*packages)
    made.tests["link"] = lambda cell: isinstance(cell, Link)
    made.filters["symbols"] = symbols
    return made


def symbols(text: str) -> Markup:
    """Return a text as HTML, with the indices of R_b, L_b, u_r and u_z set lower."""
    return Markup(_SYMBOL.sub(r"\1<sub>\2</sub>", str(escape(text))))
