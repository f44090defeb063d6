"""A stand-in for lgpio that records every call and answers as lgpio 0.2.2 does."""

from types import ModuleType
from typing import Any

Call = tuple[Any, ...]
HANDLE = 7


class error(Exception):
    """An error whose text has quotes, as lgpio's errors do."""

    def __init__(self, value: str) -> None:
        super().__init__(value)
        self.value = value

    def __str__(self) -> str:
        return repr(self.value)


class Callback:
    """A stand-in for the object that `lgpio.callback` returns."""

    def __init__(self, calls: list[Call], gpio: int) -> None:
        self._calls = calls
        self._gpio = gpio

    def cancel(self) -> None:
        self._calls.append(("cancel", self._gpio))


class StandIn(ModuleType):
    """The stand-in module.

    `chips` has the label of each chip number. `holders` has the program that holds each GPIO, and
    `levels` has the level that a read returns for each GPIO.
    """

    SET_PULL_UP, SET_PULL_DOWN, SET_PULL_NONE = 32, 64, 128
    RISING_EDGE, FALLING_EDGE, BOTH_EDGES = 1, 2, 3
    GPIO_IS_OUT = 2
    error = error

    def __init__(self) -> None:
        super().__init__("lgpio")
        self.calls: list[Call] = []
        self.chips: dict[int, str] = {0: "pinctrl-bcm2711"}
        self.holders: dict[int, str] = {}
        self.levels: dict[int, int] = {}
        self.modes: dict[int, int] = {}
        self.edges: dict[int, Any] = {}
        self.broken: set[str] = set()

    def _call(self, name: str, *arguments: Any) -> None:
        self.calls.append((name, *arguments))
        if name in self.broken:
            raise error("broken")

    def claims(self) -> list[Call]:
        """Return all recorded calls except queries."""
        asking = ("gpio_get_mode", "gpio_get_chip_info", "gpio_get_line_info")
        return [call for call in self.calls if call[0] not in asking]

    def gpiochip_open(self, chip: int) -> int:
        self._call("gpiochip_open", chip)
        if chip not in self.chips:
            raise error("can not open gpiochip")
        return HANDLE + chip

    def gpiochip_close(self, handle: int) -> None:
        self._call("gpiochip_close", handle)

    def gpio_get_chip_info(self, handle: int) -> list[Any]:
        self._call("gpio_get_chip_info", handle)
        return [0, 54, f"gpiochip{handle - HANDLE}", self.chips[handle - HANDLE]]

    def gpio_get_line_info(self, handle: int, gpio: int) -> list[Any]:
        self._call("gpio_get_line_info", handle, gpio)
        return [0, gpio, 0, f"GPIO{gpio}", self.holders.get(gpio, "")]

    def gpio_claim_output(self, handle: int, gpio: int, level: int = 0, flags: int = 0) -> None:
        self._claim(gpio, self.GPIO_IS_OUT | flags, "gpio_claim_output", handle, gpio, level)
        self.levels[gpio] = level

    def gpio_claim_input(self, handle: int, gpio: int, flags: int = 0) -> None:
        self._claim(gpio, flags, "gpio_claim_input", handle, gpio, flags)

    def gpio_claim_alert(self, handle: int, gpio: int, edges: int, flags: int = 0) -> None:
        self._claim(gpio, flags, "gpio_claim_alert", handle, gpio, edges, flags)

    def _claim(self, gpio: int, mode: int, name: str, *arguments: Any) -> None:
        self._call(name, *arguments)
        if gpio in self.holders:
            raise error("GPIO busy")
        self.modes[gpio] = mode

    def gpio_get_mode(self, handle: int, gpio: int) -> int:
        self._call("gpio_get_mode", handle, gpio)
        return self.modes[gpio]

    def gpio_free(self, handle: int, gpio: int) -> None:
        self._call("gpio_free", handle, gpio)
        if gpio not in self.modes:
            raise error("GPIO not allocated")
        del self.modes[gpio]

    def gpio_write(self, handle: int, gpio: int, level: int) -> None:
        self._call("gpio_write", handle, gpio, int(level))
        self.levels[gpio] = int(level)

    def gpio_read(self, handle: int, gpio: int) -> int:
        self._call("gpio_read", handle, gpio)
        return self.levels.get(gpio, 0)

    def callback(self, handle: int, gpio: int, edge: int, function: Any) -> Callback:
        self._call("callback", handle, gpio, edge)
        self.edges[gpio] = function
        return Callback(self.calls, gpio)
