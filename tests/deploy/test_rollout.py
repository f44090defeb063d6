"""The Ansible collection. The tests check its rules, the order of its steps, and its syntax.

`make test-rollout` rolls out to machines.
"""

import importlib.util
import json
import operator
import os
import re
import shlex
import shutil
import subprocess
import sys
from hashlib import sha256
from pathlib import Path
from typing import Any, Final

import jinja2
import pytest
import yaml

from bridges import cli
from bridges.kinds import kind_names
from bridges.settings.load import load
from workbench.commissioning.doctor.finding import ok
from workbench.commissioning.doctor.form import form
from workbench.commissioning.doctor.machine import Machine

COLLECTION: Final = Path(__file__).parents[2] / "deploy/ansible"
_spec = importlib.util.spec_from_file_location("rollout", COLLECTION / "plugins/filter/rollout.py")
assert _spec
assert _spec.loader
rollout: Any = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(rollout)

YAML: Final = b"kind: lift\n"
KILLED: Final = (
    "Lift1 door_open was on, and the guard switched the output off; this was verified after 0.2 s"
)
FORM: Final = f"""\
# lift.yaml on Raspberry Pi 4
2026-11-24 08:10, rmf-bridges 0.1.0, kernel 6.12, Python 3.13.5, buses: gpio

YAML: sha256 {sha256(YAML).hexdigest()}

| subject | | found by `doctor` |
|---|---|---|
| file | ok | lift.yaml is a valid file of a lift |
| kill test | ok | {KILLED} |
"""


def test_a_kill_test_that_went_well_is_accepted() -> None:
    assert rollout.rmf_untested(FORM, "machines/pi-lift1/lift.yaml", YAML) == ""


def test_a_form_older_than_its_yaml_is_refused() -> None:
    why = rollout.rmf_untested(FORM, "machines/pi-lift1/lift.yaml", YAML + b"# a new wire\n")
    assert why == "lift.yaml: the form was made for an earlier version of this file"


def test_the_doctors_form_is_a_record_of_its_yaml(tmp_path: Path) -> None:
    shipped = load(COLLECTION.parents[1] / "config/lift_dry_contact.yaml")
    killed = ok("kill test", "Lift1 door_open was on, and is verified off")
    made = form(shipped, [killed], Machine(tmp_path))
    assert rollout.rmf_untested(made, str(shipped.path), shipped.text) == ""


@pytest.mark.parametrize(
    ("version", "system", "full"),
    [
        ("0.1.0", "debian 12", "0.1.0+deb12"),
        ("0.1.0+r9.gabc", "raspbian 13", "0.1.0+r9.gabc+deb13"),
        ("0.1.0", "ubuntu 24.04", "0.1.0+ubuntu24.04"),
        ("0.1.0+deb13", "debian 13", "0.1.0+deb13"),
    ],
)
def test_each_machine_takes_the_package_of_its_own_system(
    version: str, system: str, full: str
) -> None:
    assert rollout.rmf_full_version(version, system) == full


@pytest.mark.parametrize(
    ("record", "why"),
    [
        ("", "there is no form"),
        (FORM.replace("# lift.yaml", "# door.yaml"), "about another file"),
        (FORM.replace("kill test | ok", "kill test | wrong"), "the kill test failed"),
        ("".join(FORM.splitlines(True)[:-1]), "has no kill test"),
        (
            FORM
            + "| kill test | wrong | Lift1 door_open is not verified off 15 s after kill -9 |\n",
            "the kill test failed",
        ),
        (
            FORM[: FORM.index("Lift1 door")] + "the kernel released the line at once |\n",
            "no kill test",
        ),
    ],
)
def test_another_form_is_refused(record: str, why: str) -> None:
    assert why in rollout.rmf_untested(record, "machines/pi-lift1/lift.yaml", YAML)


def status(name: str = "lift", state: str = "serving", level: int = 0) -> dict[str, Any]:
    faults = [{"code": "stale", "detail": ""}] if level else []
    devices = {"Lift1": {"faults": faults}}
    return {"name": name, "state": state, "level": level, "status": {"devices": devices}}


@pytest.mark.parametrize(
    ("after", "before", "why"),
    [
        ([status()], [status()], []),
        ([status(level=1)], [status(level=1)], []),
        ([status()], [], []),
        ([], [status()], ["lift: there is no such daemon"]),
        ([status(state="failed", level=2)], [status(state="failed", level=2)], ["lift: failed"]),
        ([status(level=1)], [status()], ["lift: a fault that was not there before: stale"]),
        ([status(level=1)], [], ["lift: a fault that was not there before: stale"]),
    ],
)
def test_a_machine_is_back_if_each_wanted_daemon_serves_as_before(
    after: list[Any], before: list[Any], why: list[str]
) -> None:
    assert rollout.rmf_not_back(json.dumps(after), before, ["lift"]) == why


def test_a_machine_without_an_answer_is_not_back() -> None:
    assert rollout.rmf_not_back("", [], ["lift"]) == ["rmf-bridge status gives no answer"]


def test_every_kind_has_a_role_and_needs_a_kill_test_if_it_has_outputs() -> None:
    assert set(kind_names()) == rollout.SERVED


BROKEN: Final = {
    "misspelt": "kind: lfit\n",
    "no_value": "kind:\n",
    "no_word": "kind: [lift]\n",
    "other_key": "knid: lift\nbuses: {}\n",
    "unparsable": "kind: lift\nlifts: {\n",
    "two_texts": "kind: lift\n---\nkind: door\n",
    "empty": "",
    "text": "lift\n",
}
"""Device YAMLs that no service can run. `rmf-bridge check` refuses them, so they must reach it."""


def test_a_folder_is_sorted_by_kind(tmp_path: Path) -> None:
    for kind in ("lift", "alarm", "door_supervisor"):
        (tmp_path / f"{kind}.yaml").write_text(f"kind: {kind}\n")
    (tmp_path / "profile.yaml").write_text("registers: {}\n")
    for name, text in BROKEN.items():
        (tmp_path / f"{name}.yaml").write_text(text)

    def names(files: list[str]) -> list[str]:
        return [Path(file).stem for file in files]

    served = ["alarm", "door_supervisor", "lift"]
    assert names(rollout.rmf_files(str(tmp_path))) == sorted([*served, *BROKEN])
    assert names(rollout.rmf_files(str(tmp_path), "daemon")) == ["alarm", "lift"]
    assert names(rollout.rmf_files(str(tmp_path), "supervisors")) == ["door_supervisor"]
    assert names(rollout.rmf_files(str(tmp_path), "outputs")) == ["lift"]
    assert names(rollout.rmf_beside(str(tmp_path))) == ["profile"]
    assert "there is no form" in rollout.rmf_untested_file(str(tmp_path / "lift.yaml"))


def test_check_refuses_each_broken_file_and_no_role_copies_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, text in BROKEN.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    for file in rollout.rmf_files(str(tmp_path)):
        assert cli.main(["check", "-q", file]) == os.EX_CONFIG
        assert file in capsys.readouterr().err
    assert rollout.rmf_beside(str(tmp_path)) == []
    assert [rollout.rmf_files(str(tmp_path), role) for role in rollout.ROLES] == [[], [], []]


@pytest.mark.parametrize("name", ["lift.yml", "lift.YAML"])
def test_a_file_with_a_name_that_no_service_has_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("kind: lift\n")
    for sort in (rollout.rmf_files, rollout.rmf_beside):
        with pytest.raises(ValueError, match=f"{name}: a service's file ends with .yaml"):
            sort(str(tmp_path))


def test_every_shipped_profile_and_map_is_beside_and_every_device_yaml_is_none() -> None:
    top = COLLECTION.parents[1]
    assert len(rollout.rmf_beside(str(top / "drivers/profiles"))) > 3
    beside = [Path(file).name for file in rollout.rmf_beside(str(top / "config"))]
    assert beside == ["fleet_tiny.yaml", "fleet_tiny_graph.yaml"]


def test_one_machine_is_changed_at_a_time_after_all_were_looked_at() -> None:
    look, change = yaml.safe_load((COLLECTION / "playbooks/rollout.yml").read_text())
    assert (look["any_errors_fatal"], change["any_errors_fatal"]) == (True, True)
    assert ("serial" in look, change["serial"]) == (False, 1)
    assert change["tasks"][0]["when"] == "not ansible_check_mode"


def test_nothing_is_changed_before_the_devices_are_idle_and_the_old_version_is_kept() -> None:
    tasks = yaml.safe_load((COLLECTION / "playbooks/tasks/change.yml").read_text())
    names = [task["name"] for task in tasks]
    assert names.index("Keep the old version and the old configuration") < len(tasks) - 2
    idle, change = tasks[-2:]
    assert idle["ansible.builtin.command"]["argv"] == ["rmf-bridge", "status", "--idle"]
    assert "failed_when" not in idle  # the rollout ends when the last try fails
    assert change["block"][0]["ignore_unreachable"]  # else `rescue` would be passed over
    assert [*change["rescue"][-1]] == ["name", "ansible.builtin.fail"]
    assert change["rescue"][-2]["ansible.builtin.include_tasks"] == "put_back.yml"


def script(file: str, name: str, root: Path) -> str:
    """Return the shell script of a task, for a machine whose root is this folder."""
    tasks = yaml.safe_load((COLLECTION / "playbooks/tasks" / file).read_text())
    text = str(*(task["ansible.builtin.shell"] for task in tasks if task["name"] == name))
    text = text.replace("{{ rmf_served | map('quote') | join(' ') }}", "ward")
    text = text.replace("{{ rmf_old.stdout }}", "0.1.0").replace("tar -C / ", f"tar -C {root} ")
    return in_root(text, root)


def in_root(text: str, root: Path) -> str:
    """Return a shell script with this folder as the root of its files."""
    for folder in ("/etc/", "/var/", "/run/"):
        text = re.sub(rf"(?<![\w$/]){folder}", f"{root}{folder}", text)
    return text


@pytest.mark.parametrize("mode", [0o600, 0o644])
def test_each_old_file_comes_back_even_a_secret_and_only_new_services_are_removed(
    tmp_path: Path, mode: int
) -> None:
    root, programs = tmp_path / "root", tmp_path / "bin"
    config, new = root / "etc/rmf-bridges", root / "run/rmf-bridges-rollout"
    for folder in (programs, config, new, root / "var/backups"):
        folder.mkdir(parents=True)
    for name in ("systemctl", "apt-get", "dpkg", "dpkg-query", "timeout", "rmf-bridge"):
        (programs / name).write_text(f'#!/bin/sh\necho "{name} $*" >> {tmp_path}/calls\n')
        (programs / name).chmod(0o755)
    with (programs / "rmf-bridge").open("a") as out:
        out.write(
            'if [ "$1" = backup ]; then exit 65; fi\nif [ "$1" = status ]; then echo []; fi\n'
        )
    (config / "ward.yaml").write_text("old")
    (config / "ward.yaml").chmod(mode)

    def run(file: str, name: str) -> None:
        env = os.environ | {"PATH": f"{programs}:{os.environ['PATH']}"}
        words = ["sh", "-c", script(file, name, root)]
        done = subprocess.run(words, env=env, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr

    run("change.yml", "Keep the old version and the old configuration")
    kept = root / "var/backups/rmf-bridges-rollout/files.tar.gz"
    assert kept.stat().st_mode & 0o777 == 0o600
    (tmp_path / "calls").unlink()
    for name in ("ward", "lab"):  # `lab` is a new service
        for folder in (config, new):
            (folder / f"{name}.yaml").write_text("new")
    run("put_back.yml", "Put the old files and packages back")
    assert {path.name: path.read_text() for path in config.iterdir()} == {"ward.yaml": "old"}
    assert (config / "ward.yaml").stat().st_mode & 0o777 == mode
    calls = (tmp_path / "calls").read_text().splitlines()
    assert [one for one in calls if one.startswith("rmf-bridge ")] == [
        "rmf-bridge disable lab",
        f"rmf-bridge enable {config}/ward.yaml",
    ]


@pytest.mark.parametrize(
    ("yaml_changed", "beside_changed", "enabled"),
    [(False, False, False), (True, False, True), (False, True, True)],
)
def test_a_service_starts_again_if_its_file_or_a_file_beside_it_has_changed(
    tmp_path: Path, yaml_changed: bool, beside_changed: bool, enabled: bool
) -> None:
    tasks = yaml.safe_load((COLLECTION / "roles/daemon/tasks/services.yml").read_text())
    _, copied, enable = tasks
    jinja = jinja2.Environment()
    jinja.filters.update(basename=os.path.basename, splitext=os.path.splitext, quote=shlex.quote)
    jinja.tests["changed"] = operator.truth
    given = {"item": "machines/pi/ward.yaml", copied["register"]: beside_changed}
    text = in_root(jinja.from_string(enable["ansible.builtin.shell"]).render(given), tmp_path)
    programs = tmp_path / "bin"
    for folder in (programs, tmp_path / "etc/rmf-bridges", tmp_path / "run/rmf-bridges-rollout"):
        folder.mkdir(parents=True)
    for name in ("systemctl", "rmf-bridge"):
        (programs / name).symlink_to(shutil.which("true") or "")
    (tmp_path / "etc/rmf-bridges/ward.yaml").write_text("old")
    new = tmp_path / "run/rmf-bridges-rollout/ward.yaml"
    new.write_text("new" if yaml_changed else "old")
    env = os.environ | {"PATH": f"{programs}:{os.environ['PATH']}"}
    done = subprocess.run(["sh", "-c", text], env=env, capture_output=True, text=True)
    assert (done.returncode, done.stderr, done.stdout) == (0, "", "enabled\n" if enabled else "")


def test_a_rollout_proves_the_files_beside_the_device_yamls_too() -> None:
    change = yaml.safe_load((COLLECTION / "playbooks/tasks/change.yml").read_text())[-1]
    (prove,) = [
        task["vars"]
        for task in change["block"][0]["block"]
        if task.get("ansible.builtin.include_tasks") == "prove.yml"
    ]
    assert prove["proved_files"] == "{{ rmf_files + rmf_beside }}"


def test_ansible_reads_the_playbook(tmp_path: Path) -> None:
    home = tmp_path / "ansible_collections/rmf_bridges"
    home.mkdir(parents=True)
    (home / "site").symlink_to(COLLECTION)
    program = Path(sys.executable).with_name("ansible-playbook")
    env = {"ANSIBLE_COLLECTIONS_PATH": str(tmp_path), "ANSIBLE_HOME": str(tmp_path / "home")}
    words = [str(program), "--syntax-check", "-i", "pi-lift1,", "rmf_bridges.site.rollout"]
    done = subprocess.run(words, env=os.environ | env, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
