"""Functions that all commands on a graph share: their options, joining the graph, parsing durations,
and ending on a signal."""

import argparse
import ipaddress
import os
import shlex
import signal
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

from bridges.kinds.shared.rmf_section import TRANSPORTS, Rmf, overridden
from bridges.messages import words
from bridges.messages.releases import Release
from bridges.messages.topics import Topic
from bridges.transports.transport import M, Publisher, Subscription, Transport, TransportError


def add_graph_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the graph's options: `--config`, `--domain-id`, `--transport`, `--localhost`."""
    parser.add_argument(
        "--config",
        type=Path,
        metavar="FILE",
        help="a YAML with an `rmf:` section (routers, certificates, domain): a device's, or of its own",
    )
    parser.add_argument(
        "--domain-id", type=_domain, metavar="N", help="ROS domain (default: ROS_DOMAIN_ID, else 0)"
    )
    parser.add_argument(
        "--transport",
        choices=TRANSPORTS,
        help="ros2 needs rclpy; dds and zenoh need no ROS; auto (default): the first installed",
    )
    parser.add_argument(
        "--localhost",
        action="store_true",
        help="use only the loopback interface, as `run --simulate` does",
    )


def _domain(text: str) -> int:
    if not text.isascii() or not text.isdigit() or int(text) > 232:
        raise argparse.ArgumentTypeError(f"'{text}' is not a DDS domain id: write 0 to 232")
    return int(text)


def seconds(least: float, most: float) -> Callable[[str], float]:
    """Return a function that parses an option in seconds, from `least` to `most`."""

    def read(text: str) -> float:
        with suppress(ValueError):
            if least <= float(text) <= most:
                return float(text)
        raise argparse.ArgumentTypeError(f"'{text}': write {least:g} to {most:g} seconds")

    return read


def address_and_port(text: str) -> tuple[str, int]:
    """Parse ADDRESS:PORT of `--listen`, for argparse."""
    host, _, port = text.rpartition(":")
    host = host.strip("[]")
    try:
        ipaddress.ip_address(host)
        number = int(port)
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"'{text}' is not ADDRESS:PORT, such as 0.0.0.0:8080"
        ) from None
    if not 0 <= number <= 65535:
        raise argparse.ArgumentTypeError(f"'{text}': a port is 0 to 65535")
    return host, number


def open_graph(args: argparse.Namespace, node_name: str) -> Transport:
    """Join the graph that the options name. Raises TransportError."""
    from bridges.transports.choose import open_transport

    rmf = overridden(_configured(args.config), args)
    joined = open_transport(rmf, node_name, localhost=args.localhost, ros_args=args.ros_args)
    return Renamed(joined, rmf.topics) if rmf.topics else joined


class Renamed:
    """A transport that uses the site's topic names (`rmf.topics` of a YAML).

    `names` is RMF's topic name -> the site's topic name.
    """

    def __init__(self, transport: Transport, names: Mapping[str, str]) -> None:
        self.name, self.speaks, self.dropped = transport.name, transport.speaks, transport.dropped
        self.domain_id = transport.domain_id
        self.wall, self.close = transport.wall, transport.close
        self.sender = transport.sender
        self._transport = transport
        self._names = names

    def publisher(self, topic: Topic[M]) -> Publisher[M]:
        """Declare a publisher under the site's topic name."""
        return self._transport.publisher(self._named(topic))

    def subscribe(
        self, topic: Topic[M], received: Callable[[M], None], *, others_only: bool = False
    ) -> Subscription:
        """Declare a subscription under the site's topic name."""
        return self._transport.subscribe(self._named(topic), received, others_only=others_only)

    @property
    def release(self) -> Release:
        """The release of RMF's messages that this transport uses."""
        return self._transport.release

    def faults(self) -> list[tuple[str, str]]:
        """Return (code, detail) for each present problem of the connection to other nodes."""
        return self._transport.faults()

    @property
    def lives(self) -> bool:
        """Return whether the transport's thread is alive."""
        return self._transport.lives

    def _named(self, topic: Topic[M]) -> Topic[M]:
        return topic.named(self._names.get(topic.name, topic.name))


def graph_of(args: argparse.Namespace, speaks: str) -> str:
    """Describe the graph (network of ROS nodes) that the command has joined. Example: `dds in domain 7,
    on this machine alone`."""
    from bridges.transports.choose import domain_id, peers_of, stays_on_loopback

    rmf = overridden(_configured(args.config), args)
    peers = peers_of(speaks, os.environ)
    alone = args.localhost or stays_on_loopback(rmf, os.environ, peers)
    where = f"{speaks} in domain {domain_id(rmf, os.environ)}"
    return f"{where}, on this machine alone" if alone else where


def _configured(file: Path | None) -> Rmf:
    if file is None:
        return Rmf()
    from bridges.settings.load import SettingsError, load_rmf

    try:
        return load_rmf(file)
    except SettingsError as error:
        print(*error.problems, sep="\n", file=sys.stderr)
        raise TransportError(f"{file} has errors") from None


def interruptible() -> AbstractContextManager[None]:
    """Let SIGINT, SIGTERM and SIGHUP raise KeyboardInterrupt, so that the command leaves the graph
    properly.

    Otherwise the node of a killed command would seem to stay on the graph for over 10 s.
    """
    return ended_by(signal.default_int_handler)


@contextmanager
def ended_by(action: Callable[[int, FrameType | None], object]) -> Iterator[None]:
    """Call `action` on SIGINT, SIGTERM and SIGHUP until the end of the block."""
    signals = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = {number: signal.signal(number, action) for number in signals}
    try:
        yield
    finally:
        for number, earlier in before.items():
            signal.signal(number, earlier)


def complain(command: str, text: object) -> None:
    """Write one line to standard error, with the command's name and the text. Control characters are
    escaped."""
    sys.stderr.write(words.printable(f"rmf-bridge {command}: {text}") + "\n")


@dataclass(frozen=True, slots=True)
class CommandLine:
    """The command line as the user typed it. Proposed commands repeat its options, so that a user can
    copy the proposed commands.

    `typed` has every word after `rmf-bridge`. `options` has only the options that another command needs
    to join the same graph.
    """

    typed: tuple[str, ...] = ()
    options: tuple[str, ...] = ()

    def again_with(self, option: str) -> str:
        """Return the same command with one more option."""
        return shlex.join(("rmf-bridge", *self.typed, option))

    def other(self, *command: str) -> str:
        """Return another command for the same graph. Keep `--direct` only if the other command is
        `send`."""
        options = [one for one in self.options if one != "--direct" or command[0] == "send"]
        return shlex.join(("rmf-bridge", *command, *options))


def command_line(args: argparse.Namespace) -> CommandLine:
    """Make the CommandLine from parsed arguments. `args.typed` has the words given to `cli`."""
    options = ["--direct"] if getattr(args, "direct", False) else []
    if args.config is not None:
        options += ["--config", str(args.config)]
    if args.domain_id is not None:
        options += ["--domain-id", str(args.domain_id)]
    if args.transport is not None:
        options += ["--transport", args.transport]
    if args.localhost:
        options += ["--localhost"]
    return CommandLine(tuple(args.typed), tuple(options))
