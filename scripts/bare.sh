# Read by scripts that try something in a bare Debian, after setup.sh. `suite` is its name: bookworm or trixie. Needs root or
# sudo, and the network. The base and the packages that it loads are kept in build/bare-debian/SUITE/.

as_root=()
((EUID == 0)) || as_root=(sudo)
kept=$root/build/bare-debian/$suite
mkdir -p "$kept/archives"

# make_base: what a new system starts from. Fails where no system can be made.
make_base() {
    [ ! -e "$kept/base/etc/debian_version" ] || return 0
    "${as_root[@]}" rm -rf "$kept/base" "$kept/base.part" &&
        "${as_root[@]}" debootstrap --variant=minbase "$suite" "$kept/base.part" &&
        "${as_root[@]}" mv "$kept/base.part" "$kept/base"
}

# new_bare_system: in $bare, with the project in /fathom.
bare=
new_bare_system() {
    remove_bare_system
    make_base
    bare=$(mktemp -d "$kept/system.XXXXXX")
    "${as_root[@]}" cp -a "$kept/base/." "$bare"
    "${as_root[@]}" cp /etc/resolv.conf /etc/hosts "$bare/etc/"
    "${as_root[@]}" ln -sf ../proc/self/mounts "$bare/etc/mtab" # as where Debian was installed; Blender complains without it
    # `apt` asks no question, and keeps what it loads. `sudo` is what the pages say, and the bare system has none.
    printf '%s\n' 'APT::Get::Assume-Yes "true";' 'Binary::apt::APT::Keep-Downloaded-Packages "true";' \
        'APT::Keep-Downloaded-Packages "true";' | "${as_root[@]}" tee "$bare/etc/apt/apt.conf.d/90unattended" >/dev/null
    echo force-unsafe-io | "${as_root[@]}" tee "$bare/etc/dpkg/dpkg.cfg.d/quick" >/dev/null # nobody needs it after a crash
    printf '#!/bin/sh\nexec "$@"\n' | "${as_root[@]}" install -m 755 /dev/stdin "$bare/usr/local/bin/sudo"
    "${as_root[@]}" mkdir "$bare/fathom"
    git -C "$root" ls-files -z --cached --others --exclude-standard | tar -C "$root" --null -T - -c |
        "${as_root[@]}" tar -C "$bare/fathom" -x
    in_bare_system "apt-get update"
}
remove_bare_system() {
    [ -z "$bare" ] || "${as_root[@]}" rm -rf --one-file-system "$bare"
}
trap remove_bare_system EXIT

# no_longer_bare: what runs from now on sees ../shared and the certificates of this system, which pip may need.
more_in_bare_system=()
no_longer_bare() {
    local certificates=${PIP_CERT:-/etc/ssl/certs/ca-certificates.crt}
    if [ -r "$certificates" ]; then
        "${as_root[@]}" install -m 644 "$certificates" "$bare/etc/certificates-of-the-host.crt"
        more_in_bare_system=(PIP_CERT=/etc/certificates-of-the-host.crt)
    fi
    "${as_root[@]}" mkdir "$bare/shared"
}

# in_bare_system COMMANDS: in the project's folder. What it mounts is gone when it ends: it has mounts of its own.
in_bare_system() {
    # PoCL asks /proc and /sys what processor it runs on. A user namespace, as tests make them, needs a root that no chroot made.
    # shellcheck disable=SC2016
    "${as_root[@]}" unshare --mount --propagation private bash -euc '
        bare=$1 archives=$2 shared=$3 commands=$4
        shift 4
        mount --bind "$bare" "$bare"
        mount -t proc proc "$bare/proc"
        mount --rbind /sys "$bare/sys"
        mount --rbind /dev "$bare/dev"
        mount --bind "$archives" "$bare/var/cache/apt/archives"
        if [ -d "$bare/shared" ] && [ -d "$shared" ]; then
            mount --bind -o ro "$shared" "$bare/shared"
        fi
        cd "$bare"
        pivot_root . mnt
        umount --lazy /mnt
        exec chroot . /usr/bin/env -i HOME=/root LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
            PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin "$@" \
            bash -euo pipefail -c "cd /fathom; set -x; $commands"' - "$bare" "$kept/archives" "$root/../shared" "$1" \
        "${more_in_bare_system[@]}"
}
