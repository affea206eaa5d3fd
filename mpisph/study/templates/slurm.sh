#!/usr/bin/env bash
# Runs the study {{ name }} in a job array of Slurm: sbatch THIS_FILE
# Every element begins with its share of the cases, then helps the others; before its time
# is up it stops and requeues itself. Adapt what follows to the cluster.
#
#SBATCH --job-name=mpisph-{{ name }}
#SBATCH --array=0-{{ jobs - 1 }}
#SBATCH --nodes=1
#SBATCH --ntasks={{ ranks }}
#SBATCH --time={{ minutes }}
##SBATCH --account=ACCOUNT
##SBATCH --partition=PARTITION
#SBATCH --signal=B:USR1@180
#SBATCH --requeue
#SBATCH --open-mode=append

set -uo pipefail

# Modules that the cluster needs for MPI, such as:
# module load openmpi

cd {{ folder }} || exit 2
part=$SLURM_ARRAY_TASK_ID/{{ jobs }}
seconds={{ 60 * minutes }}
if [[ ${SLURM_JOB_END_TIME:-} ]]; then
    seconds=$((SLURM_JOB_END_TIME - $(date +%s)))
fi
read -ra starter <<<"${MPISPH_LAUNCH:-mpirun --quiet -n {{ ranks }}}"
{% include "start.sh" %}
# Ends this job at once and puts it into the queue again.
scontrol requeue "${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID" ||
    say "that failed; submitted again, the study goes on"
exit 75
