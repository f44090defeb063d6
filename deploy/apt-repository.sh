#!/bin/sh
# apt-repository.sh DEBS OUT KEY: make a signed apt repository in the folder OUT from the packages in the folder DEBS.
#
# KEY is the id or fingerprint of a secret key in gpg's keyring (GNUPGHOME). OUT can be served by any web server, or be
# a file system. The machines need OUT/rmf-bridges.gpg and OUT/rmf-bridges.SUITE.sources (docs/how-to/roll-out.md).
set -eu
[ $# = 3 ] || { sed -n '2,5s/^# \{0,1\}//p' "$0" >&2; exit 64; }
debs=$1 out=$2 key=$3
for program in apt-ftparchive gpg; do
  command -v "$program" > /dev/null || { echo "$program is missing: sudo apt install apt-utils gnupg" >&2; exit 69; }
done
ls "$debs"/*.deb > /dev/null 2>&1 || { echo "no package in $debs: make deb" >&2; exit 66; }
gpg --batch --list-secret-keys "$key" > /dev/null 2>&1 || { echo "no secret key $key in gpg's keyring" >&2; exit 67; }

new=$(mktemp -d "$out.XXXXXX")
trap 'rm -rf "$new"' EXIT
chmod 755 "$new"
# Each release of Debian and Ubuntu has its own packages and its own suite. A version such as 1.0.0+deb13 names the release.
for deb in "$debs"/*.deb; do
  version=$(dpkg-deb -f "$deb" Version)
  suite=${version##*+}
  mkdir -p "$new/pool/$suite"
  cp "$deb" "$new/pool/$suite/"
done
cd "$new"
for suite in $(ls pool); do
  for arch in $(for deb in pool/"$suite"/*.deb; do dpkg-deb -f "$deb" Architecture; done | sort -u); do
    mkdir -p "dists/$suite/main/binary-$arch"
    apt-ftparchive --arch "$arch" packages "pool/$suite" > "dists/$suite/main/binary-$arch/Packages"
    gzip -9nk "dists/$suite/main/binary-$arch/Packages"
  done
  architectures=$(cd "dists/$suite/main" && echo binary-* | sed 's/binary-//g')
  apt-ftparchive -o APT::FTPArchive::Release::Origin=rmf-bridges -o APT::FTPArchive::Release::Suite="$suite" \
    -o APT::FTPArchive::Release::Codename="$suite" -o APT::FTPArchive::Release::Components=main \
    -o APT::FTPArchive::Release::Architectures="$architectures" release "dists/$suite" > "dists/$suite/Release.new"
  mv "dists/$suite/Release.new" "dists/$suite/Release"
  gpg --batch --yes -u "$key" --clearsign -o "dists/$suite/InRelease" "dists/$suite/Release"
  gpg --batch --yes -u "$key" --armor --detach-sign -o "dists/$suite/Release.gpg" "dists/$suite/Release"
done
gpg --batch --export "$key" > rmf-bridges.gpg
for suite in $(ls pool); do
  cat > "rmf-bridges.$suite.sources" <<SOURCES
Types: deb
URIs: ${URI:-https://packages.example/rmf-bridges}
Suites: $suite
Components: main
Signed-By: /etc/apt/keyrings/rmf-bridges.gpg
SOURCES
done
cd - > /dev/null
# The old repository stays whole until the new repository is complete.
[ ! -e "$out" ] || mv "$out" "$new.old"
mv "$new" "$out"
rm -rf "$new.old"
trap - EXIT
echo "$out: $(ls "$out/pool" | tr '\n' ' ')"
