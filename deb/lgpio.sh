#!/bin/sh
# Builds lgpio's wheel for a Python that has no wheel on PyPI: deb/lgpio.sh ARCH DIRECTORY.
# The script builds from the sdist, with swig and the cross compiler zig from PyPI. Any user can run the script, on any machine.
# The module uses only CPython's stable ABI, so this machine's Python.h is right for every later Python too.
set -eu
arch=$1 wheels=$2
case $arch in amd64) machine=x86_64 ;; arm64) machine=aarch64 ;; esac
here=$(cd "$(dirname "$0")/.." && pwd)
bin=$here/.venv/bin
glibc=34 # PyPI's own wheels have the same; Debian 12 has 2.36
[ -z "$(find "$wheels" -name "lgpio-*_${machine}.whl" 2>/dev/null)" ] || exit 0

headers=$("$bin/python" -c 'import sysconfig; print(sysconfig.get_path("include"))')
[ -f "$headers/Python.h" ] || { echo "Python.h is missing: sudo apt install python3-dev" >&2; exit 1; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
sed -n '/^lgpio==/,/[^\\]$/p' "$here/deb/lock/runtime.txt" > "$work/lgpio.txt" # its version and hashes
# Debian's pyconfig.h includes the architecture's pyconfig.h. For the stable ABI both architectures have the same.
for each in x86_64 aarch64; do ln -s "/usr/include/$(uname -m)-linux-gnu" "$work/$each-linux-gnu"; done
cat > "$work/setup.cfg" <<CONFIG
[build_ext]
swig_opts = -DPy_LIMITED_API=0x030b0000
[bdist_wheel]
py_limited_api = cp311
plat_name = manylinux_2_${glibc}_$machine
CONFIG
compiler="$bin/python-zig cc -target $machine-linux-gnu.2.$glibc"
PATH=$bin:$PATH PYPI=1 DIST_EXTRA_CONFIG=$work/setup.cfg SETUPTOOLS_EXT_SUFFIX=.abi3.so \
  ZIG_GLOBAL_CACHE_DIR=$work/zig CC="$compiler" LDSHARED="$compiler -shared -s -Wl,-z,relro,-z,now" \
  CFLAGS="-DPy_LIMITED_API=0x030b0000 -I$work -O2 -fstack-protector-strong" \
  "$bin/pip" wheel --quiet --disable-pip-version-check --no-cache-dir --no-deps --no-binary lgpio \
  --use-pep517 --no-build-isolation --wheel-dir "$wheels" --require-hashes --requirement "$work/lgpio.txt"
