"""The meanings of a charger's state numbers. For each meaning the YAML lists the maker's numbers.

A number that the YAML does not list counts as a fault, and the fault's text shows the number. The
driver never passes a maker's number on as an RMF state.
"""

from collections.abc import Collection, Mapping
from typing import Annotated

import msgspec

from bridges.kinds.charger.signals import Activity, FaultSide
from bridges.kinds.shared.fields import tells
from bridges.kinds.shared.remarks import Remarks
from drivers.numbers import listed_twice

CODE_MAX = 65535
Code = Annotated[int, msgspec.Meta(ge=0, le=CODE_MAX)]
STATION_ERROR: tuple[Activity, FaultSide] = (Activity.ERROR, "station")
ROBOT_ERROR: tuple[Activity, FaultSide] = (Activity.ERROR, "robot")


class Codes(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The meanings of the maker's state numbers. A number that no key lists counts as a fault, and the
    fault's text shows the number."""

    idle: Annotated[
        list[Code], msgspec.Meta(min_length=1), tells("nothing is on the pad: a robot may come.")
    ]
    charging: Annotated[list[Code], msgspec.Meta(min_length=1), tells("current flows.")]
    handshake: Annotated[
        list[Code], tells("the station recognises a robot; no current flows yet.")
    ] = []
    stopping: Annotated[list[Code], tells("current still flows, ramping down.")] = []
    released: Annotated[
        list[Code],
        tells("the robot is disconnected, and the station is not ready for the next robot."),
    ] = []
    error: Annotated[
        list[Code],
        tells("""the station is out of service, because of an error or by hand. If you give
        `robot_error`, list only errors of the station here."""),
    ] = []
    station_error: Annotated[
        list[Code],
        tells("""the station is out of service because of an error that the maker assigns to the
        station. If you give this key, `error` may list errors of the station and of the robot."""),
    ] = []
    robot_error: Annotated[
        list[Code], tells("an error of the robot, with the station itself in order.")
    ] = []

    def problems(self) -> Remarks:
        """Yield a problem for each state that is listed twice."""
        return listed_twice({name: getattr(self, name) for name in self.__struct_fields__})

    def meanings(self) -> dict[int | str, tuple[Activity, FaultSide]]:
        """Return the activity of each of the maker's states. For an error, add the side (station or
        robot) that has the error."""
        made: dict[int | str, tuple[Activity, FaultSide]] = {
            code: (activity, "") for activity, codes in self.lists().items() for code in codes
        }
        for side, codes in self._sides().items():
            made |= dict.fromkeys(codes, (Activity.ERROR, side))
        return made

    def unnamed_side(self, code: object) -> FaultSide:
        """Return the side that is at fault for a number in `error`.

        If the YAML gives `robot_error` without `station_error`, a number in `error` is a fault of the
        station. Otherwise the side is unknown, so return "".
        """
        told_apart = self.robot_error and not self.station_error
        return "station" if told_apart and code in self.error else ""

    def lists(self) -> Mapping[Activity, list[Code]]:
        """Return the maker's numbers for each activity. The numbers in `station_error` and
        `robot_error` are not included."""
        return {
            Activity.IDLE: self.idle,
            Activity.HANDSHAKE: self.handshake,
            Activity.CHARGING: self.charging,
            Activity.STOPPING: self.stopping,
            Activity.RELEASED: self.released,
            Activity.ERROR: self.error,
        }

    def rows(self) -> list[tuple[str, str]]:
        """Return the rows for `check`."""
        rows = [
            (f"state {meaning}", ", ".join(map(str, codes)) or "no code")
            for meaning, codes in self.lists().items()
        ]
        rows += [
            (f"{side}'s error", ", ".join(map(str, codes)))
            for side, codes in self._sides().items()
            if codes
        ]
        return [*rows, ("any other state", "error, with its number")]

    def _sides(self) -> Mapping[FaultSide, list[Code]]:
        return {"station": self.station_error, "robot": self.robot_error}


def first_side(sides: Collection[FaultSide]) -> FaultSide:
    """Return the side at fault for an error that several sources report. If the sources name both
    sides, return the station. Return "" if no source names a side."""
    known: tuple[FaultSide, ...] = ("station", "robot")
    return next((side for side in known if side in sides), "")
