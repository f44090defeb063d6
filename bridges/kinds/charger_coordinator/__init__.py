"""The charger coordinator, which allots all chargers of a site to robots, and queues the robots."""

from bridges.kinds.charger_coordinator import (
    core,
    keep,
    memory,
    messages,
    report,
    schedule,
    signals,
)
from bridges.kinds.charger_coordinator.memory import SiteLimits, SiteMemory
from bridges.kinds.charger_coordinator.report import SiteReport
from bridges.kinds.charger_coordinator.settings import (
    CoordinatorSettings,
    speaks_of,
    tables,
    warnings,
)
from bridges.kinds.charger_coordinator.signals import (
    ChargerStateHeard,
    ChargeUnwanted,
    ChargeWanted,
    Dedicated,
    FleetSeen,
    ReceiverHeard,
)
from bridges.kinds.shared.fields import quiet_s
from bridges.kinds.shared.graph_kind import GraphKind
from bridges.kinds.shared.recorded import Recorded
from bridges.messages.topics import (
    ADAPTER_CHARGER_CANCELS,
    ADAPTER_CHARGER_REQUESTS,
    ALERT,
    CHARGER_CANCELS,
    CHARGER_COORDINATOR,
    CHARGER_REFUSALS,
    CHARGER_REQUESTS,
    CHARGER_STATES,
    CHARGING_ASSIGNMENTS,
    FLEET_STATES,
)

KIND: GraphKind[
    CoordinatorSettings,
    SiteLimits,
    SiteMemory,
    FleetSeen | ChargerStateHeard | ReceiverHeard | ChargeWanted | ChargeUnwanted | Dedicated,
    SiteReport,
] = GraphKind(
    name="charger_coordinator",
    devices_key="coordinator",
    settings=CoordinatorSettings,
    requests={
        CHARGER_STATES: messages.accept_state,
        FLEET_STATES: messages.accept_fleet,
        ADAPTER_CHARGER_REQUESTS: messages.accept_request,
        ADAPTER_CHARGER_CANCELS: messages.accept_withdrawal,
        CHARGING_ASSIGNMENTS: messages.accept_assignments,
    },
    publishes=(
        CHARGER_REQUESTS,
        CHARGER_CANCELS,
        CHARGING_ASSIGNMENTS,
        ALERT,
        CHARGER_REFUSALS,
    ),
    answer=messages.answer,
    sole=(CHARGER_COORDINATOR,),
    yields=(CHARGING_ASSIGNMENTS,),
    device_name=messages.subject,
    quiet_s=quiet_s,
    limits=SiteLimits.of,
    initial=core.initial,
    decide=core.decide,
    stamped=messages.stamped,
    summary=messages.summary,
    idle=core.idle,
    persist=keep.persist,
    restore=keep.restore,
    tables=tables,
    warnings=warnings,
    speaks_of=speaks_of,
    on_map=lambda settings: settings.on_map(),
)

RECORDED: Recorded = {
    "charger_coordinator.memory.Grant": memory.Grant,
    "charger_coordinator.memory.Memory": memory.SiteMemory,
    "charger_coordinator.memory.Nudge": memory.Nudge,
    "charger_coordinator.memory.Seen": memory.StationSeen,
    "charger_coordinator.memory.Standing": memory.Standing,
    "charger_coordinator.memory.Wish": memory.Wish,
    "charger_coordinator.report.SiteReport": report.SiteReport,
    "charger_coordinator.schedule.LocalTime": schedule.LocalTime,
    "charger_coordinator.signals.Dedicated": signals.Dedicated,
    "charger_coordinator.signals.FleetSeen": signals.FleetSeen,
    "charger_coordinator.signals.ReceiverHeard": signals.ReceiverHeard,
    "charger_coordinator.signals.Sighting": signals.Sighting,
    "charger_coordinator.signals.StateHeard": signals.ChargerStateHeard,
    "charger_coordinator.signals.Unwanted": signals.ChargeUnwanted,
    "charger_coordinator.signals.Wanted": signals.ChargeWanted,
}
