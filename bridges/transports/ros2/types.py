"""The types of `definitions.py` for rclpy, which are the classes of the installed ROS packages.

Samples pass through rclpy as bytes (`transport.py`), so these classes only name the types. This file
compares the classes' fields with `definitions.py`. Without this comparison, the bytes of a message with
other fields could be misread.
"""

import importlib
import typing
from typing import Protocol

from bridges.messages.definitions import PACKAGES
from bridges.messages.releases import DEFAULT, DIFFERING, NEWEST, RELEASES, Release
from bridges.transports.transport import TransportError

NAMES = {str: "string", bool: "boolean", "byte": "octet", "float32": "float", "float64": "double"}
"""The IDL name of each of our types. ROS's Python classes use these names."""


class RosMessage(Protocol):
    """A message class of a ROS package (rosidl_generator_py)."""

    @classmethod
    def get_fields_and_field_types(cls) -> dict[str, str]: ...


def installed() -> Release:
    """Return the release to which the installed RMF message packages belong. Return the default release
    if they belong to no known release."""
    fitting = (one for one in RELEASES.values() if all(_fits(kind, one) for kind in DIFFERING))
    return next(fitting, DEFAULT)


def _fits(message_type: type, release: Release) -> bool:
    """Return whether the installed package and the release define this message in the same way. Also
    return True if both lack the message."""
    try:
        module = importlib.import_module(f"{PACKAGES[message_type]}.msg")
    except ImportError:
        return True  # `ros_type` reports a missing package when the message is used
    found: type[RosMessage] | None = getattr(module, message_type.__name__, None)
    if found is None or not release.has(message_type):
        return found is None and not release.has(message_type)
    theirs = found.get_fields_and_field_types()
    return list(theirs.items()) == list(fields_of(message_type, release).items())


def ros_type(message_type: type, release: Release = NEWEST) -> type[RosMessage]:
    """Return the ROS class of a message type. Raises TransportError if the class is missing or has
    other fields."""
    package, name = PACKAGES[message_type], message_type.__name__
    try:
        found: type[RosMessage] | None = getattr(
            importlib.import_module(f"{package}.msg"), name, None
        )
    except ImportError as error:
        raise TransportError(
            f"{package} does not import ({error}): {how_to_install(package)}"
        ) from error
    if found is None:
        raise TransportError(
            f"the installed {package} has no {name}: install a newer version, or use `transport: dds`"
        )
    for nested in sorted(_nested_in(message_type), key=lambda kind: kind.__name__):
        ros_type(nested, release)
    theirs, ours = found.get_fields_and_field_types(), fields_of(message_type, release)
    if list(theirs.items()) != list(ours.items()):
        raise TransportError(
            f"the installed {package}/{name} has the fields {theirs}; this version of rmf-bridge needs"
            f" {ours}. `transport: dds` does not help, because it would not match such nodes either"
        )
    return found


def how_to_install(package: str) -> str:
    """Return an instruction that installs a package on Ubuntu with ROS 2's package sources."""
    return (
        f"`sudo apt install ros-jazzy-{package.replace('_', '-')}`, and source ROS's setup file"
        " (`ros_setup:` in the YAML does that for a service)"
    )


def fields_of(message_type: type, release: Release = NEWEST) -> dict[str, str]:
    """Return the type of each field by the field's name. The types have the names that
    `get_fields_and_field_types()` uses."""
    return {name: _name(kind) for name, kind in release.fields(message_type).items()}


def _name(kind: type) -> str:
    if typing.get_origin(kind) is typing.Annotated:
        name = str(typing.get_args(kind)[1])
        return NAMES.get(name, name)
    if typing.get_origin(kind) is tuple:
        return f"sequence<{_name(typing.get_args(kind)[0])}>"
    return NAMES.get(kind) or f"{PACKAGES[kind]}/{kind.__name__}"


def _nested_in(message_type: type) -> set[type]:
    kinds = NEWEST.fields(message_type).values()
    sequences = {typing.get_args(kind)[0] for kind in kinds if typing.get_origin(kind) is tuple}
    return PACKAGES.keys() & {*kinds, *sequences}
