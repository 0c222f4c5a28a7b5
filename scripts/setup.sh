# Read by the scripts that build something: installs what is missing, builds, and reports in one line a step.

set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
preset=${preset:-release}
build=$root/build/$preset
logs=$root/build/logs
mkdir -p "$logs"

# Compiled kernels are kept here, so that nothing depends on a home folder that can be written.
export POCL_CACHE_DIR=${POCL_CACHE_DIR:-$root/build/pocl-cache}
mkdir -p "$POCL_CACHE_DIR"

# What the program and the demo need. A script that needs more sets `more_packages` and `parts` before it reads this file;
# one that builds another preset than `release` sets `preset`, and one that builds nothing sets `packages`.
declare -p packages &>/dev/null || packages=(g++ cmake ninja-build pocl-opencl-icd ocl-icd-opencl-dev opencl-clhpp-headers
    opencl-c-headers libopencv-core-dev libopencv-imgcodecs-dev libopencv-imgproc-dev libopenexr-dev libtiff-dev
    zlib1g-dev libtbb-dev libeigen3-dev libcli11-dev nlohmann-json3-dev libyaml-cpp-dev libfmt-dev libxxhash-dev)
packages+=("${more_packages[@]}")

fail() {
    echo "${0##*/}: $*" >&2
    exit 1
}

# step TEXT LOG COMMAND...: runs quietly; a failure shows the end of the log.
step() {
    local text=$1 log=$logs/$2 start=$SECONDS
    shift 2
    printf '%s ... ' "$text"
    if ! "$@" >"$log" 2>&1 </dev/null; then
        echo "failed"
        tail -n 40 "$log" >&2
        fail "$text failed; all of its output is in $log"
    fi
    echo "$((SECONDS - start)) s"
}

missing_packages() {
    comm -13 <(dpkg-query -W -f '${db:Status-Abbrev}${Package}\n' 2>/dev/null | sed -n 's/^ii *//p' | sort -u) \
        <(printf '%s\n' "${packages[@]}" | sort -u)
}

# Scripts that run at the same time install one after the other, and nothing that a package starts keeps the lock.
install_packages() {
    if ! command -v dpkg-query >/dev/null; then
        echo "no Debian packages here: taking for granted that ${packages[*]} are installed in some form"
        return
    fi
    local missing as_root=()
    ((${#packages[@]})) || return 0
    flock 9
    mapfile -t missing < <(missing_packages)
    if ((${#missing[@]} == 0)); then
        return
    fi
    if ((EUID != 0)); then
        command -v sudo >/dev/null || fail "as root, run: apt-get install --no-install-recommends ${missing[*]}"
        as_root=(sudo)
    fi
    as_root+=(env DEBIAN_FRONTEND=noninteractive apt-get -q)
    step "reading the package lists" apt-update.log "${as_root[@]}" update 9>&-
    step "installing ${#missing[@]} packages" apt-install.log \
        "${as_root[@]}" install -y --no-install-recommends "${missing[@]}" 9>&-
} 9>"$logs/packages.lock"

# build [TARGET...]: everything when none is named.
build() {
    step "configuring" configure.log cmake --preset "$preset" -S "$root" -B "$build" "${parts[@]}"
    step "building" build.log cmake --build "$build" "${@/#/--target=}"
}

# python_packages NAME...: of PyPI, in an environment for what the scripts run, whose interpreter is $python.
python_packages() {
    local tools=$root/build/python-tools
    python=$tools/bin/python
    [ -e "$python" ] || step "making a Python environment" venv.log /usr/bin/python3 -m venv "$tools"
    step "installing what is used from PyPI" pip.log "$tools/bin/pip" install "$@"
}

cd "$root"
install_packages
