"""`rmf-bridge` as a person types it at the site. While a command waits, the site's time passes."""

import io
from collections import deque
from contextlib import redirect_stderr, redirect_stdout
from functools import partial
from queue import Empty
from typing import Any, Final

import pytest

from bridges import cli
from bridges.commands import incident
from tests.site.network import Place
from tests.site.timeline import EPOCH, Timeline
from tests.workbench.troubles.site import Site
from workbench.commands import explain, send
from workbench.graph import live

LISTENS_S: Final = 10.0


def live_screen(site: Site, device: str) -> str:
    """Return the screen of `explain --live`. The command joins the graph now."""
    return _typed(site, "explain", "--live", device, "--for", f"{LISTENS_S:g}")


def file_screen(site: Site, device: str, daemon: str = "", note: str = "") -> str:
    """Return the screen of `explain FILE`.

    The recorder writes the file. If the recorder writes none, a person types `incident --note`.
    """
    path = site.file(daemon or device)
    if path is None:
        assert note, "the recorder wrote no file"
        path = site.ring(daemon or device) / "noted.mcap"
        folder = str(site.ring(daemon or device))
        words = ("incident", f"/etc/{device}.yaml", "--runtime-dir", folder, "--after", "0")
        _typed(site, *words, "--note", note, "-o", str(path))
    return f"{path.name}\n{_typed(site, 'explain', str(path), device)}"


def release_screen(site: Site, device: str) -> str:
    """Return the screen of `release`. The person confirms that the car is empty."""
    return _typed(site, "release", device)


def _typed(site: Site, *words: str) -> str:
    def joined(args: Any, name: str) -> Place:
        return Place(site.air, name, lambda: None)

    told = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(told), redirect_stderr(told):
        patch.setenv("COLUMNS", "100")
        patch.setenv("LINES", "41")
        time = _Time(site.timeline)
        for module in (explain, live, send):
            patch.setattr(module, "time", time)
        for module in (explain, send):
            patch.setattr(module, "open_graph", joined)
        patch.setattr(incident, "machine_s", time.monotonic)
        patch.setattr(incident, "_serves", lambda places: True)  # the site's daemons run
        patch.setattr(live, "SimpleQueue", partial(_Queue, site.timeline))
        cli.main(list(words))
    return told.getvalue()


class _Time:
    """A stand-in for the module `time`, with the site's time."""

    def __init__(self, timeline: Timeline) -> None:
        self._timeline = timeline

    def monotonic(self) -> float:
        return self._timeline.now

    def time(self) -> float:
        return EPOCH + self._timeline.now

    def sleep(self, seconds: float) -> None:
        self._timeline.run(self._timeline.now + seconds)


class _Queue:
    """A stand-in for SimpleQueue. While a command waits for the queue, the site's time passes."""

    def __init__(self, timeline: Timeline) -> None:
        self._timeline = timeline
        self._waiting: deque[Any] = deque()

    def put(self, one: Any) -> None:
        self._waiting.append(one)

    def get(self, timeout: float) -> Any:
        until = self._timeline.now + timeout
        while not self._waiting and self._timeline.now < until:
            self._timeline.run(min(until, self._timeline.next_at()))
        return self.get_nowait()

    def get_nowait(self) -> Any:
        if not self._waiting:
            raise Empty
        return self._waiting.popleft()
