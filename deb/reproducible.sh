#!/bin/sh
# Builds the packages twice, and compares the two builds: deb/reproducible.sh (`make reproducible`). The second build has
# another time zone, language, umask and file time, and builds manual, documentation and lgpio again. The packages of the
# first build stay in dist/.
set -eu
cd "$(dirname "$0")/.."
build() { make --no-print-directory man docs > /dev/null; for arch in ${ARCHS:-amd64 arm64}; do for python in ${PYTHONS:-3.11 3.12 3.13}; do deb/build.sh "$arch" "$python" > /dev/null; done; done; }
sums() { (cd dist && sha256sum -- *.deb *.cdx.json); }
rm -rf dist build/deb
build
sums > build/first.sums
mkdir -p build/first
rm -rf build/first/dist && mv dist build/first/dist
rm -rf build/deb
find bridges drivers hal_fakes workbench systemd config -type f -exec touch {} +
(umask 077; TZ=Pacific/Kiritimati LC_ALL=C.UTF-8 LANG=C.UTF-8; export TZ LC_ALL LANG; build)
sums > build/second.sums
rm -rf dist && mv build/first/dist dist
if cmp -s build/first.sums build/second.sums; then
  echo "reproducible: $(wc -l < build/first.sums) files are the same in both builds"
else
  echo "the builds differ:" >&2
  diff build/first.sums build/second.sums >&2 || true
  exit 1
fi
