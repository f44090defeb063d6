"""Log lines that use the words of technicians, and show no Python names such as class names."""

import json
import logging
import os
import sys
import threading
import weakref
from datetime import datetime

import pytest
from msgspec import Struct

from bridges.kinds.door.signals import DoorOutputs
from bridges.kinds.lift.signals import LiftOutputs, Side
from bridges.kinds.shared.decision import OperatorReset
from bridges.messages.definitions import LiftMode
from bridges.system.log import Seldom, Unhurried, _Formatter, _Json, _OthersOnce, pairs, plain


class Asked(Struct, frozen=True):
    session_id: str
    agv: bool
    at: float = 0.0
    floors: tuple[str, ...] = ()


def test_a_line_that_keeps_coming_is_held_back_and_its_number_is_told() -> None:
    now = 0.0
    seldom, passed = Seldom(lambda: now), []
    for second in range(1300):
        now = float(second)
        for text in [pairs("lost", device="ward", for_s=f"{second} s")] + ["other"] * (
            second == 700
        ):
            record = logging.LogRecord("bridges", logging.INFO, "", 0, text, None, None)
            if seldom.filter(record):
                passed.append((second, record.getMessage()))
    said = [(at, f'lost device=ward for_s="{at} s"') for at in range(6)]
    assert passed == [
        *said,
        (605, 'lost device=ward for_s="605 s" left_out=599'),
        (700, "other"),
        (1205, 'lost device=ward for_s="1205 s" left_out=599'),
    ]
    now = 1311.0
    record = logging.LogRecord("bridges", logging.INFO, "", 0, said[0][1], None, None)
    assert seldom.filter(record)


def test_threads_may_log_different_lines_at_the_same_time() -> None:
    """logging calls a handler's filters without a lock. More than MOST lines make the filter forget."""
    seldom, errors = Seldom(), list[Exception]()

    def log(who: int) -> None:
        try:
            for number in range(3 * Seldom.MOST):
                text = f"{who} {number}"
                seldom.filter(logging.LogRecord("bridges", logging.INFO, "", 0, text, None, None))
        except Exception as error:  # noqa: BLE001 - a thread's error would be lost
            errors.append(error)

    interval_s = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        threads = [threading.Thread(target=log, args=(who,)) for who in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        sys.setswitchinterval(interval_s)
    assert errors == []


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (
            LiftOutputs(agv_request=True, call="L3", hold_door=Side.FRONT),
            "agv_request yes, call L3, hold_door front",
        ),
        (LiftOutputs(agv_request=False, call=None, hold_door=None), "-"),
        (DoorOutputs(hold_open=True), "hold_open yes"),
        (
            Asked("you", agv=True, floors=("L1", "L2")),
            "session_id you, agv yes, at 0.0, floors L1, L2",
        ),
        (OperatorReset(), "-"),
        (LiftMode.MODE_AGV, "MODE_AGV"),
        ({"lift_requests": 3, "door_requests": 1}, "lift_requests 3, door_requests 1"),
        ({"a"}, "a"),
        ([], "-"),
        (None, "-"),
        (True, "yes"),
        (False, "no"),
        (0, "0"),
        (0.25, "0.25"),
        (OSError("no such file"), "no such file"),
    ],
)
def test_a_value_is_written_in_words_and_not_as_python(value: object, text: str) -> None:
    assert plain(value) == text


def test_a_log_line_names_the_driven_outputs_as_a_person_would() -> None:
    outputs = LiftOutputs(agv_request=True, call="L3", hold_door=None)
    assert pairs("outputs", device="Lift1", outputs=outputs) == (
        'outputs device=Lift1 outputs="agv_request yes, call L3"'
    )


def test_a_log_line_stays_one_line_whatever_is_in_it() -> None:
    line = pairs("refused", device="Lift 1", detail='a "b"\nc', floor="")
    assert line == 'refused device="Lift 1" detail="a \'b\'\\nc" floor=""'


@pytest.mark.parametrize(("level", "prefix"), [(logging.INFO, "<6>"), (logging.ERROR, "<3>")])
def test_under_systemd_every_line_carries_its_priority(level: int, prefix: str) -> None:
    record = logging.LogRecord("x", level, "", 0, "one\ntwo", (), None)
    assert _Formatter(journal=True).format(record) == f"{prefix}one\n{prefix}two"


def test_as_json_a_line_keeps_its_event_and_its_values() -> None:
    line = pairs("state", device="Lift1", level=3, agv=True, floors=("L1", "L2"))
    record = logging.LogRecord("x", logging.INFO, "", 0, line, (), None)
    told = json.loads(_Json(journal=False).format(record))
    assert datetime.fromisoformat(told.pop("at")).timestamp() == pytest.approx(
        record.created, abs=0.01
    )
    assert told == {
        "priority": "info",
        "event": "state",
        "values": {"device": "Lift1", "level": 3, "agv": True, "floors": "L1, L2"},
        "text": line,
    }


def test_as_json_under_systemd_a_text_without_an_event_is_one_line_with_its_priority() -> None:
    record = logging.LogRecord("x", logging.ERROR, "", 0, "one\ntwo", (), None)
    line = _Json(journal=True).format(record)
    assert line.startswith("<3>{")
    assert json.loads(line.removeprefix("<3>"))["text"] == "one\ntwo"


def test_a_library_line_has_keys_and_comes_once() -> None:
    once = _OthersOnce()
    lines = [
        logging.LogRecord("paho.mqtt", logging.ERROR, "a.py", line, "bad\x1b %s", ("frame",), None)
        for line in (1, 1, 2)
    ]
    assert [once.filter(line) for line in lines] == [True, False, True]
    assert lines[0].getMessage() == 'library logger=paho.mqtt text="bad\\x1b frame"'
    assert json.loads(_Json(journal=False).format(lines[0]))["event"] == "library"


def test_an_unread_log_makes_nobody_wait_and_the_dropped_lines_are_counted() -> None:
    read, write = os.pipe()
    log = Unhurried(write)
    log.setFormatter(_Formatter(journal=True))
    log.MOST, log.FLUSHED_WITHIN_S = 140_000, 0.1  # type: ignore[misc]

    def say(text: str) -> None:
        log.handle(logging.LogRecord("bridges", logging.INFO, "", 0, text, None, None))

    for number in range(4):
        say(f"{number} " + 65536 * "x")
    log.flush()
    for line in range(2):
        assert _line(read).startswith(f"<6>{line} ")
    assert _line(read) == "<4>log_not_read dropped=2"
    say("again")
    assert _line(read) == "<6>again"
    log.flush()
    if not (child := os.fork()):
        say("forked")
        logging.shutdown([weakref.ref(log)])
        os._exit(0)
    os.waitpid(child, 0)
    assert _line(read) == "<6>forked"


def _line(pipe: int) -> str:
    found = b""
    while not found.endswith(b"\n"):
        found += os.read(pipe, 1)
    return found.decode().rstrip()
