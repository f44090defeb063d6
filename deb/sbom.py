"""Writes a package's bill of materials (CycloneDX JSON): python deb/sbom.py --help.

The components are the distributions in the package's folders. If a library's wheel has no licence text,
the text is taken from deb/licences/. If it is not there either, or nothing names the licence, the build
fails.
"""

import argparse
import datetime
import shutil
import sys
import uuid
from collections.abc import Iterator
from importlib.metadata import Distribution, distribution, distributions
from pathlib import Path

from cyclonedx.contrib.license.factories import LicenseFactory
from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.model.license import License
from cyclonedx.output.json import JsonV1Dot6
from packageurl import PackageURL
from packaging.utils import canonicalize_name

OURS = "rmf-bridges"
LICENCES = Path(__file__).parent / "licences"
TEXTS = ("*LICEN[CS]E*", "*COPYING*", "licen[cs]es/**/*", "COPYRIGHT*")
CLASSIFIER = "License :: OSI Approved :: "


def main() -> int:
    """Write the file. Return 1 if a library has no licence text."""
    args = _arguments()
    found = sorted(distributions(path=args.folder), key=lambda one: canonicalize_name(one.name))
    libraries = [one for one in found if canonicalize_name(one.name) != OURS]
    unlicensed = [one.name for one in libraries if not _has_text(one)]
    if unlicensed:
        print(f"no licence text in deb/licences/ for {', '.join(unlicensed)}", file=sys.stderr)
        return 1
    libraries += map(distribution, args.more)
    unnamed = [canonicalize_name(one.name) for one in libraries if not any(_licences(one))]
    if unnamed:
        print(f"deb/licences/ needs {', '.join(f'{one}.spdx' for one in unnamed)}", file=sys.stderr)
        return 1
    args.out.write_text(_bom(args, libraries) + "\n")
    return 0


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("name", help="the package")
    parser.add_argument("version")
    parser.add_argument("arch")
    parser.add_argument("folder", nargs="+", help="a folder of distributions in the package")
    parser.add_argument("--epoch", type=int, required=True, help="the time of the build (s)")
    parser.add_argument(
        "--with",
        dest="more",
        action="append",
        default=[],
        metavar="NAME",
        help="a library of this Python that has left its files in the package",
    )
    parser.add_argument("--out", type=Path, required=True)
    return parser.parse_args()


def _has_text(library: Distribution) -> bool:
    """Return whether the licence's text is beside the library. If the text is missing, first copy it
    from deb/licences/."""
    metadata = next(file for file in library.files or () if file.name == "METADATA")
    about = Path(str(library.locate_file(metadata))).parent
    if any(text.is_file() for pattern in TEXTS for text in about.glob(pattern)):
        return True
    ours = LICENCES / f"{canonicalize_name(library.name)}.txt"
    if not ours.exists():
        return False
    (about / "licenses").mkdir()
    shutil.copyfile(ours, about / "licenses" / "LICENSE.txt")
    return True


def _bom(args: argparse.Namespace, libraries: list[Distribution]) -> str:
    purl = PackageURL("deb", name=args.name, version=args.version, qualifiers={"arch": args.arch})
    top = Component(name=args.name, version=args.version, type=ComponentType.APPLICATION, purl=purl)
    top.bom_ref.value = str(purl)
    top.licenses.add(LicenseFactory().make_from_string("Apache-2.0"))
    bom = Bom(serial_number=uuid.uuid5(uuid.NAMESPACE_URL, str(purl)))
    bom.metadata.timestamp = datetime.datetime.fromtimestamp(args.epoch, datetime.UTC)
    bom.metadata.component = top
    parts = [_component(one) for one in libraries]
    bom.components.update(parts)
    bom.register_dependency(top, parts)
    return JsonV1Dot6(bom).output_as_string(indent=1)


def _component(library: Distribution) -> Component:
    name, version = library.name, library.version
    purl = PackageURL("pypi", name=canonicalize_name(name), version=version)
    part = Component(name=name, version=version, purl=purl, bom_ref=str(purl))
    part.licenses.update(_licences(library))
    return part


def _licences(library: Distribution) -> Iterator[License]:
    """Yield a library's licences from the first of these sources that exists: our file in
    deb/licences/, the field License-Expression, the field License, the classifiers. Yield nothing if
    none exists."""
    about, factory = library.metadata, LicenseFactory()
    said = about.get("License-Expression") or about.get("License", "").partition("\n")[0]
    classes = about.get_all("Classifier", [])
    named = [one.removeprefix(CLASSIFIER) for one in classes if one.startswith(CLASSIFIER)]
    ours = LICENCES / f"{canonicalize_name(library.name)}.spdx"
    if ours.exists():
        yield factory.make_from_string(ours.read_text().strip())
    elif said:
        yield factory.make_from_string(said)
    else:
        yield from map(factory.make_with_name, named)


if __name__ == "__main__":
    sys.exit(main())
