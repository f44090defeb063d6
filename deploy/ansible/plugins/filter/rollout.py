"""The rules of the rollout. They are pure functions, whose inputs are files, texts and the output of
`rmf-bridge status --json`."""

import json
import re
from collections.abc import Callable, Iterable, Mapping
from hashlib import sha256
from pathlib import Path, PurePath
from typing import Any, Final

import yaml

DEVICES: Final = frozenset({"lift", "door", "charger", "dispenser", "ingestor"})
"""Kinds with outputs. Each device of such a kind needs the record of a kill test."""
NO_OUTPUTS: Final = frozenset({"alarm", "fleet"})
SUPERVISORS: Final = frozenset({"lift_supervisor", "door_supervisor", "charger_coordinator"})
SERVED: Final = DEVICES | NO_OUTPUTS | SUPERVISORS
TOP: Final = frozenset({"kind", "driver", "buses", "rmf"})
"""Keys at the top of a device YAML. No profile and no map has one."""
SUFFIXES: Final = (".yaml", ".yml")
NAMED: Final = re.compile(r"\+(deb|ubuntu)[0-9.]+$")
ROLES: Final = {"daemon": DEVICES | NO_OUTPUTS, "supervisors": SUPERVISORS, "outputs": DEVICES}


def rmf_kind(text: str) -> str | None:
    """Return the kind of a YAML, which may be no kind of ours. Return None for a profile, a map or
    another file that no service runs.

    Return "" if the kind is missing although this seems to be a device YAML, and if the text is no
    mapping. `rmf-bridge check` refuses such a file, so the rollout does not copy it.
    """
    try:
        content = yaml.safe_load(text)
    except yaml.YAMLError:
        return ""
    if not isinstance(content, dict):
        return ""
    return None if TOP.isdisjoint(content) else str(content.get("kind", ""))


def rmf_files(folder: str, role: str = "") -> list[str]:
    """Return the YAMLs in this folder for which this Ansible role makes a service. If no role is given,
    return every YAML that is no profile or map: `rmf-bridge check` must accept each of them."""
    return [
        str(file)
        for file, kind in _yamls(folder)
        if (kind in ROLES[role] if role else kind is not None)
    ]


def rmf_beside(folder: str) -> list[str]:
    """Return the YAMLs in this folder that have no service, which are profiles and maps."""
    return [str(file) for file, kind in _yamls(folder) if kind is None]


def _yamls(folder: str) -> list[tuple[Path, str | None]]:
    """Return each YAML with its kind. Raises ValueError for a name that would be passed over."""
    found = sorted(file for file in Path(folder).glob("*") if file.suffix.lower() in SUFFIXES)
    for file in found:
        if file.suffix != ".yaml":
            raise ValueError(f"{file}: a service's file ends with .yaml: rename it")
    return [(file, rmf_kind(file.read_text("utf-8", "replace"))) for file in found]


def rmf_untested(form: str, file: str, content: bytes) -> str:
    """Return the reason why this form does not prove a successful kill test of this YAML; "" if it
    does.

    `form`: the text that `rmf-bridge doctor FILE --kill-test --form FORM` writes. `content`: the YAML's
    bytes. The form must have their hash.
    """
    name = PurePath(file).name
    if not form.strip():
        return f"{name}: there is no form"
    if not form.startswith(f"# {name} on "):
        return f"{name}: the form is about another file: {form.splitlines()[0]}"
    if f"YAML: sha256 {sha256(content).hexdigest()}" not in form.splitlines():
        return f"{name}: the form was made for an earlier version of this file"
    rows = [row.split("|") for row in form.splitlines() if row.startswith("| kill test |")]
    levels = [row[2].strip() for row in rows]
    if "wrong" in levels:
        return f"{name}: the kill test failed"
    if not any("verified" in row[3] for row in rows if row[2].strip() == "ok"):
        return f"{name}: the form has no kill test"
    return ""


def rmf_not_back(
    after: str, before: Iterable[Mapping[str, Any]], wanted: Iterable[str]
) -> list[str]:
    """Return the reasons why a machine does not work as before the change. Return [] if every wanted
    daemon serves.

    `after`: the present output of `rmf-bridge status --json`. `before`: the parsed output before the
    change. `wanted`: names of services. A fault that a daemon had before does not count, because the
    change is not its cause.
    """
    try:
        now = {one["name"]: one for one in json.loads(after)}
    except ValueError:
        return ["rmf-bridge status gives no answer"]
    levels = {one["name"]: one["level"] for one in before}
    return [why for name in sorted(set(wanted)) if (why := _why(name, now.get(name), levels))]


def rmf_untested_file(file: str) -> str:
    """Return the reason why the form beside this YAML (NAME.md) does not prove a kill test. Return ""
    if it does."""
    form = Path(file).with_suffix(".md")
    text = form.read_text("utf-8") if form.exists() else ""
    return rmf_untested(text, file, Path(file).read_bytes())


def rmf_full_version(version: str, system: str) -> str:
    """Return the version of the packages for this machine. For example, `0.1.0` on `debian 13` becomes
    `0.1.0+deb13`.

    `system`: ID and VERSION_ID of /etc/os-release. A version that already names a system is returned
    unchanged.
    """
    name, _, number = system.strip().partition(" ")
    known = {"debian": "deb", "raspbian": "deb"}
    return version if NAMED.search(version) else f"{version}+{known.get(name, name)}{number}"


def _why(name: str, now: Mapping[str, Any] | None, levels: Mapping[str, int]) -> str:
    if now is None:
        return f"{name}: there is no such daemon"
    if now["state"] != "serving":
        return f"{name}: {now['state']}"
    if now["level"] > levels.get(name, 0):
        parts = (now["status"], *now["status"].get("devices", {}).values())
        faults = [fault["code"] for part in parts for fault in part.get("faults", ())]
        return f"{name}: a fault that was not there before: {', '.join(faults)}"
    return ""


class FilterModule:
    """The filters that Ansible finds."""

    def filters(self) -> dict[str, Callable[..., Any]]:
        """Return filter name -> function."""
        return {
            "rmf_files": rmf_files,
            "rmf_beside": rmf_beside,
            "rmf_untested_file": rmf_untested_file,
            "rmf_full_version": rmf_full_version,
            "rmf_not_back": rmf_not_back,
        }
