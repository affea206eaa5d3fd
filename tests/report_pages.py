"""A page as a reader finds it: its elements, words, links and pictures."""

import base64
import io
from html.parser import HTMLParser

from PIL import Image

VOID = {"meta", "img", "link", "br", "hr", "input"}


class Page(HTMLParser):
    """Reads a page and checks that its elements are nested as they should be."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.attributes, self.words = [], [], [], []
        self.tables, self.headings, self.style = [], [], ""
        self.feed(text)
        self.close()
        assert not self.open, "every element is closed"

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in {"td", "th"}:
            self.tables[-1][-1].append("")
        elif tag in {"h1", "h2", "h3", "h4"}:
            self.headings.append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if "style" in self.open:
            self.style += data
            return
        if "script" in self.open:
            return
        self.words.append(data)
        if {"td", "th"} & set(self.open):
            self.tables[-1][-1][-1] += data
        if {"h1", "h2", "h3", "h4"} & set(self.open):
            self.headings[-1] += data

    @property
    def text(self):
        return " ".join("".join(self.words).split())

    def all(self, tag, name):
        return [a[name] for t, a in self.attributes if t == tag and name in a]

    def table(self, *heads):
        """The rows below these first heads, in the first table that has them."""
        for rows in self.tables:
            if tuple(rows[0][: len(heads)]) == heads:
                return rows[1:]
        raise AssertionError(f"no table with {heads}")

    def value(self, name):
        """What a list of names and values says of a name."""
        return next(r[1] for rows in self.tables for r in rows if r[0] == name)

    def pictures(self):
        prefix = "data:image/webp;base64,"
        sources = self.all("img", "src")
        assert all(source.startswith(prefix) for source in sources)
        files = [base64.b64decode(source.removeprefix(prefix)) for source in sources]
        return [Image.open(io.BytesIO(file)).convert("RGB") for file in files]


def assert_nothing_is_fetched(page):
    assert not {"link", "iframe", "object"} & set(page.tags)
    assert "url(" not in page.style
    assert "@import" not in page.style
    for tag, attributes in page.attributes:
        for name, value in attributes.items():
            if name in {"src", "href", "srcset", "action"}:
                inside = value.startswith(("data:image/webp;base64,", "#"))
                assert inside, (tag, name, value[:80])


def assert_links_lead_somewhere(page):
    places = [a["id"] for _, a in page.attributes if "id" in a]
    assert len(places) == len(set(places))
    assert {link.removeprefix("#") for link in page.all("a", "href")} <= set(places)
