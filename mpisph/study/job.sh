# shellcheck shell=bash
# Sourced by the jobs of 'mpisph study script' and by scripts/mpi.sh: how ranks are
# started and asked to stop, and whether a job is to be started again.

# Stands before the command of the ranks. Until Python has its handlers, the signal that
# `launch` passes on would end a rank; so would it after the run, just before the end.
# shellcheck disable=SC2016,SC2034  # for the ranks' shell; used where this is sourced
patient=(sh -c 'trap "" USR1; exec "$@"' sh)

signals=   # those that have come, in their order
launcher=  # process that has started the ranks
asked=     # when the ranks were first asked to stop

# catch_signals: from here on, a signal to this shell asks the ranks to stop.
catch_signals() {
    local name
    # Ranks are asked by SIGUSR1 whatever the signal was; they read here which.
    MPISPH_SIGNALS=$(mktemp) || true  # without it, they say SIGUSR1
    export MPISPH_SIGNALS
    trap 'rm -f "$MPISPH_SIGNALS"' EXIT
    for name in HUP INT QUIT TERM USR1; do
        # shellcheck disable=SC2064  # each trap with its own name
        trap "note_signal $name" "$name"
    done
}

note_signal() {
    signals+=" $1"
    [[ ! $MPISPH_SIGNALS ]] || printf '%s\n' "$1" >>"$MPISPH_SIGNALS" || true
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
# `catch_signals`.
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
    local code=0
    wait "$launcher" || code=$?  # the shell remembers the true one
    # A rank that was asked before it could ignore the signal has died of it.
    if [[ $asked ]] && ((code == 128 + $(kill -l USR1))); then
        printf 'stopped before the ranks had begun\n' >&2 || true
        return 75
    fi
    return "$code"
}

# Any signal but USR1, the warning that time is nearly up.
told_to_end() { [[ $signals =~ HUP|INT|QUIT|TERM ]]; }

say() { printf 'batch: %s\n' "$*" >&2; }

# limit_walltime SECONDS: sets `walltime` to the option for a job that has so long left;
# to nothing where that is empty.
limit_walltime() {
    walltime=()
    if [[ $1 ]]; then
        # What comes after the run takes time too; and 0 would be no limit.
        local left=$(($1 - ${MPISPH_MARGIN:-60}))
        walltime=(--walltime "$((left > 0 ? left : 1))s")
    fi
}

# check_again CODE WHAT FOLDER BEFORE AFTER: returns if the job is to be started again, and
# otherwise says why not and ends this script with CODE, that of mpisph. FOLDER is where
# a file 'stop' would lie; how far all was BEFORE this start and AFTER it must differ.
check_again() {
    local code=$1 what=$2 folder=$3 before=$4 after=$5
    case $code in
    0) say "$what: done" ;;
    2) say "$what: bad input" ;;
    3) say "$what: the run is unstable" ;;
    75)
        if [[ -e $folder/stop ]]; then
            say "$what: stopped, and not started again because of the file 'stop' in $folder"
        elif told_to_end; then
            # The user or the machine wants it gone: it must not come back by itself.
            say "$what: told to end; submit it again to continue"
        elif [[ $after == "$before" ]]; then
            say "$what: not started again, for this start has not made a single step"
        else
            return 0
        fi
        ;;
    *) say "$what: failed with exit code $code: see above" ;;
    esac
    exit "$code"
}
