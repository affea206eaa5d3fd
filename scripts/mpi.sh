# shellcheck shell=bash
# Sourced by scripts/setup, scripts/run, scripts/test and scripts/batch.sh.

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

# Stands before the command of the ranks. Until Python has its handlers, the signal that
# `launch` passes on would end a rank; so would it after the run, just before the end.
# shellcheck disable=SC2016,SC2034  # for the ranks' shell; used where this is sourced
patient=(sh -c 'trap "" USR1; exec "$@"' sh)

signals=   # those that have come, in their order
launcher=  # process that has started the ranks
asked=     # when the ranks were first asked to stop

# heed_signals: from here on, a signal to this shell is a wish to stop the ranks.
heed_signals() {
    local name
    for name in HUP INT QUIT TERM USR1; do
        # shellcheck disable=SC2064  # each trap with its own name
        trap "note_signal $name" "$name"
    done
}

note_signal() {
    signals+=" $1"
    if [[ ! $launcher ]]; then
        return 0
    elif [[ ! $asked ]]; then
        ask_ranks
    # Not at once: 'timeout' sends its signal twice, and so may a terminal that closes.
    elif [[ $1 == INT || $1 == TERM ]] && ((SECONDS >= asked + 2)); then
        kill -TERM "$launcher" 2>/dev/null || true
    fi
}

# Asks the ranks to write a checkpoint and end. Open MPI's launcher passes SIGUSR1 on and
# waits; told to end itself, it would kill them a second later.
ask_ranks() {
    asked=$SECONDS
    printf 'signal%s: the ranks are asked to write a checkpoint and stop\n' \
        "$signals" >&2 || true
    # Again and again, for what comes too early is ignored; and not in the first moment,
    # when the launcher itself does not yet ignore it.
    { sleep 0.1 && while kill -USR1 "$launcher"; do sleep 1; done; } >/dev/null 2>&1 &
}

# launch COMMAND...: starts ranks and returns the exit code of their launcher, after
# `heed_signals`.
launch() {
    # In the background, for only 'wait' lets a trap run at once.
    (trap '' USR1 && exec "$@") </dev/null &
    launcher=$!
    # One that came before there was anybody to pass it on to.
    [[ ! $signals || $asked ]] || ask_ranks
    # A signal ends 'wait' early, with a code of its own.
    while kill -0 "$launcher" 2>/dev/null; do
        wait "$launcher" || true
    done
    wait "$launcher"  # the shell remembers the true one
}
