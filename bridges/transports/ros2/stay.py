"""One stay of a node on the ROS graph, from joining to leaving. A stay owns rclpy's context, node and
executor.

ROS's middleware (RMW) reads the machine's network only when a node joins. Therefore, after a change of
the machine's address, the transport leaves the graph and joins again with a new stay.
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
"""The environment variables that an RMW reads when it joins. With these values the RMW finds only this
machine's nodes, and Cyclone stays on the loopback interface."""
FAST_DDS_SPEAKS: Final = "FASTDDS_BUILTIN_TRANSPORTS"
"""The environment variable for Fast DDS's transports. Its value UDPv4 excludes shared memory. Over
shared memory, nodes of two users or containers find each other, but do not hear each other.

ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST adds shared memory again (rmw_fastrtps, participant.cpp). A Fast
DDS profile that names transports takes precedence over this variable.
"""
REFUSALS: Final = (RuntimeError, NameValidationException)
"""The exceptions with which rclpy refuses a request. RCLError and InvalidHandle are RuntimeErrors
too."""


class Stay:
    """A node on the ROS graph. If the node cannot join, the constructor removes what it has made, and
    raises one of REFUSALS."""

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
        """Return whether rclpy's context is valid. It becomes invalid when any code shuts the context
        down."""
        return bool(self._context.ok())

    def spin(self, timeout_s: float | None) -> None:
        """Wait for a callback, and run it. Stop waiting after `leave_soon`, or after `timeout_s`
        (s)."""
        self._executor.spin_once(timeout_sec=timeout_s)

    def leave_soon(self) -> None:
        """End a waiting `spin`. Any thread may call this method."""
        self._leaving.trigger()

    def leave(self) -> None:
        """Leave the graph at once. The node must not be used afterwards."""
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()

    def _join(self, name: str, domain_id: int, ros_args: Sequence[str]) -> None:
        # rclpy's logging stays off. It would open a file below $HOME, and a service has no home
        # directory.
        self._context.init(args=list(ros_args), initialize_logging=False, domain_id=domain_id)
        self.node = Node(
            name,
            context=self._context,
            enable_rosout=False,
            start_parameter_services=False,  # nobody may change a daemon's clock by a parameter
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._leaving = self.node.create_guard_condition(lambda: None)


def _on_the_network() -> dict[str, str | None]:
    speaks = os.environ.get(FAST_DDS_SPEAKS, "UDPv4")
    return {"CYCLONEDDS_URI": for_ros(os.environ), FAST_DDS_SPEAKS: speaks}


@contextmanager
def _environment(wanted: Mapping[str, str | None]) -> Iterator[None]:
    """Set these variables during the block. The value None removes a variable."""
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
