#!/bin/sh
# Makes a release in dist/ from the release's tag: KEY=NAME deb/release.sh (`make release KEY=NAME`). NAME is a key of gpg.
# Only bridges/__init__.py sets the version. Tag, CHANGELOG.md and ros/package.xml must have the same version. The script
# publishes nothing.
set -eu
cd "$(dirname "$0")/.."
bin=$PWD/.venv/bin
refuse() { echo "no release: $1" >&2; exit 1; }

version=$(sed -n 's/^__version__ = "\(.*\)"$/\1/p' bridges/__init__.py)
[ -z "$(git status --porcelain)" ] || refuse "the checkout has changes (git status)"
tags=$(git tag --points-at HEAD --list 'v*')
[ "$tags" = "v$version" ] || refuse "the commit has the tag '$tags', but the version is $version: its tag is v$version"
grep -q "<version>$version</version>" ros/package.xml || refuse "ros/package.xml has another version than $version"
notes=$(sed -n "/^## $version\(, [0-9-]*\)\?\$/,/^## /{/^## /!p}" CHANGELOG.md)
[ -n "$notes" ] || refuse "CHANGELOG.md has no section '## $version, DATE'"
[ -n "${KEY:-}" ] || refuse "KEY names no key: make release KEY=NAME (gpg --list-secret-keys)"
gpg --list-secret-keys "$KEY" > /dev/null 2>&1 || refuse "gpg has no secret key '$KEY'"

SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH
rm -rf dist build/sdist && mkdir dist
# tarball FILE FOLDER NAME: packs FOLDER/NAME into FILE. The same content always gives the same bytes.
tarball() { tar -C "$2" --sort=name --owner=0 --group=0 --numeric-owner --mtime="@$SOURCE_DATE_EPOCH" -cf - "$3" | gzip -9n > "$1"; }
make --no-print-directory reproducible # builds twice, and keeps the first build
"$bin/python" -m build --no-isolation --sdist --wheel --outdir build/sdist . > build/sdist.log
tar -C build/sdist -xzf "build/sdist/rmf_bridges-$version.tar.gz"
tarball "dist/rmf_bridges-$version.tar.gz" build/sdist "rmf_bridges-$version"
cp "build/sdist/rmf_bridges-$version-py3-none-any.whl" dist/
cp -R build/site "build/sdist/rmf-bridges-$version-documentation"
tarball "dist/rmf-bridges-$version-documentation.tar.gz" build/sdist "rmf-bridges-$version-documentation"
printf '%s\n' "$notes" > dist/NOTES.md

# The source archive and the wheel must each serve a simulated lift in an empty environment, outside the checkout.
for file in "$PWD/dist/rmf_bridges-$version.tar.gz" "$PWD/dist/rmf_bridges-$version-py3-none-any.whl"; do
  empty=$(mktemp -d)
  trap 'rm -rf "$empty"' EXIT
  python3 -m venv "$empty"
  "$empty/bin/pip" install --quiet --disable-pip-version-check "$file"
  cp config/lift_dry_contact.yaml "$empty"
  touch "$empty/run.log"
  (cd "$empty" && unset PYTHONPATH && bin/rmf-bridge --version | grep -qx "rmf-bridge $version" &&
    bin/rmf-bridge check --quiet lift_dry_contact.yaml &&
    timeout --preserve-status -s TERM 10 bin/rmf-bridge run lift_dry_contact.yaml --simulate --runtime-dir "$empty/run" > run.log 2>&1) ||
    { cat "$empty/run.log" >&2; refuse "$file does not run in an empty environment"; }
  rm -rf "$empty"
done

(cd dist && sha256sum -- * > SHA256SUMS && gpg --batch --yes --local-user "$KEY" --armor --detach-sign SHA256SUMS)
echo "version $version is in dist/: $(wc -l < dist/SHA256SUMS) files, SHA256SUMS and its signature"
