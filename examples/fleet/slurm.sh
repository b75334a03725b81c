#!/bin/bash
# A fleet as an array of Slurm: every task answers one shard, and the last one to finish writes the table.
#   sbatch examples/fleet/slurm.sh /shared/fleet.toml /shared/out
# Dry run without Slurm, one task after the other:
#   TASKS=4 examples/fleet/slurm.sh recordings/ out/fleet
#SBATCH --job-name=backdrive-fleet
#SBATCH --array=1-100
#SBATCH --cpus-per-task=1
#SBATCH --mem=1G
#SBATCH --requeue
set -euo pipefail
manifest=$1
out=$2
shift 2
if [ -n "${SLURM_ARRAY_TASK_ID:-}" ]; then
    exec backdrive fleet "$manifest" --out "$out" --jobs "${SLURM_CPUS_PER_TASK:-1}" \
        --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT" "$@"
fi
tasks=${TASKS:-4}
for task in $(seq "$tasks"); do
    # 1 means that a unit changed: the table is there.
    backdrive fleet "$manifest" --out "$out" --jobs 1 --shard "$task/$tasks" "$@" || [ $? = 1 ]
done
