"""The file on disk in which a kind keeps its memory for a restart. The file is JSON with a version. If
any part of the file is damaged, the whole file is refused."""

from typing import Annotated, TypeVar

import msgspec
from msgspec import Meta

Text = Annotated[str, Meta(min_length=1)]


class Kept(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The content of a kind's file. `version`: the version of the file's layout."""

    version: int


R = TypeVar("R", bound=Kept)


def read(kept: bytes, record: type[R], version: int, what: str) -> R:
    """Decode the record. Raises ValueError for bytes that are no such record, and for another version.
    The error's text names `what`, the expected content."""
    try:
        found = msgspec.json.decode(kept, type=record)
    except msgspec.MsgspecError as error:
        raise ValueError(f"not {what}: {error}") from error
    if found.version != version:
        raise ValueError(f"version {found.version} of {what}; this daemon reads {version}")
    return found
