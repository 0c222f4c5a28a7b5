#!/bin/sh
# Prints the builds of a kernel that are worth a look, a line of definitions each: kernel-builds.sh FOLDER KERNEL.cl [CHOICES] [MOST]
# The kernel and the headers that it includes, by their paths in FOLDER, state their finite choices in lines like this one; a
# kernel's own values replace a header's, and those of CHOICES, such as "V = 4", replace all:
#   // Built for: V = 1 4 8 16; FP64 = 0 1
# All combinations where they are MOST (0) or fewer; otherwise every pair of values of two choices is in one of the builds at least,
# since all combinations would be hundreds.
set -eu
folder=$1
kernel=$2

# Prints the lines of a file, and after them those of the headers that it includes.
choices() {
    sed -n 's|^// Built for: *||p' "$1"
    for header in $(sed -n 's|^#include "\(.*\)".*|\1|p' "$1"); do
        choices "$folder/$header"
    done
}

{
    echo "${3-}"
    choices "$kernel"
} | awk -v most_builds="${4-0}" '
    {
        gsub(/\.$/, "")
        count = split($0, parts, ";")
        for (i = 1; i <= count; ++i) {
            split(parts[i], sides, "=")
            name = sides[1]
            gsub(/ /, "", name)
            if (name == "" || name in known)
                continue
            known[name]
            names[++n] = name
            values[n] = split(sides[2], list, " ")
            for (k = 1; k <= values[n]; ++k)
                value[n, k] = list[k]
        }
    }
    function left(a, k, b, l) { return a < b ? (a, k, b, l) in open : (b, l, a, k) in open }
    END {
        if (n == 0)
            print "" # one build without definitions
        all = 1
        for (a = 1; a <= n; ++a)
            all *= values[a]
        if (n > 0 && all <= most_builds) {
            for (number = 0; number < all; ++number) {
                line = ""
                left_of = number
                for (a = 1; a <= n; ++a) {
                    line = line " -D" names[a] "=" value[a, left_of % values[a] + 1]
                    left_of = int(left_of / values[a])
                }
                print line
            }
            exit
        }
        names[++n] = "" # so that a single choice has pairs too
        values[n] = 1
        for (a = 1; a < n; ++a)
            for (b = a + 1; b <= n; ++b)
                for (k = 1; k <= values[a]; ++k)
                    for (l = 1; l <= values[b]; ++l)
                        open[a, k, b, l]
        for (a = 1; a < n; ++a)
            for (b = a + 1; b <= n; ++b)
                for (k = 1; k <= values[a]; ++k)
                    for (l = 1; l <= values[b]; ++l) {
                        if (!((a, k, b, l) in open))
                            continue
                        split("", taken)
                        taken[a] = k
                        taken[b] = l
                        for (c = 1; c <= n; ++c) { # each other choice takes the value with most pairs left
                            if (c in taken)
                                continue
                            most = -1
                            for (m = 1; m <= values[c]; ++m) {
                                gain = 0
                                for (d in taken)
                                    gain += left(c, m, d + 0, taken[d])
                                if (gain > most) {
                                    most = gain
                                    best = m
                                }
                            }
                            taken[c] = best
                        }
                        line = ""
                        for (c = 1; c <= n; ++c) {
                            for (d = c + 1; d <= n; ++d)
                                delete open[c, taken[c], d, taken[d]]
                            if (c < n)
                                line = line " -D" names[c] "=" value[c, taken[c]]
                        }
                        print line
                    }
    }'
