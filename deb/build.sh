#!/bin/sh
# Builds the Debian package of one architecture and one Python: deb/build.sh ARCH PYTHON (`make deb`).
# As an ordinary user, on any machine: wheels are fetched for the target. lgpio has none for Python 3.13: lgpio.sh
# builds it.
set -eu
arch=$1 python=$2
case $python in
  3.11) release=deb12 ;; 3.12) release=ubuntu24.04 ;; 3.13) release=deb13 ;;
  *) echo "Python $python: no release of Debian or Ubuntu that this is for" >&2; exit 1 ;;
esac
here=$(cd "$(dirname "$0")/.." && pwd)
bin=$here/.venv/bin
version=$("$bin/python" -c 'import bridges; print(bridges.__version__)')
work=$here/build/deb/$release-$arch
root=$work/root
lib=usr/lib/rmf-bridges
next=3.$((${python#3.} + 1))
SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git -C "$here" log -1 --format=%ct 2>/dev/null || date +%s)}
export SOURCE_DATE_EPOCH

rm -rf "$work"
umask 022
wheels=$here/build/deb/wheels
mkdir -p "$root/DEBIAN" "$root/$lib/bin" "$work/wheel" "$wheels"
[ "$python" != 3.13 ] || "$here/deb/lgpio.sh" "$arch" "$wheels"
"$bin/pip" wheel --quiet --disable-pip-version-check --no-deps --wheel-dir "$work/wheel" "$here"
"$bin/python" "$here/deb/wheels.py" "$work"/wheel/*.whl --arch "$arch" --python "$python" \
  --find-links "$wheels" --target "$root/$lib/lib/python$python/site-packages" --extra=gpio --extra=recording
rm -rf "$root/$lib/lib/python$python/site-packages/bin"

# A virtual environment that sees the system's packages (rclpy, lgpio), on the system's own Python.
ln -s "/usr/bin/python$python" "$root/$lib/bin/python3"
printf 'home = /usr/bin\ninclude-system-site-packages = true\nversion = %s\n' "$python" > "$root/$lib/pyvenv.cfg"
cat > "$root/$lib/bin/rmf-bridge" <<'SCRIPT'
#!/usr/lib/rmf-bridges/bin/python3
import sys

from bridges.cli import main

sys.exit(main())
SCRIPT
chmod 755 "$root/$lib/bin/rmf-bridge"
mkdir -p "$root/usr/bin"
ln -s ../lib/rmf-bridges/bin/rmf-bridge "$root/usr/bin/rmf-bridge"

put() { install -D -m 644 "$here/$1" "$root/$2"; }
put systemd/rmf-bridges.target usr/lib/systemd/system/rmf-bridges.target
put systemd/rmf-bridges.sysusers usr/lib/sysusers.d/rmf-bridges.conf
put systemd/rmf-bridges.tmpfiles usr/lib/tmpfiles.d/rmf-bridges.conf
put systemd/60-rmf-bridges.rules usr/lib/udev/rules.d/60-rmf-bridges.rules
put systemd/80-rmf-can0.network usr/share/doc/rmf-bridges/examples/80-rmf-can0.network
for unit in rmf-bridge@ rmf-bridge-recorder rmf-bridge-page; do
  sed 's#/opt/rmf-bridges/.venv/bin/#/usr/lib/rmf-bridges/bin/#' "$here/systemd/$unit.service" \
    > "$root/usr/lib/systemd/system/$unit.service"
done
for file in "$here"/config/*.yaml; do put "config/${file##*/}" "usr/share/doc/rmf-bridges/examples/${file##*/}"; done
mkdir -p "$root/usr/share/man/man1" "$root/usr/share/bash-completion/completions" \
  "$root/usr/share/zsh/vendor-completions" "$root/usr/share/fish/vendor_completions.d"
gzip -9nc "$here/build/rmf-bridge.1" > "$root/usr/share/man/man1/rmf-bridge.1.gz"
"$bin/rmf-bridge" completion bash > "$root/usr/share/bash-completion/completions/rmf-bridge"
"$bin/rmf-bridge" completion zsh > "$root/usr/share/zsh/vendor-completions/_rmf-bridge"
"$bin/rmf-bridge" completion fish > "$root/usr/share/fish/vendor_completions.d/rmf-bridge.fish"
printf 'rmf-bridges (%s+%s) unstable; urgency=medium\n\n  * See CHANGELOG.md of the project.\n\n -- rmf-bridges maintainers <rmf-bridges@localhost>  %s\n' \
  "$version" "$release" "$(date -Rud "@$SOURCE_DATE_EPOCH")" | gzip -9nc > "$root/usr/share/doc/rmf-bridges/changelog.gz"
{ printf 'Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/\n\nFiles: *\nCopyright: the authors of rmf-bridges\nLicense: Apache-2.0\n On Debian systems the text is in /usr/share/common-licenses/Apache-2.0.\n'
  printf '\nFiles: %s/lib/*\nCopyright: their authors\nLicense: various\n The licence of each library is in its *.dist-info directory there.\n' "$lib"
} > "$root/usr/share/doc/rmf-bridges/copyright"

for script in postinst prerm postrm; do
  sed "s/@PYTHON@/$python/g" "$here/deb/scripts/$script" > "$root/DEBIAN/$script"
  chmod 755 "$root/DEBIAN/$script"
done
cat > "$root/DEBIAN/control" <<CONTROL
Package: rmf-bridges
Version: $version+$release
Architecture: $arch
Maintainer: rmf-bridges maintainers <rmf-bridges@localhost>
Installed-Size: $(du -sk --apparent-size "$root" | cut -f1)
Depends: python3 (>= $python~), python3 (<< $next~), libc6 (>= 2.34), systemd (>= 252)
Suggests: can-utils
Section: net
Priority: optional
Description: connect Open-RMF to lifts, doors and chargers
 Small daemons, one for each controller, that stand between Open-RMF and a
 building: dry contacts, Modbus, HTTP and CAN. Each is configured by one YAML
 and run by systemd.
CONTROL
find "$root" -type d -name __pycache__ -prune -exec rm -rf {} +
find "$root" -exec touch -hd "@$SOURCE_DATE_EPOCH" {} +
mkdir -p "$here/dist"
dpkg-deb --root-owner-group -Zxz --build "$root" "$here/dist/rmf-bridges_$version+${release}_$arch.deb"
