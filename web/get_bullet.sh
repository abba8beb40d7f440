#!/bin/sh
# get_bullet.sh FOLDER: fetches Debian's source of Bullet, and puts what the page's engine is built of into FOLDER. It asks
# apt through a list of its own, as the machine's lists seldom have sources, and leaves those as they are.
set -eu
[ $# -eq 1 ] || { echo "usage: get_bullet.sh FOLDER" >&2; exit 2; }
mkdir -p "$1"
folder=$(cd "$1" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# The release's own archive, by the address that the machine has for it.
codename=$(. /etc/os-release && echo "${VERSION_CODENAME:-bookworm}")
archive=$(apt-get indextargets --format '$(CODENAME) $(COMPONENT) $(REPO_URI)' 'Created-By: Packages' |
  sed -n "s|^$codename main ||p" | head -n 1)
keys=/usr/share/keyrings/debian-archive-keyring.gpg
[ -e "$keys" ] && trust="[signed-by=$keys] " || trust=
echo "deb-src $trust${archive:-http://deb.debian.org/debian} $codename main" > "$work/sources.list"

mkdir -p "$work/lists/partial" "$work/archives/partial"
own_apt() {
  apt-get -qq -o Dir::Etc::sourcelist="$work/sources.list" -o Dir::Etc::sourceparts=- -o Dir::State::lists="$work/lists" \
    -o Dir::Cache="$work" -o APT::Sandbox::User=root -o Acquire::Retries=1 -o Acquire::http::Timeout=20 "$@"
}
cd "$work"
own_apt update
own_apt source --download-only bullet
mkdir source
tar -xf bullet_*.orig.tar.* --wildcards --strip-components=2 -C source '*/src/LinearMath' '*/src/BulletCollision' \
  '*/src/BulletDynamics' '*/src/BulletSoftBody/*.h' '*/src/btBullet*' '*/src/btLinearMathAll.cpp'
cp -R source/. "$folder"  # last, so that it is there whole or not at all
