#!/bin/sh
# Renews the locks: deb/lock.sh (`make lock`). Each lock pins every library by its version, and by the SHA-256 of each of its
# files on PyPI. deb/lock/runtime.txt has the libraries inside the packages, for every Python and architecture.
# deb/lock/tools.txt has the programs that build the packages.
set -eu
cd "$(dirname "$0")/.."
uv=.venv/bin/uv
[ -x "$uv" ] || .venv/bin/pip install --quiet --disable-pip-version-check uv
lock() {
  "$uv" pip compile --quiet --upgrade --universal --python-version 3.11 --generate-hashes --no-annotate \
    --custom-compile-command "make lock" --output-file "deb/lock/$1.txt" "$2" $3
}
lock runtime pyproject.toml "--extra gpio --extra mqtt --extra push --extra metrics --extra recording --extra laptop --extra plot --extra page"
lock tools deb/lock/tools.in ""
