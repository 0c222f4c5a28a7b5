#!/bin/sh
# Lets clang check every kernel, with every value of each finite choice that it is built for, though not every
# combination of them: check-kernels.sh CLANG KERNEL_DIR
set -eu
clang=$1
cd "$2"

check() { # FILE DEFINES...
    file=$1
    shift
    for arithmetic in "-DFP64=0 -DSTREAM=0" "-DFP64=0 -DSTREAM=1" "-DFP64=1 -DSTREAM=0" "-DFP64=1 -DSTREAM=1"; do
        # shellcheck disable=SC2086 # two words
        "$clang" -x cl -cl-std=CL1.2 -Xclang -finclude-default-header -fsyntax-only -Wall -Werror $arithmetic "$@" "$file"
    done
}

for lanes in 1 4 8 16; do
    for form in 0 1 2 3 4 5; do
        check linearize.cl -DV=$lanes -DFORM=$form -DSTORAGE=0 -DPIXEL_TERMS=$((form % 2)) -DW_IS_DEPTH=$((form % 2))
        check inverse_depth.cl -DV=$lanes -DFORM=$form -DSTORAGE=0 -DPIXEL_TERMS=$((form % 2)) -DW_IS_DEPTH=$((form % 2)) \
            -DPERSPECTIVE=$((form / 3))
    done
    for choices in 000 011 112 022 123 034 135; do # telecentric or not, CIRCLE, and a FORM that it comes from
        telecentric=${choices%??} form=${choices#??}
        circle=${choices#?}
        check dof_masks.cl -DV=$lanes -DCIRCLE=${circle%?} -DFORM=$form -DSTORAGE=$((form % 5)) -DTELECENTRIC=$telecentric \
            -DPIXEL_TERMS=$((form % 2)) -DW_IS_DEPTH=$((form % 2)) -DWEIGHTS=$((form % 2))
    done
    check near_field_tiles.cl -DV=$lanes
    check near_field_weight.cl -DV=$lanes
    check mixed_pixels.cl -DV=$lanes
    for output in 0 1 2; do
        check near_field.cl -DV=$lanes -DOUTPUT=$output
    done
    for storage in 1 2 3 4; do
        check linearize.cl -DV=$lanes -DFORM=0 -DSTORAGE=$storage -DPIXEL_TERMS=0 -DW_IS_DEPTH=1
    done
    for channels in 3 4; do
        check unproject.cl -DV=$lanes -DFORM=1 -DSTORAGE=0 -DCHANNELS=$channels -DPIXEL_TERMS=1 \
            -DW_IS_DEPTH=$((channels - 3))
        for radius in 0 3; do
            check normals.cl -DV=$lanes -DPERSPECTIVE=$((channels - 3)) -DCHANNELS=$channels -DRADIUS=$radius
        done
    done
    for channels in 3 4; do
        check dof_farthest.cl -DV=$lanes -DCHANNELS=$channels
        check dof_clear.cl -DV=$lanes -DCHANNELS=$channels -DPLANES=$((2 * channels + 4)) -DWIDE=1
        check dof_clear.cl -DV=$lanes -DCHANNELS=$channels -DPLANES=$((2 * channels + 7)) -DWIDE=0
        for behind in 0 1; do
            check dof_behind.cl -DV=$lanes -DCHANNELS=$channels -DCLEAN_PLATE=$behind
            check dof_tiles.cl -DV=$lanes -DCHANNELS=$channels -DBEHIND=$behind
            check dof_strips.cl -DV=$lanes -DCHANNELS=$channels -DFILL=0 -DBRIGHT=$behind -DBEHIND=1 -DMOMENT=1
            for bright in 0 1; do
                check dof_parts.cl -DV=$lanes -DCHANNELS=$channels -DBRIGHT=$bright -DDIRECT=$behind
            done
        done
        for element in 0 1 2 3; do
            check dof_planes.cl -DV=$lanes -DCHANNELS=$channels -DELEMENT=$element -DCLEAN_PLATE=$((element % 2))
            check dof.cl -DV=$lanes -DCHANNELS=$channels -DELEMENT=$element
        done
        for fill in 0 1; do
            for bright in 0 1; do
                check dof_strips.cl -DV=$lanes -DCHANNELS=$channels -DFILL=$fill -DBRIGHT=$bright -DBEHIND=$fill -DMOMENT=0
                check dof_gather.cl -DV=$lanes -DCHANNELS=$channels -DFILL=$fill -DBRIGHT=$bright -DDIRECT=$((1 - bright)) \
                    -DBEHIND=$fill
            done
        done
    done
    for perspective in 0 1; do
        for choice in 0 1; do
            for thickness in 0 1 2; do
                check ssao_planes.cl -DV=$lanes -DPERSPECTIVE=$perspective -DTHICKNESS=$thickness -DGIVEN_NORMALS=$choice \
                    -DCLAMP=$choice -DEVERY=$((1 + choice))
            done
            check ssao.cl -DV=$lanes -DPERSPECTIVE=$perspective -DCONFIDENCE=$choice -DBENT=$choice
            for output in 0 1 2; do
                check joint_upsample.cl -DV=$lanes -DPERSPECTIVE=$perspective -DOUTPUT=$output
                check denoise.cl -DV=$lanes -DPERSPECTIVE=$perspective -DREACH=$((2 * choice)) -DOUTPUT=$output \
                    -DCLAMP=$choice
            done
        done
    done
done
for file in *.cl; do
    case $file in
    denoise.cl | dof.cl | dof_behind.cl | dof_clear.cl | dof_farthest.cl | dof_gather.cl | dof_masks.cl | dof_parts.cl | dof_planes.cl | dof_strips.cl | dof_tiles.cl | joint_upsample.cl | linearize.cl | mixed_pixels.cl | near_field.cl | near_field_weight.cl | near_field_tiles.cl | normals.cl | inverse_depth.cl | ssao.cl | ssao_planes.cl | unproject.cl) ;;
    *)
        echo "check-kernels.sh does not know the choices of $file" >&2
        exit 1
        ;;
    esac
done
