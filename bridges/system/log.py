"""The log. It has one line `event key=value …` for each event, with a priority for journald."""

import codecs
import logging
import os
import re
import select
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Set
from contextlib import suppress
from datetime import UTC, datetime
from enum import Enum
from typing import Final

import msgspec

ESCAPED = "unicode_escape"
codecs.lookup(ESCAPED)  # loads the codec now, because later all file descriptors may be in use
_PRIORITY = {"DEBUG": 7, "INFO": 6, "WARNING": 4, "ERROR": 3, "CRITICAL": 2}


class LogLine(str):
    """A log line `event key=value …`. It keeps the event and the values for `--log-format json`."""

    __slots__ = ("event", "values")
    event: str
    values: Mapping[str, object]


def pairs(event: str, **values: object) -> LogLine:
    """Return one log line. Quote and escape values with spaces, quotes or line breaks."""
    shown = (f"{key}={_quoted(plain(value))}" for key, value in values.items())
    line = LogLine(" ".join([event, *shown]))
    line.event, line.values = event, values
    return line


def plain(value: object) -> str:
    """Return a value as text for people, such as `agv_request yes, call L3`.

    Leave out the fields of a struct that have no value. None becomes `-`. A struct in which no field
    has a value becomes `-` too.
    """
    match value:
        case None:
            return "-"
        case bool():
            return "yes" if value else "no"
        case Enum():
            return value.value if isinstance(value.value, str) else value.name
        case Mapping():
            return _listed(f"{key} {plain(part)}" for key, part in value.items())
        case tuple() | list() | Set():
            return _listed(map(plain, value))
    if isinstance(value, msgspec.Struct):
        return _listed(f"{key} {plain(part)}" for key, part in _set(value))
    return str(value)


def _listed(parts: Iterator[str]) -> str:
    return ", ".join(parts) or "-"


def _set(record: msgspec.Struct) -> Iterator[tuple[str, object]]:
    for name in record.__struct_fields__:
        part = getattr(record, name)
        if part is not None and part is not False and part not in ("", ()):
            yield name, part


def _quoted(text: str) -> str:
    if text and text.isprintable() and not any(c in text for c in ' "='):
        return text
    return '"' + text.encode(ESCAPED).decode("ascii").replace('"', "'") + '"'


class _Formatter(logging.Formatter):
    """A formatter of text lines. Under systemd a line is `<6>text`, where 6 is journald's priority. On
    a terminal a line is `12:34:56.789 INFO text`."""

    def __init__(self, journal: bool) -> None:
        super().__init__(
            "%(message)s" if journal else "%(asctime)s.%(msecs)03d %(levelname)s %(message)s"
        )
        self.datefmt = "%H:%M:%S"
        self._journal = journal

    def format(self, record: logging.LogRecord) -> str:
        text = super().format(record)
        if not self._journal:
            return text
        prefix = f"<{_PRIORITY.get(record.levelname, 6)}>"
        return "\n".join(prefix + line for line in text.splitlines())


class _Json(logging.Formatter):
    """A formatter of JSON lines. A line has the time `at` (ISO 8601), the priority and the text. For
    our own events it also has the event and the values."""

    def __init__(self, journal: bool) -> None:
        super().__init__()
        self._journal = journal

    def format(self, record: logging.LogRecord) -> str:
        at = datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds")
        told: dict[str, object] = {"at": at, "priority": record.levelname.lower()}
        if isinstance(record.msg, LogLine):
            told["event"] = record.msg.event
            told["values"] = {key: _as_json(value) for key, value in record.msg.values.items()}
        told["text"] = record.getMessage()
        if record.exc_info:
            told["traceback"] = self.formatException(record.exc_info)
        line = msgspec.json.encode(told).decode()
        return f"<{_PRIORITY.get(record.levelname, 6)}>{line}" if self._journal else line


def _as_json(value: object) -> object:
    """Return numbers, booleans and texts unchanged. Return other values as in the text log."""
    return value if isinstance(value, int | float | str) else plain(value)


class _OthersOnce(logging.Filter):
    """A filter for the log calls of libraries. It passes each log call (a line of a library's code)
    only once, as `library logger=… text=…`.

    Without this filter anybody could cause endless log lines by sending bad frames or datagrams. The
    filter passes all lines of our own code, which already logs each event once.
    """

    OURS = ("root", "bridges", "drivers", "hal_fakes", "workbench")

    def __init__(self) -> None:
        super().__init__()
        self._said: set[tuple[str, int]] = set()

    def filter(self, record: logging.LogRecord) -> bool:
        place = record.pathname, record.lineno
        if record.name.partition(".")[0] in self.OURS:
            return True
        record.exc_info = record.exc_text = None  # no operator needs a library's traceback
        text = record.getMessage()  # may quote untrusted input
        record.args = None
        record.msg = pairs("library", logger=record.name, text=text)
        first = place not in self._said
        self._said.add(place)
        return first


class Seldom(logging.Filter):
    """A filter for repeated lines. It passes the first OFTEN lines of a series. Then it passes one line
    in each AGAIN_S (s), with the number of suppressed lines. A pause longer than PAUSE_S (s) ends
    the series.

    Without this filter, a device that is lost each second and found again would fill the disk. Lines
    that differ only in a number of seconds count as equal. `now` returns the time (monotonic s).
    """

    OFTEN, PAUSE_S, AGAIN_S, MOST = 6, 10.0, 600.0, 1000
    SECONDS = re.compile(r"\d+(\.\d+)? s\b")

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._now = now
        self._runs: dict[str, _Run] = {}
        self._counting = threading.Lock()  # logging calls a handler's filters without a lock

    def filter(self, record: logging.LogRecord) -> bool:
        with self._counting:
            return self._passes(record)

    def _passes(self, record: logging.LogRecord) -> bool:
        now, text = self._now(), self.SECONDS.sub("", record.getMessage())
        run = self._runs.pop(text, None)
        if run is None or now - run.last_at > self.PAUSE_S:
            run = _Run()
        self._runs[text] = run  # at the end, because the oldest is first
        if len(self._runs) > self.MOST:
            del self._runs[next(iter(self._runs))]
        run.times, run.last_at = run.times + 1, now
        if run.times > self.OFTEN and now - run.told_at < self.AGAIN_S:
            run.left_out += 1
            return False
        if run.left_out and isinstance(record.msg, LogLine):
            record.msg = pairs(record.msg.event, **record.msg.values, left_out=run.left_out)
        run.told_at, run.left_out = now, 0
        return True


class _Run(msgspec.Struct):
    times: int = 0
    last_at: float = 0.0
    told_at: float = 0.0
    left_out: int = 0


class Unhurried(logging.Handler):
    """A handler that never lets a caller wait. One thread of its own writes the lines to the file
    descriptor `to`.

    If nobody reads the log (Ctrl-S, a full pipe), lines wait up to MOST bytes. Further lines are
    dropped, and their number is logged when a reader reads again. The thread starts with the first
    line, also in a forked child.
    """

    MOST: Final = 256 << 10
    FLUSHED_WITHIN_S: Final = 1.0
    """The longest wait (s) for a reader at the process's end."""

    def __init__(self, to: int) -> None:
        super().__init__()
        self._to = to
        self._begin()
        os.register_at_fork(after_in_child=self._begin)

    def _begin(self) -> None:
        self._changed = threading.Condition()
        self._lines = deque[bytes]()
        self._size = self._dropped = 0
        self._thread: threading.Thread | None = None

    def emit(self, record: logging.LogRecord) -> None:
        """Queue a line, or drop and count it."""
        try:
            self._put(self._encoded(record))
        except Exception:  # noqa: BLE001 - as logging.StreamHandler
            self.handleError(record)

    def flush(self) -> None:
        """Wait until all lines are written, but not longer than FLUSHED_WITHIN_S."""
        with self._changed:
            self._changed.wait_for(lambda: not self._size, self.FLUSHED_WITHIN_S)

    def _encoded(self, record: logging.LogRecord) -> bytes:
        return (self.format(record) + "\n").encode(errors="backslashreplace")

    def _put(self, line: bytes) -> None:
        with self._changed:
            if self._size and self._size + len(line) > self.MOST:
                self._dropped += 1
                return
            self._append(line)
            if self._thread is None:
                self._thread = threading.Thread(target=self._write, name="log", daemon=True)
                self._thread.start()
            self._changed.notify_all()

    def _append(self, line: bytes) -> None:
        self._lines.append(line)
        self._size += len(line)

    def _write(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._lines)
                line = self._lines.popleft()
            with suppress(OSError):  # the reader has ended, or the disk is full
                _write_all(self._to, line)
            with self._changed:
                self._size -= len(line)
                if self._dropped and not self._lines:  # the dropped lines were the later ones
                    self._append(self._told())
                self._changed.notify_all()

    def _told(self) -> bytes:
        text, self._dropped = pairs("log_not_read", dropped=self._dropped), 0
        return self._encoded(logging.makeLogRecord({"levelname": "WARNING", "msg": text}))


def _write_all(to: int, line: bytes) -> None:
    while line:
        select.select([], [to], [])  # needed if another process made the descriptor non-blocking
        line = line[os.write(to, line) :]


def start(level: str = "INFO", *, json: bool = False, unhurried: bool = False) -> None:
    """Send every log line to stderr, as text or as JSON. `unhurried`: no thread waits for the log's
    reader, because this process drives outputs."""
    to_stderr: logging.Handler = logging.StreamHandler(sys.stderr)
    if unhurried:
        with suppress(OSError, AttributeError):  # stderr is closed, or is no file
            to_stderr = Unhurried(sys.stderr.fileno())
    journal = "JOURNAL_STREAM" in os.environ
    to_stderr.setFormatter(_Json(journal) if json else _Formatter(journal))
    to_stderr.addFilter(_OthersOnce())
    to_stderr.addFilter(Seldom())
    logging.basicConfig(level=level, handlers=[to_stderr], force=True)
