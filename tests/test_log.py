import logging

import pytest

from bridges.log import _Formatter, pairs


def test_a_log_line_stays_one_line_whatever_is_in_it() -> None:
    line = pairs("refused", device="Lift 1", detail='a "b"\nc', floor="")
    assert line == 'refused device="Lift 1" detail="a \'b\'\\nc" floor=""'


@pytest.mark.parametrize(("level", "prefix"), [(logging.INFO, "<6>"), (logging.ERROR, "<3>")])
def test_under_systemd_every_line_carries_its_priority(level: int, prefix: str) -> None:
    record = logging.LogRecord("x", level, "", 0, "one\ntwo", (), None)
    assert _Formatter(journal=True).format(record) == f"{prefix}one\n{prefix}two"
