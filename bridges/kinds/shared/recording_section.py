"""The `recording:` section of a YAML: what is recorded, and how much space the files may take on the
disk."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from bridges.kinds.shared.fields import tells

Megabytes = Annotated[float, Meta(ge=0.25, le=16, extra={"unit": "MB"})]
Files = Annotated[int, Meta(ge=1, le=10_000)]
Space = Annotated[float, Meta(ge=1, le=100_000, extra={"unit": "MB"})]
Patience = Annotated[float, Meta(ge=10, le=86400, extra={"unit": "s"})]


class RecordingSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings for the recording of the daemon's messages and decisions. With `ring`, nothing is
    written to a disk while all is well."""

    keep: Annotated[
        Literal["nothing", "ring", "continuous"],
        tells("""`ring`: the last minutes stay in memory, and the recorder makes a file of them when
        something goes wrong. `continuous`: everything is written into files, and the oldest files are
        deleted. `nothing`: nothing is recorded."""),
    ] = "ring"
    ring_mb: Annotated[
        Megabytes, tells("the ring's size. 1 MB holds at least 10 minutes of a lift.")
    ] = 1.0
    files: Annotated[
        Files,
        tells("""how many files the recorder keeps, of all daemons of the machine together. If the
        YAMLs of these daemons differ, the recorder uses the largest number."""),
    ] = 400
    files_mb: Annotated[
        Space,
        tells("""how large these files may be together. If the YAMLs differ, the recorder uses the
        largest number."""),
    ] = 200.0
    waiting_s: Annotated[
        Patience, tells("how long a requester may wait; after that the recorder makes a file.")
    ] = 180.0
