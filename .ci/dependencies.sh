# Sourced by ./demo, ./check, ./bench and .ci/run: installs the Debian packages that are missing.
# docs/dependencies.md says what each is for.

carom_build_packages="g++ cmake ninja-build pkg-config libbullet-dev libeigen3-dev libsndfile1-dev
  libmysofa-dev libpng-dev libhwy-dev libsdl2-dev libassimp-dev libmeshoptimizer-dev libmumps-seq-dev
  libopenblas0-serial nlohmann-json3-dev libcli11-dev libssl-dev libmuparser-dev
  libzstd-dev zlib1g-dev"
carom_test_packages="libgtest-dev libgmock-dev libvalijson-dev debhelper python3 python3-numpy"
# For tests that are left out where they are missing: pages in a browser, the films of `carom video`, and what lintian says of packages.
carom_page_packages="chromium ffmpeg python3 lintian"
carom_bench_packages="libbenchmark-dev"
carom_lint_packages="clang clang-format clang-tidy libclang-rt-14-dev"
# For tests/fuzz/run: llvm reads what regions were reached.
carom_fuzz_packages="clang libclang-rt-14-dev llvm python3"
# For docs/figures/make.sh: the plots of tests/bench.
carom_figure_packages="python3 python3-numpy python3-scipy python3-matplotlib"
# A second standard library, for what other platforms have: compiled, not run.
carom_libcxx_packages="clang-19 libc++-19-dev libc++abi-19-dev"

# The WebAssembly modules, and their tests, which are left out where these are missing (docs/web.md). web/get_bullet.sh unpacks
# with tar and xz.
carom_web_packages="clang-19 lld-19 libc++-19-dev-wasm32 libc++abi-19-dev-wasm32 libclang-rt-19-dev-wasm32 wasi-libc
  binaryen libhwy-dev libeigen3-dev nlohmann-json3-dev xz-utils nodejs"
# Packages of nodejs from elsewhere bring npm along, and conflict with Debian's.
command -v npm >/dev/null || carom_web_packages="$carom_web_packages npm"

carom_require() {
  local package missing=""
  for package in "$@"; do
    # A package stays in dpkg's list after removal, so its state is asked, not its presence.
    [ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" = installed ] ||
      missing="$missing $package"
  done
  [ -n "$missing" ] || return 0
  local sudo=""
  if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null; then
      echo "carom: these Debian packages are missing, and there is neither root nor sudo to install them:" >&2
      echo "   $missing" >&2
      echo "   as root: apt-get install$missing" >&2
      exit 1
    fi
    sudo=sudo
  fi
  echo "installing$missing"
  local log
  log=$(mktemp)
  if ! { $sudo apt-get update -qq &&
         DEBIAN_FRONTEND=noninteractive $sudo apt-get install -y -qq --no-install-recommends $missing; } \
       >"$log" 2>&1 </dev/null; then
    tail -n 15 "$log" >&2
    rm -f "$log"
    echo "carom: apt-get could not install:$missing" >&2
    echo "   what it said is above; is the network there, and is this Debian 12 or newer?" >&2
    exit 1
  fi
  rm -f "$log"
}

# carom_build PRESET [-DOPTION=VALUE]... [TARGET]...: configures and builds, quietly unless it fails.
carom_build() {
  command -v dpkg-query >/dev/null || {
    echo "carom: this script installs with apt-get; elsewhere, see docs/dependencies.md and run" >&2
    echo "   cmake --preset $1 && cmake --build --preset $1" >&2
    exit 1
  }
  mkdir -p build
  local preset=$1 log=build/$1.log options=()
  shift
  while [[ "${1:-}" == -D* ]]; do
    options+=("$1")
    shift
  done
  if ! cmake --preset "$preset" "${options[@]}" >"$log" 2>&1 ||
     ! cmake --build --preset "$preset" ${1:+--target "$@"} >>"$log" 2>&1; then
    tail -n 40 "$log" >&2
    echo "carom: the build of preset '$preset' failed; the whole log is $log" >&2
    exit 1
  fi
}
