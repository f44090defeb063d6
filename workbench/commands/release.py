"""`rmf-bridge release LIFT`: an operator ends the session of whoever holds a lift.

It is `send lift LIFT --end` under the name that an operator looks for: it sends the holder's
END_SESSION to the lift supervisor until the lift shows that the session is over. If the supervisor does
not obey within seconds, or there is none, it goes to the lift's own daemon by itself; where a robot may
be in the car, only with `--car-empty`. A robot that keeps requesting the lift goes to the end of the
queue.
"""

import argparse

from workbench.commands import send


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The lift, and the options that every sender has."""
    parser.add_argument("name", metavar="LIFT", help="the lift, as RMF names it")
    parser.add_argument(
        "--session", default="", metavar="ID", help="end only this session (default: any)"
    )
    parser.add_argument(
        "--car-empty",
        action="store_true",
        help="somebody has looked: no robot is in the car, so its own daemon may be asked to let go",
    )
    parser.set_defaults(falls_back=True, direct=False)
    parser.set_defaults(kind="lift", end=True, floor=None, granted_only=False)
    send.add_shared_arguments(parser, direct=False)


def run(args: argparse.Namespace) -> int:
    """As `send`: 0 when the session was seen to end, 1 with the reason when not."""
    return send.run(args)
