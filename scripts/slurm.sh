#!/usr/bin/env bash
# Runs a case under Slurm, as often as it takes until the run is done: see usage below.
# Options of sbatch on its command line go before those here.
#
# Name of the job in the queue.
#SBATCH --job-name=mpisph
# Size: ranks, and the nodes they are spread over; one rank a core.
#SBATCH --nodes=1
#SBATCH --ntasks=16
# Longest time of one start. A run that takes longer is started again, so a short time,
# which waits less in the queue, does no harm.
#SBATCH --time=04:00:00
# Your account and partition, where the cluster asks for them (remove one #).
##SBATCH --account=ACCOUNT
##SBATCH --partition=PARTITION
# Leave these three. The first sends this script SIGUSR1 three minutes before time is up;
# a large run needs more if a step and a checkpoint take longer.
#SBATCH --signal=B:USR1@180
#SBATCH --requeue
#SBATCH --open-mode=append
# Output goes to slurm-JOB.out, of an array to slurm-JOB_INDEX.out; --output changes it.

set -euo pipefail

# Modules that the cluster needs for MPI, such as:
# module load openmpi

usage() {
    cat <<'USAGE'
usage: sbatch [options of sbatch] scripts/slurm.sh CASE [-- options of 'mpisph run']
       sbatch --array=0-N [...] scripts/slurm.sh CASE... [-- options of 'mpisph run']

Runs CASE in runs/<name of the case> below the folder of submission; an element of a job
array runs the CASE of its number, from 0 on. Shortly before its time is up, the run
writes a checkpoint and the job requeues itself, until the run is done, unstable or wrong,
a file 'stop' lies in its folder, or a start makes no step. After a node has failed, the
run continues from its last checkpoint.

  -o FOLDER        (an option of 'mpisph run') where the run goes; of several, their folders
  MPISPH_RUNS      instead of 'runs'
  MPISPH_LAUNCH    what starts the ranks, such as 'srun --kill-on-bad-exit=1'; default
                   'mpirun --quiet -n TASKS'
  MPISPH_MARGIN    seconds of the job's time that are not the run's (default 60)
  MPISPH_HOME      the checkout, where this script does not find it

Exit code: that of mpisph; 2 also for a wrong call, 75 where the run is to be continued.
USAGE
}

case ${1:-} in
-h | --help)
    usage
    exit 0
    ;;
esac
if [[ ! ${SLURM_JOB_ID:-} ]]; then
    usage >&2
    exit 2
fi

# Slurm runs a copy of this script elsewhere, and knows where it came from.
submitted=$(scontrol show job "$SLURM_JOB_ID" 2>/dev/null |
    sed -n 's/^ *Command=\([^ ]*\).*/\1/p') || true
for home in "${MPISPH_HOME:-}" "${submitted%/*}/.." "${SLURM_SUBMIT_DIR:-.}" \
    "$(dirname "${BASH_SOURCE[0]}")/.."; do
    [[ ! -f $home/scripts/batch.sh ]] || break
done
if [[ ! -f $home/scripts/batch.sh ]]; then
    echo "slurm.sh: set MPISPH_HOME to the checkout of mpisph" >&2
    exit 2
fi
# shellcheck source=scripts/batch.sh
source "$home/scripts/batch.sh"
catch_signals

job=$SLURM_JOB_ID
if [[ ${SLURM_ARRAY_TASK_ID:-} ]]; then
    # The plain number of one element is that of the whole array.
    job=${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID
fi
choose_case "${SLURM_ARRAY_TASK_ID:-}" "$@"

# Older versions of Slurm do not tell; then the signal alone ends the run in time.
left=
if [[ ${SLURM_JOB_END_TIME:-} ]]; then
    left=$((SLURM_JOB_END_TIME - $(date +%s)))
fi
restarted=
if ((${SLURM_RESTART_COUNT:-0})); then
    restarted=yes
fi
read -ra starter <<<"${MPISPH_LAUNCH:-mpirun --quiet ${SLURM_NTASKS:+-n $SLURM_NTASKS}}"
run_case "$restarted" "$left" "${starter[@]}"

say "$folder: not done yet; requeueing job $job"
# Ends this job at once and puts it into the queue again.
scontrol requeue "$job" ||
    say "that failed; submit it again to continue the run"
exit 75
