#!/bin/sh
# Compiles layout.cpp as hosts with other flags than the installed library's would, and compares what
# the programs print. Usage: layout.sh PREFIX LIBDIR FOLDER COMPILER [FLAG]...
set -eu
prefix=$1 libdir=$2 folder=$3 compiler=$4
shift 4
export PKG_CONFIG_PATH="$prefix/$libdir/pkgconfig${PKG_CONFIG_PATH:+:$PKG_CONFIG_PATH}"
mkdir -p "$folder"
run() { # NAME FLAG...
  name=$1
  shift
  # shellcheck disable=SC2046 # flags are words
  "$compiler" -std=c++20 "$@" $(pkg-config --cflags carom) "$(dirname "$0")/layout.cpp" -o "$folder/$name" \
    $(pkg-config --libs carom)
  "$folder/$name" >"$folder/$name.txt"
  [ "$name" = plain ] || diff "$folder/plain.txt" "$folder/$name.txt" || {
    echo "the layout of public types, or the sound, depends on: $*"
    exit 1
  }
}
run plain "$@" -O0
run optimised "$@" -O3
run avx2 "$@" -O2 -mavx2 -mfma
run native "$@" -O2 -march=native
echo "one layout of $(($(wc -l <"$folder/plain.txt") - 1)) types under all flags"
