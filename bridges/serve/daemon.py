"""The daemon: one YAML in service. Opens the transport, starts the service's loops, tells systemd how
it is, and on SIGTERM or SIGINT switches every output off and leaves RMF's graph.
"""

import logging
import os
import signal
import threading
import time
from collections.abc import Sequence
from types import FrameType
from typing import Any

import msgspec

from bridges import __version__
from bridges.log import pairs
from bridges.rmf.choose import open_transport
from bridges.rmf.definitions import DiagnosticArray
from bridges.rmf.stamps import stamp
from bridges.rmf.topics import DIAGNOSTICS
from bridges.rmf.transport import Publisher, TransportError
from bridges.serve.diagnostics import diagnosis
from bridges.serve.directory import KeptFile, RuntimeDirectory, state_file
from bridges.serve.notify import notify, watchdog_s
from bridges.serve.service import OpenBus, named_by, service
from bridges.settings.load import Config
from drivers import DriverError

log = logging.getLogger(__name__)

STOP_WITHIN_S = 5.0
STATUS_EVERY_S = 1.0


class Daemon:
    """Everything that one `rmf-bridge run` holds. `simulated` is shown wherever the state is."""

    def __init__(
        self,
        config: Config,
        runtime: RuntimeDirectory,
        *,
        open_bus: OpenBus | None = None,
        localhost: bool = False,
        simulated: bool = False,
        ros_args: Sequence[str] = (),
    ) -> None:
        """Raises TransportError or HalError when it cannot be."""
        self._config = config
        self._runtime = runtime
        self._simulated = simulated
        self._stop = threading.Event()
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._on_signal)
        node_name = f"rmf_bridge_{config.path.stem}"
        self._transport = open_transport(
            config.rmf, node_name, localhost=localhost, ros_args=ros_args
        )
        if config.buses and not simulated:
            runtime.claim(config.text)  # before anything is: `outputs-off` goes by it
        kept = None if simulated else KeptFile(state_file(config.path))
        self._service = service(config, self._transport, open_bus or config.open_bus, kept)
        self._loops = self._service.loops
        self._diagnostics: Publisher[DiagnosticArray] | None = None
        if config.rmf.diagnostics:
            self._diagnostics = self._transport.publisher(named_by(config, DIAGNOSTICS))

    def serve(self) -> int:
        """Run until a signal, and return the exit code: 0 when every output is off and verified."""
        signal.signal(signal.SIGUSR1, self._on_reset)
        self._service.subscribe()
        for loop in self._loops:
            loop.start()
        log.info(pairs("serving", file=self._config.path, kind=self._config.kind, **self._about()))
        try:
            self._watch()
        finally:
            safe = self._shut_down()
        return 0 if safe else 1

    def _watch(self) -> None:
        """Tell systemd that we are ready, and each time that every loop has finished scans."""
        period_s = min(STATUS_EVERY_S, (watchdog_s() or 10.0) / 3)
        told_ready = False
        fed = [-1] * len(self._loops)
        while not self._stop.wait(0.02 if not told_ready else period_s):
            if not all(loop.alive for loop in self._loops):
                raise SystemExit(70)  # a defect of ours, logged by its thread; systemd restarts us
            if not told_ready and all(loop.ready for loop in self._loops):
                notify("READY=1")
                log.info(pairs("ready", file=self._config.path))
                told_ready = True
            scans = [loop.scans for loop in self._loops]
            if all(now > before for now, before in zip(scans, fed, strict=True)):
                notify("WATCHDOG=1")
                fed = scans
            if told_ready:
                self._tell()

    def _shut_down(self) -> bool:
        notify("STOPPING=1")
        deadline = time.monotonic() + STOP_WITHIN_S
        safe = [loop.stop(max(0.1, deadline - time.monotonic())) for loop in self._loops]
        self._transport.close()
        if all(safe):
            self._runtime.released()
        log.info(pairs("stopped", outputs_off=all(safe)))
        return all(safe)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        self._stop.set()

    def _on_reset(self, number: int, frame: FrameType | None) -> None:
        """`rmf-bridge reset`: an operator says that it is safe to go on."""
        self._service.reset()

    def _about(self) -> dict[str, Any]:
        about = {"version": __version__, "node": self._transport.name, "pid": os.getpid()}
        return about | ({"SIMULATED": "no hardware moves"} if self._simulated else {})

    def _tell(self) -> None:
        """How everything is, to the status file and to ROS."""
        daemon = {
            "simulated": self._simulated,
            "file": str(self._config.path),
            **self._about(),
            "samples_dropped": dict(self._transport.dropped),
            **self._service.status(),
        }
        devices = self._service.devices()
        self._runtime.write_status(msgspec.json.encode({**daemon, "devices": devices}))
        if self._diagnostics is None:
            return
        at = stamp(self._transport.wall())
        found = diagnosis(self._transport.name, self._config.kind, daemon, devices, at)
        try:
            self._diagnostics.publish(found)
        except TransportError as error:  # the states, more urgent, say so as an error
            log.debug(pairs("not_published", topic=DIAGNOSTICS.name, reason=error))


def outputs_off(config: Config, timeout_s: float) -> bool:
    """Switch off every output that a file names, from a fresh process; True when verified.

    Bounded: a bus that does not answer is given up after `timeout_s` (s) in all.
    """
    results: dict[str, bool] = {}
    threads = [
        threading.Thread(target=_bus_off, args=(config, name, results), daemon=True)
        for name in config.buses
    ]
    deadline = time.monotonic() + timeout_s
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(max(0.0, deadline - time.monotonic()))
    return len(results) == len(config.devices) and all(results.values())


def _bus_off(config: Config, bus_name: str, results: dict[str, bool]) -> None:
    bus = config.open_bus(bus_name)
    for name, device in config.devices.items():
        if config.bus_of(name) == bus_name:
            results[name] = _device_off(name, config.driver_type.create(name, device, bus))
    bus.close()


def _device_off(name: str, driver: Any) -> bool:
    try:
        driver.open()
        driver.make_safe()
    except DriverError as error:
        log.error(pairs("outputs_not_off", device=name, reason=error))
        return False
    finally:
        driver.close()
    log.info(pairs("outputs_off", device=name))
    return True
