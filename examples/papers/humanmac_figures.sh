#!/bin/sh
# HumanMAC (Chen et al. 2023), Figures 3 to 6: prediction, switch, part-body control, and people it was not trained on.
#
#   sh examples/papers/humanmac_figures.sh WEIGHTS PAST TARGET DATA OUT
#
# WEIGHTS: a network of 17 joints of Human3.6M (motionloom import), or any other. PAST and TARGET: motion files, or arrays
# .npy (frames, 17, 3) in the axes of the network's data. DATA: amass_retargeted.npy, or AMASS. OUT: gets futures as BVH
# and NPZ with a picture and a film over each other, and OUT/figure6/report.md.
# SAMPLE="--steps 10" and MEASURE="--windows 5" are options of predict and switch, and of evaluate prediction.
set -eu
weights=$1 past=$2 target=$3 data=$4 out=$5
mkdir -p "$out"
motionloom predict "$past" --weights "$weights" --count 5 --out "$out/figure3" --format bvh --format npz ${SAMPLE:---steps 100}
motionloom switch "$past" "$target" --weights "$weights" --out "$out/figure4.bvh" ${SAMPLE:---steps 100}
for part in right_leg left_leg torso left_arm right_arm lower_body upper_body; do
    motionloom predict "$past" --weights "$weights" --count 5 --out "$out/figure5_$part" --seconds "${SECONDS_HELD:-1}" \
        --hold "$part" --from "$target" ${SAMPLE:---steps 100}
done
motionloom evaluate prediction --weights "$weights" --data "$data" --protocol amass --out "$out/figure6" \
    ${MEASURE:---samples 50}
