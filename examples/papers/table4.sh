#!/bin/sh
# PriorMDM (Shafir et al. 2024), Table 4: control by inpainting, by fine-tuned networks and by blending them.
#
#   sh examples/papers/table4.sh WEIGHTS DATA EVALUATOR OUT [NETWORK...]
#
# WEIGHTS: the prior without control, an imported checkpoint or a shipped name. DATA: the HumanML3D folder, or a built
# set. EVALUATOR: Guo's, imported, or own. NETWORK: fine-tuned networks that are there, such as imported left_wrist and
# root_horizontal, or adapters of WEIGHTS; CONTROL=FILE where a file's name does not say its control. Without any, one is
# trained for each control on SET, a built set (motionloom data build). OUT/table4/report.md has the table.
# Full size: days of a GPU. For a smaller run set
#   CONTROLS="trajectory left_wrist"   what is trained
#   TRAIN="steps=100 ..."              entries of recipes/control.toml (full=false: adapters, as shipped)
#   KINDS=trajectory,left_wrist        goals that are measured (default: all of the paper's and more)
#   MEASURE="--count 8 --steps 4"      options of 'motionloom evaluate control'
set -eu
here=$(cd "$(dirname "$0")/../.." && pwd)
weights=$1 data=$2 judge=$3 out=$4
shift 4
if [ $# -eq 0 ]; then
    for control in ${CONTROLS:-trajectory left_wrist right_foot}; do
        file=$out/$control/$control.safetensors
        [ -f "$file" ] || motionloom train control --recipe "$here/recipes/control.toml" --data "${SET:-$data}" \
            --out "$out/$control" --set "name=$control" "control=$control" "start=$weights" full=true given_rank=0 \
            rate=1e-4 "sources=[]" ${TRAIN:-}
        set -- "$@" "$control=$file"
    done
fi
motionloom evaluate control --weights "$weights" --adapters "$@" --data "$data" --evaluator "$judge" \
    --out "$out/table4" ${KINDS:+--kinds $KINDS} ${MEASURE:---count 1000 --replications 20 --steps 1000 --guidance 2.5}
