"""The peers of a lift's daemon: two nodes in the usual style, which only set a pin and read an input.

Both use the same transport and the same pins as the daemon, so that only the node's structure differs.

- `timers`: the structure of RMF's own template (open-rmf/lift_adapter_template, lift_adapter.py:60-61).
  One thread serves requests at once, reads the input each 0.5 s, and publishes each second.
- `loop`: a node in a single file, whose only loop serves the last request, reads, publishes and sleeps
  for 0.5 s.

A LiftRequest switches the pin. The words `on` and `off` on stdin switch the input. Each edge of the pin
or input gives a line on stdout with signal, level and time (monotonic s).
"""

import queue
import sys
import threading
import time
from typing import Any, Final

from gpiozero import Button, Device, OutputDevice
from gpiozero.pins.mock import MockFactory

from bridges.kinds.shared.rmf_section import Rmf
from bridges.messages.definitions import LiftMode, LiftRequest, LiftRequestType, LiftState
from bridges.messages.topics import LIFT_REQUESTS, LIFT_STATES
from bridges.transports.choose import open_transport

READS_S: Final = 0.5
PUBLISHES_S: Final = 1.0


class Peer:
    """The pin, the input and the ends on the graph that both nodes have."""

    def __init__(self, domain: int) -> None:
        Device.pin_factory = MockFactory()
        self.relay, self.emergency = OutputDevice(12), Button(11, pull_up=False)
        self.requests: queue.SimpleQueue[LiftRequest] = queue.SimpleQueue()
        transport = open_transport(Rmf(domain_id=domain, transport="dds"), "peer", localhost=True)
        self._states = transport.publisher(LIFT_STATES)
        transport.subscribe(LIFT_REQUESTS, self.requests.put)
        self.read()

    def serve(self, request: LiftRequest) -> None:
        self.relay.value = request.request_type == LiftRequestType.REQUEST_AGV_MODE
        tell("relay", self.relay.value)

    def read(self) -> None:
        mode = LiftMode.MODE_EMERGENCY if self.emergency.is_pressed else LiftMode.MODE_AGV
        self._state = LiftState(lift_name="Lift1", current_mode=int(mode))

    def publish(self) -> None:
        self._states.publish(self._state)


def timers(peer: Peer) -> None:
    """Serve for ever, as an executor with one thread and two timers does."""
    reads_at = publishes_at = time.monotonic()
    while True:
        wait_s = min(reads_at, publishes_at) - time.monotonic()
        try:
            peer.serve(peer.requests.get(timeout=max(wait_s, 1e-4)))
        except queue.Empty:
            now = time.monotonic()
            if now >= reads_at:
                reads_at += READS_S
                peer.read()
            if now >= publishes_at:
                publishes_at += PUBLISHES_S
                peer.publish()


def loop(peer: Peer) -> None:
    """Serve for ever, one step after the other."""
    while True:
        while not peer.requests.empty():
            peer.serve(peer.requests.get())
        peer.read()
        peer.publish()
        time.sleep(READS_S)


STYLES: Final = {"timers": timers, "loop": loop}


def turn_input(pin: Any) -> None:
    """Switch the input as the words on stdin say, until stdin ends."""
    for line in sys.stdin:
        pressed = line.strip() == "on"
        tell("input", pressed)
        (pin.drive_high if pressed else pin.drive_low)()


def tell(signal: str, level: object) -> None:
    """Write an edge to stdout."""
    print(signal, int(bool(level)), time.monotonic(), flush=True)


def main(domain: int, style: str) -> None:
    """Run the node of this style until SIGTERM."""
    peer = Peer(domain)
    threading.Thread(target=turn_input, args=(peer.emergency.pin,), daemon=True).start()
    print("ready", file=sys.stderr, flush=True)
    STYLES[style](peer)


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2])
