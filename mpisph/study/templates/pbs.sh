#!/usr/bin/env bash
# Runs a study in a job array of PBS: qsub -J 0-{{ jobs - 1 }} THIS_FILE
# Every element begins with its share of the cases, then helps the others; before its time
# is up it stops and submits itself again as a job of its own. Adapt what follows to the
# cluster.
#
#PBS -N {{ job_name }}
#PBS -l select=1:ncpus={{ ranks }}:mpiprocs={{ ranks }}
#PBS -l walltime={{ "%02d:%02d:00" % (minutes // 60, minutes % 60) }}
##PBS -A ACCOUNT
##PBS -q QUEUE
#PBS -j oe
#PBS -r y
#PBS -S /bin/bash

set -uo pipefail

# Modules that the cluster needs for MPI, such as:
# module load openmpi

cd {{ folder }} || exit 2
source {{ job_sh }} || exit 2
catch_signals
element=${PBS_ARRAY_INDEX:-${MPISPH_ELEMENT:-0}}
part=$element/{{ jobs }}
left={{ 60 * minutes }}
if [[ ${MPISPH_LAUNCH:-} ]]; then
    read -ra starter <<<"$MPISPH_LAUNCH"
else
    starter=(mpirun --quiet -n {{ ranks }} --hostfile "$PBS_NODEFILE")
fi
{% include "start.sh" %}
# By name: qsub would take a comma in a value for the end of it.
export MPISPH_ELEMENT=$element MPISPH_SCRIPT=${MPISPH_SCRIPT:-${BASH_SOURCE[0]}}
qsub -v "MPISPH_ELEMENT,MPISPH_SCRIPT${MPISPH_LAUNCH:+,MPISPH_LAUNCH}" "$MPISPH_SCRIPT" ||
    say "that failed; submit it again to continue the study"
exit 75
