#!/usr/bin/env bash
# Runs a case under PBS Pro or OpenPBS, as often as it takes until the run is done: see
# usage below.
#
# Name of the job in the queue.
#PBS -N mpisph
# Size: nodes, and on each of them cores and ranks, one rank a core.
#PBS -l select=1:ncpus=16:mpiprocs=16
# Longest time of one start. A run that takes longer is started again, so a short time,
# which waits less in the queue, does no harm.
#PBS -l walltime=04:00:00
# Your account and queue, where the cluster asks for them (remove one #).
##PBS -A ACCOUNT
##PBS -q QUEUE
# Leave these: output and errors in one file; after a node has failed, run again; bash,
# whatever the login shell.
#PBS -j oe
#PBS -r y
#PBS -S /bin/bash

set -euo pipefail

# Modules that the cluster needs for MPI, such as:
# module load openmpi

usage() {
    cat <<'USAGE'
usage: qsub [options of qsub] -v CASE=FILE scripts/pbs.sh
       CASE="FILE..." ARGS="options of 'mpisph run'" \
           qsub [-J 0-N] [options of qsub] -v CASE,ARGS scripts/pbs.sh

Runs CASE in runs/<name of the case> below the folder of submission; an element of a job
array (-J) runs the CASE of its number, from 0 on. Shortly before its time is up, the run
writes a checkpoint and the job submits itself again, until the run is done, unstable or
wrong, a file 'stop' lies in its folder, or a start makes no step. After a node has
failed, the run continues from its last checkpoint. An element of an array is submitted
again as a job of its own.

Variables, to be named after -v; CASE and ARGS are split at spaces:

  CASE             one case file, or one for each element of an array
  ARGS             options of 'mpisph run'; -o FOLDER: where the run goes; of several,
                   their folders
  MPISPH_RUNS      instead of 'runs'
  MPISPH_LAUNCH    what starts the ranks; default 'mpirun --quiet' with PBS's list of nodes
  MPISPH_WALLTIME  the job's time, h:mm:ss, where qstat cannot be asked on the node
  MPISPH_MARGIN    seconds of it that are not the run's (default 60)
  MPISPH_QSUB      options of qsub for submitting again, such as '-A ACCOUNT'; size, time,
                   name and queue stay as they are, others are those in the script
  MPISPH_HOME      the checkout, where it is not the folder of submission
  MPISPH_SCRIPT    the script to submit again; default the copy of it that PBS runs

Exit code: that of mpisph; 2 also for a wrong call, 75 where the run is to be continued.
USAGE
}

case ${1:-} in
-h | --help)
    usage
    exit 0
    ;;
esac
if [[ ! ${PBS_JOBID:-} ]]; then
    usage >&2
    exit 2
fi

# PBS starts in the home folder.
cd "${PBS_O_WORKDIR:-.}"
# PBS runs a copy of this script elsewhere, and does not say where it came from.
for home in "${MPISPH_HOME:-}" "$PWD" .. "$(dirname "${BASH_SOURCE[0]}")/.."; do
    [[ ! -f $home/scripts/batch.sh ]] || break
done
if [[ ! -f $home/scripts/batch.sh ]]; then
    echo "pbs.sh: set MPISPH_HOME to the checkout of mpisph" >&2
    exit 2
fi
# shellcheck source=scripts/batch.sh
source "$home/scripts/batch.sh"
catch_signals

# job_attribute NAME: what PBS says of this job; it folds long lines.
job_attribute() {
    qstat -f "$PBS_JOBID" 2>/dev/null | sed -e ':more;N;$!b more;s/\n\t//g' |
        sed -n "s/^ *$1 = //p" || true
}

# seconds H:MM:SS
seconds() {
    local part total=0
    [[ $1 =~ ^[0-9]+(:[0-9]+)*$ ]] || bad_input "$1: expected a time such as 4:00:00"
    for part in ${1//:/ }; do
        total=$((60 * total + 10#$part))
    done
    echo "$total"
}

index=${PBS_ARRAY_INDEX:-${MPISPH_INDEX:-}}
[[ ${CASE:-}${ARGS:-} != *$'\n'* ]] || bad_input "CASE and ARGS: expected one line each"
read -ra cases <<<"${CASE:-}"
read -ra arguments <<<"${ARGS:-}"
choose_case "$index" "${cases[@]}" -- "${arguments[@]}"

# PBS gives no warning, so the run itself must watch its time.
left=
limit=${MPISPH_WALLTIME:-$(job_attribute Resource_List.walltime)}
if [[ $limit ]]; then
    left=$(seconds "$limit")
    left=$((left - SECONDS))
else
    say "no time limit known (see MPISPH_WALLTIME): this job will not start itself again"
fi
if [[ ${MPISPH_LAUNCH:-} ]]; then
    read -ra starter <<<"$MPISPH_LAUNCH"
else
    starter=(mpirun --quiet -n "$(wc -l <"$PBS_NODEFILE")" --hostfile "$PBS_NODEFILE")
fi
run_case "${MPISPH_RESTARTED:-}" "$left" "${starter[@]}"

# What was on the command line of qsub counts no more than what is in the script.
again=(-N "${PBS_JOBNAME:-mpisph}")
for name in select place walltime; do
    value=$(job_attribute "Resource_List.$name")
    [[ ! $value ]] || again+=(-l "$name=$value")
done
[[ ! ${PBS_O_QUEUE:-} ]] || again+=(-q "$PBS_O_QUEUE")
read -ra more <<<"${MPISPH_QSUB:-}"
script=${MPISPH_SCRIPT:-${BASH_SOURCE[0]}}
[[ -f $script ]] || script=$home/scripts/pbs.sh
export CASE ARGS=${ARGS:-} MPISPH_INDEX=$index MPISPH_RESTARTED=yes
names=$(IFS=, && echo "CASE,ARGS,${!MPISPH_*}")

say "$folder: not done yet; submitting again"
qsub "${again[@]}" "${more[@]}" -v "$names" "$script" ||
    say "that failed; submit it again to continue the run"
exit 75
