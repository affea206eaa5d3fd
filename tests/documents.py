"""The project's documents: their headings, code, links and tables."""

import re
import tomllib
from pathlib import Path

from launch import TOP

_NOT_OURS = (".venv", "runs", "build", "dist")


def _documents():
    found = [*TOP.glob("*.md"), *TOP.rglob("README.md")]
    names = {path.relative_to(TOP) for path in found}
    ours = [n for n in names if not n.parts[0].startswith(_NOT_OURS)]
    return sorted(str(n) for n in ours if not any(p[0] == "." for p in n.parts))


NAMES = _documents()


def text_of(name):
    return (TOP / name).read_text(encoding="utf-8")


def fences(text, language):
    """The blocks of code in one language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.S | re.M)


def prose(text):
    """All that is not in a block of code."""
    return re.sub(r"^```.*?^```$", "", text, flags=re.S | re.M)


def spans(text):
    """The pieces of code within sentences and tables."""
    return re.findall(r"`([^`\n]+)`", prose(text))


def code_lines(text):
    """The lines that a shell would see, and pieces of code; comments left out."""
    lines = [line for block in fences(text, "sh") for line in block.splitlines()]
    return [re.sub(r"(^|\s+)#.*", "", line) for line in lines] + spans(text)


def anchors(text):
    """What the headings are called in links, as GitHub makes it."""
    heads = re.findall(r"^#+ (.+)$", prose(text), re.M)
    kept = (re.sub(r"[^\w\- ]", "", head.lower()) for head in heads)
    return [head.replace(" ", "-") for head in kept]


def links(text):
    """The targets of links and pictures."""
    found = re.findall(r"\]\(([^)\s]+)\)", prose(text))
    return found + re.findall(r'src="([^"]+)"', prose(text))


def table_rows(text, head):
    """The rows below the table head that begins so, each a list of cells."""
    lines = iter(text.splitlines())
    for line in lines:
        if line.startswith(head):
            break
    next(lines)
    rows = []
    for line in lines:
        if not line.startswith("|"):
            break
        rows.append([cell.strip() for cell in line.strip("|").split("|")])
    return rows


def example_case():
    """The complete case on the front page, as tomllib reads it."""
    (text,) = fences(text_of("README.md"), "toml")
    return tomllib.loads(text)


def join(old, new):
    """Add the tables of `new` to those of `old`; arrays are put together."""
    for key, value in new.items():
        if isinstance(value, dict) and key in old:
            join(old[key], value)
        elif isinstance(value, list) and key in old:
            old[key] = old[key] + value
        else:
            old[key] = value
    return old


def folder_of(name):
    return Path(TOP / name).parent
