"""Chooses values for a simulated charger's fields, so that the driver reads the wanted activity from
them.

This file tries values until the driver's own rules give that activity.
"""

import itertools
from collections.abc import Iterator, Mapping
from typing import Final

from bridges.kinds.charger.signals import Activity
from drivers.charger.rules import (
    MEANINGS,
    UNKNOWN,
    Meaning,
    Rule,
    StationErrors,
    Test,
    judge,
    places,
)
from drivers.charger.state_codes import ROBOT_ERROR
from drivers.json_fields import Value

NEAREST: Final = {
    Activity.HANDSHAKE: Activity.IDLE,
    Activity.STOPPING: Activity.CHARGING,
    Activity.RELEASED: Activity.IDLE,
}
"""The replacement for each activity that a charger may be unable to show. If the charger's map has no
code and no rule for an activity, the charger shows the replacement."""


def values(
    rules: list[Rule],
    errors: StationErrors,
    wanted: Meaning,
    natural: Mapping[str, Value],
) -> dict[str, Value] | None:
    """Return the value of each field. `natural` gives the fields' usual values, which are tried first.

    Return None if no rule fits. If no rule shows an error, the first error field shows the error.
    """
    shown: dict[str, Value] = {at: 0 for _, at in errors.places()}
    shown |= {n.at: n.well[0] for n in errors.codes}
    is_shown = wanted[0] is Activity.ERROR and _shows_error(errors, shown, wanted == ROBOT_ERROR)
    at = dict.fromkeys(at for _, at in places(rules))
    tried = [_candidates(place, rules, natural, shown) for place in at]
    if is_shown or not rules:
        return {**{place: first for place, (first, *_) in zip(at, tried, strict=True)}, **shown}
    for found in itertools.product(*tried):
        said = {**shown, **dict(zip(at, found, strict=True))}
        rule = judge(rules, said.__getitem__)
        if (MEANINGS[rule.means] if rule else UNKNOWN) == wanted:
            return said
    activity = NEAREST.get(wanted[0])
    return values(rules, errors, (activity, ""), natural) if activity else None


def _shows_error(errors: StationErrors, shown: dict[str, Value], robot: bool) -> bool:
    """Write an error of the robot or of the station into `shown`. If there is no field for errors of
    that side, write an error of the other side. Return whether `shown` has an error now."""
    sides = ("robot", "station") if robot else ("station", "robot")
    for side in sides:
        for number in errors.codes:
            for code in getattr(number, side):
                shown[number.at] = code
                return True
        for flags in errors.bits:
            for bit in getattr(flags, side):
                shown[flags.at] = 1 << bit
                return True
        for at in getattr(errors, side):
            shown[at] = 1
            return True
    return False


def _candidates(
    at: str, rules: list[Rule], natural: Mapping[str, Value], shown: Mapping[str, Value]
) -> list[Value]:
    if at in shown:
        return [shown[at]]
    first: list[Value] = [natural[at]] if at in natural else []
    tests = (rule.when[at] for rule in rules if at in rule.when)
    return [*first, *(value for test in tests for value in _near(test)), 0, False]


def _near(test: Test) -> Iterator[Value]:
    """Yield some values that pass a test, and some that fail."""
    yield from test.one_of
    for limit in (test.above, test.below):
        if limit is not None:
            yield from (limit + 1, limit - 1, limit)
    numbers = [n for n in test.one_of if isinstance(n, int | float) and not isinstance(n, bool)]
    if numbers:
        yield max(numbers) + 1
    if any(isinstance(value, bool) for value in test.one_of):
        yield from (True, False)
