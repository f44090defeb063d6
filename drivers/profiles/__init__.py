"""A profile is a file with the register map or frame map of one make of device. The key `profile: NAME`
of a device YAML selects the file drivers/profiles/NAME.yaml.

    for: door_register       the driver that reads the profile
    hardware: untried        `tried` or `untried` on the hardware; `none` for an invented example
    source: "..."            where the numbers come from
    map: {...}               the content, under the key that a device YAML uses for it

A profile is parsed like a device YAML, so each problem has its file, line and column. Only code that
uses a profile imports the parser, because `outputs-off` must work without a parser.
"""

import functools
from pathlib import Path
from typing import Generic, TypeVar

import msgspec
from msgspec.inspect import LiteralType

from bridges.kinds.shared.fields import Name
from bridges.kinds.shared.remarks import Remarks
from bridges.yaml.problems import SettingsError
from bridges.yaml.spelling import either, unknown
from drivers.profiles import texts
from drivers.profiles.texts import FOLDER

Content = TypeVar("Content", bound=msgspec.Struct, covariant=True)


class Profile(Generic[Content]):
    """One type of profile, such as the register maps of doors. `reader` is the driver that `for:`
    names. `key` is the YAML key of the map, and `content` is the struct of the map."""

    def __init__(self, reader: str, key: str, content: type[Content]) -> None:
        self.reader = reader
        self.key = key
        self._content = content

    def names(self, folder: Path = FOLDER) -> list[str]:
        """Return the names of the profiles of this type."""
        first = f"for: {self.reader}"
        files = sorted({*folder.glob("*.yaml"), *texts.known_in(folder)})
        return [f.stem for f in files if f.suffix == ".yaml" and first in _lines(f)]

    def load(self, name: str, folder: Path = FOLDER) -> Content:
        """Load a profile's content as its struct. Raises SettingsError with every problem."""
        found = self._read(folder / f"{name}.yaml")[self.key]
        assert isinstance(found, self._content)
        return found

    def chosen(self, name: str | None, inline: Content | None) -> Content:
        """Return `inline`, the map that the device's YAML gives. If `inline` is None, return the map of
        the profile `name`. Raises SettingsError."""
        return inline or self.load(name or "")

    def problems(self, name: str | None, inline: object) -> Remarks:
        """Yield problems of `profile:`, and of the key (such as `map`) that may replace the profile."""
        if name is None and inline is None:
            text = f"needs '{self.key}', or a profile: {either(self.names())}"
            yield ("profile",), text
        elif name is not None and inline is not None:
            yield ("profile",), f"'{self.key}' is given as well: delete one of the two"
        elif name is not None and name not in self.names():
            yield ("profile",), unknown("profile", name, self.names())
        elif name is not None:
            try:
                self.load(name)
            except SettingsError as error:
                for problem in error.problems:
                    yield ("profile",), f"the profile has a problem: {problem}"

    def warnings(self, name: str | None, advice: str) -> Remarks:
        """Yield a warning for a make's profile that nobody has tried on hardware. `advice` tells the
        reader which test to do."""
        if name and self._read(FOLDER / f"{name}.yaml")["hardware"] == "untried":
            text = f"nobody has tried the profile {name} on hardware: {advice}"
            yield ("profile",), text

    def _read(self, file: Path) -> dict[str, object]:
        from bridges.yaml.parsing import read

        text = texts.text(file, lambda: read(str(file)))
        return _understood(str(file), text, self.reader, self.key, self._content)


def _lines(file: Path) -> list[str]:
    return (texts.known(file) or file.read_bytes()).decode("utf-8", "replace").splitlines()


@functools.cache
def _understood(
    file: str, text: bytes, reader: str, key: str, content: type[msgspec.Struct]
) -> dict[str, object]:
    from bridges.yaml.parsing import YamlFile, compose
    from bridges.yaml.positions import Spot
    from bridges.yaml.values import BROKEN, Values

    page = YamlFile(file)
    root = compose(page, text)
    spot, values = Spot(root, root, "the file"), Values(page)
    types: dict[str, object] = {
        "for": LiteralType((reader,)),
        "hardware": LiteralType(("tried", "untried", "none")),
        "source": Name,
        key: content,
    }
    found = values.known(values.entries(spot), spot, dict.fromkeys(types, "see drivers/profiles/"))
    made = {name: values.make(types[name], entry.spot()) for name, entry in found.items()}
    page.check()
    assert BROKEN not in made.values()
    return made
