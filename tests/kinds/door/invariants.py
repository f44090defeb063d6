"""Rules for every decision of the door's core, in any history.

The rules judge the event, the inputs, the outputs, and a ledger of events that the walk keeps
(`walk.py`). They do not use the core's memory.
"""

from typing import Any

from bridges.kinds.door.core import decide
from bridges.kinds.door.memory import DoorLimits, DoorMemory
from bridges.kinds.door.pulses import REST_S
from bridges.kinds.door.signals import OpenRequested
from bridges.kinds.shared.decision import Sampled, WriteFailed
from bridges.messages.definitions import DoorModeValue
from tests.kinds.door.walk import UNLIKE, Step, World, burns, fresh, reading, sighted


def check(step: Step) -> None:
    """Check every rule. An AssertionError names the broken rule in its traceback."""
    the_hold_has_a_reason(step)
    the_relay_follows_the_hold(step)
    open_is_the_truth(step)
    hazards_are_as_read(step)
    a_request_that_waits_has_a_reason(step)
    assert step.decision.report.read_at == step.ledger.read_at
    assert step.decision.wake_at > step.now


def the_hold_has_a_reason(step: Step) -> None:
    """Require a reason whenever the core holds the door open.

    A reason is RMF's request, a fire, or an obstruction. An obstruction counts only after the core has
    let the door go, while the door closes.
    """
    held, ledger = step.decision.report.hold, step.ledger
    if not _sighted(step):
        assert not held
        return
    if burns(step.decision):
        assert held == (step.limits.on_fire == "open")
        return
    assert held or not ledger.wanted
    if held and not ledger.wanted:
        assert ledger.let_go or step.limits.debounce
        assert "DOOR_OBSTRUCTED" in _codes(step)
    if (
        _exact(step)
        and _signal(step, "obstruction")
        and ledger.let_go
        and not step.limits.estimated
    ):
        assert held


def the_relay_follows_the_hold(step: Step) -> None:
    """Require that the relay is on if and only if the core holds the door open.

    With `pulse` the relay is on in pulses. The first pulse begins when the core begins to hold the
    door. A pulse has its length, and the next one comes in time. A pulse in which a scan failed is
    prolonged, and the next one comes after a short rest.
    """
    outputs, pulse = step.decision.outputs, step.limits.pulse
    held, seen = step.ledger.held, step.ledger.pulse
    if pulse is None or not held:
        assert (outputs.hold_open, outputs.between_pulses) == (held, False)
        return
    assert seen is not None
    assert outputs.between_pulses == (not outputs.hold_open)
    rest_s = min(REST_S, pulse.every_s - pulse.on_s)
    end = seen.at + pulse.on_s
    if seen.failed_at is not None:
        end = min(seen.failed_at + pulse.on_s, seen.at + pulse.every_s - rest_s)
    if seen.off_at is None:
        assert step.now < end
        return
    assert seen.off_at >= end
    rested = seen.off_at + rest_s
    assert step.now < (
        rested if seen.failed_at is not None else max(rested, seen.at + pulse.every_s)
    )


def open_is_the_truth(step: Step) -> None:
    """Require evidence whenever the report shows the door OPEN.

    The evidence is a fresh reading of the open contact. If the door has no such contact, and the site
    permits estimates, the evidence is that the door has been held for the opening time. With `pulse`
    the evidence also includes a pulse before that time, and no failed pulse since.
    """
    shown, sample = step.decision.report, step.world.sample
    if not _sighted(step):
        assert shown.mode is DoorModeValue.MODE_OFFLINE
    if shown.mode is not DoorModeValue.MODE_OPEN:
        return
    assert _sighted(step)
    assert not (burns(step.decision) and step.limits.on_fire == "release")
    assert shown.estimated == (sample.opened is None)
    if sample.opened is None:
        assert step.limits.estimated
        assert step.ledger.held
        delay_s = step.limits.t.open_delay_s
        assert step.ledger.sure_since is not None
        assert delay_s is not None
        assert step.now >= step.ledger.sure_since + delay_s
        if step.limits.pulse:
            assert step.ledger.pulse is not None
            assert step.ledger.pulse.row_since is not None
            assert step.now >= step.ledger.pulse.row_since + delay_s
        return
    assert not _told_otherwise(step, "opened", step.limits.debounce.get("opened", 0.0))
    if _exact(step):
        assert (sample.opened, sample.closed, sample.lost) == (True, False, "")


def a_request_that_waits_has_a_reason(step: Step) -> None:
    """Require a reason in the report for each OPEN request that waits.

    An OPEN request waits if RMF wants the door open and the report does not show OPEN. If the core does
    not hold the door then, the rule also requires a fault. This fault is not required before the first
    reading.
    """
    shown = step.decision.report
    assert bool(shown.waits) == (step.ledger.wanted and shown.mode is not DoorModeValue.MODE_OPEN)
    stands = shown.waits and not shown.hold and step.ledger.read_at is not None
    assert not stands or _codes(step) & {"COMMUNICATION_LOST", "TWO_NODES_FOR_ONE_DEVICE"}


def hazards_are_as_read(step: Step) -> None:
    """Require that the core reports a fire and an obstruction as the contacts show them.

    A fire begins at once, and ends after a delay. An OPEN request is refused only during a fire with
    `on_fire: release`.
    """
    clear_s = step.limits.t.hazard_clear_s
    if fresh(step.ledger, step.now, step.limits):
        assert not (burns(step.decision) and _told_otherwise(step, "fire", clear_s))
        assert burns(step.decision) or not (_exact(step) and _signal(step, "fire"))
    if "DOOR_OBSTRUCTED" in _codes(step):
        assert not _told_otherwise(step, "obstruction", clear_s)
        assert not step.ledger.wanted
    refused = isinstance(step.event, OpenRequested) and burns(step.decision)
    assert bool(step.decision.refused) == (refused and step.limits.on_fire == "release")


def nothing_changes_before_wake_at(world: World, limits: DoorLimits) -> None:
    """Scan now, and scan again right before the core's `wake_at` with the same inputs. Require that the
    outputs and the report stay the same."""
    now = _scan(world, world.memory, 0.0, limits)
    until = min(now.wake_at, 1e4)
    later = _scan(world, now.memory, until * (1.0 - 1e-6), limits)
    assert later.outputs == now.outputs
    assert later.report.news() == now.report.news()


def _scan(world: World, memory: DoorMemory, now: float, limits: DoorLimits) -> Any:
    decision = decide(memory, reading(world), now, limits)
    if world.writable:
        return decision
    return decide(decision.memory, WriteFailed("timeout"), now, limits)


def _sighted(step: Step) -> bool:
    return sighted(step.ledger, step.now, step.limits)


def _codes(step: Step) -> set[str]:
    return {fault.code for fault in step.decision.report.faults}


def _exact(step: Step) -> bool:
    """Return whether the event is a reading that counts at once, because this door has no debounce."""
    return isinstance(step.event, Sampled) and not step.limits.debounce


def _signal(step: Step, name: str) -> bool:
    return bool(getattr(step.world.sample, name))


def _told_otherwise(step: Step, name: str, for_s: float) -> bool:
    """Return whether this contact was "not asserted" in all readings of the last `for_s` seconds."""
    since = step.ledger.unlike[UNLIKE.index(name)]
    return since is not None and step.now >= since + for_s
