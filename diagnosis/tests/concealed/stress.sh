#!/usr/bin/env bash
# Where does it break? Draws small sets beyond the usual ones, diagnoses them and sums up:
#   stress.sh OUT [COUNT]      COUNT cases of each kind (6)
# Needs numpy, scipy and gcc, and the independent simulator in ../shared/concealed (or where BACKDRIVE_CONCEALED says).
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
out=${1:?usage: stress.sh OUT [COUNT]}
count=${2:-6}
python=${PYTHON:-python3}
export OPENBLAS_NUM_THREADS=1

one() { # NAME OPTIONS-OF-DRAW...
    local name=$1
    shift
    "$python" "$here/draw.py" --out "$out/$name" --count "$count" "$@" >"$out/$name.draw.log" 2>&1
    "$python" "$here/measure.py" "$out/$name/cases" "$out/$name/truth" "$out/$name/verdicts" ${PROGRAM:+--program "$PROGRAM"} >"$out/$name.score.txt" 2>&1
    printf '== %s\n' "$name"
    sed -n '/verdict right/p;/detection, single/p;/false alarms (/p;/single: physics and place/p;/doubles*: /p;/time/p' "$out/$name.score.txt"
}

mkdir -p "$out"
one noise-4 --class single --seed 11 --snr 4 --least 1.2
one noise-16 --class single --seed 12 --snr 16 --least 1.05
one triples --class triple --seed 13
one six-bodies --class single --seed 14 --six
one short --class single --seed 15 --samples 500
one controlled --class single --seed 16 --controlled
one wrong-hold --class mixed --seed 17 --wrong-hold
count=1
one long --class single --seed 18 --samples 500000
