"""The site's dispenser. It makes a delivery each hour, and has its own troubles and its own network.

RMF's task may continue only when the item has left the dispenser (`workbench/rmf_model/workcells.py`).
The daemon dies during a delivery, the conveyor jams, the PLC restarts, and messages are lost or late.
Later a person comes and looks. For each delivery whose outcome is unknown, this person decides whether
the item has left.
"""

from collections.abc import Callable
from functools import partial
from random import Random
from typing import Any

from bridges.kinds.dispenser import KIND
from bridges.kinds.shared.decision import DecidedByPerson
from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.heard import Heard
from bridges.settings.load import load
from drivers.dispenser import dry_contact
from hal_fakes.plants import dispenser
from tests.drivers.far import PointsFar
from tests.site.building import CONFIG, Device
from tests.site.daemons import DeviceDaemon
from tests.site.network import Air, Place
from tests.site.timeline import EPOCH, Timeline
from workbench.judge import judge as laws
from workbench.judge.judge import Judge
from workbench.judge.law import Verdict
from workbench.rmf_model.workcells import WorkcellPhase

NAME = "pharmacy_dispenser"
FIRST_S, EVERY_S = 30.0, 3600.0
COMES_S = 90.0
"""The time (s) from the request until a person comes."""
WAITS_S = 400.0
"""The longest permitted time of a delivery (s)."""
LAWS = tuple(law.id for law in laws.LAWS["dispenser"] if law.id != "W4.rate")
"""The laws that hold even if the daemon dies and results get lost. A dead daemon sends no states."""
TROUBLES = ("nothing", "dies", "jam", "restart", "slow", "dies and is out of reach")

Require = Callable[[bool, str], None]


class Storeroom:
    """The dispenser, its daemon and RMF's phase. `done` counts the deliveries for each trouble."""

    def __init__(self, timeline: Timeline, random: Random, require: Require) -> None:
        self.done: dict[str, int] = {}
        self._timeline = timeline
        self._random = random
        self._require = require
        self.air = Air(timeline, random)
        self._plant, device = _device(timeline)
        self.daemon = DeviceDaemon(timeline, self.air, device)
        self._rmf = Place(self.air, "delivery", lambda: None)
        self._judge = Judge("dispenser", NAME, only=LAWS)
        self._requests = self._rmf.publisher(topics.DISPENSER_REQUESTS)
        for topic in (topics.DISPENSER_STATES, topics.DISPENSER_RESULTS):
            self._rmf.subscribe(topic, partial(self._hear, topic))
        self._phase: WorkcellPhase | None = None
        self._trouble = ""
        self._before = 0
        self._number = 0

    def open(self) -> None:
        """Start the daemon, and let the first robot ask for its item."""
        self.daemon.start()
        self._timeline.after(FIRST_S, self._deliver)

    def _deliver(self) -> None:
        self._number += 1
        trouble = TROUBLES[self._number % len(TROUBLES)]
        self._trouble, self._before = trouble, self._plant.moved
        items = (d.DispenserRequestItem("medicine_box", 1),)
        request = d.DispenserRequest(d.Time(), f"task {self._number}", NAME, "fleet", items)
        self._phase = WorkcellPhase(request, self._timeline.now)
        self._ask()
        if trouble.startswith("dies"):
            self._timeline.after(self._random.uniform(0.0, 4.0), self._die)
        if trouble == "dies and is out of reach":
            self.air.cut_off(NAME, self._timeline.now + 30.0)
        if trouble in ("jam", "slow"):
            self._plant.fail("conveyor", "stuck" if trouble == "jam" else "slow")
        if trouble == "restart":
            self._timeline.after(self._random.uniform(0.5, 2.0), self._restart)
        self._timeline.after(COMES_S, self._look)
        self._timeline.after(WAITS_S, self._end)
        self._timeline.after(EVERY_S, self._deliver)

    def _ask(self) -> None:
        if self._phase is not None and not self._phase.outcome:
            for _, message in self._phase.tick(self._timeline.now):
                assert isinstance(message, d.DispenserRequest)
                self._heard(topics.DISPENSER_REQUESTS, message)
                self._requests.publish(message)
            self._timeline.after(1.0, self._ask)

    def _die(self) -> None:
        self.daemon.kill()
        self._timeline.after(self._random.uniform(1.0, 8.0), self.daemon.start)

    def _restart(self) -> None:
        self._press(True)
        self._timeline.after(0.5, lambda: self._press(False))

    def _press(self, on: bool) -> None:
        self._plant.press("restart", on, self._timeline.now)
        self.daemon.look()

    def _look(self) -> None:
        """Let a person repair the machine, decide the delivery, and reset the daemon."""
        self._restart()  # restart first, because the repaired conveyor will move the item
        self._plant.fail("conveyor", None)
        faults = self.daemon.faults()
        if "OUTCOME_UNKNOWN" in faults:
            verdict: Any = "done" if self._plant.moved > self._before else "again"
            self.daemon.scan(DecidedByPerson(verdict))
        self._timeline.after(5.0, self.daemon.reset)

    def _end(self) -> None:
        """Require that the delivery has ended. RMF's task may have continued only if the item has left
        the dispenser."""
        phase, moved = self._phase, self._plant.moved - self._before
        assert phase is not None
        said = f"{phase.outcome} ({phase.why}), {moved} moved"
        what = f"delivery {self._number} ({self._trouble}): {said}"
        self._require(bool(phase.outcome), what)
        self._require(moved == (phase.outcome == "completed"), what)
        found = [one for one in self._judge.verdicts() if one.verdict is Verdict.BROKEN]
        self._require(not found, f"{NAME} breaks {[(one.law.id, one.evidence) for one in found]}")
        self.done[self._trouble] = self.done.get(self._trouble, 0) + 1

    def _hear(self, topic: Any, message: Any) -> None:
        self._heard(topic, message)
        if self._phase is not None:
            self._phase.hear(message, self._timeline.now)

    def _heard(self, topic: Any, message: Any) -> None:
        now = self._timeline.now
        self._judge.hear(Heard(now, EPOCH + now, topic.name, message))


def _device(timeline: Timeline) -> tuple[dispenser.WorkcellPlant, Device]:
    settings: Any = load(CONFIG / "dispenser_contacts.yaml").devices[NAME]
    wires = dry_contact.wires(settings)
    plant = dispenser.build(NAME, settings, wires)
    far = PointsFar(timeline, plant, wires)
    return plant, Device(
        NAME,
        KIND,
        settings,
        plant,
        far,
        "dry_contact",
        lambda: dry_contact.create(NAME, settings, far),
        dry_contact.debounce(settings),
        0.0,
    )
