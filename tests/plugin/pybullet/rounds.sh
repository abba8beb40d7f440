#!/usr/bin/env bash
# The plugin comes and goes 1000 times over the server stub, natively and from Python, and 10 times
# under valgrind: no crash, no error, no leak. By hand, as it takes some minutes:
#
#     tests/plugin/pybullet/rounds.sh [BUILD]
set -eu
build=$(realpath "${1:-build/check}")
here=$(realpath "$(dirname "$0")")
plugin=$build/plugin/pybullet
tests=$build/tests/plugin/pybullet
. "$here/../../../.ci/dependencies.sh"
carom_require valgrind python3

CAROM_ROUNDS=1000 "$tests/pybullet_tests" --gtest_filter=PybulletPlugin.ComesAndGoes
CAROM_ROUNDS=1000 CAROM_PYTHON=$plugin CAROM_PYBULLET_STUB=$tests/libpybullet_stub.so \
  PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 "$here/carom_py_test.py" Clients
CAROM_ROUNDS=10 valgrind --leak-check=full --errors-for-leak-kinds=definite --error-exitcode=1 \
  "$tests/pybullet_tests" --gtest_filter=PybulletPlugin.ComesAndGoes
echo "1000 rounds, and 10 under valgrind: nothing is wrong"
