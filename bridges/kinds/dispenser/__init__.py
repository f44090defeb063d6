"""Dispensers: a DispenserRequest starts one cycle of a machine, and the machine's inputs become the
DispenserResult.

`bridges/kinds/ingestor` does the same with an ingestor's messages.
"""

from bridges.kinds.dispenser import core, keep, memory, messages, report, signals
from bridges.kinds.dispenser.memory import WorkcellLimits, WorkcellMemory
from bridges.kinds.dispenser.report import WorkcellReport
from bridges.kinds.dispenser.settings import WorkcellSettings
from bridges.kinds.dispenser.signals import ItemRequested, WorkcellOutputs, WorkcellSample
from bridges.kinds.shared.decision import DecidedByPerson, MemoryKept, MemoryNotKept
from bridges.kinds.shared.kind import Kind
from bridges.kinds.shared.recorded import Recorded
from bridges.messages import topics
from bridges.messages.definitions import DispenserState

KIND: Kind[
    WorkcellSettings,
    WorkcellLimits,
    WorkcellMemory,
    WorkcellSample,
    ItemRequested | MemoryKept | MemoryNotKept | DecidedByPerson,
    WorkcellOutputs,
    WorkcellReport,
] = Kind(
    name="dispenser",
    devices_key="dispensers",
    states=topics.DISPENSER_STATES,
    requests={topics.DISPENSER_REQUESTS: messages.accept},
    device_name=messages.device_name,
    sender=lambda request: str(request.request_guid),
    limits=WorkcellLimits.of,
    initial=core.initial,
    decide=core.decide,
    state_message=messages.state_of(DispenserState),
    summary=messages.summary,
    published=core.published,
    publishes=lambda settings: (topics.DISPENSER_RESULTS,),
    results=messages.results_on(topics.DISPENSER_RESULTS),
    answer=messages.answer_on(topics.DISPENSER_RESULTS),
    stamped=messages.stamped,
    keeping=keep.KEEPING,
    decided_by_person=True,
)

RECORDED: Recorded = {
    "dispenser.memory.Cycle": memory.Cycle,
    "dispenser.memory.Job": memory.Job,
    "dispenser.memory.WorkcellMemory": memory.WorkcellMemory,
    "dispenser.memory.WorkcellSenses": memory.WorkcellSenses,
    "dispenser.report.WorkcellReport": report.WorkcellReport,
    "dispenser.signals.Item": signals.Item,
    "dispenser.signals.ItemRequested": signals.ItemRequested,
    "dispenser.signals.WorkcellOutputs": signals.WorkcellOutputs,
    "dispenser.signals.WorkcellSample": signals.WorkcellSample,
}
"""The names under which a dispenser's values are recorded. An ingestor's values have the same names."""
