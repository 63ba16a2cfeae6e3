#!/bin/sh
# PriorMDM (Shafir et al. 2024), Table 2: nine settings of DoubleTake over HumanML3D's test set.
#
#   sh examples/papers/table2.sh WEIGHTS HUMANML3D EVALUATOR OUT
#
# WEIGHTS: an imported checkpoint, or a shipped name. HUMANML3D: the data set's folder. EVALUATOR: Guo's, imported, or own.
# OUT/report.md has the nine rows beside the published ones. A run that stopped goes on. Full size: days of a GPU.
# For a smaller run set MEASURE to options of 'motionloom evaluate transitions', such as "--steps 24 --replications 3".
set -eu
motionloom evaluate transitions --rows table2 --weights "$1" --data "$2" --evaluator "$3" --out "$4" \
    ${MEASURE:---steps 1000 --replications 10}
