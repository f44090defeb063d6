"""The topics that we publish or subscribe to, with their types and QoS.

The QoS fits the endpoints of RMF's own nodes (rmf_ros2 9dedd0f; agv/Node.cpp, lift_supervisor/Node.cpp,
door_supervisor/Node.cpp). All endpoints are RELIABLE with KEEP_LAST history. Only durability and depth
differ.
"""

from typing import Generic, Literal, TypeVar

from msgspec import Struct
from msgspec.structs import replace

from bridges.messages import definitions as d

M_co = TypeVar("M_co", bound=d.Message, covariant=True)


class Qos(Struct, frozen=True):
    """The QoS of a RELIABLE endpoint with KEEP_LAST(`depth`)."""

    durability: Literal["volatile", "transient_local"]
    depth: int


VOLATILE = Qos("volatile", 100)
RETAINED = Qos("transient_local", 100)


class Topic(Struct, Generic[M_co], frozen=True):
    """A topic under its ROS name (without `rt/`).

    - `publish`: the QoS of our publisher
    - `subscribe`: the QoS of our subscription
    - `lasting`: Does a retained message still hold when its publisher leaves the graph and joins again?
      A state such as an alarm does. A request does not.
    """

    name: str
    type: type[M_co]
    publish: Qos = VOLATILE
    subscribe: Qos = VOLATILE
    lasting: bool = True

    @property
    def repeats(self) -> int:
        """The number of its last messages that our publisher sends again after it has joined again.

        Volatile subscriptions hear them too. So no request is among them: a lift would obey the request
        of a ride that has ended.
        """
        retains = self.publish.durability == "transient_local"
        return self.publish.depth if retains and self.lasting else 0

    def named(self, name: str) -> "Topic[M_co]":
        """Return the same topic under another name."""
        return replace(self, name=name)

    def live(self) -> "Topic[M_co]":
        """Return the same topic for a subscription that receives no retained messages."""
        return replace(self, subscribe=VOLATILE)


AnyTopic = Topic[d.Message]
"""A topic of any message type."""


LIFT_STATES = Topic("lift_states", d.LiftState)
# The subscription is VOLATILE. With TRANSIENT_LOCAL our restart would replay up to 100 old requests.
LIFT_REQUESTS = Topic(
    "lift_requests", d.LiftRequest, publish=RETAINED, subscribe=VOLATILE, lasting=False
)
ADAPTER_LIFT_REQUESTS = Topic(
    "adapter_lift_requests", d.LiftRequest, publish=RETAINED, subscribe=RETAINED, lasting=False
)
DOOR_STATES = Topic("door_states", d.DoorState)
DOOR_REQUESTS = Topic("door_requests", d.DoorRequest)
ADAPTER_DOOR_REQUESTS = Topic("adapter_door_requests", d.DoorRequest)
DOOR_SUPERVISOR_HEARTBEAT = Topic("door_supervisor_heartbeat", d.SupervisorHeartbeat)
CHARGER_STATES = Topic("charger_states", d.ChargerState)
CHARGER_REQUESTS = Topic("charger_requests", d.ChargerRequest)
CHARGER_CANCELS = Topic("charger_cancels", d.ChargerCancel)
# Our own topic. It carries the reason for a refused request, because RMF has no message for it.
CHARGER_REFUSALS = Topic("charger_refusals", d.DiagnosticStatus)
# Our own topics for requests to the charger coordinator. RMF has no such topics.
ADAPTER_CHARGER_REQUESTS = Topic("adapter_charger_requests", d.ChargerRequest)
ADAPTER_CHARGER_CANCELS = Topic("adapter_charger_cancels", d.ChargerCancel)
# A topic without messages. Only one charger coordinator may serve RMF's ROS graph. The active
# coordinator declares a publisher on this topic. A second coordinator sees this publisher and waits.
CHARGER_COORDINATOR = Topic("charger_coordinator", d.Bool)
# The topics of workcells (dispensers and ingestors) are the same in all RMF releases from Humble to
# Lyrical. RMF's fleet adapter uses SystemDefaults with keep_last(100) for them.
DISPENSER_REQUESTS = Topic("dispenser_requests", d.DispenserRequest)
DISPENSER_STATES = Topic("dispenser_states", d.DispenserState)
DISPENSER_RESULTS = Topic("dispenser_results", d.DispenserResult)
INGESTOR_REQUESTS = Topic("ingestor_requests", d.IngestorRequest)
INGESTOR_STATES = Topic("ingestor_states", d.IngestorState)
INGESTOR_RESULTS = Topic("ingestor_results", d.IngestorResult)
FLEET_STATES = Topic("fleet_states", d.FleetState)
# Retained for a fleet adapter that starts later. rmf_charging_schedule also retains the messages.
CHARGING_ASSIGNMENTS = Topic(
    "charging_assignments", d.ChargingAssignments, publish=RETAINED, subscribe=RETAINED
)
# Retained, because rmf-web's api-server subscribes transient-local (rmf_io/alerts, QoS of depth 10).
ALERT = Topic("alert", d.Alert, publish=RETAINED, subscribe=RETAINED)
# The next two are retained, because a volatile publisher never matches a fleet adapter (rmf_ros2#341).
FIRE_ALARM_TRIGGER = Topic("fire_alarm_trigger", d.Bool, publish=RETAINED, subscribe=RETAINED)
EMERGENCY_SIGNAL = Topic(
    "emergency_signal", d.EmergencySignal, publish=RETAINED, subscribe=RETAINED
)
DIAGNOSTICS = Topic("diagnostics", d.DiagnosticArray)


def every() -> list[AnyTopic]:
    """List all topics of this file in order."""
    return [topic for topic in globals().values() if isinstance(topic, Topic)]
