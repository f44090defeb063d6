"""Facts about one workcell (dispenser or ingestor), from its messages, and the workcell's story (a list
of its events)."""

from bridges.observe.news import News
from bridges.observe.workcell import ObservedDispenser, ObservedIngestor, ObservedWorkcell
from workbench.explain.device import Device


class WorkcellFacts(Device, ObservedWorkcell):
    """A workcell with its story (a list of its events)."""

    def says(self, one: News) -> str:
        """Return a line of the story. Return "" if the story leaves the event out."""
        match one.what:
            case "asks" if one.requester:
                return f"{self.name} is asked for {one.requester.wants} (request {one.who})"
            case "result":
                return f"{self.name} answers request {one.who}: {one.text}"
            case "changed":
                queue = f", queue {self.queue.value}" if self.queue.value else ""
                return f"{self.name} is {self.mode.value}{queue}"
        return ""


class DispenserFacts(WorkcellFacts, ObservedDispenser):
    """Facts about a dispenser."""


class IngestorFacts(WorkcellFacts, ObservedIngestor):
    """Facts about an ingestor."""
