"""Where each key of a TOML file stands."""

from __future__ import annotations

import tomllib
from functools import lru_cache

import tree_sitter
import tree_sitter_toml

from mpisph.inputs.findings import Key

_DEEPEST = 100
"""Levels of a document's tree. A case needs some ten; tomllib takes a time that grows
as the square of a key's parts."""


def deep_line(text: str) -> int | None:
    """Return the first line of a document that is nested absurdly deep, or None.

    Parameters
    ----------
    text : str
        Any text: what is no TOML is looked at as far as it can be.

    Returns
    -------
    int or None
        Line, counted from 1.
    """
    cursor = _parse(text).walk()
    depth = 0
    while True:
        if cursor.goto_first_child():
            depth += 1
            if depth > _DEEPEST and cursor.node is not None:
                return _line(cursor.node)
            continue
        while not cursor.goto_next_sibling():
            if not cursor.goto_parent():
                return None
            depth -= 1


def line_numbers(text: str) -> dict[Key, int]:
    """Return the line of every key and array element of a TOML document.

    Parameters
    ----------
    text : str
        A valid TOML document, without a `deep_line`.

    Returns
    -------
    dict
        Lines, counted from 1, by key: tuples of table keys and array indices,
        as in ``("bodies", 0, "radius")``.
    """
    root = _parse(text).root_node
    lines: dict[Key, int] = {}
    lengths: dict[Key, int] = {}
    for node in root.named_children:
        if node.type == "pair":
            _add_pair(node, (), lines)
        elif node.type in {"table", "table_array_element"}:
            _add_table(node, lines, lengths)
    return lines


def _parse(text: str) -> tree_sitter.Tree:
    return _parser().parse(text.encode("utf-8"))


@lru_cache(maxsize=1)
def _parser() -> tree_sitter.Parser:
    return tree_sitter.Parser(tree_sitter.Language(tree_sitter_toml.language()))


def _add_table(
    node: tree_sitter.Node, lines: dict[Key, int], lengths: dict[Key, int]
) -> None:
    """Add a ``[table]`` or ``[[array of tables]]`` with its pairs.

    `lengths` holds the number of elements of each array of tables so far.
    """
    header, *pairs = node.named_children
    path: Key = ()
    parts = _key_parts(header)
    for depth, part in enumerate(parts):
        path = (*path, part)
        lines.setdefault(path, _line(header))
        is_new_element = node.type == "table_array_element" and depth == len(parts) - 1
        if is_new_element:
            lengths[path] = lengths.get(path, 0) + 1
        if path in lengths:
            path = (*path, lengths[path] - 1)
            lines.setdefault(path, _line(header))
    for pair in pairs:
        if pair.type == "pair":
            _add_pair(pair, path, lines)


def _add_pair(node: tree_sitter.Node, prefix: Key, lines: dict[Key, int]) -> None:
    key, *values = (n for n in node.named_children if n.type != "comment")
    path = prefix
    for part in _key_parts(key):
        path = (*path, part)
        lines.setdefault(path, _line(key))
    for value in values:
        _add_value(value, path, lines)


def _add_value(node: tree_sitter.Node, path: Key, lines: dict[Key, int]) -> None:
    children = [child for child in node.named_children if child.type != "comment"]
    if node.type == "inline_table":
        for child in children:
            _add_pair(child, path, lines)
    elif node.type == "array":
        for index, child in enumerate(children):
            lines[(*path, index)] = _line(child)
            _add_value(child, (*path, index), lines)


def _key_parts(node: tree_sitter.Node) -> tuple[str, ...]:
    if node.type == "dotted_key":
        return tuple(part for n in node.named_children for part in _key_parts(n))
    text = (node.text or b"").decode("utf-8")
    if node.type == "quoted_key":
        return tuple(tomllib.loads(f"{text} = 0"))
    return (text,)


def _line(node: tree_sitter.Node) -> int:
    return node.start_point.row + 1
