"""`rmf-bridge notify FILE`: tell people about a site's troubles, through a webhook, mail or ntfy.

The command only listens to RMF's graph. The command runs beside the page or the recorder, and never
inside a daemon that moves hardware.
"""

import argparse
import logging
import os
import shlex
import sys
import time
from collections import Counter
from collections.abc import Container, Iterable, Iterator
from contextlib import closing, suppress
from datetime import datetime
from hashlib import sha256
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
from workbench.notify.courier import Courier
from workbench.notify.messages import NoticeText, worded
from workbench.notify.notices import KeptTrouble, Notices
from workbench.notify.settings import NotifySettings, Recipient, load
from workbench.notify.troubles import Trouble, heard_now, of_certificates, of_daemons, troubles

logger = logging.getLogger(__name__)
TURN_S: Final = 1.0
DAEMONS_EVERY_S: Final = 5.0
FILES_EVERY_S: Final = 60.0
"""The time (s) after which certificates and systemd's units are looked at again."""
TOLD: Final = "told.json"
ACKNOWLEDGED: Final = "acknowledged-"
"""The beginning of a file's name. Each file has the key of one trouble that a person acknowledges."""
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
        metavar="DIR",
        help="the folder that keeps the troubles already reported; by default the service's",
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
    - 77: this user may not acknowledge troubles of the service.
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


def _acknowledge(given: Path | None, key: str) -> int:
    state = given or _state()
    if given is None and state != SERVICE_STATE and SERVICE_STATE.exists():
        told = "repeat the command with sudo, or name the folder of another notify with --state"
        complain("notify", f"{SERVICE_STATE} is not readable for this user: {told}")
        return os.EX_NOPERM
    name = ACKNOWLEDGED + sha256(key.encode(errors="replace")).hexdigest()[:16]
    os.umask(0o022)  # root writes this file, and the service's user reads it
    try:
        files.replace(state / name, key.encode(errors="replace"))
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
    state = args.state or _state()
    command = f"rmf-bridge notify {shlex.quote(str(args.file.absolute()))}"
    if state == SERVICE_STATE:
        command = f"sudo {command}"
    elif args.state is not None:
        command += f" --state {shlex.quote(str(state.absolute()))}"
    desk = Desk(settings, state, command, [Courier(to) for to in settings.to])
    with closing(open_graph(args, "rmf_bridge_notify")) as transport:
        ear = Ear(transport)
        site = HeardDevices(graph=command_line(args).options)
        try:
            while True:
                for heard in ear.listen(TURN_S):
                    site.take(heard)
                site.pass_time(time.monotonic(), time.time())
                desk.turn(site)
        finally:
            desk.keep()


class Machine:
    """This machine's daemons and certificates, and the certificates of the file of `notify`."""

    def __init__(self, others: Iterable[str]) -> None:
        self._others = [(NOTIFY, "certificates", file) for file in others]
        self._reader = CertificateReader()
        self._units: dict[str, str] = {}
        self._daemons: list[daemons.DaemonStatus] = []
        self._ended: list[Trouble] = []
        self._daemons_at = self._files_at = AGES_AGO
        self.known = {("daemon", NOTIFY)}
        """The daemons that were looked at, as (kind, name)."""

    def troubles(self, now: Moment, heard: Container[tuple[str, str]]) -> Iterator[Trouble]:
        """Yield the present troubles. `heard` has the devices heard since the start."""
        files_due = now.at >= self._files_at
        if files_due:
            self._files_at = now.at + FILES_EVERY_S
            self._units = daemons.units()
        if now.at >= self._daemons_at:
            self._daemons_at = now.at + DAEMONS_EVERY_S
            self._daemons = [*daemons.daemons(daemons.folders(), self._units, now.wall)]
            self.known |= {("daemon", printable(one.name)) for one in self._daemons}
        if files_due:
            named = [used for one in self._daemons for used in one.certificates]
            ends = of_certificates([*named, *self._others], self._reader.end, now.wall)
            self._ended = [*ends]
        yield from self._ended
        yield from of_daemons(self._daemons, heard)


class Kept(msgspec.Struct, frozen=True):
    """The file of the state: the troubles that people know, and the notices that each recipient has not
    taken yet."""

    told: list[KeptTrouble]
    waiting: dict[str, list[NoticeText]]


class Desk:
    """A finder of new notices. At each call of `turn`, `Desk` gives the new notices to the couriers. It
    also stores on disk which notices it has given to them, and which of them still wait."""

    def __init__(
        self, settings: NotifySettings, state: Path, command: str, couriers: Iterable[Courier]
    ) -> None:
        """`command`: the command that acknowledges a trouble of this `notify`, without `--ack`."""
        self._settings, self._command, self._state = settings, command, state
        self._couriers = dict(zip(_names(settings.to), couriers, strict=True))
        self._notices = Notices(settings)
        self._remedies = faults.for_explain()
        self._machine = Machine(settings.certificates)
        self._kept = b""
        self._not_kept = False
        with suppress(OSError, msgspec.MsgspecError):
            self._kept = files.read(state / TOLD, 1 << 22)
            kept = msgspec.json.decode(self._kept, type=Kept)
            self._notices.restore(kept.told, time.monotonic(), _ahead_s())
            for name, courier in self._couriers.items():
                for notice in kept.waiting.get(name, ()):
                    courier.take(notice)

    def turn(self, site: HeardDevices) -> None:
        """Look at the site once, and give new notices to the couriers."""
        self._take_acknowledgements()
        ids: dict[tuple[str, str], str] = {
            (one.kind, printable(one.id)): one.id for one in site.stated()
        }
        ours = [*self._machine.troubles(site.now, {*ids, *self._notices.silent})]
        present = [*troubles(site, site.now, self._settings), *ours]
        heard, at = heard_now(site, site.now) | self._machine.known, datetime.now().astimezone()
        for notice in self._notices.turn(present, heard, site.now.at, at.time()):
            one = notice.trouble
            device = ids.get((one.kind, one.device))
            kind = next((known for known in KINDS if known == one.kind), None)
            explained = (
                site.explain(kind, device, None, self._remedies) if kind and device else None
            )
            page = self._settings.page
            text = worded(notice, explained, page, self._remedies, at, self._command)
            for courier in self._couriers.values():
                courier.take(text)
        self.keep()

    def _take_acknowledgements(self) -> None:
        for path in sorted(self._state.glob(f"{ACKNOWLEDGED}*")):
            with suppress(OSError):
                key = files.read(path, 4096).decode(errors="replace")
                known = self._notices.acknowledge(key)
                if self.keep():
                    logger.info(pairs("acknowledged", trouble=key, known=known))
                    path.unlink()  # only now, because SIGTERM may come in between

    def keep(self) -> bool:
        """Store what has changed. Return False if the disk does not take it; the next call then tries
        again."""
        told = self._notices.kept(_ahead_s())
        waiting = {name: courier.waiting for name, courier in self._couriers.items()}
        kept = msgspec.json.encode(Kept(told, waiting))
        if kept != self._kept:
            try:
                files.replace(self._state / TOLD, kept)
            except OSError as error:
                if not self._not_kept:
                    logger.error(pairs("not_kept", file=self._state / TOLD, reason=error))
                self._not_kept = True
                return False
            self._kept, self._not_kept = kept, False
        return True


def _ahead_s() -> float:
    """Return how far the wall clock is ahead of the monotonic clock."""
    return time.time() - time.monotonic()


def _names(to: Iterable[Recipient]) -> Iterator[str]:
    """Yield a name for each recipient. Further recipients of the same name get a number."""
    seen: Counter[str] = Counter()
    for one in to:
        seen[one.name] += 1
        yield one.name if seen[one.name] == 1 else f"{one.name} ({seen[one.name]})"
