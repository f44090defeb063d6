"""The `http` bus in a YAML file: good addresses, and the problems that `check` finds in bad
addresses."""

import msgspec
import pytest

from drivers.hal.http import Base, HttpSettings, base, warnings


@pytest.mark.parametrize(
    ("text", "parts", "url"),
    [
        ("192.168.1.60", Base("192.168.1.60", 80, ""), "http://192.168.1.60/state"),
        ("192.168.1.60/", Base("192.168.1.60", 80, ""), "http://192.168.1.60/state"),
        ("http://tpu-3.local:8080/api/v1/", Base("tpu-3.local", 8080, "/api/v1"), None),
        ("https://tpu", Base("tpu", 443, "", "https"), "https://tpu/state"),
        ("https://tpu:80", Base("tpu", 80, "", "https"), "https://tpu:80/state"),
        ("[fe80::1]:81/api", Base("fe80::1", 81, "/api"), "http://[fe80::1]:81/api/state"),
    ],
)
def test_an_address_is_host_port_and_path(text: str, parts: Base, url: str | None) -> None:
    assert base(text) == parts
    assert base(text).url("/state") == (url or "http://tpu-3.local:8080/api/v1/state")


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("ftps://tpu/api", "is not the address of an API"),
        ("admin:secret@tpu/api", "token_file"),
        ("tpu:99999", "ports are 1 to 65535"),
        ("tpu:0", "ports are 1 to 65535"),
        ("tpu/api?x=1", "is not the address of an API"),
        ("tpu/a b", "is not the address of an API"),
        ("ftp://tpu", "is not the address of an API"),
        ("-tpu", "is not the address of an API"),
        ("tpu\n", "is not the address of an API"),
        ("", "is not the address of an API"),
    ],
)
def test_a_text_that_is_not_an_address_is_refused_with_its_fix(text: str, hint: str) -> None:
    with pytest.raises(ValueError, match=hint):
        base(text)


def test_a_wrong_address_is_a_problem_of_the_settings() -> None:
    [(path, text)] = HttpSettings(api_base="tpu:0").problems()
    assert path == ("api_base",)
    assert text == "port 0 does not exist: ports are 1 to 65535"
    assert list(HttpSettings(api_base="tpu").problems()) == []


def test_the_default_timeout_and_scan_are_a_second() -> None:
    made = msgspec.convert({"type": "http", "api_base": "tpu"}, HttpSettings)
    assert made == HttpSettings(api_base="tpu", timeout_s=1.0, scan_s=1.0, token_file=None)


def test_a_setting_without_effect_is_refused() -> None:
    made = HttpSettings(api_base="tpu", ca_file="/etc/ca.pem", token_header="X-API-Key")
    assert list(made.problems()) == [
        (
            ("ca_file",),
            "has no effect without https: let api_base begin with https://, or delete ca_file",
        ),
        (("token_header",), "needs token_file, which names the file with the header's value"),
    ]


def test_a_token_that_everybody_can_read_on_the_way_is_warned_of() -> None:
    plain, tls = (
        HttpSettings(api_base=f"{way}://tpu", token_file="t") for way in ("http", "https")
    )
    assert [path for path, _ in warnings(plain)] == [("token_file",)]
    assert list(warnings(tls)) == []
