#!/bin/sh
# The host by pkg-config and a compiler, as a Makefile has it. The folder of the host's own headers is
# that of the find_package host's build. Usage: host.sh PREFIX LIBDIR OWN FOLDER COMPILER [FLAG]...
set -eu
prefix=$1 libdir=$2 own=$3 folder=$4 compiler=$5
shift 5
export PKG_CONFIG_PATH="$prefix/$libdir/pkgconfig${PKG_CONFIG_PATH:+:$PKG_CONFIG_PATH}"
mkdir -p "$folder"
# shellcheck disable=SC2046 # flags are words
"$compiler" -std=c++20 "$@" -I"$own" $(pkg-config --cflags carom-plugin carom-bullet) \
  "$(dirname "$0")/main.cpp" -o "$folder/host" $(pkg-config --libs carom-plugin carom-bullet)
"$folder/host"
