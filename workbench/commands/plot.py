"""`rmf-bridge plot`: draw a device's timeline from a recording into one HTML, SVG or PNG file.

A browser shows the file without network and without script. In HTML, the explanation is below the
picture. For a PNG file, the package resvg renders the SVG. resvg is an extra, and only this module
imports resvg.
"""

import argparse
import os
from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import Final

from bridges.messages.words import KINDS
from bridges.runtime import faults
from workbench.explain.device_timeline import Drawing
from workbench.explain.heard_devices import HeardDevices
from workbench.explain.palette import PAPER, Theme
from workbench.explain.picture import svg
from workbench.explain.text import lines
from workbench.explain.timeline import Timeline
from workbench.graph.join import complain
from workbench.replay.recordings import RecordingSpan, add_span_arguments, told_between, unreadable
from workbench.replay.sources import BagError

SUFFIXES: Final = (".html", ".svg", ".png")
INSTALL: Final = "in the git clone of rmf-bridges run .venv/bin/pip install '.[plot]'"
NARROWEST, WIDEST = 480, 8000


class PlotError(Exception):
    """An error if no picture can be made. The error's text gives the remedy."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `plot`."""
    parser.add_argument(
        "file", type=Path, metavar="FILE", help="a recording of any form that `explain` reads"
    )
    parser.add_argument("--device", metavar="NAME", help="default: the recording's only device")
    parser.add_argument(
        "--kind", choices=KINDS, help="the kind, if a lift and a door have the same name"
    )
    parser.add_argument(
        "-o",
        "--output",
        type=_output,
        required=True,
        metavar="PICTURE",
        help="a name that ends with .html, .svg or .png; an existing file is replaced",
    )
    parser.add_argument(
        "--width",
        type=_width,
        default=1200,
        metavar="PIXELS",
        help=f"the picture's width, {NARROWEST} to {WIDEST} (default 1200)",
    )
    parser.add_argument(
        "--theme",
        choices=("light", "dark"),
        help="default: light or dark, as the reader's screen is set; a PNG is light",
    )
    add_span_arguments(parser)


def _output(text: str) -> Path:
    if Path(text).suffix.lower() not in SUFFIXES:
        raise argparse.ArgumentTypeError(f"'{text}' does not end with one of {', '.join(SUFFIXES)}")
    return Path(text)


def _width(text: str) -> int:
    if not text.isascii() or not text.isdigit() or not NARROWEST <= int(text[:6]) <= WIDEST:
        raise argparse.ArgumentTypeError(f"'{text}': write pixels, {NARROWEST} to {WIDEST}")
    return int(text)


def run(args: argparse.Namespace) -> int:
    """Return the exit code.

    - 0: the file was written.
    - 1: there is nothing to draw, or the file cannot be written.
    - 66: FILE is no readable recording.
    """
    try:
        name = args.device or _only(args)
        timeline, words = _read(args, name)
        _write(args.output, _picture(args, timeline, words))
    except BagError as error:
        return unreadable("plot", error)
    except PlotError as error:
        complain("plot", error)
        return 1
    print(f"{args.output}: {timeline.kind} {timeline.device}, {len(timeline.lanes)} rows")
    left_out = timeline.left_out + sum(lane.left_out for lane in timeline.lanes)
    if left_out:
        complain("plot", f"{left_out} older parts did not fit: choose a time with --from and --to")
    return 0


def _only(args: argparse.Namespace) -> str:
    """Return the name of the recording's only device. Raises PlotError if the recording has more
    devices."""
    site = HeardDevices()
    for heard in told_between(args.file, RecordingSpan(args.from_, args.to), "plot", ""):
        site.take(heard)
    names = {name: f"{kind} {name}" for kind, name in site.devices() if args.kind in (None, kind)}
    if len(names) > 1:
        listed = ", ".join([*names.values()][:20])
        raise PlotError(f"choose with --device: {listed}")
    for name in names:
        return name
    raise PlotError(f"{args.file} holds no state of any lift, door or charger in that time")


def _read(args: argparse.Namespace, name: str) -> tuple[Timeline, list[str]]:
    """Return the device's timeline, and the lines of its explanation. Raises PlotError if the recording
    has no state of the device."""
    span, site = RecordingSpan(args.from_, args.to), HeardDevices(name)
    drawings = {kind: Drawing(kind, name) for kind in KINDS if args.kind in (None, kind)}
    for heard in told_between(args.file, span, "plot", name):
        site.take(heard)
        for drawing in drawings.values():
            drawing.take(heard)
    kinds = [kind for kind, shown in site.devices() if shown == name and kind in drawings]
    if len(kinds) > 1:
        raise PlotError(f"'{name}' is a {' and a '.join(kinds)}: choose with --kind")
    for kind in kinds:
        site.story_from(span.begins_at)
        words = lines(site.explain(kind, name, None, faults.for_explain()))
        return drawings[kind].timeline(span.begins_at), words
    raise PlotError(f"{args.file} holds no state of '{name}' in that time")


def _picture(args: argparse.Namespace, timeline: Timeline, words: list[str]) -> bytes:
    theme: Theme | None = args.theme
    match args.output.suffix.lower():
        case ".svg":
            return svg(timeline, args.width, None, theme).encode()
        case ".png":
            return _png(svg(timeline, args.width, None, theme or "light"))
    return "".join(_page(svg(timeline, args.width, None, theme), words, theme)).encode()


def _png(picture: str) -> bytes:
    """Render the SVG as PNG. Raises PlotError if resvg is not installed."""
    try:
        import resvg_py
    except ImportError:
        raise PlotError(f"a PNG needs resvg: {INSTALL}; or write .svg or .html") from None
    return bytes(resvg_py.svg_to_bytes(svg_string=picture, zoom=2))


def _page(picture: str, words: list[str], theme: Theme | None) -> Iterator[str]:
    """Yield the parts of an HTML page with the picture and the words. On a narrow screen, people scroll
    the picture."""
    colours = [
        f"body{{background:{PAPER[theme or 'light'][0]};color:{PAPER[theme or 'light'][1]}}}"
    ]
    if theme is None:
        back, text = PAPER["dark"][:2]
        colours.append(
            f"@media (prefers-color-scheme: dark){{body{{background:{back};color:{text}}}}}"
        )
    yield "<!DOCTYPE html>\n<html lang='en'><head><meta charset='utf-8'>"
    yield "<meta name='viewport' content='width=device-width, initial-scale=1'>"
    yield "<meta name='color-scheme' content='light dark'>"
    yield f"<title>{escape(words[0])}</title><style>"
    yield "body{font-family:system-ui,sans-serif;margin:1rem}.wide{overflow-x:auto}"
    yield "pre{white-space:pre-wrap;font-size:.85rem;line-height:1.4}"
    yield "".join(colours)
    yield f"</style></head><body><main><div class='wide' tabindex='0'>{picture}</div>"
    yield f"<pre>{escape(chr(10).join(words))}</pre></main></body></html>\n"


def _write(file: Path, content: bytes) -> None:
    """Write the whole file. If this fails, write nothing, and raise PlotError."""
    beside = file.with_name(f".{file.name}.{os.getpid()}")
    try:
        try:
            beside.write_bytes(content)
            beside.replace(file)
        finally:
            beside.unlink(missing_ok=True)
    except OSError as error:
        raise PlotError(f"{file} cannot be written: {error.strerror}") from None
