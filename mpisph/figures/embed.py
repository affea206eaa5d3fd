"""Pictures that lie within a page."""

import base64
import io
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from PIL import Image

from mpisph.figures.style import LOSSLESS, PAGE_FORMAT


class Picture(NamedTuple):
    """A picture that lies within the page.

    Attributes
    ----------
    source : str
        Data URL of the file.
    width, height : int
        [pixels].
    """

    source: str
    width: int
    height: int


def embed(draw: Callable[[io.BytesIO], object]) -> Picture:
    """Return what a function draws as a picture of a page.

    Parameters
    ----------
    draw : callable
        Draws a figure into memory, see `figures.style.save`.
    """
    file = io.BytesIO()
    draw(file)
    encoded = base64.b64encode(file.getvalue()).decode("ascii")
    with Image.open(file) as opened:
        kind = str(opened.format).lower()
        return Picture(f"data:image/{kind};base64,{encoded}", *opened.size)


def embed_file(path: Path) -> Picture:
    """Return the picture in a file as a picture of a page.

    Raises
    ------
    OSError
        If the file cannot be read.
    """
    with Image.open(path) as opened:
        return embed(lambda file: opened.save(file, PAGE_FORMAT, **LOSSLESS))
