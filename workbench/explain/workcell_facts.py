"""One dispenser's or ingestor's facts from its messages, and its story."""

from bridges.observe.news import News
from bridges.observe.workcell import ObservedDispenser, ObservedIngestor, ObservedWorkcell
from workbench.explain.device import Device


class WorkcellFacts(Device, ObservedWorkcell):
    """What both kinds of workcell tell."""

    def says(self, one: News) -> str:
        """Return a line of the story; "" for none."""
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
    """A dispenser's."""


class IngestorFacts(WorkcellFacts, ObservedIngestor):
    """An ingestor's."""
