"""A real browser for the tests of pages: Chromium without a screen."""

import os
import shutil
from contextlib import contextmanager

import pytest

FLAGS = (
    "--no-sandbox",
    "--no-first-run",
    "--disable-quic",
    "--disable-dev-shm-usage",
    "--disable-sync",
    "--disable-background-networking",
    "--disable-component-update",
    # WebGL without a graphics card.
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)

WIDE = {"width": 1280, "height": 900}
NARROW = {"width": 420, "height": 850}


def chromium():
    """Where Chromium is; None where it is not installed."""
    return shutil.which("chromium") or shutil.which("google-chrome")


def require_chromium():
    """Skip a test where there is none, unless the whole of the tests runs."""
    if chromium() is None:
        text = "needs Chromium: `scripts/test` installs it where it may"
        assert "MPISPH_BROWSER" not in os.environ, text
        pytest.skip(text)


@contextmanager
def browser(*flags):
    """Start a browser."""
    from playwright.sync_api import sync_playwright

    require_chromium()
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(
            executable_path=chromium(), args=[*FLAGS, *flags]
        )
        try:
            yield started
        finally:
            started.close()


class Trouble(list):
    """What a page says in the console, what it throws, and what it asks others for."""

    def __init__(self, page):
        super().__init__()
        page.on("console", lambda message: self.append(f"console: {message.text}"))
        page.on("pageerror", lambda error: self.append(f"error: {error}"))
        page.on("request", self._note)

    def _note(self, request):
        if not request.url.startswith(("file:", "data:", "blob:", "http://127.0.0.1:")):
            self.append(f"fetches {request.url}")
