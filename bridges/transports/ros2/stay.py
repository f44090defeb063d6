"""One stay of a node on ROS 2's graph: rclpy's context, node and executor, from joining to leaving.

An RMW looks at the machine's network once, when a context's node joins: after a change of address the
transport leaves and joins again with a new stay.
"""

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Final

from rclpy.context import Context
from rclpy.exceptions import NameValidationException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from bridges.transports.cyclone import LOOPBACK, for_ros

ON_LOOPBACK: Final = {
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    "ROS_LOCALHOST_ONLY": None,
    "ROS_STATIC_PEERS": None,
    "CYCLONEDDS_URI": LOOPBACK,
}
"""The variables that an RMW reads when it joins. With these it only finds this machine's nodes, and
Cyclone stays on the loopback interface."""
FAST_DDS_SPEAKS: Final = "FASTDDS_BUILTIN_TRANSPORTS"
"""The variable of Fast DDS. UDPv4 leaves its shared memory out: that carries nothing between nodes of
two users or two containers, although they find each other. `LOCALHOST` brings it back (rmw_fastrtps,
participant.cpp), and a profile with transports of its own prevails."""
REFUSALS: Final = (RuntimeError, NameValidationException)
"""How rclpy refuses: RCLError and InvalidHandle are RuntimeErrors."""


class Stay:
    """A node that has joined. Raises one of REFUSALS if it cannot, and then leaves nothing behind."""

    def __init__(
        self, name: str, domain_id: int, *, loopback: bool, ros_args: Sequence[str]
    ) -> None:
        self._context = Context()
        try:
            with _environment(ON_LOOPBACK if loopback else _on_the_network()):
                self._join(name, domain_id, ros_args)
        except REFUSALS:
            self._context.try_shutdown()
            raise

    @property
    def lasts(self) -> bool:
        """Whether nobody has shut rclpy's context down."""
        return bool(self._context.ok())

    def spin(self, timeout_s: float | None) -> None:
        """Run one callback, or return when `leave_soon` is called or the time is over."""
        self._executor.spin_once(timeout_sec=timeout_s)

    def leave_soon(self) -> None:
        """End the `spin` that waits; from any thread."""
        self._leaving.trigger()

    def leave(self) -> None:
        """Leave the graph at once. Nobody may use the node any more."""
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()

    def _join(self, name: str, domain_id: int, ros_args: Sequence[str]) -> None:
        # Without rclpy's logging: it would open a file below $HOME, and a service has none.
        self._context.init(args=list(ros_args), initialize_logging=False, domain_id=domain_id)
        self.node = Node(
            name,
            context=self._context,
            enable_rosout=False,
            start_parameter_services=False,  # nobody changes the clock of a running daemon
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._leaving = self.node.create_guard_condition(lambda: None)


def _on_the_network() -> dict[str, str | None]:
    speaks = os.environ.get(FAST_DDS_SPEAKS, "UDPv4")
    return {"CYCLONEDDS_URI": for_ros(os.environ), FAST_DDS_SPEAKS: speaks}


@contextmanager
def _environment(wanted: Mapping[str, str | None]) -> Iterator[None]:
    """Set these variables for the length of the block; None removes one."""
    before = {name: os.environ.get(name) for name in wanted}
    _set(wanted)
    try:
        yield
    finally:
        _set(before)


def _set(wanted: Mapping[str, str | None]) -> None:
    for name, value in wanted.items():
        os.environ.pop(name, None)
        if value is not None:
            os.environ[name] = value
