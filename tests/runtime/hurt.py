"""The command `rmf-bridge`, with a part that fails as soon as a file exists.

`python -m tests.runtime.hurt PART FILE run …` takes one of these parts:
- `reader`: the transport's reader raises again and again.
- `bus`: the next reading of the Modbus bus never ends.
- `loop`: the thread of the bus `dead` raises.
- `watch`: the daemon's main thread raises.
"""

import sys
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from bridges import cli
from bridges.runtime.loop import Loop
from drivers.hal.modbus import ModbusBus
from hal_fakes.wire import wire


def _reader() -> type:
    if wire() == "dds":
        from bridges.transports.dds.transport import DdsTransport

        return DdsTransport
    from bridges.transports.zenoh.transport import ZenohTransport

    return ZenohTransport


def _daemon() -> type:
    from bridges.runtime.daemon import Daemon

    return Daemon


def _raises(*_: Any) -> None:
    raise MemoryError("no memory left")


def _raises_for_the_dead(loop: Loop) -> None:
    if loop.name == "bus-dead":
        _raises()


def _hangs(*_: Any) -> None:
    threading.Event().wait()


HURTS: dict[str, tuple[Callable[[], type], str, Callable[..., None]]] = {
    "reader": (_reader, "_follow_network", _raises),
    "bus": (lambda: ModbusBus, "read", _hangs),
    "loop": (lambda: Loop, "round", _raises_for_the_dead),
    "watch": (_daemon, "_require_life", _raises),
}


def main(argv: Sequence[str]) -> int:
    """Run the command. The chosen part fails as soon as the file exists."""
    what, file, *command = argv
    owner, name, fail = HURTS[what]
    whole = getattr(owner(), name)

    def hurt(*arguments: Any) -> object:
        if Path(file).exists():
            fail(*arguments)
        return whole(*arguments)

    setattr(owner(), name, hurt)
    return cli.main(command)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
