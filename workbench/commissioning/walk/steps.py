"""The outputs that a walk (`rmf-bridge walk`) tests for each kind of device. Also the feedback that the
inputs should show."""

from collections.abc import Callable, Collection, Iterator
from typing import Any, Final

from bridges.kinds.alarm.signals import PanelOutputs
from bridges.kinds.charger.signals import CURRENT_FLOWS, ChargerOutputs, ChargerSample
from bridges.kinds.dispenser.signals import WorkcellOutputs, WorkcellSample
from bridges.kinds.door.signals import DoorOutputs, DoorSample
from bridges.kinds.lift.settings import LiftSettings
from bridges.kinds.lift.signals import DoorReading, LiftOutputs, LiftSample, Motion, Side
from bridges.settings.load import Config
from workbench.commissioning.walk.core import WalkStep

Outputs = Collection[str]
"""Names of the outputs that the device has (`Config.outputs`)."""


def _lift(settings: LiftSettings, outputs: Outputs) -> Iterator[WalkStep]:
    if "agv_mode_request" in outputs:
        yield WalkStep(
            "agv_mode_request",
            "asks the lift for AGV mode",
            LiftOutputs(agv_request=True),
            "AGV mode is confirmed",
            lambda sample: sample.agv is True,
            _hazard,
        )
    for level in settings.levels():
        yield WalkStep(
            f"call {level}",
            f"calls the car to {level}",
            LiftOutputs(call=level),
            f"the car is at {level}",
            _arrived(level),
            _hazard,
        )
    for side in dict.fromkeys(stop.side for stop in settings.stops().values()):
        name = "door_open" if side is Side.FRONT else "rear_door_open"
        if name not in outputs:
            continue
        yield WalkStep(
            name,
            f"opens the {side.value} door and holds it",
            LiftOutputs(hold_door=side),
            "the door is open",
            _opened(side),
            _not_standing,
        )


def _hazard(sample: LiftSample) -> str:
    return f"the lift shows {', '.join(sorted(sample.hazards))}" if sample.hazards else ""


def _not_standing(sample: LiftSample) -> str:
    if hazard := _hazard(sample):
        return hazard
    if sample.motion not in (None, Motion.STOPPED):
        return f"the car is {sample.motion.value}"
    return "" if sample.level is not None else "no floor is shown: the car may be between floors"


def _arrived(level: str) -> Callable[[LiftSample], bool]:
    return lambda sample: sample.level == level and sample.motion in (None, Motion.STOPPED)


def _opened(side: Side) -> Callable[[LiftSample], bool]:
    return lambda s: (s.door if side is Side.FRONT else s.rear_door) is DoorReading.OPEN


def _door(settings: object, outputs: Outputs) -> Iterator[WalkStep]:
    def fire(sample: DoorSample) -> str:
        return "the fire alarm is on" if sample.fire else ""

    yield WalkStep(
        "hold_open",
        "opens the door and holds it",
        DoorOutputs(hold_open=True),
        "the door is open",
        lambda sample: sample.opened is True,
        fire,
    )


def _charger(settings: object, outputs: Outputs) -> Iterator[WalkStep]:
    if "enable" not in outputs:
        return  # a person tests a charger without contacts with `rmf-bridge send charger`

    def at_fault(sample: ChargerSample) -> str:
        return f"the station shows an error {sample.error_text}".rstrip() if _fault(sample) else ""

    yield WalkStep(
        "enable",
        "lets the station charge a robot on its pad",
        ChargerOutputs(power=True),
        "current flows",
        lambda sample: sample.activity in CURRENT_FLOWS,
        at_fault,
    )


def _workcell(settings: object, outputs: Outputs) -> Iterator[WalkStep]:
    def hinders(sample: WorkcellSample) -> str:
        if sample.fault or sample.errors:
            return f"it shows a fault {'; '.join(sample.errors)}".rstrip()
        return "the input done is on before the start" if sample.done else ""

    yield WalkStep(
        "start",
        "starts one cycle, with no robot there",
        WorkcellOutputs(start=True, guid="walk"),
        "the cycle has succeeded",
        lambda sample: sample.done is True,
        hinders,
    )


def _fault(sample: ChargerSample) -> bool:
    return sample.activity.value in ("error", "unknown")


KINDS: Final[dict[str, Callable[[Any, Outputs], Iterator[WalkStep]]]] = {
    "lift": _lift,
    "door": _door,
    "charger": _charger,
    "alarm": lambda settings, outputs: iter(()),  # an alarm panel has no outputs
    "dispenser": _workcell,
    "ingestor": _workcell,
}
OFF: Final = {
    "lift": LiftOutputs(),
    "door": DoorOutputs(),
    "charger": ChargerOutputs(power=False),
    "alarm": PanelOutputs(),
    "dispenser": WorkcellOutputs(),
    "ingestor": WorkcellOutputs(),
}


def untestable(config: Config) -> str:
    """Return the reason why nobody can test the outputs of this kind by hand. Return "" for a kind with
    steps."""
    return "" if config.kind in KINDS else f"a {config.kind} has no outputs to test by hand"


def steps(config: Config, device: str) -> list[WalkStep]:
    """Return a step for every output of a device, in the order of testing."""
    return list(KINDS[config.kind](config.devices[device], config.outputs(device)))
