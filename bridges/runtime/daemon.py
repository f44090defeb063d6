"""The daemon that serves one YAML. It opens the transport, starts the loops and feeds systemd's
watchdog.

On SIGTERM, the daemon switches every output off and leaves RMF's graph. It does the same on any other
signal that would end a process.
"""

import logging
import os
import platform
import secrets
import time
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import msgspec

from bridges import VERSION
from bridges.blackbox.entries import Head
from bridges.blackbox.ring import Ring
from bridges.messages.cdr import CdrError
from bridges.messages.definitions import DiagnosticArray
from bridges.messages.stamps import ClockError, stamp
from bridges.messages.topics import DIAGNOSTICS
from bridges.runtime import guard, last_mark, order, record, signals
from bridges.runtime.diagnostics import CERTIFICATE_FILES, diagnosis
from bridges.runtime.guard import Guard
from bridges.runtime.notify import notify, watchdog_s
from bridges.runtime.predecessor import Predecessor
from bridges.runtime.record import ClaimRecord
from bridges.runtime.ring_writer import NOBODY, NoWriter, RingWriter
from bridges.runtime.runtime_directory import KEPT, MemoryFile, Once, RuntimeDirectory, state_file
from bridges.runtime.service import OpenBus, clock_of, named_by, service
from bridges.runtime.serving import stop
from bridges.settings.load import Config
from bridges.settings.named_files import certificate_files
from bridges.system.log import pairs
from bridges.transports.choose import open_transport
from bridges.transports.transport import Publisher, TransportError

log = logging.getLogger(__name__)

STOP_WITHIN_S = 5.0
STATUS_EVERY_S = 1.0
NEXT_ORDER_S, SHOWN_S = 3.0, 0.5
"""The longest time (s) from one person's order to the next, and the time (s) for which the status file
shows an answer at least. `rmf-bridge` looks for the answer each 0.05 s."""
ALIVE = "WATCHDOG=1"
STARTING = "WATCHDOG=1\nEXTEND_TIMEOUT_USEC=30000000"
"""A message that asks systemd for 30 more seconds, because a start with many silent devices takes
long."""


class Daemon:
    """One run of `rmf-bridge run`. `simulated`: there is no hardware, and the status and the
    diagnostics say so."""

    def __init__(
        self,
        config: Config,
        runtime: RuntimeDirectory,
        end: signals.End,
        *,
        open_bus: OpenBus | None = None,
        localhost: bool = False,
        simulated: bool = False,
        ros_args: Sequence[str] = (),
        outputs_off: Sequence[str] = (),
        rmf: Any = None,
    ) -> None:
        """Prepare the daemon. `outputs_off`: the command that switches the outputs off after this
        process has died. `rmf`: an object that replaces RMF's fleet adapter in a simulation.

        Raises TransportError or HalError if a transport or bus cannot be opened.
        """
        self._config = config
        self._certificates = certificate_files(config)
        self._runtime = runtime
        self._end = end
        self._simulated = simulated
        self._once = Once()
        self._guard: Guard | None = None
        self._predecessor: Predecessor | None = None
        ours, unsafe = record.of(config), frozenset[str]()
        if config.drives and not simulated:
            self._predecessor = Predecessor(runtime.records, ours, outputs_off)
            unsafe = self._predecessor.make_safe(end.wait)
        self._transport = open_transport(
            config.rmf, config.node, localhost=localhost, ros_args=ros_args
        )
        # A memory of devices gets no second path. Two files could differ, and an old memory of devices
        # is worse than no memory.
        instead = None if config.buses else runtime.path / KEPT
        path = runtime.path / KEPT if simulated else state_file(config.path)
        kept = MemoryFile(path, instead)
        open_bus = open_bus or config.open_bus
        self._writer = self._writer_of(ours)
        self._service = service(
            config, self._transport, open_bus, kept, unsafe, self._writer, new=simulated, rmf=rmf
        )
        self._loops = self._service.loops
        # The record of the claimed outputs is written here, for `outputs-off`. It is written after the
        # buses are open, because a daemon that cannot open a bus needs no record. It is written before
        # `serve`, because `serve` claims the outputs.
        if config.drives and not simulated:
            self._convenience("mark", partial(last_mark.leave, name=last_mark.CLAIMED))
            runtime.claim(ours)
            self._guard = Guard(outputs_off) if guard.needed() else None
        self._health_topic = named_by(config, DIAGNOSTICS)
        self._told = 0
        self._given = deque[order.PersonsOrder]()
        self._ordered: order.PersonsOrder | None = None
        self._next_order_at = 0.0
        self._longest_unfed_s = 0.0
        self._diagnostics: Publisher[DiagnosticArray] | None = None
        if config.rmf.diagnostics:
            self._diagnostics = self._transport.publisher(self._health_topic)

    def _writer_of(self, record: ClaimRecord) -> NoWriter:
        """Return the writer that records into the daemon's ring file. Return NOBODY, which records
        nothing, if the YAML switches recording off."""
        keep = self._config.recording
        if keep.keep == "nothing":
            return NOBODY
        head = Head(
            run=secrets.token_hex(8),
            pid=os.getpid(),
            version=VERSION,
            kind=self._config.kind,
            file=record.file,
            yaml=record.yaml,
            texts=record.texts,
            simulated=self._simulated,
            versions={"python": platform.python_version(), "transport": self._transport.speaks},
            recording=keep,
        )
        make = partial(Ring, self._runtime.path, head, int(keep.ring_mb * 1e6))
        return RingWriter(make, clock_of(self._transport), lambda: self._transport.release)

    def serve(self) -> int:
        """Run until a signal comes. Return the exit code, which is 0 only if every output is verified
        off."""
        self._orders = signals.Orders()
        self._service.subscribe()
        self._given.extend(order.take(self._runtime.path, self._config.path))  # during the start
        log.info(pairs("serving", file=self._config.path, kind=self._config.kind, **self._about()))
        try:
            for loop in self._loops:
                loop.start()
            self._watch()
        except Exception as error:
            self._writer.died(f"{type(error).__name__}: {error}")
            raise
        finally:
            safe = self._shut_down()
        return 0 if safe else 1

    def _obey(self) -> None:
        """Take the orders that a signal has announced, and carry out the oldest order. The next order
        waits until the status file has the answer, but at most NEXT_ORDER_S."""
        if self._orders.announced():
            if not (found := order.take(self._runtime.path, self._config.path)):
                log.warning(pairs("no_order", reason="a signal came without a readable order"))
            self._given.extend(found)
        if self._given and time.monotonic() >= self._next_order_at:
            given = self._ordered = self._given.popleft()
            self._next_order_at = time.monotonic() + NEXT_ORDER_S
            log.info(pairs("ordered", what=type(given.event).__name__, order=given.event))
            self._service.obey(given.event, given.device)

    def _watch(self) -> None:
        """Tell systemd when the daemon is ready. Feed systemd's watchdog while every loop makes
        progress."""
        period_s = min(STATUS_EVERY_S, (watchdog_s() or 10.0) / 6)
        told_ready, tell_at = False, 0.0
        fed, fed_at = [-1] * len(self._loops), time.monotonic()
        while not self._end.wait(0.02 if not told_ready else period_s, self._orders):
            self._require_life()
            self._obey()
            if not told_ready and all(loop.ready for loop in self._loops):
                self._convenience("sd_notify", partial(notify, "READY=1"))
                log.info(pairs("ready", file=self._config.path))
                told_ready = True
            finished = [loop.finished for loop in self._loops]
            if all(now > before for now, before in zip(finished, fed, strict=True)):
                self._convenience("sd_notify", partial(notify, ALIVE if told_ready else STARTING))
                self._longest_unfed_s = max(self._longest_unfed_s, time.monotonic() - fed_at)
                fed, fed_at = finished, time.monotonic()
            if self._predecessor is not None:
                self._predecessor.tick(time.monotonic())
            if told_ready and time.monotonic() >= tell_at:
                tell_at = time.monotonic() + STATUS_EVERY_S - period_s / 2
                self._convenience("graph", self._service.look)
                self._writer.look()
                self._convenience("status", self._tell)

    def _require_life(self) -> None:
        """Raise SystemExit if the transport or a loop has died. Then systemd restarts the daemon."""
        if not self._transport.lives:
            log.critical(pairs("died", transport=self._transport.name))
            self._writer.died(f"transport {self._transport.name}")
        elif all(loop.alive for loop in self._loops):
            return
        else:
            self._writer.died("; ".join(loop.died for loop in self._loops if loop.died))
        raise SystemExit(os.EX_SOFTWARE)

    def _shut_down(self) -> bool:
        self._convenience("sd_notify", partial(notify, "STOPPING=1"))
        safe = stop(self._loops, STOP_WITHIN_S)
        self._writer.ended(safe=safe)
        self._convenience("transport", self._transport.close)
        if self._predecessor is not None:
            self._predecessor.close()
        if safe:
            self._runtime.released()
            if not self._left():
                self._convenience("mark", last_mark.leave)
            if self._guard is not None:
                self._guard.dismiss()
        log.info(pairs("stopped", outputs_off=safe))
        return safe

    def _left(self) -> list[str]:
        """Return the names of the records that dead daemons left, because their outputs are not
        verified off."""
        return self._predecessor.left() if self._predecessor else []

    def _convenience(self, what: str, do: Callable[[], None]) -> None:
        """Call `do`. Log a failure once and continue, because the caller will try again."""
        try:
            do()
        except Exception as error:  # noqa: BLE001 - logged by Once
            self._once.failed(what, error)
        else:
            self._once.works(what)

    def _about(self) -> dict[str, Any]:
        about = {"version": VERSION, "node": self._transport.name, "pid": os.getpid()}
        return about | ({"SIMULATED": "no hardware moves"} if self._simulated else {})

    def _apart(self) -> list[dict[str, str]]:
        """Return the transport's faults. Each of them keeps this node and other nodes from hearing each
        other."""
        return [{"code": code, "detail": detail} for code, detail in self._transport.faults()]

    def _slack(self) -> dict[str, float]:
        """Return the shortest time (s), since the last call, that was left before systemd's watchdog
        would have ended the daemon."""
        unfed_s, self._longest_unfed_s = self._longest_unfed_s, 0.0
        allowed_s = watchdog_s()
        return {"watchdog_slack_s": round(allowed_s - unfed_s, 3)} if allowed_s else {}

    def _answer(self) -> order.OrderAnswered | None:
        """Return the answer to a person's last order. Return None until every device has decided about
        the order."""
        given, refused = self._ordered, self._service.refusals()
        if given is None or refused is None:
            return None
        return order.OrderAnswered(given.id, dict(refused))

    def _tell(self) -> None:
        """Write the status file, and publish diagnostics."""
        service = self._service.status()
        daemon = {
            "simulated": self._simulated,
            "file": str(self._config.path.absolute()),
            "kind": self._config.kind,
            **self._about(),
            CERTIFICATE_FILES: self._certificates,
            "transport": self._transport.speaks,
            "release": self._transport.release.name,
            "domain_id": self._transport.domain_id,
            "samples_dropped": dict(self._transport.dropped),
            "predecessor_not_off": self._left(),
            **self._slack(),
            **service,
            "faults": [*service.get("faults", []), *self._apart()],
        }
        devices = self._service.devices()
        answer = self._answer()
        ours = self._runtime.process
        process = {"boot": ours.boot, "started": ours.started}
        told = {**daemon, "order": answer, "devices": devices, **process}
        self._runtime.write_status(msgspec.json.encode(told))
        if answer:
            self._next_order_at = min(self._next_order_at, time.monotonic() + SHOWN_S)
        if self._diagnostics is None:
            return
        try:
            at = stamp(self._transport.wall())
            found = diagnosis(self._transport.name, self._config.kind, daemon, devices, at)
            self._diagnostics.publish(found)
            self._told += 1
            if self._told % max(1, len(devices)) == 0:  # do not record every message
                self._writer.spoken(self._health_topic.name, found, sent=True)
        except (
            TransportError,
            CdrError,
            ClockError,
        ) as error:  # debug is enough, because `outlet.py` logs unpublished states as errors
            log.debug(pairs("not_published", topic=DIAGNOSTICS.name, reason=error))
