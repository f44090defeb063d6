"""Draw a timeline as SVG. Lanes run from left to right, each span has a label, and details appear under
the pointer.

Every text becomes a text node of an XML tree, so a name from the network cannot become markup. The
picture needs no script, font or network.
"""

import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator
from datetime import datetime, tzinfo
from typing import Final
from xml.etree.ElementTree import Element, SubElement, tostring

from bridges.observe.requesters import Moment
from workbench.explain.palette import MEANING, TONES, Theme, style
from workbench.explain.phrases import TimePhrases, lasted
from workbench.explain.timeline import Lane, LaneSpan, Mark, Timeline, Tone

LEAST_WIDE: Final = 480
ROW: Final = 24.0
GAP: Final = 8.0
TOP: Final = 82.0
BOTTOM: Final = 56.0
RIGHT: Final = 16.0
CHAR: Final = 6.6
"""Width (pixels) of one character, rounded up. The font size is 12 pixels."""
NARROW: Final = 1.2
"""Width (pixels) below which a span is drawn together with its neighbours."""
TICKS: Final = (1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 10800, 21600, 43200)
ROBOT: Final = re.compile(r"(?:^|(?<= for ))[^\s/]+/(?=[^\s/]+(?: \(request \S*\))?$)")
"""Pattern of the fleet's name and slash in front of a robot's name."""
FONT: Final = "font-family:system-ui,'Noto Sans','DejaVu Sans',sans-serif"
TEXT: Final = ".txt{font-size:12px}.small{font-size:11px}.title{font-size:16px;font-weight:600}"


def svg(
    timeline: Timeline,
    width: int = 1200,
    zone: tzinfo | None = None,
    theme: Theme | None = None,
) -> str:
    """Draw the picture. `zone` is the time zone of the axis, or None for this machine's zone. If
    `theme` is None, the reader's screen chooses the theme."""
    return tostring(Picture(timeline, max(LEAST_WIDE, width), zone, theme).root, "unicode")


class Picture:
    """The XML tree of one picture."""

    def __init__(
        self, timeline: Timeline, width: int, zone: tzinfo | None, theme: Theme | None
    ) -> None:
        self._timeline = timeline
        self._clock = TimePhrases(Moment(timeline.to_s, self._wall(timeline.to_s)), zone)
        self._left = _gutter(timeline.lanes, width)
        self._width = width
        rows = len(timeline.lanes)
        groups = len({lane.name for lane in timeline.lanes})
        self._foot = TOP + rows * ROW + max(0, groups - 1) * GAP
        height = self._foot + BOTTOM + _legend_height(width)
        name = f"{timeline.kind} {timeline.device}"
        self.root = Element(
            "svg",
            {
                "xmlns": "http://www.w3.org/2000/svg",
                "viewBox": f"0 0 {width} {height:g}",
                "width": f"{width}",
                "height": f"{height:g}",
                "role": "img",
                "aria-label": f"Timeline of {name}",
                "style": FONT,
            },
        )
        SubElement(self.root, "style").text = TEXT + style(theme)
        self._patterns()
        self._rect(0, 0, width, height, "paper")
        self._head(name)
        self._axis()
        self._rows()
        self._steps()
        self._legend()

    # ---- positions of parts

    def _wall(self, at: float) -> float:
        return self._timeline.wall + at - self._timeline.from_s

    def _x(self, at: float) -> float:
        length = max(0.001, self._timeline.to_s - self._timeline.from_s)
        share = (at - self._timeline.from_s) / length
        return self._left + share * (self._width - self._left - RIGHT)

    # ---- XML elements

    def _rect(self, x: float, y: float, wide: float, high: float, looks: str) -> Element:
        return SubElement(
            self.root,
            "rect",
            {
                "x": f"{x:.1f}",
                "y": f"{y:.1f}",
                "width": f"{wide:.1f}",
                "height": f"{high:.1f}",
                "class": looks,
            },
        )

    def _text(self, x: float, y: float, text: str, looks: str, anchor: str = "start") -> None:
        place = {"x": f"{x:.1f}", "y": f"{y:.1f}", "class": looks, "text-anchor": anchor}
        SubElement(self.root, "text", place).text = text

    def _line(self, x: float, y: float, to_y: float, looks: str) -> Element:
        at = f"{x:.1f}"
        place = {"x1": at, "x2": at, "y1": f"{y:.1f}", "y2": f"{to_y:.1f}", "class": looks}
        return SubElement(self.root, "line", place)

    def _patterns(self) -> None:
        """Define the patterns: hatches for wrong spans, dots for unknown spans, and lines for requested
        spans."""
        defs = SubElement(self.root, "defs")
        for tone, size, path, wide in (
            ("wrong", 8, "M-1,9 L9,-1", "1.4"),
            ("unknown", 6, "M0,3 L2,3", "1.2"),
            ("asks", 9, "M4.5,0 L4.5,9", "1"),
        ):
            pattern = SubElement(
                defs,
                "pattern",
                {
                    "id": f"p-{tone}",
                    "width": f"{size}",
                    "height": f"{size}",
                    "patternUnits": "userSpaceOnUse",
                },
            )
            SubElement(pattern, "path", {"d": path, "class": f"p-{tone}", "stroke-width": wide})

    # ---- parts of the picture

    def _head(self, name: str) -> None:
        timeline, clock = self._timeline, self._clock
        self._text(12, 24, name, "title ink")
        for_s = lasted(timeline.to_s - timeline.from_s)
        began = clock.date(timeline.wall)
        left_out = timeline.left_out + sum(lane.left_out for lane in timeline.lanes)
        more = f", {left_out} older parts left out" if left_out else ""
        self._text(12, 42, f"from {began}, {for_s}{more}", "small weak")

    def _axis(self) -> None:
        """Draw vertical lines at round times."""
        begin, end = self._timeline.wall, self._wall(self._timeline.to_s)
        fits = max(2, int((self._width - self._left) // 90))
        step = next((tick for tick in TICKS if (end - begin) / tick <= fits), 86400)
        for wall in _round_times(begin, end, step, self._clock.zone):
            x = self._x(self._timeline.from_s + wall - begin)
            self._line(x, TOP - 8, self._foot + 4, "grid")
            text = self._clock.time(wall).rpartition(" ")[2]
            anchor = "end" if x > self._width - RIGHT - 30 else "middle"
            self._text(x, TOP - 12, text, "small weak", anchor)
            self._text(x, self._foot + 18, text, "small weak", anchor)

    def _rows(self) -> None:
        y, before = TOP, ""
        if not self._timeline.lanes:
            self._text(12, TOP + 4, "Nothing was heard about the device in this time.", "txt ink")
        for lane in self._timeline.lanes:
            y += GAP if before and lane.name != before else 0.0
            if lane.name != before:
                self._text(12, y + 16, lane.name, "txt ink")
            room = self._left - 12 - 76
            self._text(self._left - 8, y + 16, _fitted(lane.row, room), "small weak", "end")
            self._row(lane, y)
            y, before = y + ROW, lane.name

    def _row(self, lane: Lane, y: float) -> None:
        what = f"{lane.name} {lane.row}".strip()
        for span, parts in _drawable(lane.spans, self._x):
            x, end = self._x(span.from_s), self._x(span.to_s)
            wide = max(0.8, end - x)
            box = self._rect(x, y + 2, wide, ROW - 4, f"f-{span.tone}")
            self._hint(box, self._told(what, span, parts))
            if span.tone in ("wrong", "unknown", "asks"):
                over = self._rect(x, y + 2, wide, ROW - 4, "")
                over.set("fill", f"url(#p-{span.tone})")
                over.set("pointer-events", "none")
            if wide > 2:
                self._line(x, y + 2, y + ROW - 2, "paper-edge edge")
            if text := _fitted(span.label, wide - 8):
                self._text(x + 5, y + 16, text, f"txt t-{span.tone}")
        self._marks(lane, y, what)

    def _marks(self, lane: Lane, y: float, what: str) -> None:
        """Draw a pointer at each mark. Add the mark's label if there is space before the next mark."""
        busy = [(self._x(span.from_s), self._x(span.to_s)) for span in lane.spans]
        places = [self._x(mark.at_s) for mark in lane.marks]
        for number, (mark, x) in enumerate(zip(lane.marks, places, strict=True)):
            after = min([*places[number + 1 : number + 2], self._width - RIGHT])
            point = f"M{x - 5:.1f},{y + 1:.1f} h10 l-5,9 z"
            shape = SubElement(self.root, "path", {"d": point, "class": "ink"})
            self._hint(shape, f"{what}: {mark.label}, {self._at(mark)}")
            free = min([after, *(start for start, end in busy if end > x + 5)]) - x - 14
            inside = any(start <= x + 8 < end for start, end in busy)
            if not inside and (text := _fitted(mark.label, free)):
                self._text(x + 7, y + 16, text, "small ink")

    def _told(self, what: str, span: LaneSpan, parts: int) -> str:
        start = self._clock.time(self._wall(span.from_s), tenths=True)
        end = self._clock.time(self._wall(span.to_s), tenths=True)
        label = span.label if parts == 1 else f"{parts} changes"
        return f"{what}: {label}, {start} to {end} ({lasted(span.to_s - span.from_s)})"

    def _at(self, mark: Mark) -> str:
        return self._clock.time(self._wall(mark.at_s), tenths=True)

    def _hint(self, element: Element, text: str) -> None:
        SubElement(element, "title").text = text

    def _steps(self) -> None:
        """Draw a line at each step of the listener's clock."""
        for mark in self._timeline.steps:
            line = self._line(self._x(mark.at_s), TOP - 8, self._foot + 4, "step")
            self._hint(line, mark.label)
            self._text(self._x(mark.at_s) + 4, self._foot + 32, mark.label, "small ink")

    def _legend(self) -> None:
        x, y = 12.0, self._foot + BOTTOM - 6
        for tone in TONES:
            wide = 18 + 6 + len(MEANING[tone]) * CHAR + 18
            if x + wide > self._width:
                x, y = 12.0, y + 20
            self._rect(x, y - 11, 18, 14, f"f-{tone}")
            if tone in ("wrong", "unknown", "asks"):
                self._rect(x, y - 11, 18, 14, "").set("fill", f"url(#p-{tone})")
            self._text(x + 24, y, MEANING[tone], "small weak")
            x += wide


def _legend_height(width: int) -> float:
    total = sum(42 + len(MEANING[tone]) * CHAR for tone in TONES)
    return 20.0 * (total // (width - 24)) + 8


def _gutter(lanes: Iterable[Lane], width: int) -> float:
    """Return the width (pixels) of the names on the left. The width is at most a quarter of the
    picture."""
    longest = max((_wide(lane.row) for lane in lanes), default=0.0)
    return min(max(96.0, 12 + 76 + longest + 8), max(150.0, width / 4))


def _wide(text: str) -> float:
    """Return a text's approximate width (pixels). A wide character such as 走 counts twice."""
    return CHAR * sum(1.7 if unicodedata.east_asian_width(c) in "WF" else 1.0 for c in text)


def _fitted(text: str, room: float) -> str:
    """Shorten the text to fit. Return "" if almost nothing fits.

    Drop the name of the fleet from a robot's text, but never shorten the robot's name. Thus two robots
    of a fleet never look the same.
    """
    if _wide(text) <= room:
        return text
    if (robot := ROBOT.sub("", text)) != text:
        alone, for_, _ = robot.partition(" for ")
        shorter = alone if for_ else robot.partition(" (")[0]
        return next((one for one in (robot, shorter) if _wide(one) <= room), "")
    kept = text
    while kept and _wide(kept) + CHAR > room:
        kept = kept[: min(len(kept) - 1, int(room / CHAR))] if len(kept) > 1 else ""
    return f"{kept.rstrip()}…" if len(kept) >= 2 else ""


def _round_times(begin: float, end: float, step: int, zone: tzinfo | None) -> Iterator[float]:
    """Yield the round times between `begin` and `end`, on the zone's local clock."""
    try:
        offset = datetime.fromtimestamp(begin, zone).astimezone(zone).utcoffset()
    except (OverflowError, ValueError, OSError):
        offset = None
    east = offset.total_seconds() if offset else 0.0
    first = -((-begin - east) // step) * step - east
    for number in range(200):
        if first + number * step > end:
            return
        yield first + number * step


WORST: Final[dict[Tone, int]] = {"wrong": 2, "unknown": 1}


def _drawable(
    spans: Iterable[LaneSpan], x: Callable[[float], float]
) -> Iterator[tuple[LaneSpan, int]]:
    """Join spans that are too narrow to see. Yield each resulting span with the number of spans joined
    in it."""
    joined: list[LaneSpan] = []
    for span in spans:
        gap = joined and x(span.from_s) - x(joined[-1].to_s) > NARROW
        narrow = x(span.to_s) - x(span.from_s) < NARROW
        if joined and (gap or not narrow or x(joined[-1].to_s) - x(joined[0].from_s) >= NARROW):
            yield _one(joined), len(joined)
            joined = []
        if narrow:
            joined.append(span)
        else:
            yield span, 1
    if joined:
        yield _one(joined), len(joined)


def _one(spans: list[LaneSpan]) -> LaneSpan:
    """Join narrow spans into one span. The new span has the most serious tone of the narrow spans."""
    tone = max(spans, key=lambda span: (WORST.get(span.tone, 0), span.to_s - span.from_s)).tone
    label = spans[0].label if len(spans) == 1 else ""
    return LaneSpan(spans[0].from_s, spans[-1].to_s, label, tone)
