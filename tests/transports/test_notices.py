"""The number of failed reads after which a transport ends its thread."""

import pytest

from bridges.transports.notices import Failures


@pytest.mark.parametrize(
    ("at", "too_many"),
    [
        pytest.param([0, 1, 2, 3], False, id="four in a row"),
        pytest.param([0, 1, 2, 3, 4], True, id="five in a row"),
        pytest.param([0, 9, 18, 27, 36], True, id="five with good reads in between"),
        pytest.param([0, 1, 2, 3, 13, 14, 15, 16], False, id="four, a calm time, and four"),
        pytest.param([0, 10, 20, 30, 40, 50], False, id="one in each calm time"),
    ],
)
def test_five_failures_without_a_calm_time_in_between_are_too_many(
    at: list[float], too_many: bool
) -> None:
    failures = Failures()
    for now in at:
        failures.count(now)
    assert failures.too_many is too_many
