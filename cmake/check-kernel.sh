#!/bin/sh
# Lets clang check a kernel with the finite choices that it is built for: check-kernel.sh CLANG FOLDER KERNEL.cl STAMP
# STAMP is touched where nothing was found, and STAMP.d lists the headers. The builds are those of kernel-builds.sh. The built-in
# functions are those of builtins.h, and in the first build those of Clang's own header.
set -eu
clang=$1
folder=$2
kernel=$3
stamp=$4

"$(dirname "$0")/kernel-builds.sh" "$folder" "$kernel" | {
    builtins='-Xclang -finclude-default-header'
    while read -r defines; do
        # shellcheck disable=SC2086 # one line is several definitions
        "$clang" -x cl -cl-std=CL1.2 -I "$folder" $builtins -fsyntax-only -Wall -Werror \
            -MD -MF "$stamp.d" -MT "$stamp" $defines "$kernel" || {
            echo "$kernel does not compile with $defines" >&2
            exit 1
        }
        builtins='-cl-no-stdinc -DBUILTINS -include opencl-c-base.h'
    done
}
touch "$stamp"
