"""The type and QoS of each of our topics, typed by hand and without `bridges/messages/topics.py`.

A row is (type, publisher's QoS, subscriber's QoS). Line numbers belong to rmf_ros2 9dedd0f (2026-05),
or to a version that the comment names.
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
    # The fleet adapter subscribes with SystemDefaults keep_last(100) (agv/Node.cpp:37,53), the lift
    # supervisor with 10, and rmf-web with reliable volatile 10. One node may publish many lifts in a
    # row. A depth of 1 (SystemDefaults on Cyclone, rmw_node.cpp:2160-2197) would lose all messages but
    # the last.
    "lift_states": ("rmf_lift_msgs/LiftState", PLAIN, PLAIN),
    # lift_supervisor publishes reliable, transient_local, keep_last(100). A node subscribes volatile,
    # because otherwise its restart would hear up to 100 old requests.
    "lift_requests": ("rmf_lift_msgs/LiftRequest", RETAINED, PLAIN),
    # Reliable, transient_local, keep_last(100) at both ends (agv/Node.cpp, lift_supervisor/Node.cpp).
    "adapter_lift_requests": ("rmf_lift_msgs/LiftRequest", RETAINED, RETAINED),
    # SystemDefaults. The fleet adapter has depth 100, the supervisor 10, and rmf-web reliable 100.
    "door_states": ("rmf_door_msgs/DoorState", PLAIN, PLAIN),
    # door_supervisor publishes SystemDefaults keep_last(10), volatile. No message is retained.
    "door_requests": ("rmf_door_msgs/DoorRequest", PLAIN, PLAIN),
    # SystemDefaults. The fleet adapter has depth 100, rmf-web 10, and door_supervisor 10.
    "adapter_door_requests": ("rmf_door_msgs/DoorRequest", PLAIN, PLAIN),
    # SystemDefaults. door_supervisor has depth 10, and the fleet adapter 100.
    "door_supervisor_heartbeat": ("rmf_door_msgs/SupervisorHeartbeat", PLAIN, PLAIN),
    # RMF has no node for chargers and names no topic. So chargers have the QoS of doors.
    "charger_states": ("rmf_charger_msgs/ChargerState", PLAIN, PLAIN),
    "charger_requests": ("rmf_charger_msgs/ChargerRequest", PLAIN, PLAIN),
    "charger_cancels": ("rmf_charger_msgs/ChargerCancel", PLAIN, PLAIN),
    # This is our own topic, on which a requester hears why a request was refused. No message is
    # retained, because an old refusal helps nobody.
    "charger_refusals": ("diagnostic_msgs/DiagnosticStatus", PLAIN, PLAIN),
    "adapter_charger_requests": ("rmf_charger_msgs/ChargerRequest", PLAIN, PLAIN),
    "adapter_charger_cancels": ("rmf_charger_msgs/ChargerCancel", PLAIN, PLAIN),
    # SystemDefaults keep_last(100) at the fleet adapter's ends (agv/Node.cpp:37,61-71,81-91). The
    # dispenser repeats a missed result at the adapter's next request, so no message is retained.
    "dispenser_requests": ("rmf_dispenser_msgs/DispenserRequest", PLAIN, PLAIN),
    "dispenser_states": ("rmf_dispenser_msgs/DispenserState", PLAIN, PLAIN),
    "dispenser_results": ("rmf_dispenser_msgs/DispenserResult", PLAIN, PLAIN),
    "ingestor_requests": ("rmf_ingestor_msgs/IngestorRequest", PLAIN, PLAIN),
    "ingestor_states": ("rmf_ingestor_msgs/IngestorState", PLAIN, PLAIN),
    "ingestor_results": ("rmf_ingestor_msgs/IngestorResult", PLAIN, PLAIN),
    # The fleet adapter publishes with SystemDefaults, depth 100.
    "charger_coordinator": ("std_msgs/Bool", PLAIN, PLAIN),
    "fleet_states": ("rmf_fleet_msgs/FleetState", PLAIN, PLAIN),
    # The fleet adapter subscribes reliable transient_local. A volatile publisher would never match.
    "charging_assignments": ("rmf_fleet_msgs/ChargingAssignments", RETAINED, RETAINED),
    # rmf-web's api-server subscribes reliable transient_local, depth 10.
    "alert": ("rmf_task_msgs/Alert", RETAINED, RETAINED),
    # The fleet adapter subscribes reliable transient_local, depth 100 (agv/Node.cpp:73-79, from
    # rmf_ros2#341 on).
    "fire_alarm_trigger": ("std_msgs/Bool", RETAINED, RETAINED),
    # The fleet adapter subscribes reliable transient_local keep_last(100).
    "emergency_signal": ("rmf_fleet_msgs/EmergencySignal", RETAINED, RETAINED),
    # diagnostic_aggregator and rqt subscribe with rclcpp's default: reliable, volatile, keep_last(10).
    "diagnostics": ("diagnostic_msgs/DiagnosticArray", PLAIN, PLAIN),
}
