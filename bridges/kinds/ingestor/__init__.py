"""Ingestors, which take what a robot brings. An ingestor uses the code of a dispenser, because only the
messages differ."""

from msgspec.structs import replace

from bridges.kinds import dispenser
from bridges.kinds.dispenser import messages
from bridges.messages import topics
from bridges.messages.definitions import IngestorState

KIND = replace(
    dispenser.KIND,
    name="ingestor",
    devices_key="ingestors",
    states=topics.INGESTOR_STATES,
    requests={topics.INGESTOR_REQUESTS: messages.accept},
    state_message=messages.state_of(IngestorState),
    publishes=lambda settings: (topics.INGESTOR_RESULTS,),
    results=messages.results_on(topics.INGESTOR_RESULTS),
    answer=messages.answer_on(topics.INGESTOR_RESULTS),
)
