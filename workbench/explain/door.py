"""Explain, in sentences from a door's messages, why a robot waits at the door or why the door stays
open.

RMF's DoorOpen waits for two conditions. The door's state must be OPEN, and a heartbeat of the door
supervisor must list the robot for this door. RMF's DoorClose waits until no heartbeat lists the robot
(rmf_ros2, DoorOpen.cpp and DoorClose.cpp). The robot sends no request while the robot drives through.
"""

from shlex import quote
from typing import Final

from bridges.observe.door import CLOSED, OPEN, SUPERVISOR
from bridges.observe.limits import FLAPS, REQUESTER_SILENT_S, SILENT_S
from bridges.observe.requesters import DeviceRequester, Moment
from workbench.explain import answer as common
from workbench.explain import first_causes
from workbench.explain.answer import Answer
from workbench.explain.door_facts import DoorFacts
from workbench.explain.explanation import CheckedField
from workbench.explain.phrases import TimePhrases, lasted, listed

SETTLES_S: Final = 2.0
LONG_S: Final = 60.0
"""Maximum normal time (s) of a robot's drive through a doorway."""
OPENS_S, MOVES_S = 8.0, 15.0
"""Normal times (s) of a door that nobody holds. OPENS_S is the time from the last holder's end until
the door moves. MOVES_S is the time for which the door moves."""
AWAY: Final = ("offline", "unknown")
FIRE: Final = "FIRE_ALARM"
"""The fault of a door in a fire alarm. A door that the daemon has then released is shown as unknown."""
RESTART: Final = (
    "restart the door supervisor (rmf_door_supervisor, or the one of rmf-bridges); look into the"
    " doorways first, because RMF's supervisor then lets go of every door whose holder is silent"
)


def answer(
    door: DoorFacts, clock: TimePhrases, around: common.OthersHeard, focus: str = ""
) -> Answer:
    """Explain the door's state at the time of the last message. `focus` is the requester to explain.
    With "", explain the requester who waits."""
    if door.last_state is None:
        return _with_askers(common.unheard(door, around), door, clock)
    stopped = common.stopped(door, around, clock)
    if stopped is not None:
        stopped.say(f"{door.name} was {door.mode.value} then.")
        return _with_askers(stopped, door, clock)
    claim = _in_question(door, clock, focus)
    found = Answer(since=_begins(door, claim))
    if claim is not None:
        wants = "open" if claim.wants == OPEN else "released"
        found.say(
            f"{claim.who} has waited {clock.since(claim.since)} for {door.name} to be {wants}."
        )
        found.asks, found.fields = claim.who, _fields(door, claim, clock)
        found.notes += common.clock_of(claim)
    since = clock.since(door.mode.since)
    found.say(f"{door.name} has been {door.mode.value} {since}.{_held_by(door, clock)}")
    _forgotten(found, door, clock)
    if len(door.flaps(clock.now)) < FLAPS and (old := common.old_reading(door, clock)):
        found.say(old)
    held_open = door.holders or claim or (door.asked and door.asked.value == OPEN)
    end = "open" if held_open or door.has_order(clock.now) else "shut"
    if (
        first_causes.two_nodes(found, door, clock, around, "door_states")
        or first_causes.comes_and_goes(found, door, clock)
        or first_causes.own_fault(found, door, clock, around, door.mode.value, end)
    ):
        return found
    if FIRE in door.faults(clock.now) and (door.mode.value in AWAY or not held_open):
        first_causes.own_fault(found, door, clock, around, codes=(FIRE,))
    elif door.mode.value in AWAY:
        _away(found, door, clock)
    elif claim is None:
        _nobody_asks(found, door, clock, around)
    elif claim.wants == OPEN:
        _opens(found, door, claim, clock)
    elif not _stamped_before_its_open(found, door, claim):
        _not_taken(found, door, claim, clock)
    return found


def _held_by(door: DoorFacts, clock: TimePhrases) -> str:
    """Say who holds the door, as far as the heartbeats tell."""
    last, every = door.last_heartbeat, [*door.holders.items()][:4]
    if last is None:
        lost = "" if door.hears_lists else " (perhaps it is not recorded), so no holder is known"
        return "" if door.noted else f" No heartbeat of a door supervisor was heard{lost}."
    if door.unheeded(clock.now):
        names = listed([who for who, _ in every]) if every else "nobody"
        return f" By the last heartbeat, at {clock.time(last.wall)}, {names} held it."
    holders = ", ".join(f"{who} {clock.since(since)}" for who, since in every)
    return f" The door has been held by {holders}." if holders else " Nobody holds it."


def _in_question(door: DoorFacts, clock: TimePhrases, focus: str) -> DeviceRequester | None:
    waiting = door.asking(clock.now)
    if focus:
        return next((one for one in waiting if one.who == focus), None)
    return waiting[0] if waiting else None


def _begins(door: DoorFacts, claim: DeviceRequester | None) -> float:
    starts = [claim.since.at] if claim else []
    starts += [since.at - SETTLES_S for since in door.holders.values()]
    starts += [since.at - LONG_S for since in door.forgotten.values()]
    return min(starts, default=float("-inf"))


def _with_askers(found: Answer, door: DoorFacts, clock: TimePhrases) -> Answer:
    for claim in [one for one in door.requesters if one.wants == OPEN and one.asks(clock.now)][:3]:
        found.say(f"{claim.who} has waited {clock.since(claim.since)} for the door to be open.")
        found.since = min(found.since, claim.since.at)
    return found


def _fields(
    door: DoorFacts, claim: DeviceRequester, clock: TimePhrases
) -> tuple[CheckedField, ...]:
    """Return the fields that DoorOpen or DoorClose checks, with the values that this requester's fleet
    adapter sees."""
    told = {
        "door": door.mode.since,
        "heartbeat": door.holders.get(claim.who) or claim.since,
    }
    return tuple(
        CheckedField(*check, clock.since(told[check.name])) for check in door.checks(claim)
    )


def _forgotten(found: Answer, door: DoorFacts, clock: TimePhrases) -> None:
    """Name the requesters for which the supervisor no longer keeps the door open."""
    for who, since in [*door.forgotten.items()][:4]:
        found.say(
            f"{who} held the door and sent no CLOSE, but the supervisor dropped it at"
            f" {clock.time(since.wall)}. The supervisor has most likely restarted and forgotten {who},"
            " which may stand in the doorway."
        )


# ---- a requester waits


def _away(found: Answer, door: DoorFacts, clock: TimePhrases) -> None:
    own = door.own(clock.now)
    why = "its fault says why" if own and own.faults else "its daemon's log says why"
    found.say(
        f"The door is shown as {door.mode.value}: it cannot be read or believed, so nobody can pass.",
        "a person",
        f"check the door's wires, bus and power: {why}",
    )


def _opens(found: Answer, door: DoorFacts, claim: DeviceRequester, clock: TimePhrases) -> None:
    """Explain why the requester waits for an open door."""
    asked, name = door.asked, door.name
    ordered = asked is None and door.has_order(clock.now)
    passed = ordered or (asked is not None and asked.value == OPEN)
    unknown = door.last_heartbeat is None and passed and (ordered or door.sender == SUPERVISOR)
    if claim.who not in door.holders and not unknown:
        _not_taken(found, door, claim, clock)
    elif ordered:
        found.say("Nothing was heard on `door_requests` (perhaps it is not recorded).")
        _stays_shut(found, door, clock, f"The daemon of {name} has a request for OPEN")
    elif passed:
        who = "The supervisor" if door.sender == SUPERVISOR else door.sender
        _stays_shut(found, door, clock, f"{who} asks for OPEN")
    elif asked is None:
        found.say(
            f"The supervisor's heartbeat lists {claim.who}, but nothing was heard on `door_requests`:"
            " the supervisor sends no OPEN, or this topic is not recorded.",
            "a person",
            f"see whether the log of the node of {name} has the request for OPEN; if not, what the log"
            " of the supervisor says",
        )
    else:
        found.say(
            f"The supervisor's heartbeat lists {claim.who}, but the supervisor asks for CLOSE.",
            "the supervisor",
            f"send OPEN for {name}",
        )


def _stays_shut(found: Answer, door: DoorFacts, clock: TimePhrases, asked: str) -> None:
    """Explain a door that is asked to open and does not. `asked` says who asks."""
    since, on = clock.since(door.mode.since), common.relays(door, clock)
    found.say(f"{asked}, and the door has been {door.mode.value} {since}{on}.")
    began = [door.asked.since] if door.asked else [*door.holders.values()]
    new = any(one.seen and clock.now.at - one.at < SETTLES_S for one in began)
    leaf = "a person has to check the relay that drives the leaf, and its wire"
    if on == common.RELAYS_OFF and new:
        found.acts("the device's node", f"open {door.name}: the request came a moment ago")
    elif on == common.RELAYS_OFF:
        reasons = ", ".join(door.refusals(clock.now, clock.now.at - 10.0, door.kind))
        deaf = "" if door.has_order(clock.now) else "hear the request, or does not "
        does = f"refuses the request: {reasons}" if reasons else f"does not {deaf}obey it"
        found.say(
            f"The daemon {does}.",
            "a person",
            f"see in the log of the daemon of {door.name} whether it has the request for OPEN; if not,"
            " check its network (`rmf-bridge doctor FILE` on its machine)",
        )
    elif door.own(clock.now) is None and door.mode.value == CLOSED:
        found.say(
            f"Whether the node of {door.name} asks its controller to open is not known.",
            "the device's node",
            f"open {door.name}; its log says whether it asks its controller. If it does, {leaf}",
        )
    else:
        found.acts(
            "the controller",
            f"open {door.name} fully, so that its contact shows OPEN; if it does not, {leaf}",
        )
        if began and all(clock.now.at - one.at > LONG_S for one in began):
            found.say(
                "The door should be open by now. The cause may be an obstacle, a lock, or a dead"
                " contact."
            )


def _stamped_before_its_open(found: Answer, door: DoorFacts, claim: DeviceRequester) -> bool:
    """Check whether the requester's CLOSE has an older stamp than its OPEN. If so, explain this and
    return True."""
    older_s = door.stamps.get(claim.who, 0.0) - (claim.last.wall - claim.stamp_age_s)
    if not claim.stamped or older_s <= 0.0:
        return False
    found.say(
        f"{claim.who} asks for CLOSE, but the stamp of this CLOSE is {lasted(older_s)} older than the"
        " stamp of its OPEN: its clock was set back. RMF's door supervisor drops such a CLOSE. A"
        " supervisor of rmf-bridges takes it only after repeats for a while.",
        "a person",
        f"set the clock of the machine with the fleet adapter of {claim.who} (NTP); until then, when"
        f" the doorway is clear: {_close(door, claim.who)}",
    )
    return True


def _not_taken(found: Answer, door: DoorFacts, claim: DeviceRequester, clock: TimePhrases) -> None:
    """Explain why the supervisor does not list a requester that asks for OPEN, or still lists a
    requester that asks for CLOSE."""
    who, now, ours = claim.who, clock.now, door.supervisor(clock.now)
    opens = claim.wants == OPEN
    reasons = ", ".join(door.refusals(now, claim.since.at, SUPERVISOR))
    last = door.last_heartbeat
    answers_s = SILENT_S if last is not None and last.at < claim.since.at else SETTLES_S
    if not opens:
        found.say(f"{who} asks for CLOSE, but the last heartbeat still lists {who}.")
    if now.at - claim.since.at < answers_s:
        found.say(
            "The supervisor may need a moment to answer.",
            "the supervisor",
            f"list {who}" if opens else f"remove {who} from its list",
        )
    elif reasons:
        found.say(
            f"The door supervisor refuses requests for {door.name}: {reasons}.",
            "the supervisor",
            f"take the request of {who} when this reason is gone; its log has the details",
        )
    elif ours is not None and (f"{who} (" in ours.value("held_by")) == opens:
        found.say(
            "The door supervisor reports that it has taken the request, but no heartbeat says so.",
            "a person",
            "see what the supervisor waits for: `rmf-bridge status` on its machine",
        )
    elif ours is not None:
        found.say(
            f"The door supervisor is running and refuses nothing, but has not taken the request of"
            f" {who}: the requests do not reach it.",
            "a person",
            f"check the network between the fleet adapter of {who} and the door supervisor"
            " (`rmf-bridge doctor FILE` on both machines)",
        )
    elif not door.hears_lists:
        found.say(
            "Nothing asks for OPEN on `door_requests`: the door supervisor does not pass the request"
            " on, or is not running.",
            "a person",
            f"see whether the door supervisor runs, and what its log says of {who}",
        )
    elif last is None:
        found.say(
            "Nobody takes the request: no door supervisor was heard on `door_supervisor_heartbeat`.",
            "a person",
            "start rmf_door_supervisor, or a door supervisor of rmf-bridges",
        )
    elif door.unheeded(now):
        found.say(
            f"No heartbeat has come since {clock.time(last.wall)}, though a door supervisor answers"
            " each request with one: it is not running, hangs or is cut off from the requests.",
            "a person",
            RESTART,
        )
    else:
        lists = f"{'does not list' if opens else 'still lists'} {who}"
        found.say(
            f"The door supervisor is running, but {lists}: the requests do not reach it, or it refuses"
            " them. A supervisor of rmf-bridges refuses replays, and too many requesters.",
            "a person",
            f"see whether the log of the door supervisor has the request of {who}; if not, check the"
            " network between the two",
        )


# ---- no requester waits


def _nobody_asks(
    found: Answer, door: DoorFacts, clock: TimePhrases, around: common.OthersHeard
) -> None:
    asked = door.asked.value if door.asked else ""
    free = max(door.mode.since.at, door.released.at if door.released else 0.0)
    for_s = clock.now.at - free
    if door.forgotten and not door.holders:
        who = next(iter(door.forgotten))
        found.acts(
            "a person",
            f"look into the doorway of {door.name}; while {who} stands in it: `rmf-bridge send door"
            f" {quote(door.name)} open --requester {quote(who)}`",
        )
    elif door.holders and (door.mode.value == OPEN or asked == CLOSED):
        _held_open(found, door, clock)
    elif door.last_heartbeat is None and asked == OPEN:
        _asked_open(found, door, clock)
    elif door.holders or door.has_order(clock.now):
        _stays_shut(found, door, clock, "OPEN is wanted")
    elif door.mode.value == CLOSED:
        _idle(found, door, clock, around)
    elif door.last_heartbeat is None and not asked and not door.asks_now(clock.now):
        _nobody_tells(found, door, clock, around)
    elif not door.mode.since.seen and for_s <= MOVES_S:
        found.say(
            "No robot holds the door. It may close in a moment. If it does not, a push button, somebody"
            " in the doorway or the door's own controller keeps it open.",
            "nobody",
            "listen for longer",
        )
    elif for_s <= (OPENS_S if door.mode.value == OPEN else MOVES_S):
        found.say(
            "No robot holds the door, so the door closes or will close in a moment.",
            "nobody",
            f"wait until {door.name} is closed",
        )
    else:
        found.say(
            "No robot holds the door. A push button, somebody in the doorway or the door's own"
            " controller keeps it open. CLOSE from RMF's supervisor only releases a hold.",
            "the controller",
            f"close {door.name} when nobody is in the doorway",
        )


def _idle(found: Answer, door: DoorFacts, clock: TimePhrases, around: common.OthersHeard) -> None:
    """Explain a closed door that nobody wants open. One of its faults may still need a person."""
    heard = door.asked or door.last_heartbeat or door.unanswered or door.noted
    if heard is None and not around.live:
        found.say(
            "No request and no heartbeat was heard, only states. So nobody waits for the door, or these"
            " topics are not recorded.",
            "nobody",
            "if a robot waits: record `/adapter_door_requests`, `/door_requests` and"
            " `/door_supervisor_heartbeat` too",
        )
        return
    found.say("Nobody waits for the door.")
    if not first_causes.needs_a_person(found, door, clock, around):
        found.acts("nobody", "there is nothing to do")


def _nobody_tells(
    found: Answer, door: DoorFacts, clock: TimePhrases, around: common.OthersHeard
) -> None:
    """Explain an open door that no requester is known to hold.

    RMF's supervisor sends a heartbeat only after requests. Whenever a state shows an open door that
    nobody holds, the supervisor sends CLOSE (door_supervisor/Node.cpp).
    """
    if clock.now.at - door.began.at < REQUESTER_SILENT_S:
        found.say(
            "It is not yet known whether a robot holds the door.", "nobody", "listen for longer"
        )
        return
    doorway = f"look into the doorway of {door.name}"
    if around.nobody_publishes("door_requests"):
        found.say(
            "No node publishes `door_requests`, so the door supervisor is not running. It is not known"
            " whether a robot holds the door. A robot in the doorway sends nothing.",
            "a person",
            f"{doorway}; when no robot stands in it, start the door supervisor, which lets go of every"
            " door whose holder is silent",
        )
        return
    holds = "a robot holds the door, and most likely stands silent in the doorway"
    if nodes := around.publishers("door_requests"):
        found.say(
            "RMF's supervisor sends CLOSE whenever a state shows an open door that nobody holds."
            f" {nodes} publishes `door_requests` and sends no CLOSE, so {holds}.",
            "the robot",
            f"drive through and send CLOSE; if {door.name} stays open for more than a minute, a person"
            " has to look into the doorway",
        )
        return
    found.say(
        f"Nothing asks for CLOSE: either {holds}, or no door supervisor is running, or"
        " `door_requests` is not recorded.",
        "a person",
        f"{doorway}; when no robot stands in it, see whether the door supervisor is running",
    )


def _asked_open(found: Answer, door: DoorFacts, clock: TimePhrases) -> None:
    """Explain a request that was heard only on `door_requests`, the topic of the door's daemon. The
    sender is the supervisor, or a person with `send --direct`."""
    assert door.asked is not None
    since, direct = door.asked.since, door.sender != SUPERVISOR
    said = f"On door_requests {door.asked_by} has asked for OPEN {clock.since(since)}"
    if door.mode.value != OPEN:
        _stays_shut(found, door, clock, said)
        return
    sent = [door.sender] if direct else [one.who for one in door.requesters if one.wants == OPEN]
    whose = "" if direct or not sent else f" {listed(sent[:4])} sent OPEN and no CLOSE."
    _ends_hold(found, door, clock, sent[0] if sent else "", since, f"{said}.{whose}")


def _held_open(found: Answer, door: DoorFacts, clock: TimePhrases) -> None:
    """Name the holders, and tell when the last request came."""
    who, since = min(door.holders.items(), key=lambda one: one[1].at)
    claim = door.requesters.get(who)
    said = (
        f"The last request came at {clock.time(claim.last.wall)}."
        if claim
        else "No request from a holder was heard."
    )
    _ends_hold(found, door, clock, who, since, said)


def _ends_hold(
    found: Answer, door: DoorFacts, clock: TimePhrases, who: str, since: Moment, said: str
) -> None:
    """Say how the hold of an open door ends. `who` is the holder, or "" if the holder is not known.
    Silence is normal, because a robot in a doorway sends nothing."""
    robot, let_go = "/" in who or not who, "find out who holds the door"
    if robot and clock.now.at - since.at <= LONG_S:
        found.say(
            f"{said} A robot in the doorway sends nothing until it has driven through.",
            "the robot",
            f"{who or 'the robot'} has to drive through; then its fleet adapter sends CLOSE. If"
            f" {door.name} stays open for more than a minute, a person has to look into the doorway",
        )
        return
    why = (
        "RMF has no time limit: a robot that died in the doorway, or a dashboard that somebody left,"
        " keeps the door open for ever."
        if robot
        else f"{who} is no robot's name (FLEET/ROBOT), so a dashboard or a person may have sent OPEN."
        " The door stays open until the same name sends CLOSE."
    )
    if who:
        let_go = f"only when the doorway is clear: {_close(door, who)}"
    found.say(f"{said} {why}", "a person", f"look into the doorway; {let_go}")


def _close(door: DoorFacts, who: str) -> str:
    """Return the command that ends this requester's hold."""
    direct = " --direct" if door.last_heartbeat is None and door.sender == who else ""
    return f"`rmf-bridge send door {quote(door.name)} close --requester {quote(who)}{direct}`"
