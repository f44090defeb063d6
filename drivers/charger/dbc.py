"""DBC files, which cantools reads. A DBC file describes a maker's frames and the signals in the frames.

The code uses the file's names for frames and signals. A value is in the signal's unit, after scaling.
The value of an enumerated signal is its number.
"""

import functools
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final

from bridges.system import user_files
from drivers import DriverError
from drivers.profiles import texts

if TYPE_CHECKING:
    from cantools.database import Message

EXTENDED: Final = 1 << 31
SIZE_MAX: Final = 4 << 20


class Dbc:
    """One DBC file. An invalid file raises ValueError with the problem."""

    def __init__(self, text: str) -> None:
        import cantools
        from cantools.database.errors import Error

        try:
            database = cantools.database.load_string(text, "dbc")
        except Error as error:
            raise ValueError(f"is not a DBC file: {' '.join(str(error).split())[:200]}") from None
        assert isinstance(database, cantools.database.Database)
        self._messages: dict[str, Message] = {
            message.name: message for message in database.messages
        }

    def frames(self) -> list[str]:
        """Return the names of the file's frames."""
        return list(self._messages)

    def signals(self, frame: str) -> list[str]:
        """Return the names of a frame's signals."""
        return [signal.name for signal in self._messages[frame].signals]

    def is_paged(self, frame: str, signal: str) -> bool:
        """Return whether only some of these frames have the signal (it is multiplexed)."""
        found = self._messages[frame].get_signal_by_name(signal)
        return found.multiplexer_ids is not None

    def id(self, frame: str) -> int:
        """Return a frame's id. If the id has 29 bits, EXTENDED is set."""
        message = self._messages[frame]
        return int(message.frame_id) | (EXTENDED if message.is_extended_frame else 0)

    def length(self, frame: str) -> int:
        """Return a frame's length in bytes."""
        return int(self._messages[frame].length)

    def decode(self, frame: str, payload: bytes) -> dict[str, float]:
        """Return the value of each signal that has a finite number. Raises DriverError."""
        from cantools.database.errors import Error

        try:
            found = self._messages[frame].decode(payload, decode_choices=False)
        except (Error, ValueError, KeyError) as error:
            raise DriverError(f"{frame} {payload.hex(' ')} cannot be decoded: {error}") from None
        assert isinstance(
            found, dict
        )  # a list would mean nested frames, and DBC has no nested frames
        return {
            name: value
            for name, value in found.items()
            if isinstance(value, int | float) and math.isfinite(value)
        }

    def encode(self, frame: str, values: Mapping[str, float]) -> bytes:
        """Encode the payload. `values` must give a value for every signal. Raises ValueError."""
        from cantools.database.errors import Error

        try:
            return bytes(self._messages[frame].encode(dict(values)))
        except (Error, OverflowError) as error:
            raise ValueError(f"{frame}: {' '.join(str(error).split())}") from None

    def unit(self, frame: str, signal: str) -> str:
        """Return a signal's unit, or ""."""
        return str(self._messages[frame].get_signal_by_name(signal).unit or "")

    def bounds(self, frame: str, signal: str) -> tuple[float, float]:
        """Return a signal's minimum and maximum in the file."""
        found = self._messages[frame].get_signal_by_name(signal)
        low, high = found.minimum, found.maximum
        return -math.inf if low is None else low, math.inf if high is None else high

    def sample(self, frame: str, signal: str, value: float) -> bytes | None:
        """Encode a frame with this value in one signal and 0 in all other signals. Return None if the
        frame cannot hold the value."""
        from cantools.database.errors import Error

        message = self._messages[frame]
        values = dict.fromkeys(self.signals(frame), 0.0) | {signal: value}
        try:
            return bytes(message.encode(values, scaling=True, strict=False))
        except (Error, OverflowError, KeyError):
            return None


def path(name: str) -> Path:
    """Return the path of a DBC file. If `name` is not an absolute path, the file is in
    drivers/profiles/."""
    return texts.FOLDER / name


def load(name: str) -> Dbc:
    """Load the DBC file that `path` finds for this name. Raises ValueError with the problem."""
    file = path(name)
    return _understood(file, texts.text(file, lambda: _read(file)))


@functools.cache
def _understood(file: Path, text: bytes) -> Dbc:
    try:
        return Dbc(text.decode("cp1252"))
    except (ValueError, UnicodeDecodeError) as error:
        raise ValueError(f"{file} {error}") from None


def _read(file: Path) -> bytes:
    try:
        text = user_files.read(file, SIZE_MAX).content
    except OSError as error:
        raise ValueError(f"{file} cannot be read: {error.strerror}") from None
    if len(text) > SIZE_MAX:
        raise ValueError(f"{file} is larger than {SIZE_MAX >> 20} MiB")
    return text
