#!/bin/sh
# PriorMDM (Shafir et al. 2024), Table 3: prefix completion of two people, with MRT, Com only and both ablations.
#
#   sh examples/papers/table3.sh PAIRS OUT [WEIGHTS]
#
# PAIRS: 3DPW as its owners distribute it, ComMDM's processed folder dataset/3dpw (new_joint_vecs, canon_data, text), or a
# pack of pairs. WEIGHTS: the prior, an imported checkpoint or a shipped name. OUT: gets a block for each row, the
# transformer, and OUT/table3/completion/report.md. Blocks that are finished are not trained again.
# Full size: 8 blocks and MRT, hours of a GPU. For a smaller run set
#   TRAIN="steps=100 ..."   entries of recipes/duet.toml
#   LAYERS="6 4 2 0"        after which layers of the prior a block sits, besides the last
#   DEPTHS="2 4"            layers of the deeper blocks
#   MRT=100000              steps of the multi-range transformer
#   MEASURE="--crops 20"    options of 'motionloom evaluate duet'
set -eu
here=$(cd "$(dirname "$0")/../.." && pwd)
pairs=$1 out=$2 weights=${3:-default}
mkdir -p "$out"
bare=$out/bare.safetensors
[ -f "$bare" ] || motionloom evaluate duet --data "$pairs" --weights "$weights" --write-bare "$bare"
beside=
train() { # NAME PRIOR ENTRY...
    name=$1 prior=$2
    shift 2
    [ -f "$out/$name/$name.safetensors" ] || motionloom train duet --recipe "$here/recipes/duet.toml" --pairs "$pairs" \
        --out "$out/$name" --set "name=$name" "start=$prior" pair.aware=false "$@" ${TRAIN:-}
}
train com_mdm "$weights"
train com_only "$bare"
for depth in ${DEPTHS-2 4}; do
    train "com_mdm_${depth}layers" "$weights" "pair.layers=$depth"
    beside="$beside $out/com_mdm_${depth}layers/com_mdm_${depth}layers.safetensors"
done
for layer in ${LAYERS-6 4 2 0}; do
    train "com_mdm_layer$layer" "$weights" "pair.split=$layer"
    beside="$beside $out/com_mdm_layer$layer/com_mdm_layer$layer.safetensors"
done
motionloom evaluate duet --only completion --data "$pairs" --weights "$weights" --out "$out/table3" \
    --block "$out/com_mdm/com_mdm.safetensors" --communication-only "$out/com_only/com_only.safetensors" \
    --train-mrt "${MRT:-100000}" ${beside:+--beside $beside} ${MEASURE:---crops 1000 --steps 1000 --given published}
