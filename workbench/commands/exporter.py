"""`rmf-bridge exporter`: publish metrics for Prometheus about RMF's graph and this machine's daemons.

The exporter only listens. The exporter needs prometheus_client, from the extra `metrics`. No daemon
imports prometheus_client. On 127.0.0.1, only this machine can read the metrics. On another address,
everybody on that network can read the names, states and faults of the site's devices. A reverse proxy
with TLS and a login prevents this reading.
"""

import argparse
import logging
import os
import signal
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Final

from bridges.observe.all_devices import PlainGraph
from bridges.observe.requesters import Moment
from bridges.observe.tally import SiteTally
from bridges.runtime import daemons
from bridges.system import log
from bridges.system.certificates import CertificateEnd, CertificateReader
from bridges.system.installed import how_to_install
from bridges.system.log import pairs
from bridges.transports.transport import TransportError
from workbench.graph.join import (
    add_graph_arguments,
    address_and_port,
    complain,
    interruptible,
    open_graph,
)
from workbench.graph.live import Ear

if TYPE_CHECKING:
    from prometheus_client.core import Metric

PORT: Final = 9763
RECORDER: Final = Path("/var/lib/rmf-bridge-recorder")
"""Folder in which `rmf-bridge-recorder.service` writes recordings."""
LISTEN_S: Final = 0.5
logger = logging.getLogger(__name__)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `exporter`."""
    parser.add_argument(
        "--listen",
        type=address_and_port,
        default=("127.0.0.1", PORT),
        metavar="ADDRESS:PORT",
        help=f"default: 127.0.0.1:{PORT}; with port 0, any free port",
    )
    parser.add_argument(
        "--no-graph",
        action="store_true",
        help="export only this machine's daemons, because another machine exports the graph",
    )
    parser.add_argument(
        "--runtime-dirs", type=Path, metavar="DIR", help="the folder of this machine's daemons"
    )
    parser.add_argument(
        "--certificate",
        action="append",
        default=[],
        metavar="FILE",
        help="another certificate whose end date is exported, such as that of the web page's proxy",
    )
    add_graph_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Return the exit code.

    - 0: Ctrl-C or SIGTERM ended the exporter.
    - 1: the exporter could not join the graph.
    - 69: the exporter could not start, and has printed the remedy.
    """
    log.start()
    try:
        from prometheus_client import CollectorRegistry, ProcessCollector, start_http_server
    except ImportError as error:
        complain("exporter", f"{error}: {how_to_install('page')}")
        return os.EX_UNAVAILABLE
    site = Site(args.runtime_dirs, args.certificate)
    registry = CollectorRegistry()
    ProcessCollector(registry=registry)
    registry.register(site)
    try:
        server, thread = start_http_server(args.listen[1], args.listen[0], registry)
    except OSError as error:
        complain("exporter", f"{args.listen[0]} port {args.listen[1]}: {error.strerror}")
        return os.EX_UNAVAILABLE
    print(f"metrics on http://{args.listen[0]}:{server.server_port}/metrics", flush=True)
    try:
        with interruptible():
            _serve(args, site)
    except TransportError as error:
        complain("exporter", error)
        return 1
    except KeyboardInterrupt:
        return 0
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
    return 0


def _serve(args: argparse.Namespace, site: "Site") -> None:
    """Listen to the graph until Ctrl-C or SIGTERM."""
    if args.no_graph:
        while True:
            signal.pause()
    with closing(open_graph(args, "rmf_bridge_exporter")) as transport:
        ear = Ear(transport)
        while True:
            site.listen(ear)


class Site:
    """A collector for prometheus_client. The collector reads the graph's devices and this machine's
    daemons."""

    def __init__(self, runtime_dirs: Path | None = None, certificates: Sequence[str] = ()) -> None:
        self._runtime_dirs = runtime_dirs
        self._certificates, self._reader = certificates, CertificateReader()
        self._unreadable: dict[str, str] = {}
        self._graph, self._tally = PlainGraph(), SiteTally()
        self._lock = threading.Lock()
        self._listens = False

    def listen(self, ear: Ear) -> None:
        """Listen for half a second, and take the messages heard."""
        for heard in ear.listen(LISTEN_S):
            with self._lock:
                self._tally.take(self._graph, self._graph.hear(heard))
        with self._lock:
            self._listens = True

    def collect(self) -> "Iterator[Metric]":
        """Yield every metric family. At each scrape, a thread of the HTTP server calls this method."""
        from workbench.metrics import families, machine

        now = Moment(time.monotonic(), time.time())
        with self._lock:
            if self._listens:
                yield from families.of_graph(self._graph, self._tally, now)
        found = [*self._daemons(now.wall)]
        yield from machine.of_machine(found)
        yield from machine.of_certificates(found, self._certificates, self._end)
        yield from machine.of_recordings(RECORDER)

    def _end(self, file: str) -> CertificateEnd:
        """Return the end of a certificate. If the end is unknown, log the reason once, because a metric
        cannot give a reason."""
        end = self._reader.end(file)
        if end.reason and end.reason != self._unreadable.get(file):
            logger.warning(pairs("certificate_unreadable", file=file, reason=end.reason))
        self._unreadable[file] = end.reason
        return end

    def _daemons(self, wall: float) -> Iterator[daemons.DaemonStatus]:
        if self._runtime_dirs is not None:
            return daemons.daemons(sorted(self._runtime_dirs.iterdir()), {}, wall)
        return daemons.daemons(daemons.folders(), daemons.units(), wall)
