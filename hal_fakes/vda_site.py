"""A broker with robots that speak VDA 5050 (`hal_fakes/vda5050.py`)."""

import threading
import time
from collections.abc import Sequence
from typing import Final

from drivers.hal.mqtt import MqttSettings
from hal_fakes.mosquitto import Mosquitto
from hal_fakes.vda5050 import FakeVdaRobot

LOOK_S: Final = 0.02


class VdaSite:
    """A broker with its robots. `replace` has the settings with which the real bus finds the broker."""

    def __init__(self, settings: MqttSettings, stations: Sequence[FakeVdaRobot]) -> None:
        self._robots = stations
        self._broker = Mosquitto()
        self._joined: set[str] = set()
        self._broken = ""
        self._closed = threading.Event()
        self.replace = self._broker.replace
        self._thread = threading.Thread(target=self._run, name="vda-site", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the robots and the broker. The caller may call `close` twice."""
        self._closed.set()
        self._thread.join()
        for each in self._robots:
            each.leave()
        self._broker.close()

    def _run(self) -> None:
        while not self._closed.wait(LOOK_S):
            self._fail_broker()
            for each in self._robots if not self._broken else ():
                gone = each.plant.failures.get("unit") == "off"
                if gone and each.name in self._joined:
                    self._joined.discard(each.name)
                    each.leave()
                elif not gone and each.name not in self._joined:
                    self._joined.add(each.name)
                    each.join(self._broker.port)
                each.tick(time.monotonic())

    def _fail_broker(self) -> None:
        modes = (each.plant.failures.get("server") for each in self._robots)
        mode = next((mode for mode in modes if mode), "")
        if mode == self._broken:
            return
        frozen, before, self._broken = ("stuck", "slow"), self._broken, mode
        if before in frozen:
            self._broker.thaw()
        elif before:
            self._broker.start()
        if mode in frozen:
            self._broker.freeze()
        elif mode:
            self._broker.kill()
            self._joined.clear()
            for each in self._robots:
                each.leave()
