"""The robot's name in a ChargerState's error_message. A reader of the message gets back exactly the
name that the charger wrote."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridges.kinds.charger.pad import Misplaced, misplaced_in
from bridges.kinds.charger.report import FaultCause, diagnosis, error_text
from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger.signals import Activity, ChargerSample
from tests.depth import examples

ODD = st.sampled_from([*' ,"/\\\n', "stands here", " is expected", "unknown receiver ", ""])
NAMES = st.one_of(st.text(), st.lists(st.one_of(ODD, st.text(max_size=3))).map("".join))
ROBOTS = st.builds(RobotName, NAMES, NAMES)
EXPECTED = st.none() | ROBOTS
MISPLACED = st.one_of(
    st.builds(Misplaced, ROBOTS, expected=EXPECTED),
    st.builds(Misplaced, st.none(), NAMES, EXPECTED),
)


@settings(max_examples=examples(1000))
@given(MISPLACED)
def test_every_receiver_id_survives_the_error_text(misplaced: Misplaced) -> None:
    assert misplaced_in(misplaced.text) == misplaced
    assert diagnosis(misplaced.text) is FaultCause.PAD


def test_plain_ids_are_written_as_they_are_and_others_quoted() -> None:
    one, odd = RobotName("tiny", "AMR01"), RobotName("tiny", "AMR 1, spare")
    assert [
        Misplaced(one).text,
        Misplaced(one, expected=odd).text,
        Misplaced(None, "4711").text,
        Misplaced(None, 'RX,"1"', one).text,
    ] == [
        "wrong docking: tiny/AMR01 is not assigned here",
        'wrong docking: tiny/AMR01 stands here, tiny/"AMR 1, spare" is expected',
        "unknown receiver 4711",
        'unknown receiver "RX,\\"1\\"", tiny/AMR01 is expected',
    ]


def test_names_of_any_script_are_readable_in_an_error() -> None:
    assert Misplaced(RobotName("Räumer", "Wäsche 1")).text == (
        'wrong docking: Räumer/"Wäsche 1" is not assigned here'
    )


@pytest.mark.parametrize(
    "text",
    ["", "station: fan", "wrong docking: AMR01", "unknown receiver a b", "unknown receiver 1, 2"],
)
def test_an_error_text_of_another_form_names_no_robot(text: str) -> None:
    assert misplaced_in(text) is None


@pytest.mark.parametrize(
    "words",
    ["wrong docking: a/b is not assigned here", "Charger unreachable", "unknown receiver 1"],
)
def test_the_words_of_a_station_do_not_count_as_words_of_the_daemon(words: str) -> None:
    told = error_text(ChargerSample(Activity.ERROR, 9, words))
    assert (told, diagnosis(told)) == (f"the charger says: {words}", FaultCause.UNCLEAR)
