# Shared by scripts/run, scripts/test, scripts/lint, scripts/python and .ci/run: what the project needs from Debian, how it gets
# there, and how the tree is built. Sourced, not run; the caller has `set -euo pipefail`.
# shellcheck shell=bash disable=SC2034  # the lists and assume_yes are used by the scripts that source this

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

# The one list of Debian packages. Never libopencv-dev: it brings Qt, GDAL and Java (673 MB) for nothing.
packages_build=(
  g++ cmake ninja-build
  libeigen3-dev
  libopencv-core-dev libopencv-imgproc-dev libopencv-video-dev
  libpng-dev libjpeg-dev
  liboctomap-dev libgeographiclib-dev
  libyaml-cpp-dev nlohmann-json3-dev libfmt-dev libcli11-dev libboost-dev
  libsdformat-dev libembree-dev libassimp-dev  # the simulator, 15 MB of 58; the build does without where they are missing
  libbz2-dev liblz4-dev libzstd-dev libsqlite3-dev  # recordings of ROS; the build does without where they are missing
  libwebsockets-dev  # `pade live --web`; the build does without where it is missing
  libompl-dev  # `pade plan`; the build does without where it is missing
)
packages_test=(libgtest-dev libgmock-dev)
packages_formats=(libopencv-imgcodecs-dev)  # TIFF, BMP, WebP ... and the oracle of our image files; brings GDAL, so `run` does without
packages_lint=(clang-format clang-tidy)
packages_docs=(doxygen)
packages_dds=(cyclonedds-dev libfastrtps-dev)  # topics of ROS 2 and the peer that they are tested with: for scripts/dds alone
packages_video=(libavformat-dev libavcodec-dev libswscale-dev ffmpeg)  # videos as cameras, and who makes them: for scripts/video-oracle
packages_python=(pybind11-dev python3-dev python3-numpy python3-build python3-venv mypy)  # for scripts/python alone

assume_yes=false
configure_options=()  # beside those of the preset

say() {
  if [ -t 1 ]; then printf '\033[1m%s\033[0m\n' "$*"; else printf '%s\n' "$*"; fi
}
die() {
  printf '%s: %s\n' "$(basename "$0")" "$*" >&2
  exit 1
}

# missing_packages NAME...: those that dpkg does not have installed.
missing_packages() {
  local have
  have=$(dpkg-query -W -f '${db:Status-Status} ${Package}\n' "$@" 2>/dev/null | sed -n 's/^installed //p' || true)
  printf '%s\n' "$@" | grep -vxF -e "${have:-none}" || true
}

# as_root COMMAND...: as root, through sudo where needed; sudo asks for a password only at a terminal.
as_root() {
  if [ "$(id -u)" = 0 ]; then
    "$@"
  elif [ -t 0 ]; then
    sudo "$@"
  else
    sudo -n "$@"
  fi
}

apt_get() {
  as_root env DEBIAN_FRONTEND=noninteractive LC_ALL=C apt-get -q \
    -o Acquire::Retries=3 -o DPkg::Lock::Timeout=300 -o APT::Install-Recommends=false "$@"
}

# ensure_packages NAME...: install what is missing, after saying what and how much. At a terminal it asks once
# (not with --yes); without one it never asks. Does nothing, at once, where all is there.
ensure_packages() {
  if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
    say "Without apt, install the equivalents of these Debian packages yourself:"
    printf '  %s\n' "$*"
    return 0
  fi
  local missing
  mapfile -t missing < <(missing_packages "$@")
  [ ${#missing[@]} -gt 0 ] || return 0

  say "Missing Debian packages:"
  printf '%s ' "${missing[@]}" | fold -s -w 100 | sed 's/^/  /'
  printf '\n'
  if [ "$(id -u)" != 0 ] && ! command -v sudo >/dev/null; then
    die "needs root or sudo to install them; run as root: apt-get install --no-install-recommends ${missing[*]}"
  fi
  say "Refreshing the package lists ..."
  apt_get update -q=2 || die "apt-get update failed; is this machine on line, and may $(id -un) use sudo?"

  # apt itself knows what they pull in, how much is downloaded, and how much disk it takes.
  local plan
  plan=$(LC_ALL=C apt-get -o APT::Install-Recommends=false install --assume-no "${missing[@]}" 2>&1 || true)
  grep -q 'newly installed' <<<"$plan" || die "apt-get cannot install them: $(tail -n 3 <<<"$plan")"
  grep -E '^[0-9]+ upgraded|^Need to get|^After this operation' <<<"$plan" | sed 's/^/  /'

  if [ -t 0 ] && [ "$assume_yes" = false ]; then
    local answer
    read -r -p "Install them? [Y/n] " answer
    case $answer in '' | [Yy]*) ;; *) die "nothing was installed" ;; esac
  fi
  local log
  log=$(mktemp)
  say "Installing ..."
  if [ -t 1 ]; then
    apt_get install -y "${missing[@]}"
  else
    apt_get install -y "${missing[@]}" >"$log" 2>&1 || {
      tail -n 20 "$log" >&2
      rm -f "$log"
      die "apt-get install failed"
    }
  fi
  rm -f "$log"
}

# job_count: as many compilers as there are cores, and one for each GB of free memory at most.
job_count() {
  local cores memory
  cores=$(nproc)
  memory=$(awk '/^MemAvailable/ {print int($2 / 1048576)}' /proc/meminfo 2>/dev/null || echo "$cores")
  [ "$memory" -ge 1 ] || memory=1
  [ "$memory" -lt "$cores" ] && echo "$memory" || echo "$cores"
}

# say_how_far LOG: while this script runs, every 25 s how far the log of a build says that it is.
say_how_far() {
  local seconds=0
  while kill -0 $$ 2>/dev/null; do
    sleep 1
    seconds=$((seconds + 1))
    [ $((seconds % 25)) != 0 ] || echo "  $(grep -oE '^\[[0-9]+/[0-9]+\]' "$1" | tail -n 1) after $seconds s"
  done
}

# configure PRESET FOLDER: with a preset of CMakePresets.json.
configure() {
  local log=$root/$2/build.log
  mkdir -p "$root/$2"
  # A folder that was configured by hand keeps its generator.
  [ -f "$root/$2/CMakeCache.txt" ] || export CMAKE_GENERATOR=${CMAKE_GENERATOR:-Ninja}
  (cd "$root" && cmake --preset "$1" "${configure_options[@]}") >"$log" 2>&1 || {
    cat "$log" >&2
    die "CMake could not configure $2/"
  }
}

# build PRESET FOLDER [TARGET...]: configure, then build.
build() {
  local preset=$1 folder=$2 log=$root/$2/build.log targets=()
  shift 2
  [ $# = 0 ] || targets=(--target "$@")
  say "Building into $folder/ (preset $preset, $(job_count) jobs) ..."
  local start=$SECONDS
  configure "$preset" "$folder"
  # At a terminal the build shows its own progress; in a pipe it says every 25 s how far it is.
  if [ -t 1 ]; then
    cmake --build "$root/$folder" -j "$(job_count)" "${targets[@]}" || die "the build failed"
  else
    say_how_far "$log" &
    local speaker=$! failed=false
    cmake --build "$root/$folder" -j "$(job_count)" "${targets[@]}" >"$log" 2>&1 || failed=true
    kill "$speaker" 2>/dev/null || true
    if [ "$failed" = true ]; then
      grep -vE '^\[[0-9]+/[0-9]+\] (Building|Linking)' "$log" | tail -n 60 >&2
      die "the build failed; all of its output is in $folder/build.log"
    fi
  fi
  echo "  built in $((SECONDS - start)) s"
}

# run_tests PRESET FOLDER [CTEST ARGUMENT...]: what build made.
run_tests() {
  local preset=$1 folder=$2
  shift 2
  say "Testing $folder/ ..."
  # One more than processors: the tests of live sessions mostly wait.
  (cd "$root" && ctest --preset "$preset" -j "$(($(job_count) + 1))" --no-tests=error "$@")
}
