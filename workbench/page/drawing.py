"""Draw the site's devices as HTML and SVG: a shaft, a door, a charger, a robot. All functions are pure.

Names come from the network, so every text goes through `html.escape`. A colour alone never has a
meaning, because each drawing also has words with the same meaning.
"""

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Final
from urllib.parse import quote

from bridges.messages import definitions as d
from bridges.messages import words
from bridges.messages.words import Stated
from bridges.observe.alarms import ObservedAlarm
from workbench.explain.answer import Remedies
from workbench.page.live_site import DeviceView, RobotShown, Stands

OLD: Final = ' class="old"'
NOW: Final = '<span class="now">now</span><span class="was">was</span>'
"""HTML with the two words `now` and `was`, of which the browser shows one. It shows `was` if the page's
server is silent."""
WAS: Final = "was"
NO_FLOOR: Final = "at no known floor"
SILENT_DO: Final = "run `rmf-bridge status` on the machine of its daemon, and check the network."
STALE_DO: Final = "check the device, its bus, and the clock of its daemon's machine."
MOST_TOLD: Final = 10
ROBOT_SILENT_S: Final = 10.0
HALF: Final[Mapping[int, float]] = {d.LiftMotion.MOTION_UP: -0.5, d.LiftMotion.MOTION_DOWN: 0.5}
"""Motion -> offset of the car, in floors. The offset is half a floor in the direction of the motion."""
LONGEST: Final = 160
"""Maximum length (characters) of a text on a card. In the list of troubles, LONGEST_FAULT is the
limit."""
LONGEST_FAULT: Final = 400
MOST_FLOORS: Final = 40
"""Maximum number of landings in a shaft's drawing. With more landings, only words tell the car's
place."""
FLOOR_PX, SHAFT_PX, LABEL_PX = 22, 44, 46
ARROWS: Final = {d.LiftMotion.MOTION_UP: "▲", d.LiftMotion.MOTION_DOWN: "▼"}
LEAVES: Final = {"open": 0.12, "moving": 0.3, "closed": 0.5}
"""Door state -> the part of the doorway that each of the two door leaves covers."""


def card(view: DeviceView, left: float | None = None) -> str:
    """Draw one device as a box with name, state and faults.

    `left` is where the last drawing showed a lift's car, as `car_place` returns it.
    """
    row = view.row
    name = f"<h3>{_told(row.name)}</h3>"
    old = bool(row.mark)
    classes = " ".join(
        filter(None, ("card", row.kind, "old" if old else "", "faulty" if row.faults else ""))
    )
    marks = "".join(_marks(view))
    facts = "".join(_facts(view, left))
    return (
        f'<article class="{classes}">{name}{marks}'
        f'<div class="body">{_picture(view, left)}<dl>{facts}</dl></div></article>'
    )


def path_of(kind: str, name: str) -> str:
    """Return the address of the device's own page."""
    return f"/{kind}/{quote(name, safe='')}"


def linked(kind: str) -> bool:
    """Has the device or robot a view of its own?"""
    return kind in (*words.KINDS, "robot")


def standing(alarms: Iterable[ObservedAlarm]) -> str:
    """Say why robots stand: one sentence for each alarm and drill that stops them."""
    told = []
    for one in alarms:
        sentence = escape(one.because(lambda wall: "\0")).replace("\0", when(one.since or 0.0))
        sign = "◔" if one.state == "drill" else "✖"
        told += [f'<p class="panel {one.state}">{sign} {sentence}</p>'] if one.stands else []
    return f'<div role="alert">{"".join(told)}</div>' if told else ""


def attention(wrong: Sequence[DeviceView], remedies: Remedies) -> str:
    """List the troubles of the first devices in `wrong`, each with its remedy."""
    items = "".join(_trouble(view, remedies) for view in wrong[:MOST_TOLD])
    more = len(wrong) - MOST_TOLD
    items += f"<li>{more} more: see “Only what needs attention”.</li>" if more > 0 else ""
    return (
        f'<h2>What is wrong, and what to do</h2><ul class="troubles">{items}</ul>' if wrong else ""
    )


def _trouble(view: DeviceView, remedies: Remedies) -> str:
    row = view.row
    name = _told(row.name)
    link = f'<a href="{path_of(row.kind, row.name)}">{name}</a>' if linked(row.kind) else name
    told = [_old(view)] if row.mark else []
    does = []
    if row.mark and not row.faults:
        does.append(SILENT_DO if row.mark.startswith("SILENT") else STALE_DO)
    for fault in filter(None, row.faults.split("; ")):
        told.append(_told(fault, LONGEST_FAULT))
        does += [do for do in remedies.get(fault.partition(" (")[0], ())[1:] if do not in does]
    steps = "".join(f"<p><b>Do:</b> {escape(do)}</p>" for do in does)
    return f'<li class="panel">{link} <span class="wrong">✖ {"; ".join(told)}</span>{steps}</li>'


def _old(view: DeviceView) -> str:
    mark = view.row.mark
    if mark.startswith("SILENT"):
        return f"OLD: silent since {when(view.heard_wall)}" if view.heard_wall else "OLD: silent"
    read = f"read at {when(view.read_wall)}" if view.read_wall else "never read"
    return f"OLD: {_told(mark.lower())}, {read}"


def when(wall: float) -> str:
    """Return the HTML of a time (s since the epoch). The browser shows the time in the browser's
    zone."""
    return f'<time data-at="{wall:.3f}"></time>'


def _marks(view: DeviceView) -> Iterable[str]:
    row = view.row
    if row.simulated:
        yield _chip("SIMULATED", "simulated")
    if row.mark:
        yield _chip(_old(view), "old")
    else:
        yield _chip("OLD: the page's server is silent", "old lost")
    for fault in filter(None, row.faults.split("; ")):
        yield _chip(_told(fault), "fault")


def _chip(html: str, kind: str) -> str:
    sign = {"fault": "✖ ", "old": "◷ ", "simulated": "◇ "}[kind.partition(" ")[0]]
    return f'<p class="chip {kind}">{sign}{html}</p>'


def _facts(view: DeviceView, left: float | None) -> Iterable[str]:
    row = view.row
    state = row.state
    if isinstance(view.state, d.LiftState):
        state = _placed(state, view.state, left)
    yield _fact(WAS if row.mark else NOW, state)
    if row.held_by not in ("-", ""):
        named = {"charger": "for", "robot": "assigned"}
        yield _fact(named.get(row.kind, "held by"), row.held_by)
    if view.stands is not None:
        yield _fact("has it for", had(view.stands))
    if row.waiting:
        yield _fact("waiting", row.waiting)


def had(stands: Stands) -> str:
    """Format the time in minutes, such as `at least 12 min`. With seconds, a card would change every
    second."""
    minutes = int(stands.for_s // 60)
    if stands.at_least:
        return f"at least {minutes} min" if minutes else "since before this page listened"
    return f"{minutes} min" if minutes else "less than a minute"


def _fact(name: str, value: str) -> str:
    return f"<dt>{name}</dt><dd>{_told(value)}</dd>"


def _told(text: str, longest: int = LONGEST) -> str:
    """Format a text as HTML. Cut the text after `longest` characters."""
    return escape(text if len(text) <= longest else f"{text[:longest]}…")


def _picture(view: DeviceView, left: float | None) -> str:
    match view.state:
        case d.LiftState() as lift:
            return shaft(lift, left, old=bool(view.row.mark))
        case d.DoorState() as door:
            word = words.plain(d.DoorModeValue, door.current_mode.value)
            return _svg(44, 44, f"door {word}", _leaves(2, 4, 40, 36, word))
        case d.ChargerState() as charger:
            return _plug(words.plain(d.ChargerStateValue, charger.state))
        case _:
            return ""


def car_place(state: Stated | None, left: float | None) -> float | None:
    """Return the place of a lift's car. 0 is the highest floor, and 0.5 is between the two highest
    floors. Return None if the place is unknown.

    A car between floors is half a floor away from its last place, in the direction of its motion.
    """
    if not isinstance(state, d.LiftState):
        return None
    floors = floors_of(state)
    if state.current_floor in floors:
        return float(floors.index(state.current_floor))
    if state.current_floor or left is None:
        return None
    to = floors.index(state.destination_floor) if state.destination_floor in floors else left
    by = HALF.get(state.motion_state, (to > left) / 2 - (to < left) / 2)
    place = left if left % 1 else left + by
    return place if place % 1 and 0 < place < len(floors) - 1 else None


def _placed(told: str, state: d.LiftState, left: float | None) -> str:
    """If the car is between floors, add where it is to `told`, the description of the lift's state."""
    place = car_place(state, left)
    if state.current_floor or (place is None and state.motion_state not in HALF):
        return told
    if place is None:
        return told.replace(NO_FLOOR, "between floors")
    upper, lower = map(words.printable, floors_of(state)[int(place) : int(place) + 2])
    return told.replace(NO_FLOOR, f"between {lower} and {upper}")


def shaft(state: d.LiftState, left: float | None = None, *, old: bool = False) -> str:
    """Draw a lift's shaft with the car, its door and its direction. The highest floor is at the top.

    `left` is where the last drawing showed the car, as `car_place` returns it.
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
    said = _placed(words.condition(state), state, left) + (" (old)" if old else "")
    if (place := car_place(state, left)) is not None:
        parts.append(_car(state, place, left))
    return _svg(LABEL_PX + SHAFT_PX + 24, height, said, "".join(parts))


def _car(state: d.LiftState, place: float, left: float | None) -> str:
    y = 4 + FLOOR_PX * place
    door = words.plain(d.LiftDoor, state.door_state)
    car = _leaves(LABEL_PX + 4, y, SHAFT_PX - 8, FLOOR_PX - 4, door)
    x = LABEL_PX + SHAFT_PX + 6
    arrow = f'<text class="arrow" x="{x}" y="{y + 14}">{_arrow(state.motion_state)}</text>'
    if left is None or left == place:
        return car + arrow
    by = FLOOR_PX * (left - place)
    return f'<g class="moves" style="--from:{by:g}px">{car}{arrow}</g>'


def floors_of(state: d.LiftState) -> list[str]:
    """Return the landings from the top down, because RMF lists the landings from the bottom up. Return
    [] if there are too many."""
    floors = list(dict.fromkeys(state.available_floors))
    return floors[::-1] if len(floors) <= MOST_FLOORS else []


def _arrow(motion: int) -> str:
    return next((sign for known, sign in ARROWS.items() if known == motion), "")


def _short(text: str) -> str:
    return text if len(text) <= 6 else f"{text[:2]}…{text[-3:]}"


def _leaves(x: float, y: float, width: float, height: float, door: str) -> str:
    """Draw a car or doorway with two leaves. The leaves are apart, together, or halfway. If the door's
    state is unknown, hatch the leaves."""
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
    """Draw a table of the robots that fleet states list."""
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
    old = now - robot.heard.at > ROBOT_SILENT_S
    since = f" (OLD: silent since {when(robot.heard.wall)})" if old else ""
    cells = (
        _told(words.printable(f"{robot.fleet}/{state.name}")),
        _told(words.plain(d.RobotModeValue, state.mode.mode)) + since,
        _told(words.printable(state.location.level_name) or "?"),
        f"{max(0.0, min(100.0, state.battery_percent)):.0f} %",
    )
    inner = "".join(f"<td>{cell}</td>" for cell in cells)
    return f"<tr{OLD if old else ''}>{inner}</tr>"
