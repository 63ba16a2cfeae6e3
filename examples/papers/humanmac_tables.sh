#!/bin/sh
# HumanMAC (Chen et al. 2023), Tables 1 to 7 on one data set.
#
#   sh examples/papers/humanmac_tables.sh DATA OUT [WEIGHTS]
#
# DATA: data_3d_h36m.npz, data_3d_humaneva15.npz, AMASS or a CMU pack (Tables 1 and 6 are the same of other data). WEIGHTS:
# an imported checkpoint; without it a network is trained. OUT: gets a folder for each table, with a report in it.
# Full size: days of a GPU for each row. For a smaller run set
#   TRAIN="steps=100 ..."        entries of recipes/predictor_h36m.toml
#   SIZES="--width 512 ..."      of the networks of Tables 2 to 5 and 7
#   STUDY="--train-steps 100"    options of 'motionloom evaluate study'
#   MEASURE="--samples 5"        options of 'motionloom evaluate prediction'
#   KEPT="5 10 20 30"  DEPTH="2 4 6 8 10"  NOISE="100 1000"   values of Tables 2, 3 and 5
set -eu
here=$(cd "$(dirname "$0")/../.." && pwd)
data=$1 out=$2 weights=${3:-$2/network/network.safetensors}
[ -f "$weights" ] || motionloom train predictor --recipe "$here/recipes/predictor_h36m.toml" --data "$data" \
    --out "$out/network" --set name=network ${TRAIN:-}
motionloom evaluate prediction --data "$data" --weights "$weights" --out "$out/table1" ${MEASURE:---samples 50}
study() { # TABLE NAME VALUE...
    table=$1 name=$2
    shift 2
    motionloom evaluate study "$name" --data "$data" --out "$out/$table" --keep "$out/networks" --variant published \
        ${SIZES:---width 512 --layers 8 --heads 8 --kept 20} ${STUDY:---train-steps 782000 --samples 50} --values "$@"
}
study table2 coefficients ${KEPT:-5 10 20 30}
study table3 layers ${DEPTH:-2 4 6 8 10}
study table4 schedules ${SCHEDULES:-linear cosine sqrt}
study table5 noising ${NOISE:-100 1000}
study table7 dct false true
