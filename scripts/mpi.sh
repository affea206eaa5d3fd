# shellcheck shell=bash
# Sourced by scripts/setup, scripts/run, scripts/test and scripts/batch.sh.
# shellcheck source=mpisph/study/job.sh
source "$(dirname "${BASH_SOURCE[0]}")/../mpisph/study/job.sh"

# The cores this process may use: Open MPI counts a core with two threads once.
usable_cores() {
    local threads cores
    # nproc would answer with OMP_NUM_THREADS where that is set.
    threads=$(env -u OMP_NUM_THREADS -u OMP_THREAD_LIMIT nproc)
    cores=$(lscpu --parse=CORE,SOCKET | grep -v '^#' | sort -u | wc -l)
    echo $((cores < threads ? cores : threads))
}

# mpi_settings RANKS: exports what Open MPI needs to start RANKS ranks on this machine.
mpi_settings() {
    # Started by an MPI process, mpirun would take itself for one of its ranks, and fail.
    if [[ -v PMIX_NAMESPACE ]]; then
        unset "${!OMPI_@}" "${!ORTE_@}" "${!PMIX_@}"
    fi
    if ((EUID == 0)); then
        export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
    fi
    # Without these, waiting ranks spin on the cores that the others need.
    if (($1 > $(usable_cores))); then
        export OMPI_MCA_rmaps_base_oversubscribe=1
        export OMPI_MCA_mpi_yield_when_idle=1
        export OMPI_MCA_hwloc_base_binding_policy=none
    fi
}
