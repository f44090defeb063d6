"""The site's devices as HTML and SVG: a shaft, a door, a charger, a robot. Pure.

Every text goes through `html.escape`: names come from the network. Nothing is shown only by colour;
each drawing has its meaning in words.
"""

from collections.abc import Iterable, Sequence
from html import escape
from typing import Final
from urllib.parse import quote

from bridges.messages import definitions as d
from bridges.messages import words
from workbench.page.live_site import DeviceView, RobotShown, Stands

OLD: Final = ' class="old"'
LONGEST: Final = 160
"""Limit of characters of a text on a card; the device's own page has the whole text."""
MOST_FLOORS: Final = 40
"""Limit of landings of a drawn shaft; beyond it, words alone give the car's place."""
FLOOR_PX, SHAFT_PX, LABEL_PX = 22, 44, 46
ARROWS: Final = {d.LiftMotion.MOTION_UP: "▲", d.LiftMotion.MOTION_DOWN: "▼"}
LEAVES: Final = {"open": 0.12, "moving": 0.3, "closed": 0.5}
"""The share of the doorway that each leaf covers."""


def card(view: DeviceView, *, before: DeviceView | None = None) -> str:
    """Draw one device as a box: name, state and faults.

    `before`: the last drawing's view, so the car's movement is visible.
    """
    row = view.row
    name = f"<h3>{_told(row.name)}</h3>"
    old = bool(row.mark)
    classes = " ".join(
        filter(None, ("card", row.kind, "old" if old else "", "faulty" if row.faults else ""))
    )
    marks = "".join(_chip(text, kind) for text, kind in _marks(view))
    return (
        f'<article class="{classes}">{name}{marks}'
        f'<div class="body">{_picture(view, before)}<dl>{"".join(_facts(view))}</dl></div></article>'
    )


def path_of(kind: str, name: str) -> str:
    """Return the address of the device's own page."""
    return f"/{kind}/{quote(name, safe='')}"


def _marks(view: DeviceView) -> Iterable[tuple[str, str]]:
    row = view.row
    if row.simulated:
        yield "SIMULATED", "simulated"
    if row.mark:
        yield f"OLD: {row.mark.lower()}, last reading {row.age} old", "old"
    for fault in filter(None, row.faults.split("; ")):
        yield fault, "fault"


def _chip(text: str, kind: str) -> str:
    sign = {"fault": "✖ ", "old": "◷ ", "simulated": "◇ "}[kind]
    return f'<p class="chip {kind}">{sign}{_told(text)}</p>'


def _facts(view: DeviceView) -> Iterable[str]:
    row = view.row
    yield _fact("now" if not row.mark else "was", row.state)
    if row.held_by not in ("-", ""):
        yield _fact("for" if row.kind == "charger" else "held by", row.held_by)
    if view.stands is not None:
        yield _fact("has it for", had(view.stands))
    if row.waiting:
        yield _fact("waiting", row.waiting)


def had(stands: Stands) -> str:
    """Format in minutes, so a card does not change every second: `at least 12 min`."""
    minutes = int(stands.for_s // 60)
    if stands.at_least:
        return f"at least {minutes} min" if minutes else "since before this page heard of it"
    return f"{minutes} min" if minutes else "less than a minute"


def _fact(name: str, value: str) -> str:
    return f"<dt>{escape(name)}</dt><dd>{_told(value)}</dd>"


def _told(text: str) -> str:
    """Format as HTML; of a long text its beginning."""
    return escape(text if len(text) <= LONGEST else f"{text[:LONGEST]}…")


def _picture(view: DeviceView, before: DeviceView | None) -> str:
    match view.state:
        case d.LiftState() as lift:
            left = before.state if before and isinstance(before.state, d.LiftState) else lift
            return shaft(lift, left.current_floor, old=bool(view.row.mark))
        case d.DoorState() as door:
            word = words.plain(d.DoorModeValue, door.current_mode.value)
            return _svg(44, 44, f"door {word}", _leaves(2, 4, 40, 36, word))
        case d.ChargerState() as charger:
            return _plug(words.plain(d.ChargerStateValue, charger.state))
        case _:
            return ""


def shaft(state: d.LiftState, left: str = "", *, old: bool = False) -> str:
    """Draw a lift's shaft: floors, highest at the top, car at its floor, door and direction.

    `left`: the car's floor in the last drawing.
    """
    floors = floors_of(state)
    if not floors:
        return ""
    height = FLOOR_PX * len(floors) + 4
    parts = []
    for index, floor in enumerate(floors):
        y = 2 + FLOOR_PX * index
        parts.append(_rect("shaft", LABEL_PX, y, SHAFT_PX, FLOOR_PX))
        target = " target" if floor == state.destination_floor else ""
        sign = "◎ " if target else ""
        parts.append(
            f'<text class="floor{target}" x="{LABEL_PX - 5}" y="{y + 15}" text-anchor="end">'
            f"{sign}{escape(_short(floor))}</text>"
        )
    if state.current_floor in floors:
        parts.append(_car(state, floors, left))
    said = words.condition(state) + (" (old)" if old else "")
    return _svg(LABEL_PX + SHAFT_PX + 24, height, said, "".join(parts))


def _car(state: d.LiftState, floors: Sequence[str], left: str) -> str:
    place = floors.index(state.current_floor)
    y = 4 + FLOOR_PX * place
    door = words.plain(d.LiftDoor, state.door_state)
    car = _leaves(LABEL_PX + 4, y, SHAFT_PX - 8, FLOOR_PX - 4, door)
    x = LABEL_PX + SHAFT_PX + 6
    arrow = f'<text class="arrow" x="{x}" y="{y + 14}">{_arrow(state.motion_state)}</text>'
    if left == state.current_floor or left not in floors:
        return car + arrow
    by = FLOOR_PX * (floors.index(left) - place)
    return f'<g class="moves" style="--from:{by}px">{car}{arrow}</g>'


def floors_of(state: d.LiftState) -> list[str]:
    """Return the landings from the top down (RMF lists them from the bottom up); empty if too
    many."""
    floors = list(dict.fromkeys(state.available_floors))
    return floors[::-1] if len(floors) <= MOST_FLOORS else []


def _arrow(motion: int) -> str:
    return next((sign for known, sign in ARROWS.items() if known == motion), "")


def _short(text: str) -> str:
    return text if len(text) <= 6 else text[:5] + "…"


def _leaves(x: float, y: float, width: float, height: float, door: str) -> str:
    """Draw a car or doorway with two leaves: apart, together, or between; hatched if unknown."""
    share = LEAVES.get(door)
    frame = _rect("car", x, y, width, height)
    if share is None:
        at = f'x="{x + width / 2:g}" y="{y + height / 2 + 5:g}"'
        return f'{frame}<text class="unknown" {at} text-anchor="middle">?</text>'
    leaf, style = width * share, f"leaf {door}"
    left = _rect(style, x, y, leaf, height)
    return frame + left + _rect(style, x + width - leaf, y, leaf, height)


def _rect(style: str, x: float, y: float, width: float, height: float) -> str:
    size = f'width="{width:.4g}" height="{height:.4g}"'
    return f'<rect class="{style}" x="{x:.4g}" y="{y:.4g}" {size}/>'


def _plug(state: str) -> str:
    sign = {"charging": "⚡", "idle": "○", "error": "✖", "assigned": "◔", "released": "◒"}
    text = f'<text class="plug" x="22" y="32" text-anchor="middle">{sign.get(state, "?")}</text>'
    ring = f'<circle class="pad {escape(state)}" cx="22" cy="22" r="19"/>'
    return _svg(44, 44, f"charger {state}", ring + text)


def _svg(width: float, height: float, said: str, inner: str) -> str:
    return (
        f'<svg class="drawn" style="width:{width / 16:.4g}rem;height:{height / 16:.4g}rem"'
        f' viewBox="0 0 {width:g} {height:g}" role="img"'
        f' aria-label="{_told(said)}"><title>{_told(said)}</title>{inner}</svg>'
    )


def robots(found: Sequence[RobotShown], now: float) -> str:
    """Draw the robots that fleets report, as a table."""
    if not found:
        return ""
    rows = "".join(_robot(one, now) for one in found)
    heads = "".join(
        f'<th scope="col">{text}</th>' for text in ("robot", "does", "level", "battery")
    )
    table = f"<table><thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table>"
    return f'<h2>Robots</h2><div class="panel">{table}</div>'


def _robot(robot: RobotShown, now: float) -> str:
    state = robot.state
    silent_s = now - robot.at
    old = f" (OLD: silent {silent_s:.0f} s)" if silent_s > 10 else ""
    does = words.plain(d.RobotModeValue, state.mode.mode) + old
    cells = (
        words.printable(f"{robot.fleet}/{state.name}"),
        does,
        words.printable(state.location.level_name) or "?",
        f"{max(0.0, min(100.0, state.battery_percent)):.0f} %",
    )
    inner = "".join(f"<td>{_told(cell)}</td>" for cell in cells)
    return f"<tr{OLD if old else ''}>{inner}</tr>"
