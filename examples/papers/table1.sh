#!/bin/sh
# PriorMDM (Shafir et al. 2024), Table 1: DoubleTake over BABEL, with and without transition embedding and geometric losses.
#
#   sh examples/papers/table1.sh BABEL OUT
#
# BABEL: a folder with train.json, val.json and AMASS's recordings (docs/babel.md). OUT: gets the set, four priors, the
# evaluator and OUT/table1/report.md, with transitions of 70 frames and of 30. Runs that stopped go on.
# Full size: days of a GPU for each prior. For a smaller run, or Guo's evaluator for BABEL, set
#   TRAIN="steps=100 ..."  JUDGE="steps=100 ..."  entries of recipes/babel.toml and recipes/babel_evaluator.toml
#   MEASURE="--steps 24"   options of 'motionloom evaluate transitions'
#   EVALUATOR=FILE         an evaluator that is there: none is trained
set -eu
here=$(cd "$(dirname "$0")/../.." && pwd)
babel=$1 out=$2
[ -f "$out/set/set.json" ] || motionloom data build "$babel" --features babel --out "$out/set"
train() { # NAME ENTRY...
    name=$1
    shift
    motionloom train prior --recipe "$here/recipes/babel.toml" --data "$out/set" --out "$out/$name" \
        --set "name=$name" "$@" ${TRAIN:-}
}
train plain net.flags=false
train geometric geometric=1.0
train embedded net.flags=true
train embedded_geometric net.flags=true geometric=1.0
judge=${EVALUATOR:-$out/judge/judge.safetensors}
[ -n "${EVALUATOR:-}" ] || motionloom train evaluator --recipe "$here/recipes/babel_evaluator.toml" --data "$out/set" \
    --out "$out/judge" --set name=judge ${JUDGE:-}
motionloom evaluate transitions --rows table1 --data "$out/set" --evaluator "$judge" --out "$out/table1" \
    --weights "$out/plain/plain.safetensors" --beside "$out/geometric/geometric.safetensors" \
    "$out/embedded/embedded.safetensors" "$out/embedded_geometric/embedded_geometric.safetensors" \
    ${MEASURE:---steps 1000 --replications 10}
