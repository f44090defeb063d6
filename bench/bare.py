"""The baseline of the benchmarks. A bare transport node in a separate process only answers requests."""

import signal
import sys
import threading

from bridges.kinds.shared.rmf_section import Rmf
from bridges.messages.definitions import LiftRequest, LiftState
from bridges.messages.topics import LIFT_REQUESTS, LIFT_STATES
from bridges.transports.choose import open_transport
from hal_fakes.wire import Wire


def main(domain: int, speaks: Wire) -> None:
    """Answer each LiftRequest with a LiftState until SIGTERM."""
    done = threading.Event()
    signal.signal(signal.SIGTERM, lambda number, frame: done.set())
    transport = open_transport(Rmf(transport=speaks, domain_id=domain), "bare", localhost=True)
    states = transport.publisher(LIFT_STATES)

    def answer(request: LiftRequest) -> None:
        states.publish(LiftState(session_id=request.session_id))

    transport.subscribe(LIFT_REQUESTS, answer)
    print("ready", file=sys.stderr, flush=True)
    while not done.wait(1.0):
        states.publish(LiftState(lift_name="idle"))
    transport.close()


if __name__ == "__main__":
    main(int(sys.argv[1]), "zenoh" if sys.argv[2:] == ["zenoh"] else "dds")
