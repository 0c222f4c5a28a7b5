# Read by scripts that run something on the OpenCL drivers of Debian 13, after setup.sh. Its folder is build/debian-13/, and what runs
# there sees build/ at the same path. Needs root and the network.

# root_of NAME ARCHITECTURE SUITE PACKAGES: a Debian in build/NAME.
root_of() {
    local folder=$root/build/$1
    [ -e "$folder/complete" ] && return
    rm -rf "$folder"
    debootstrap --arch="$2" --variant=minbase --include="$4" "$3" "$folder" >"$logs/$1.log" 2>&1 &&
        touch "$folder/complete"
}

# in_root NAME COMMAND...: runs it in that Debian. Its mounts end with the command.
in_root() {
    # shellcheck disable=SC2016 # the inner shell's variables
    unshare --mount --propagation private bash -c '
        set -e
        folder=$1/$2 here=$1
        shift 2
        for each in proc sys dev; do mount --rbind /$each "$folder/$each"; done
        mkdir -p "$folder$here"
        mount --bind "$here" "$folder$here"
        exec chroot "$folder" env HOME=/root "$@"' in_root "$root/build" "$@"
}

# debian_13: makes it; where it cannot be had, $no_debian_13 says why.
no_debian_13=
debian_13() {
    if ((EUID != 0)); then
        no_debian_13="that needs root"
    elif ! root_of debian-13 amd64 trixie pocl-opencl-icd,mesa-opencl-icd,ocl-icd-libopencl1; then
        no_debian_13="it cannot be made: $(tail -n 1 "$logs/debian-13.log")"
    fi
    [ ! "$no_debian_13" ]
}
