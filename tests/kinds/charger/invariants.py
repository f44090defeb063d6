"""Rules for every decision of the charger's core, in any history.

The rules judge the event, the readings, the outputs, and a ledger of events that the walk keeps
(`walk.py`). From the core's memory the rules take only the present request, the ordered power and the
counts of commands.
"""

from bridges.kinds.charger.signals import Activity
from bridges.kinds.shared.decision import IoFailed, OperatorReset, Sampled
from bridges.messages.definitions import ChargerStateValue as State
from tests.kinds.charger.walk import CLEAR_S, RIVAL_S, Step

FLOWS = (Activity.CHARGING, Activity.STOPPING)
BAD = (Activity.ERROR, Activity.UNKNOWN)


def check(step: Step) -> None:
    """Check every rule. An AssertionError names the broken rule in its traceback."""
    the_message_is_whole(step)
    the_state_is_what_was_read(step)
    power_has_a_reason(step)
    nobody_else_is_energised(step)
    protection_lasts(step)
    requests_end_on_good_readings(step)
    commands_are_counted(step)
    a_request_that_waits_has_a_reason(step)
    assert step.decision.report.read_at == step.ledger.read_at
    assert step.decision.wake_at > step.now


def the_message_is_whole(step: Step) -> None:
    """Require an error text in state ERROR, and no error text in any other state.

    While the core has a request, the message must name that request and its robot.
    """
    shown = step.decision.report
    assert shown.state in set(State)
    assert (shown.error_message != "") == (shown.state is State.CHARGER_ERROR)
    held = step.decision.memory.holder is not None
    if held:
        assert (shown.request_id, shown.fleet, shown.robot) == (
            step.ledger.granted,
            *(step.ledger.robot or ("", "")),
        )
    assert held or shown.request_id == ""
    if shown.state is State.CHARGER_IDLE:
        assert not held
        assert shown.robot == ""
    if shown.state is State.CHARGER_ASSIGNED:
        assert held


def the_state_is_what_was_read(step: Step) -> None:
    """If current flows, require the state CHARGING or ERROR. Without current forbid the state CHARGING.

    Require ERROR if the station does not answer or is faulty, or if a second node serves the same
    station.
    """
    state = step.decision.report.state
    sighted = _sighted(step)
    flows = step.seen is not None and step.seen.activity in FLOWS
    if state is State.CHARGER_CHARGING:
        assert sighted
        assert flows
    if not sighted or _rivalled(step) or step.ledger.out:
        assert state is State.CHARGER_ERROR
    if sighted and step.seen and step.seen.activity in BAD:
        assert state is State.CHARGER_ERROR
    if sighted and flows:
        assert state in (State.CHARGER_CHARGING, State.CHARGER_ERROR)


def power_has_a_reason(step: Step) -> None:
    """If the core orders power, require a valid request and a station that is healthy and answers."""
    power, shown = step.decision.outputs.power, step.decision.report
    if power:
        assert step.ledger.granted is not None
        assert not step.ledger.spoiled
        assert _sighted(step)
        assert not _rivalled(step)
        assert not step.ledger.out
        assert step.seen
        assert step.seen.activity not in BAD
        assert step.seen.measured.at_height is not False
        assert step.seen.measured.range_ok is not False
        assert shown.state is not State.CHARGER_RELEASED
    if power is None and _sighted(step):
        assert step.seen
        assert step.seen.activity in FLOWS
        assert step.ledger.adopted or not step.limits.can_stop
    if _rivalled(step) or step.ledger.out:
        assert power is False


def nobody_else_is_energised(step: Step) -> None:
    """If the station recognises robots, require power only for the robot of the request.

    The robot must be in range when the power begins.
    """
    power, sample, limits = step.decision.outputs.power, step.seen, step.limits
    if not limits.receivers or sample is None or not _sighted(step):
        return
    receiver = sample.measured.receiver_id
    who = limits.receivers.get(receiver or "")
    if power:
        assert receiver is not None
        assert who == step.ledger.robot or (not receiver and _going_on(step))
    if receiver and who is None:
        assert power is False
        assert step.decision.report.state is State.CHARGER_ERROR
    if power and not step.before.memory.power and not _going_on(step):
        assert sample.measured.in_range is not False
    if who and power is False and step.ledger.granted and who != step.ledger.robot:
        assert step.decision.report.state is State.CHARGER_ERROR


def protection_lasts(step: Step) -> None:
    """Require a station to stay out of service until the core has cleared its errors with success.

    A good reading within CLEAR_S after the clearing proves the success.
    """
    before, after = step.before.ledger, step.ledger
    if before.out and not after.out:
        assert isinstance(step.event, Sampled)
        assert before.cleared_at is not None
        assert step.now - before.cleared_at <= CLEAR_S
        assert step.event.sample.activity not in (*BAD, *FLOWS)


def requests_end_on_good_readings(step: Step) -> None:
    """Require a good reading whenever a request ends.

    There is one exception: an operator may reset a station that has been silent for a long time. This
    reset ends the request without a reading.
    """
    before = step.before.ledger
    if before.granted is None or step.ledger.granted == before.granted:
        return
    if isinstance(step.event, OperatorReset):
        assert not _sighted(step)
        silent_s = step.limits.t.peer_internal_timeout_s
        assert silent_s is not None
        assert before.read_at is None or step.now - before.read_at >= silent_s
    elif step.ledger.granted is None:
        assert isinstance(step.event, Sampled)
    else:  # a reading shows the robot of a newer request on the pad
        assert step.seen
        seen = step.limits.receivers.get(step.seen.measured.receiver_id or "")
        assert seen == step.ledger.robot
    assert not isinstance(step.event, IoFailed)


def commands_are_counted(step: Step) -> None:
    """Require that a decision raises the count of each type of command by at most one.

    While a second node serves the same station, the core may not clear errors.
    """
    before, outputs = step.before.memory, step.decision.outputs
    assert outputs.clear_errors - before.clear_errors in (0, 1)
    assert outputs.range_checks - before.range_checks in (0, 1)
    if _rivalled(step):
        assert outputs.clear_errors == before.clear_errors


def a_request_that_waits_has_a_reason(step: Step) -> None:
    """Require a reason in the report for each request that waits.

    A request waits in the states ASSIGNED and ERROR. It also waits in CHARGING if the core orders the
    power off.
    """
    shown, seen = step.decision.report, step.seen
    may_not = step.decision.outputs.power is False and seen and seen.activity is Activity.CHARGING
    waits = step.decision.memory.holder is not None and (
        shown.state in (State.CHARGER_ASSIGNED, State.CHARGER_ERROR)
        or (shown.state is State.CHARGER_CHARGING and may_not)
    )
    assert not waits or shown.waits or shown.faults, shown
    assert not shown.waits or step.ledger.granted is not None
    assert shown.state is not State.CHARGER_ASSIGNED or shown.waits


def _sighted(step: Step) -> bool:
    return step.ledger.read_at is not None and step.ledger.misses < step.limits.t.misses


def _rivalled(step: Step) -> bool:
    at = step.ledger.rival_at
    return at is not None and step.now - at < RIVAL_S


def _going_on(step: Step) -> bool:
    """Return whether current has already flowed for the present request."""
    holder = step.decision.memory.holder
    return holder is not None and holder.started
