"""The colours and patterns of each tone, in the light and the dark theme. A tone is the meaning of a
span in a timeline.

The colours are safe for colour-blind readers, and come from Okabe and Ito
(https://jfly.uni-koeln.de/color/). Colour alone never tells two tones apart. Each span has a label, and
the tones wrong, unknown and requested also have a pattern.
"""

from dataclasses import dataclass
from typing import Final, Literal

from workbench.explain.timeline import Tone

Theme = Literal["light", "dark"]
TONES: Final[tuple[Tone, ...]] = ("calm", "works", "open", "held", "asks", "wrong", "unknown")
MEANING: Final[dict[Tone, str]] = {
    "calm": "at rest",
    "works": "moves or is on",
    "open": "open",
    "held": "has a session",
    "asks": "is asked for",
    "wrong": "fault or hazard",
    "unknown": "not known",
}


@dataclass(frozen=True, slots=True)
class ToneStyle:
    """The colours of a tone in one theme. `text` is the colour of text on the fill. `pattern` is the
    colour of the pattern's lines over the fill, or "" without a pattern."""

    fill: str
    text: str
    pattern: str = ""


LIGHT: Final[dict[Tone, ToneStyle]] = {
    "calm": ToneStyle("#dcdfe3", "#1b1d21"),
    "works": ToneStyle("#8fcdf2", "#10181d"),
    "open": ToneStyle("#4fc3a1", "#0c1a15"),
    "held": ToneStyle("#f3bf4a", "#1d1604"),
    "asks": ToneStyle("#f7f0b0", "#1d1b04", "#a89a1c"),
    "wrong": ToneStyle("#e8854a", "#1d0d04", "#f7c3a1"),
    "unknown": ToneStyle("#ffffff", "#3a3e45", "#b4b9c1"),
}
DARK: Final[dict[Tone, ToneStyle]] = {
    "calm": ToneStyle("#474c55", "#f2f4f7"),
    "works": ToneStyle("#236f9d", "#ffffff"),
    "open": ToneStyle("#0a8463", "#ffffff"),
    "held": ToneStyle("#c68a12", "#140e00"),
    "asks": ToneStyle("#4a450f", "#fffbd1", "#77701c"),
    "wrong": ToneStyle("#7c3206", "#ffffff", "#b4500f"),
    "unknown": ToneStyle("#17191d", "#dfe3e9", "#5a606a"),
}
LOOKS: Final[dict[Theme, dict[Tone, ToneStyle]]] = {"light": LIGHT, "dark": DARK}
PAPER: Final[dict[Theme, tuple[str, str, str, str]]] = {
    "light": ("#ffffff", "#1b1d21", "#5b616b", "#d3d7dd"),
    "dark": ("#17191d", "#eceff3", "#a7adb8", "#363b44"),
}
"""Colours of the background, the text, the weaker text and the grid, in this order."""
STEP: Final[dict[Theme, str]] = {"light": "#b54a12", "dark": "#e8854a"}
"""Colour of a vertical line. The line marks a step of the clock, or the moment for which a recording
was kept."""


def css(theme: Theme) -> str:
    """Return the CSS rules of one theme."""
    back, text, weak, grid = PAPER[theme]
    rules = [
        f".paper{{fill:{back}}}",
        f".ink{{fill:{text}}}",
        f".weak{{fill:{weak}}}",
        f".grid{{stroke:{grid};stroke-width:1}}",
        f".edge{{stroke:{weak}}}",
        f".step{{stroke:{STEP[theme]};stroke-width:1.5;stroke-dasharray:4 3}}",
    ]
    for tone, look in LOOKS[theme].items():
        halo = f";stroke:{look.fill};stroke-width:4;paint-order:stroke" if look.pattern else ""
        rules += [f".f-{tone}{{fill:{look.fill}}}", f".t-{tone}{{fill:{look.text}{halo}}}"]
        if look.pattern:
            rules.append(f".p-{tone}{{stroke:{look.pattern};fill:none}}")
    return "".join(rules)


def style(theme: Theme | None) -> str:
    """Return the style sheet of one theme. With None, return both themes, so that the reader's screen
    setting selects one."""
    if theme is not None:
        return css(theme)
    return f"{css('light')}@media (prefers-color-scheme: dark){{{css('dark')}}}"
