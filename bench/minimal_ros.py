"""The baseline on ROS. An rclpy node in a separate process only sets a pin.

A LiftRequest switches the pin. The words `on` and `off` on stdin switch an input. The node publishes
each edge of the input as a LiftState. Each edge of the pin or input also gives a line on stdout with
signal, level and time (monotonic s).
"""

import os
import sys
import threading
from typing import Any

import rclpy
from gpiozero import Button, Device, OutputDevice
from gpiozero.pins.mock import MockFactory
from rclpy.executors import ExternalShutdownException
from rclpy.qos import DurabilityPolicy, QoSProfile
from rmf_lift_msgs.msg import LiftRequest, LiftState

from bench.peers import tell, turn_input
from bridges.transports.cyclone import LOOPBACK


def main(domain: int) -> None:
    """Serve until SIGTERM."""
    os.environ["CYCLONEDDS_URI"] = LOOPBACK
    Device.pin_factory = MockFactory()
    relay, emergency = OutputDevice(12), Button(11, pull_up=False)
    rclpy.init(args=[], domain_id=domain)
    node = rclpy.create_node("minimal")
    volatile = QoSProfile(depth=100, durability=DurabilityPolicy.VOLATILE)
    states = node.create_publisher(LiftState, "lift_states", volatile)

    def serve(request: Any) -> None:
        relay.value = request.request_type == LiftRequest.REQUEST_AGV_MODE
        tell("relay", relay.value)

    def publish(mode: int) -> None:
        states.publish(LiftState(lift_name="Lift1", current_mode=mode))

    emergency.when_pressed = lambda: publish(LiftState.MODE_EMERGENCY)
    emergency.when_released = lambda: publish(LiftState.MODE_AGV)
    node.create_subscription(LiftRequest, "lift_requests", serve, volatile)
    threading.Thread(target=turn_input, args=(emergency.pin,), daemon=True).start()
    print("ready", file=sys.stderr, flush=True)
    try:
        rclpy.spin(node)
    except ExternalShutdownException:
        node.destroy_node()


if __name__ == "__main__":
    main(int(sys.argv[1]))
