"""The Config that the daemon gets from a correct file."""

from pathlib import Path
from typing import Any

import msgspec
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from bridges.kinds.shared.rmf_section import Rmf
from bridges.settings import names as named
from bridges.settings.load import Config, Problem, load
from drivers.hal.points import Wire
from tests.depth import examples
from tests.settings.reading import RIGHT, changed, config_of

GATE = {
    "lanes": ["in", "out"],
    "inputs": {
        "opened": {"point": "A0", "active": "high", "pull": "up"},
        "closed": {"point": "1A", "active": "low", "pull": "down", "debounce_s": 0.01},
    },
    "outputs": {"hold": {"point": "A2", "active": "high"}},
    "codes": {1: "in", 2: "out"},
    "limits": {"open_s": 3, "tries": 2},
}
OPENED = Wire("opened", "in", "A0", "high", "up", None, ("inputs", "opened"))
CLOSED = Wire("closed", "in", "1A", "low", "down", 0.01, ("inputs", "closed"))
HOLD = Wire("hold", "out", "A2", "high", path=("outputs", "hold"))


def gate(raw: Any) -> Any:
    return msgspec.convert(raw, named.driver_called("gate", "contact").settings, str_keys=True)


def test_a_correct_file_becomes_a_config(file: Path) -> None:
    assert config_of(file, RIGHT) == Config(
        path=file,
        text=RIGHT.encode(),
        kind="gate",
        driver="contact",
        rmf=Rmf(transport="dds", domain_id=7),
        buses={"header": named.bus_called("pins").settings()},
        devices={"north": gate(GATE)},
        bus_types={"header": "pins"},
    )


def test_a_path_may_be_a_text(file: Path) -> None:
    assert config_of(file, RIGHT) == load(str(file))


def test_a_config_knows_the_bus_and_the_wires_of_a_device(file: Path) -> None:
    config = config_of(file, RIGHT)
    assert config.bus_of("north") == "header"
    assert config.wires("north") == [OPENED, CLOSED, HOLD]


def test_a_driver_without_a_table_has_no_wires(file: Path) -> None:
    text = "kind: gate\ndriver: web\nbuses: {s: {type: web, host: h}}\ngates: {north: {}}\n"
    assert config_of(file, text).wires("north") == []


def test_a_legal_but_unlikely_setting_is_kept_as_a_warning(file: Path) -> None:
    text = changed("    limits:", "    accept_unsafe: {hold: the door is light}\n    limits:")
    text = changed("tries: 2", "loud: true", text)
    assert config_of(file, text).warnings == (
        Problem(
            str(file),
            15,
            21,
            "warning: 'north': unsafe wiring of 'hold' is accepted: the door is light",
        ),
        Problem(str(file), 16, 31, "warning: 'north': it will be loud"),
    )


NAMES = st.text(min_size=1, max_size=8).filter(
    lambda t: t == t.strip() and t.isprintable() and t.isascii()
)
SECONDS = st.one_of(st.integers(1, 60), st.floats(0.1, 60))
INPUTS = st.fixed_dictionaries(
    {"active": st.sampled_from(["high", "low"]), "pull": st.sampled_from(["up", "down", "none"])},
    optional={"debounce_s": st.floats(0, 10)},
)
LANES = st.dictionaries(
    NAMES,
    st.fixed_dictionaries(
        {}, optional={"side": st.sampled_from(["left", "right"]), "heights": st.just([1.5, 2])}
    ),
    min_size=1,
)
LIMITS = st.fixed_dictionaries(
    {},
    optional={
        "open_s": SECONDS,
        "close_s": st.none(),
        "tries": st.integers(1, 10**17),
        "even": st.integers(-99, 99).map(lambda n: 2 * n),
        "gain": st.floats(allow_nan=False, allow_infinity=False),
        "loud": st.booleans(),
        "baud": st.sampled_from([9600, 19200]),
        "label": st.one_of(st.integers(-9, 9), st.from_regex("^[a-z]+$", fullmatch=True)),
    },
)


@st.composite
def gates(draw: st.DrawFn) -> dict[str, Any]:
    """Draw the raw values of a correct gate."""
    names = draw(st.lists(NAMES, unique=True, max_size=9))
    lanes = draw(st.one_of(LANES, st.lists(NAMES, min_size=1)))
    lane = st.sampled_from(list(lanes))
    return {
        "lanes": lanes,
        "inputs": {name: draw(INPUTS) | {"point": f"A{i}"} for i, name in enumerate(names)},
        "codes": draw(st.dictionaries(st.integers(0, 15), lane)),
        "limits": draw(LIMITS),
    }


class Quoting(yaml.SafeDumper):
    """A YAML writer like PyYAML's, except that it quotes every string and each key."""


Quoting.add_representer(
    str, lambda dumper, text: dumper.represent_scalar("tag:yaml.org,2002:str", text, style='"')
)


@pytest.mark.parametrize("flow", [True, False])
def test_every_correct_file_gives_the_same_structs_as_msgspec(file: Path, flow: bool) -> None:
    @settings(max_examples=examples(60))
    @given(st.dictionaries(NAMES, gates(), min_size=1, max_size=1))
    def check(devices: dict[str, Any]) -> None:
        raw = {"kind": "gate", "driver": "contact", "buses": {"b": {"type": "pins"}}}
        text = yaml.dump(
            {**raw, "gates": devices}, Dumper=Quoting, default_flow_style=flow, allow_unicode=True
        )
        config = config_of(file, text)
        assert config.devices == {name: gate(value) for name, value in devices.items()}
        assert [gate(msgspec.to_builtins(d)) for d in config.devices.values()] == list(
            config.devices.values()
        )

    check()
