#!/bin/sh
# Builds the three Debian packages for one architecture and one Python: deb/build.sh ARCH PYTHON (`make deb`).
# - rmf-bridges has the daemons and the recorder, as one archive that its postinst unpacks.
# - rmf-bridges-workbench adds the workbench and the fakes.
# - rmf-bridges-page adds the web page's libraries.
# The last two packages install into a folder named after the version. The script runs as an ordinary user, on any machine,
# because it fetches wheels for the target. The versions and hashes are in deb/lock/ (`make lock`). PyPI has no lgpio for
# Python 3.13, so lgpio.sh builds lgpio. Each package has its bill of materials (sbom.py). `deb/reproducible.sh` shows that two
# builds are the same.
set -eu
arch=$1 python=$2
case $python in
  3.11) release=deb12 ;; 3.12) release=ubuntu24.04 ;; 3.13) release=deb13 ;;
  *) echo "Python $python: not the Python of a supported release of Debian or Ubuntu" >&2; exit 1 ;;
esac
here=$(cd "$(dirname "$0")/.." && pwd)
bin=$here/.venv/bin
maintainer="${DEBFULLNAME:-rmf-bridges maintainers} <${DEBEMAIL:-rmf-bridges@localhost}>"
work=$here/build/deb/$release-$arch
root=$work/root bench=$work/workbench page=$work/page tree=$work/tree wheels=$here/build/deb/wheels
lib=usr/lib/rmf-bridges
site=$tree/lib/python$python/site-packages
SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git -C "$here" log -1 --format=%ct 2>/dev/null || date +%s)}
export SOURCE_DATE_EPOCH

rm -rf "$work" "$here"/build/lib "$here"/build/bdist.* # otherwise a wheel would keep deleted modules
umask 022
mkdir -p "$root/DEBIAN" "$bench/DEBIAN" "$page/DEBIAN" "$root/$lib/bin" "$root/usr/bin" "$tree/bin" "$work/wheel" "$wheels"

# The workbench gets the libraries that the daemons lack. The page gets the libraries that daemons and workbench lack. Libraries of
# Cyclone's own commands and colorzero's build tools are left out, because an installation would have to compile twice as much.
built=
[ "$python" != 3.13 ] || { "$here/deb/lgpio.sh" "$arch" "$wheels"; built="--built $wheels"; }
"$bin/pip" wheel --quiet --disable-pip-version-check --no-deps --no-build-isolation --wheel-dir "$work/wheel" "$here"
version=$(basename "$work"/wheel/*.whl | cut -d- -f2)+$release # with the commit (setup.py)
fill() {
  into=$1; shift
  "$bin/python" "$here/deb/wheels.py" "$work"/wheel/*.whl --arch "$arch" --python "$python" \
    --lock "$here/deb/lock/runtime.txt" $built --without cyclonedds:rich-click --without colorzero:setuptools --target "$into" "$@"
}
# without PLACE OTHER: removes every file from PLACE that OTHER has too.
without() { (cd "$2" && find . ! -type d -print0) | (cd "$1" && xargs -0 rm -f); }
in_bench=$bench/usr/lib/rmf-bridges-workbench/$version in_page=$page/usr/lib/rmf-bridges-page/$version
mkdir -p "$in_bench" "$in_page"
fill "$site" --extra=gpio --extra=recording --extra=push --extra=mqtt
cp -R "$site/." "$in_bench"
fill "$in_bench" --extra=gpio --extra=recording --extra=push --extra=mqtt --extra=laptop --extra=plot
cp -R "$in_bench/." "$in_page"
fill "$in_page" --extra=gpio --extra=recording --extra=push --extra=mqtt --extra=laptop --extra=plot --extra=page --extra=metrics
without "$in_page" "$in_bench"
rm -rf "$site/workbench" "$site/hal_fakes"
without "$in_bench" "$site"
for each in "$site" "$in_bench" "$in_page"; do
  rm -rf "$each/bin" "$each/cyclonedds/tools" "$each/cyclonedds/.libs/idlc" # programs of the libraries
  find "$each" -type f -exec chmod 644 {} +
  find "$each" -type d -empty -delete
done

# sbom PACKAGE ROOT FOLDER...: adds the bill of materials and missing licence texts.
sbom() {
  package=$1 doc=$2/usr/share/doc/$1
  shift 2
  mkdir -p "$doc" "$here/dist"
  "$bin/python" "$here/deb/sbom.py" "$package" "$version" "$arch" "$@" --epoch "$SOURCE_DATE_EPOCH" --out "$doc/sbom.cdx.json"
  cp "$doc/sbom.cdx.json" "$here/dist/${package}_${version}_$arch.cdx.json"
}
sbom rmf-bridges "$root" "$site"
sbom rmf-bridges-workbench "$bench" "$in_bench" --with mkdocs-material
sbom rmf-bridges-page "$page" "$in_page"

# Make a virtual environment on the system's own Python. The environment sees the system's packages, such as rclpy. postinst
# writes the first line of its program. Thus a daemon imports from its own tree, even if `current` later names another tree.
ln -s "/usr/bin/python$python" "$tree/bin/python3"
printf 'home = /usr/bin\ninclude-system-site-packages = true\nversion = %s\n' "$python" > "$tree/pyvenv.cfg"
cat > "$tree/bin/rmf-bridge" <<'SCRIPT'
#!/usr/bin/python3
import sys

from bridges.cli import main

sys.exit(main())
SCRIPT
chmod 755 "$tree/bin/rmf-bridge"
tar -C "$tree" --sort=name --owner=0 --group=0 --numeric-owner --mtime="@$SOURCE_DATE_EPOCH" -cJf "$root/$lib/tree.tar.xz" .
ln -s ../current/bin/rmf-bridge "$root/$lib/bin/rmf-bridge"
ln -s ../lib/rmf-bridges/bin/rmf-bridge "$root/usr/bin/rmf-bridge"

put() { install -D -m 644 "$here/$2" "$1/$3"; }
unit() {
  mkdir -p "$1/usr/lib/systemd/system"
  sed 's#/opt/rmf-bridges/.venv/bin/#/usr/lib/rmf-bridges/bin/#' "$here/systemd/$2" > "$1/usr/lib/systemd/system/$2"
}
for each in rmf-bridges.target rmf-bridge@.service rmf-bridge-recorder.service rmf-bridge-outputs-off.service; do
  unit "$root" "$each"
done
mkdir "$root/usr/lib/systemd/system/multi-user.target.wants" # for every enabled service, because off is safe
ln -s ../rmf-bridge-outputs-off.service "$root/usr/lib/systemd/system/multi-user.target.wants/"
for each in rmf-bridge-page.service rmf-bridge-exporter.service rmf-bridge-notify.service; do unit "$page" "$each"; done
put "$root" systemd/rmf-bridges-slice.conf 'usr/lib/systemd/system/system-rmf\x2dbridge.slice.d/10-boot.conf'
put "$root" systemd/rmf-bridges.sysusers usr/lib/sysusers.d/rmf-bridges.conf
put "$page" systemd/rmf-bridges-page.sysusers usr/lib/sysusers.d/rmf-bridges-page.conf
put "$root" systemd/rmf-bridges.tmpfiles usr/lib/tmpfiles.d/rmf-bridges.conf
put "$root" systemd/60-rmf-bridges.rules usr/lib/udev/rules.d/60-rmf-bridges.rules
examples=usr/share/doc/rmf-bridges/examples
put "$root" systemd/80-rmf-can0.network $examples/80-rmf-can0.network
for file in "$here"/config/*.yaml; do put "$root" "config/${file##*/}" "$examples/${file##*/}"; done
mkdir -p "$root/usr/share/man/man1" "$root/usr/share/bash-completion/completions" \
  "$root/usr/share/zsh/vendor-completions" "$root/usr/share/fish/vendor_completions.d"
gzip -9nc "$here/build/rmf-bridge.1" > "$root/usr/share/man/man1/rmf-bridge.1.gz"
"$bin/rmf-bridge" completion bash > "$root/usr/share/bash-completion/completions/rmf-bridge"
"$bin/rmf-bridge" completion zsh > "$root/usr/share/zsh/vendor-completions/_rmf-bridge"
"$bin/rmf-bridge" completion fish > "$root/usr/share/fish/vendor_completions.d/rmf-bridge.fish"

mkdir -p "$bench/usr/share/doc/rmf-bridges-workbench"
html=$bench/usr/share/doc/rmf-bridges-workbench/html
cp -R "$here/build/site" "$html" # `make docs`, perhaps under another umask
chmod -R u=rwX,go=rX "$html"

# package NAME ROOT DEPENDS SUMMARY [TREE [RECOMMENDS]]: builds a package with control files, changelog, copyright and
# lintian's overrides.
# The description comes on stdin. TREE is the tree that the package's postinst unpacks. Without a recommended package the package
# works, and says what it cannot do.
package() {
  doc=$2/usr/share/doc/$1
  mkdir -p "$doc"
  printf '%s (%s) unstable; urgency=medium\n\n  * See CHANGELOG.md of the project.\n\n -- %s  %s\n' \
    "$1" "$version" "$maintainer" "$(date -Rud "@$SOURCE_DATE_EPOCH")" | gzip -9nc > "$doc/changelog.gz"
  cp "$here/deb/copyright" "$doc/copyright"
  put "$2" "deb/lintian/$1" "usr/share/lintian/overrides/$1"
  for script in "$here/deb/scripts/$1".*; do
    sed "s/@PYTHON@/$python/g; s/@VERSION@/$version/g" "$script" > "$2/DEBIAN/${script##*.}"
    chmod 755 "$2/DEBIAN/${script##*.}"
  done
  cat > "$2/DEBIAN/control" <<CONTROL
Package: $1
Version: $version
Architecture: $arch
Maintainer: $maintainer
Installed-Size: $(du -ck --apparent-size "$2" ${5:-} | tail -1 | cut -f1)
Depends: $3
Section: net
Priority: optional
CONTROL
  [ -z "${6:-}" ] || echo "Recommends: $6" >> "$2/DEBIAN/control"
  echo "Description: $4" >> "$2/DEBIAN/control"
  cat >> "$2/DEBIAN/control"
  find "$2" -exec touch -hd "@$SOURCE_DATE_EPOCH" {} +
  mkdir -p "$here/dist"
  dpkg-deb --root-owner-group -Zxz --build "$2" "$here/dist/$1_${version}_$arch.deb"
  ! command -v lintian > /dev/null || lintian --allow-root --fail-on error "$here/dist/$1_${version}_$arch.deb"
}
# Depend on this exact Python. The version of `python3` changes with Debian's release, so an upgrade would remove our packages.
# The program openssl reads the ends of certificates for check, doctor, exporter and notify.
libc='libc6 (>= 2.34)' # of the wheels' tags (wheels.py, lgpio.sh)
package rmf-bridges "$root" "python$python, $libc, systemd (>= 252)" \
  "connect Open-RMF to lifts, doors and chargers" "$tree" openssl <<'DESCRIPTION'
 Small daemons, one for each controller, that stand between Open-RMF and a
 building: dry contacts, Modbus, HTTP and CAN. Each is configured by one YAML
 and run by systemd.
DESCRIPTION
package rmf-bridges-workbench "$bench" "rmf-bridges (= $version), $libc" \
  "look at Open-RMF's lifts, doors and chargers, and commission them" <<'DESCRIPTION'
 The commands of rmf-bridge that no daemon needs: watch, send, explain, plot,
 judge, replay, init, doctor and walk, and fake hardware to simulate a device.
DESCRIPTION
package rmf-bridges-page "$page" "rmf-bridges-workbench (= $version), $libc" \
  "web page and metrics of Open-RMF's lifts, doors and chargers" <<'DESCRIPTION'
 The web page of rmf-bridge page: RMF's graph, each device and recordings, and
 the metrics of rmf-bridge exporter for Prometheus, and the notices of
 rmf-bridge notify; services with a user of their own.
DESCRIPTION
