"""A page that follows runs under way: served to this machine alone."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Sequence
from functools import partial
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from mpisph.core.errors import MpisphError
from mpisph.figures.fields import Chosen
from mpisph.io.standing import standing
from mpisph.io.status import FINAL
from mpisph.viewer.data import MOST_PARTICLES, Frame, Shown
from mpisph.viewer.page import make_view, page, read_runs, shown_run

HOST = "127.0.0.1"
"""Only this machine reaches it."""

_NAMES = (HOST, "localhost")
# What a browser on this machine may call it: a page of another site that has its name
# point here is refused.

_KINDS = {"html": "text/html; charset=utf-8", "json": "application/json"}


class Followed:
    """Runs that are looked at again when their snapshots have become more.

    Parameters
    ----------
    folders : sequence of Path
    chosen : sequence of Chosen
        See `page.write_view`.
    most : int
    """

    def __init__(
        self, folders: Sequence[Path], chosen: Sequence[Chosen], most: int
    ) -> None:
        self._look: Callable[[], Any] = partial(read_runs, folders, chosen)
        self._folders, self._chosen, self._most = folders, chosen, most
        self._lock = threading.Lock()
        self._seen: list[list[Path]] = []
        self._kept: dict[tuple[Path, int], Frame] = {}
        self.runs = self._look()
        self.shown: list[Shown] = []
        self.over = False
        self.update()
        # Once and for all: what draws the still pictures serves one thread only.
        view = make_view(self.runs, [], chosen, served=True)
        self.html = page(self.runs, view)

    def update(self) -> None:
        """Read the runs again where there is something new.

        What cannot be read just now, for it is being written, is read the next time.
        """
        with self._lock:
            over = all(standing(folder).state in FINAL for folder in self._folders)
            try:
                runs = self._look()
                seen = [[path for path, _ in run.snapshots] for run in runs]
                if seen != self._seen:
                    share = 1.0 / len(runs)
                    self.shown = [
                        shown_run(run, self._chosen, self._most, share, self._kept)
                        for run in runs
                    ]
                    self.runs, self._seen = runs, seen
                self.over = over
            except (MpisphError, OSError):
                if not self.shown:
                    raise

    def description(self) -> str:
        """Return what a browser must know besides the particles, as JSON."""
        self.update()
        with self._lock:
            runs = []
            for shown in self.shown:
                about = dict(shown.description)
                about["frames"] = [
                    {**frame, "key": key}
                    for frame, key in zip(about["frames"], shown.keys, strict=True)
                ]
                runs.append(about)
            return json.dumps({"runs": runs, "over": self.over}, allow_nan=False)

    def part(self, words: Sequence[str]) -> bytes | None:
        """Return packed codes by their path, such as ``0, frames, snapshot_00003``."""
        with self._lock:
            try:
                shown = self.shown[int(words[0])]
                match words[1:]:
                    case ["fixed"]:
                        return shown.fixed
                    case ["frames", key]:
                        return shown.frames[shown.keys.index(key)]
            except (IndexError, ValueError):
                pass
            return None


class _Handler(BaseHTTPRequestHandler):
    """Answers with the page and its parts; nothing else of the machine is read."""

    followed: Followed

    def do_GET(self) -> None:
        name = (self.headers.get("Host") or "").rpartition(":")[0]
        if name not in _NAMES:
            self.send_error(HTTPStatus.FORBIDDEN)
            return
        path = urlsplit(self.path).path
        words = path.strip("/").split("/")
        if path == "/":
            self._answer(self.followed.html.encode(), _KINDS["html"])
        elif words == ["runs.json"]:
            self._answer(self.followed.description().encode(), _KINDS["json"])
        elif words[0] == "runs" and (part := self.followed.part(words[1:])) is not None:
            self._answer(part, "application/octet-stream")
        elif words == ["favicon.ico"]:  # every browser asks for it
            self.send_response(HTTPStatus.NO_CONTENT)
            self.end_headers()
        else:
            self.send_error(HTTPStatus.NOT_FOUND)

    def _answer(self, content: bytes, kind: str) -> None:
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, *_: object) -> None:
        """Say nothing of each request."""


def make_server(
    folders: Sequence[Path],
    port: int = 0,
    chosen: Sequence[Chosen] = (),
    most: int = MOST_PARTICLES,
) -> ThreadingHTTPServer:
    """Return a server of a page that follows runs, on the loopback address.

    Parameters
    ----------
    folders : sequence of Path
        Folders of runs, each with a snapshot.
    port : int, optional
        By default a free one; see ``server_address``.
    chosen, most
        See `page.write_view`.

    Raises
    ------
    MpisphError
        See `page.write_view`.
    OSError
        If the port is taken, or if a file cannot be read.
    """
    followed = Followed(folders, chosen, most)
    handler = type("Handler", (_Handler,), {"followed": followed})
    server = ThreadingHTTPServer((HOST, port), handler)
    server.daemon_threads = True
    return server
