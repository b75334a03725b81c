#!/usr/bin/env bash
# Where does it break? Draws small sets beyond the usual ones, diagnoses them and prints a row of a Markdown table for each:
#   stress.sh OUT [COUNT]      COUNT cases of each class (6), of the one with 500,000 samples one
# ONLY='noise-4 loop' runs these classes. PROGRAM names a built `diagnose`. What was drawn or written before is used again.
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
    [[ -z ${ONLY:-} || " $ONLY " == *" $name "* ]] || return 0
    "$python" "$here/draw.py" --out "$out/$name" --count "$count" ${BACKDRIVE_CONCEALED:+--simulator "$BACKDRIVE_CONCEALED"} "$@" >"$out/$name.draw.log" 2>&1
    "$python" "$here/measure.py" "$out/$name/cases" "$out/$name/truth" "$out/$name/verdicts" --row "$name" \
        ${PROGRAM:+--program "$PROGRAM"} >"$out/$name.score.txt" 2>&1
    tail -n 1 "$out/$name.score.txt"
}

mkdir -p "$out"
echo '| class | cases | verdict right | confidently wrong | median s | p90 s |'
echo '|---|---|---|---|---|---|'
one noise-4 --class single --seed 11 --snr 4 --least 1.2
one noise-16 --class single --seed 12 --snr 16 --least 1.05
one margin-3-to-10 --class single --seed 22 --margin-range 3 10
one triples --class triple --seed 13
one six-bodies --class single --seed 14 --six
one short --class single --seed 15 --samples 500
one controlled --class single --seed 16 --controlled
one wrong-hold --class mixed --seed 17 --wrong-hold
one hand --class single --seed 21 --hand
one hand-nulls --class nulls --seed 31 --hand
one loop --class single --seed 23 --loop
one loop-nulls --class nulls --seed 33 --loop
one clock --class single --seed 24 --clock
one clock-nulls --class nulls --seed 34 --clock
one velocity --class single --seed 25 --velocity
one velocity-nulls --class nulls --seed 35 --velocity
one torque-constant --seed 26 --torque-constant
one load-friction --class single --seed 27 --effect load_friction
one warm-friction --class single --seed 28 --effect warm_friction
count=1
one long --class single --seed 18 --samples 500000
