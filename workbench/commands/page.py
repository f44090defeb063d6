"""`rmf-bridge page`: serve a web page that shows RMF's live graph, or one recording.

The page needs the extra `page` (NiceGUI). No daemon imports NiceGUI. By default, the page listens on
127.0.0.1. On another address (`--listen`), the page needs a password file or a reverse proxy.
"""

import argparse
import getpass
import ipaddress
import os
import socket
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from bridges.system import directories, log
from bridges.system.installed import how_to_install
from workbench.graph.join import (
    add_graph_arguments,
    address_and_port,
    command_line,
    complain,
    open_graph,
)

PORT: Final = 8080
LOOPBACK: Final = "127.0.0.1"
RECORDER: Final = Path("/var/lib/rmf-bridge-recorder")
"""Folder in which `rmf-bridge-recorder.service` writes recordings."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `page`."""
    parser.add_argument(
        "recording", nargs="?", type=Path, metavar="FILE", help="show this recording, and no graph"
    )
    parser.add_argument(
        "--listen",
        type=address_and_port,
        default=(LOOPBACK, PORT),
        metavar="ADDRESS:PORT",
        help=f"default: {LOOPBACK}:{PORT}; with port 0, any free port",
    )
    parser.add_argument(
        "--host",
        action="append",
        default=[],
        metavar="NAME",
        help="another name that browsers use for this page, such as rmf.hospital.example",
    )
    parser.add_argument(
        "--passwords",
        type=Path,
        metavar="FILE",
        help="the file of users who may log in and act (see --add-user)",
    )
    parser.add_argument(
        "--add-user", metavar="NAME", help="ask for a password, write it to --passwords, and end"
    )
    parser.add_argument(
        "--proxy", metavar="ADDRESS", help="a reverse proxy whose --proxy-header names the user"
    )
    parser.add_argument("--proxy-header", default="X-Remote-User", metavar="HEADER")
    parser.add_argument(
        "--incidents",
        type=Path,
        default=_incidents(),
        metavar="DIR",
        help="the folder of recorded incidents (default: the recorder's)",
    )
    parser.add_argument(
        "--runtime-dirs", type=Path, metavar="DIR", help="the folder of this machine's daemons"
    )
    add_graph_arguments(parser)


def _incidents() -> Path:
    """Return the recorder service's folder if this user may read the folder. Otherwise return the
    folder of the user's own recorder."""
    if os.access(RECORDER, os.R_OK | os.X_OK):
        return RECORDER
    return directories.state_base() / "recordings"


def run(args: argparse.Namespace) -> int:
    """Return 0 after Ctrl-C or SIGTERM. Otherwise print the remedy, and return 64, 66, 69 or 78."""
    from workbench.page.access import PasswordError, users

    log.start()
    try:
        if args.add_user:
            return _add_user(args)
        known = users(args.passwords) if args.passwords else {}
    except PasswordError as error:
        complain("page", error)
        return os.EX_CONFIG
    if why := _unsafe(args):
        complain("page", why)
        return os.EX_USAGE
    if args.recording and (code := _unreadable(args.recording)):
        return code
    address, port = args.listen
    try:
        opened = socket.create_server(args.listen, family=_family(address))
    except OSError as error:
        why = os.strerror(error.errno) if error.errno else str(error)
        other = f"for a free port: --listen {address}:0"
        complain("page", f"{address} port {port}: {why}; {other}")
        return os.EX_UNAVAILABLE
    with opened:
        return _serve(args, opened, known)


def _serve(args: argparse.Namespace, opened: socket.socket, known: Mapping[str, str]) -> int:
    """Serve the page with NiceGUI. The import is in this function, because the import takes seconds on
    a Raspberry Pi."""
    try:
        from workbench.page import web
    except ImportError as error:
        complain("page", f"{error}: {how_to_install('page')}")
        return os.EX_UNAVAILABLE
    web.serve(args, opened, known, lambda: open_graph(args, "rmf_bridge_page"), _graph(args))
    return 0


def _family(address: str) -> socket.AddressFamily:
    return socket.AF_INET6 if ":" in address else socket.AF_INET


def _unreadable(recording: Path) -> int:
    """Return 0 if the page can show a part of this recording. Otherwise return the exit code."""
    from workbench.replay.bags import BagError, Notes, all_in
    from workbench.replay.recordings import unreadable

    try:
        next(all_in(recording, Notes()), None)
    except BagError as error:
        return unreadable("page", error)
    return 0


def _graph(args: argparse.Namespace) -> Sequence[str]:
    return command_line(args).options


def _add_user(args: argparse.Namespace) -> int:
    from workbench.page.access import add_user

    if args.passwords is None:
        complain("page", "--add-user needs --passwords FILE, the file for the new user")
        return os.EX_USAGE
    if sys.stdin.isatty():
        password = getpass.getpass(f"Password of {args.add_user}: ")
        if getpass.getpass("Once more: ") != password:
            complain("page", "the two passwords differ; nothing was written")
            return os.EX_USAGE
    else:
        password = sys.stdin.readline().rstrip("\n")
    add_user(args.passwords, args.add_user, password)
    print(f"{args.add_user} may log in: {args.passwords}")
    return 0


def _unsafe(args: argparse.Namespace) -> str:
    """Return the reason not to listen on the address. Return "" if the page may listen."""
    loopback = ipaddress.ip_address(args.listen[0]).is_loopback
    if loopback or args.passwords or args.proxy:
        return ""
    return (
        f"on {args.listen[0]} everybody on that network would see the site: give --passwords FILE,"
        " or --proxy ADDRESS for a reverse proxy that knows its users"
    )
