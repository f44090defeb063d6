"""The type and QoS of each topic of this project.

The table was typed by hand. It uses nothing from `bridges/messages/topics.py`.

A row is (type, publisher's QoS, subscriber's QoS). Each line number belongs to rmf_ros2 9dedd0f
(2026-05), or to the version that the comment names.
"""

from collections.abc import Mapping
from typing import Final, NamedTuple


class Qos(NamedTuple):
    """QoS as `ros2 topic info --verbose` shows it."""

    reliability: str
    durability: str
    history: str
    depth: int


PLAIN: Final = Qos("RELIABLE", "VOLATILE", "KEEP_LAST", 100)
RETAINED: Final = Qos("RELIABLE", "TRANSIENT_LOCAL", "KEEP_LAST", 100)

GOLDEN: Final[Mapping[str, tuple[str, Qos, Qos]]] = {
    # The fleet adapter subscribes with SystemDefaults keep_last(100) (agv/Node.cpp:37,53). The lift
    # supervisor has keep_last(10), and rmf-web has reliable, volatile, keep_last(10). One node may
    # publish many lifts in a row. On Cyclone, SystemDefaults means a depth of 1
    # (rmw_node.cpp:2160-2197). With that depth all messages except the last would be lost.
    "lift_states": ("rmf_lift_msgs/LiftState", PLAIN, PLAIN),
    # lift_supervisor publishes reliable, transient_local, keep_last(100). A node subscribes volatile.
    # Otherwise a restarted node would hear up to 100 old requests.
    "lift_requests": ("rmf_lift_msgs/LiftRequest", RETAINED, PLAIN),
    # Publisher and subscriber are reliable, transient_local, keep_last(100) (agv/Node.cpp,
    # lift_supervisor/Node.cpp).
    "adapter_lift_requests": ("rmf_lift_msgs/LiftRequest", RETAINED, RETAINED),
    # Everybody uses SystemDefaults. The fleet adapter has depth 100 and the supervisor depth 10.
    # rmf-web is reliable with depth 100.
    "door_states": ("rmf_door_msgs/DoorState", PLAIN, PLAIN),
    # door_supervisor publishes with SystemDefaults keep_last(10), volatile. No message is retained.
    "door_requests": ("rmf_door_msgs/DoorRequest", PLAIN, PLAIN),
    # Everybody uses SystemDefaults. The fleet adapter has depth 100, rmf-web 10, and door_supervisor
    # 10.
    "adapter_door_requests": ("rmf_door_msgs/DoorRequest", PLAIN, PLAIN),
    # Both nodes use SystemDefaults. door_supervisor has depth 10, and the fleet adapter has depth 100.
    "door_supervisor_heartbeat": ("rmf_door_msgs/SupervisorHeartbeat", PLAIN, PLAIN),
    # RMF has no node for chargers and names no topic for chargers. So chargers have the QoS of doors.
    "charger_states": ("rmf_charger_msgs/ChargerState", PLAIN, PLAIN),
    "charger_requests": ("rmf_charger_msgs/ChargerRequest", PLAIN, PLAIN),
    "charger_cancels": ("rmf_charger_msgs/ChargerCancel", PLAIN, PLAIN),
    # RMF has no such topic. On this topic a requester hears why a request was refused. No message is
    # retained, because an old refusal helps nobody.
    "charger_refusals": ("diagnostic_msgs/DiagnosticStatus", PLAIN, PLAIN),
    "adapter_charger_requests": ("rmf_charger_msgs/ChargerRequest", PLAIN, PLAIN),
    "adapter_charger_cancels": ("rmf_charger_msgs/ChargerCancel", PLAIN, PLAIN),
    # The fleet adapter publishes and subscribes with SystemDefaults keep_last(100)
    # (agv/Node.cpp:37,61-71,81-91). When the adapter repeats a request, the dispenser repeats the
    # result. So no message is retained.
    "dispenser_requests": ("rmf_dispenser_msgs/DispenserRequest", PLAIN, PLAIN),
    "dispenser_states": ("rmf_dispenser_msgs/DispenserState", PLAIN, PLAIN),
    "dispenser_results": ("rmf_dispenser_msgs/DispenserResult", PLAIN, PLAIN),
    "ingestor_requests": ("rmf_ingestor_msgs/IngestorRequest", PLAIN, PLAIN),
    "ingestor_states": ("rmf_ingestor_msgs/IngestorState", PLAIN, PLAIN),
    "ingestor_results": ("rmf_ingestor_msgs/IngestorResult", PLAIN, PLAIN),
    # The fleet adapter publishes with SystemDefaults, depth 100.
    "charger_coordinator": ("std_msgs/Bool", PLAIN, PLAIN),
    "fleet_states": ("rmf_fleet_msgs/FleetState", PLAIN, PLAIN),
    # The fleet adapter subscribes reliable, transient_local. A volatile publisher would never match.
    "charging_assignments": ("rmf_fleet_msgs/ChargingAssignments", RETAINED, RETAINED),
    # The api-server of rmf-web subscribes reliable, transient_local, depth 10.
    "alert": ("rmf_task_msgs/Alert", RETAINED, RETAINED),
    # The fleet adapter subscribes reliable, transient_local, depth 100 (agv/Node.cpp:73-79). The
    # subscription exists since rmf_ros2#341.
    "fire_alarm_trigger": ("std_msgs/Bool", RETAINED, RETAINED),
    # The fleet adapter subscribes reliable, transient_local, keep_last(100).
    "emergency_signal": ("rmf_fleet_msgs/EmergencySignal", RETAINED, RETAINED),
    # diagnostic_aggregator and rqt subscribe with the default of rclcpp, which is reliable, volatile,
    # keep_last(10).
    "diagnostics": ("diagnostic_msgs/DiagnosticArray", PLAIN, PLAIN),
}
