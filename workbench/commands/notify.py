"""`rmf-bridge notify FILE`: tell people about a site's troubles, through a webhook, mail or ntfy.

The command only listens to RMF's graph. The command runs beside the page or the recorder, and never
inside a daemon that moves hardware.
"""

import argparse
import logging
import os
import sys
import threading
import time
from collections import deque
from collections.abc import Iterable
from contextlib import closing, suppress
from datetime import datetime
from pathlib import Path
from typing import Final

import msgspec

from bridges.kinds.shared.durations import AGES_AGO
from bridges.messages.words import KINDS, printable
from bridges.observe.requesters import Moment
from bridges.runtime import daemons, faults
from bridges.system import directories, files, log
from bridges.system.certificates import CertificateReader
from bridges.system.log import pairs
from bridges.transports.transport import TransportError
from bridges.yaml.problems import SettingsError
from workbench.explain.heard_devices import HeardDevices
from workbench.graph.join import (
    add_graph_arguments,
    command_line,
    complain,
    interruptible,
    open_graph,
)
from workbench.graph.live import Ear
from workbench.notify import channels
from workbench.notify.messages import NoticeText, worded
from workbench.notify.notices import KeptTrouble, Notices
from workbench.notify.settings import NotifySettings, Recipient, load
from workbench.notify.troubles import Trouble, of_certificates, troubles

logger = logging.getLogger(__name__)
TURN_S: Final = 1.0
RETRY_S: Final = (5.0, 30.0, 120.0, 600.0)
"""Pauses (s) after failed tries. After the last pause of the list, the program repeats the last
pause."""
MOST_WAITING: Final = 200
"""Maximum number of notices that wait for an unreachable recipient. The program drops the oldest
notices, and logs that."""
CERTIFICATES_EVERY_S: Final = 60.0
NOTIFY: Final = "notify"
"""Name that notices give in place of a daemon's name. The name stands for certificates that only the
file of `notify` lists."""
SERVICE_STATE: Final = Path("/var/lib/rmf-bridge-notify")
"""Folder in which `rmf-bridge-notify.service` stores the troubles already reported."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `notify`."""
    parser.add_argument(
        "file", type=Path, metavar="FILE", help="the file of recipients (docs: Monitor)"
    )
    parser.add_argument(
        "--test", action="store_true", help="send a test notice to each recipient, and end"
    )
    parser.add_argument(
        "--ack",
        metavar="TROUBLE",
        help="stop the repeats of this trouble; the notice gives the name",
    )
    parser.add_argument(
        "--state",
        type=Path,
        default=_state(),
        metavar="DIR",
        help="the folder that keeps the troubles already reported",
    )
    add_graph_arguments(parser)


def _state() -> Path:
    given = os.environ.get("STATE_DIRECTORY", "").split(":")[0]
    if given:
        return Path(given)
    service = os.access(SERVICE_STATE, os.R_OK | os.W_OK | os.X_OK)
    return SERVICE_STATE if service else directories.state_base() / "notify"


def run(args: argparse.Namespace) -> int:
    """Return the exit code.

    - 0: Ctrl-C or SIGTERM ended the program, or every recipient accepted its test notice.
    - 1: a recipient refused its test notice, or the program could not join the graph.
    - 73: the program cannot write the file of `--ack`.
    - 78: FILE has an error.
    """
    log.start()
    try:
        settings = load(args.file)
    except SettingsError as error:
        print("\n".join(map(str, error.problems)), file=sys.stderr)
        return os.EX_CONFIG
    if args.ack:
        return _acknowledge(args.state, args.ack)
    if args.test:
        return _test(settings)
    try:
        with interruptible():
            _serve(args, settings)
    except TransportError as error:
        complain("notify", error)
        return 1
    except KeyboardInterrupt:
        return 0
    return 0


def _acknowledge(state: Path, key: str) -> int:
    try:
        files.replace(state / "acknowledged", key.encode())
    except OSError as error:
        complain("notify", f"{state} cannot be written: {error.strerror}")
        return os.EX_CANTCREAT
    print(f"{key}: if notify reports this trouble now, its repeats stop, and notify logs that")
    return 0


def _test(settings: NotifySettings) -> int:
    text = "This is a test. Nothing is wrong."
    notice = NoticeText("new", "warning", "test", "rmf-bridges: a test", text, settings.page or "")
    refused = 0
    for to in settings.to:
        try:
            channels.send(to, notice)
        except channels.ChannelError as error:
            complain("notify", f"{to.name}: {error}")
            refused = 1
        else:
            print(f"{to.name}: taken")
    return refused


def _serve(args: argparse.Namespace, settings: NotifySettings) -> None:
    desk = Desk(settings, args.state, [Courier(to) for to in settings.to])
    with closing(open_graph(args, "rmf_bridge_notify")) as transport:
        ear = Ear(transport)
        site = HeardDevices(graph=command_line(args).options)
        while True:
            for heard in ear.listen(TURN_S):
                site.take(heard)
            site.pass_time(time.monotonic(), time.time())
            desk.turn(site)


class Courier:
    """A sender of one recipient's notices, on a separate thread. A slow recipient delays no other
    recipient's notices."""

    def __init__(self, to: Recipient) -> None:
        self._to = to
        self._waiting: deque[NoticeText] = deque(maxlen=MOST_WAITING)
        self._came = threading.Event()
        threading.Thread(target=self._run, name=to.name, daemon=True).start()

    def take(self, notice: NoticeText) -> None:
        """Queue a notice, if its severity is high enough for this recipient."""
        if self._to.least == "critical" and notice.severity != "critical":
            return
        if len(self._waiting) == MOST_WAITING:
            logger.error(pairs("notice_dropped", to=self._to.name, title=self._waiting[0].title))
        self._waiting.append(notice)
        self._came.set()

    def _run(self) -> None:
        tries = 0
        while True:
            self._came.wait()
            self._came.clear()
            while self._waiting:
                tries = 0 if self._sent(self._waiting[0]) else tries + 1
                if tries:
                    time.sleep(RETRY_S[min(tries, len(RETRY_S)) - 1])
                else:
                    self._waiting.popleft()

    def _sent(self, notice: NoticeText) -> bool:
        try:
            channels.send(self._to, notice)
        except channels.ChannelError as error:
            logger.error(pairs("notice_not_taken", to=self._to.name, reason=error))
            return False
        logger.info(pairs("notice", to=self._to.name, what=notice.event, title=notice.title))
        return True


class Certificates:
    """The certificates of this machine's daemons, and those of the file of `notify`."""

    def __init__(self, others: Iterable[str]) -> None:
        self._named = [(NOTIFY, "certificates", file) for file in others]
        self._reader = CertificateReader()
        self._present: list[Trouble] = []
        self._next_at = AGES_AGO
        self.known: set[tuple[str, str]] = set()
        """The daemons whose certificates were looked at, as (kind, name)."""

    def troubles(self, now: Moment) -> list[Trouble]:
        """Return the present troubles. The files are looked at each minute."""
        if now.at >= self._next_at:
            self._next_at = now.at + CERTIFICATES_EVERY_S
            found = [*daemons.daemons(directories.runtimes(), {}, now.wall)]
            self.known = {("daemon", printable(one.name)) for one in found} | {("daemon", NOTIFY)}
            named = [used for one in found for used in one.certificates]
            named += self._named
            self._present = [*of_certificates(named, self._reader.end, now.wall)]
        return self._present


class Desk:
    """A finder of new notices. At each call of `turn`, `Desk` gives the new notices to the couriers. It
    also stores on disk which notices it has given to them."""

    def __init__(self, settings: NotifySettings, state: Path, couriers: list[Courier]) -> None:
        self._settings = settings
        self._told, self._acknowledged = state / "told.json", state / "acknowledged"
        self._couriers = couriers
        self._notices = Notices(settings)
        self._remedies = faults.for_explain()
        self._certificates = Certificates(settings.certificates)
        self._kept = b""
        with suppress(OSError, msgspec.MsgspecError):
            self._kept = files.read(self._told, 1 << 20)
            kept = msgspec.json.decode(self._kept, type=list[KeptTrouble])
            self._notices.restore(kept, time.monotonic())

    def turn(self, site: HeardDevices) -> None:
        """Look at the site once, and give new notices to the couriers."""
        self._take_acknowledgement()
        ended = self._certificates.troubles(site.now)
        present = [*troubles(site, site.now, self._settings), *ended]
        ids: dict[tuple[str, str], str] = {
            (one.kind, printable(one.id)): one.id for one in site.stated()
        }
        for report in site.nodes.values():
            ids[report.subject[0], printable(report.subject[1])] = ""
        ids |= dict.fromkeys(self._certificates.known, "")
        for notice in self._notices.turn(present, ids, site.now.at, datetime.now().time()):
            one = notice.trouble
            device = ids.get((one.kind, one.device))
            kind = next((known for known in KINDS if known == one.kind), None)
            explained = (
                site.explain(kind, device, None, self._remedies) if kind and device else None
            )
            text = worded(notice, explained, self._settings.page, self._remedies)
            for courier in self._couriers:
                courier.take(text)
        self._keep()

    def _take_acknowledgement(self) -> None:
        with suppress(OSError):
            key = files.read(self._acknowledged, 4096).decode(errors="replace")
            self._acknowledged.unlink()
            known = self._notices.acknowledge(key)
            logger.info(pairs("acknowledged", trouble=key, known=known))

    def _keep(self) -> None:
        kept = msgspec.json.encode(self._notices.kept())
        if kept != self._kept:
            try:
                files.replace(self._told, kept)
            except OSError as error:
                logger.error(pairs("not_kept", file=self._told, reason=error))
            self._kept = kept
