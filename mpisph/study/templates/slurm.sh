#!/usr/bin/env bash
# Runs a study in a job array of Slurm: sbatch THIS_FILE
# Every element begins with its share of the cases, then helps the others; before its time
# is up it stops and requeues itself. Adapt what follows to the cluster.
#
#SBATCH --job-name={{ job_name }}
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
source {{ job_sh }} || exit 2
catch_signals
part=$SLURM_ARRAY_TASK_ID/{{ jobs }}
left={{ 60 * minutes }}
if [[ ${SLURM_JOB_END_TIME:-} ]]; then
    left=$((SLURM_JOB_END_TIME - $(date +%s)))
fi
read -ra starter <<<"${MPISPH_LAUNCH:-mpirun --quiet -n {{ ranks }}}"
{% include "start.sh" %}
# Ends this job at once and puts it into the queue again.
scontrol requeue "${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID" ||
    say "that failed; submit it again to continue the study"
exit 75
