"""deb/sbom.py lists the libraries of a package. It refuses a library whose licence has no text."""

import json
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
SBOM = ROOT / "deb/sbom.py"


def library(site: Path, name: str, *metadata: str, licence: str = "") -> None:
    about = site / f"{name}-1.0.dist-info"
    about.mkdir(parents=True)
    lines = "".join(f"{line}\n" for line in metadata)
    (about / "METADATA").write_text(f"Metadata-Version: 2.4\nName: {name}\nVersion: 1.0\n{lines}\n")
    (about / "RECORD").write_text(f"{about.name}/METADATA,,\n")
    if licence:
        (about / licence).parent.mkdir(exist_ok=True)
        (about / licence).write_text("Do as you like.\n")


def written(site: Path, *more: str) -> dict[str, Any]:
    out = site.parent / "sbom.cdx.json"
    words = [sys.executable, "-W", "error", str(SBOM), "rmf-bridges", "1.2.3", "arm64", str(site)]
    subprocess.run([*words, "--epoch", "1700000000", "--out", str(out), *more], check=True)
    found: dict[str, Any] = json.loads(out.read_text())
    return found


def test_each_library_is_listed_with_its_version_licence_and_package_url(tmp_path: Path) -> None:
    site = tmp_path / "site"
    library(site, "rmf_bridges", "License-Expression: Apache-2.0")
    library(site, "one", "License-Expression: MIT", licence="licenses/LICENSE")
    library(site, "two", "License: BSD License", licence="COPYING")
    bom = written(site, "--with", "mkdocs-material")
    theme = version("mkdocs-material")
    assert [
        (part["name"], part["version"], part["purl"], part.get("licenses"))
        for part in bom["components"]
    ] == [
        (
            "mkdocs-material",
            theme,
            f"pkg:pypi/mkdocs-material@{theme}",
            [{"license": {"id": "MIT"}}],
        ),
        ("one", "1.0", "pkg:pypi/one@1.0", [{"license": {"id": "MIT"}}]),
        ("two", "1.0", "pkg:pypi/two@1.0", [{"license": {"name": "BSD License"}}]),
    ]
    assert bom["bomFormat"] == "CycloneDX"
    assert "pkg:deb/rmf-bridges@1.2.3?arch=arm64" in json.dumps(bom["metadata"])


def test_the_same_libraries_give_the_same_bytes(tmp_path: Path) -> None:
    library(tmp_path / "site", "one", "License: MIT", licence="LICENSE")
    first = json.dumps(written(tmp_path / "site"))
    assert json.dumps(written(tmp_path / "site")) == first
    assert "2023-11-14T22:13:20" in first


def test_a_library_without_its_licence_ends_the_build(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    library(tmp_path / "site", "silent", "License-Expression: MIT")
    with pytest.raises(subprocess.CalledProcessError):
        written(tmp_path / "site")
    assert capfd.readouterr().err == "no licence text in deb/licences/ for silent\n"


def test_a_library_whose_licence_has_no_name_ends_the_build(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    library(tmp_path / "site", "Silent_Two", licence="LICENSE")
    with pytest.raises(subprocess.CalledProcessError):
        written(tmp_path / "site")
    assert capfd.readouterr().err == "deb/licences/ needs silent-two.spdx\n"


@pytest.mark.parametrize(
    ("name", "licence", "holder"),
    [("mcap", "MIT", "Foxglove Technologies Inc"), ("pyserial", "BSD-3-Clause", "Chris Liechti")],
)
def test_missing_licence_texts_of_a_wheel_come_from_our_files(
    tmp_path: Path, name: str, licence: str, holder: str
) -> None:
    site = tmp_path / "site"
    library(site, name)
    (part,) = written(site)["components"]
    assert part["licenses"] == [{"license": {"id": licence}}]
    text = (site / f"{name}-1.0.dist-info/licenses/LICENSE.txt").read_text()
    assert f"Copyright (c) {'2001-2020 ' if name == 'pyserial' else ''}{holder}" in text
