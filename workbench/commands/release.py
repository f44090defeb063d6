"""`rmf-bridge release LIFT`: an operator ends a lift's present session.

`release` does the same as `send lift LIFT --end`. It sends the session holder's END_SESSION to the lift
supervisor, until the lift shows the session's end. If no supervisor runs, or the supervisor does not
obey within seconds, `release` asks the lift's own daemon. If a robot may be in the car, this direct
request needs `--car-empty`.

After the end, `release` watches the lift for 5 s. Then `release` prints which robot has the lift, and
whether the car moves. A robot that keeps requesting the lift goes to the end of the queue.
"""

import argparse

from workbench.commands import send


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the argument for the lift, and the options that all sending commands share."""
    parser.add_argument("name", metavar="LIFT", help="the lift, as RMF names it")
    parser.add_argument(
        "--session", default="", metavar="ID", help="end only this session (default: any)"
    )
    parser.add_argument(
        "--car-empty",
        action="store_true",
        help="somebody has seen that the car is empty, so the lift's own daemon may release the lift",
    )
    parser.set_defaults(falls_back=True, direct=False)
    parser.set_defaults(kind="lift", end=True, floor=None, granted_only=False)
    send.add_shared_arguments(parser, direct=False)


def run(args: argparse.Namespace) -> int:
    """Return 0 if the lift showed the session's end. Otherwise print the reason, and return the exit
    code of `send`."""
    return send.run(args)
