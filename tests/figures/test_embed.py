"""Pictures that lie within a page: as they were drawn."""

import base64
import io

import matplotlib.figure
import numpy as np
from PIL import Image

from mpisph.figures import style
from mpisph.figures.embed import embed
from mpisph.figures.style import save


def decode(picture):
    file = base64.b64decode(picture.source.partition(",")[2])
    return Image.open(io.BytesIO(file))


def test_a_picture_is_embedded_as_it_is_drawn(tmp_path):
    """Every pixel, the grey of each density in a radiograph too; and in fewer bytes."""
    figure = matplotlib.figure.Figure(figsize=(2.0, 1.0), dpi=100)
    axes = figure.add_axes((0.1, 0.1, 0.8, 0.8))
    axes.imshow(np.arange(800).reshape(20, 40), cmap="gray", aspect="auto")
    axes.plot([3, 30], [3, 15], "o-", markersize=9)
    picture = embed(lambda out: save(figure, out))
    assert (picture.width, picture.height) == (200, 100)
    assert picture.source.startswith("data:image/webp;base64,")
    path = tmp_path / "figure.png"
    save(figure, path)
    with Image.open(path) as drawn:
        wanted = np.asarray(drawn.convert("RGB"))
    np.testing.assert_array_equal(decode(picture).convert("RGB"), wanted)
    assert len(picture.source) < path.stat().st_size


def test_without_webp_a_picture_is_png(monkeypatch):
    monkeypatch.setattr(style, "PAGE_FORMAT", "png")
    figure = matplotlib.figure.Figure(figsize=(2.0, 1.0), dpi=100)
    picture = embed(lambda out: save(figure, out))
    assert picture.source.startswith("data:image/png;base64,")
    assert decode(picture).size == (picture.width, picture.height) == (200, 100)
