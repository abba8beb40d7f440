#!/bin/sh
# Builds consumer/main.cpp with pkg-config and a compiler, as a Makefile would, and runs it.
# Usage: consumer.sh PREFIX LIBDIR FOLDER COMPILER [FLAG]...
set -eu
prefix=$1 libdir=$2 folder=$3 compiler=$4
shift 4
export PKG_CONFIG_PATH="$prefix/$libdir/pkgconfig${PKG_CONFIG_PATH:+:$PKG_CONFIG_PATH}"
source=$(dirname "$0")/consumer/main.cpp
mkdir -p "$folder"
# shellcheck disable=SC2046 # flags are words
"$compiler" -std=c++20 "$@" $(pkg-config --cflags carom) "$source" -o "$folder/consumer" $(pkg-config --libs carom)
"$folder/consumer"
