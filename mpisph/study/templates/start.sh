
say() { printf 'study: %s\n' "$*" >&2; }
# How far the runs have come: a start that changes nothing is not repeated.
reached() { cat {{ root }}/cases/*/status.json 2>/dev/null | grep '"step"' | cksum; }

# A signal is a wish to stop: mpirun passes SIGUSR1 on, told to end it would kill.
asked=
launcher=
# shellcheck disable=SC2317,SC2329  # the traps call it
ask() {
    asked+=" $1"
    [[ ! $launcher ]] || kill -USR1 "$launcher" 2>/dev/null
}
trap 'ask USR1' USR1
trap 'ask TERM' TERM INT HUP
before=$(reached)
seconds=$((seconds > 120 ? seconds - 60 : 60))
say "$(date '+%F %T'), $(uname -n): part $part, $seconds s"
# Until Python heeds the signal, it would end a rank.
# shellcheck disable=SC2016  # for the ranks' shell
(
    trap '' USR1
    exec "${starter[@]}" sh -c 'trap "" USR1; exec "$@"' sh \
        {{ mpisph }} study run {{ study }} -o {{ root }} \
        --ranks-per-case {{ ranks_per_case }} --part "$part" --walltime "${seconds}s"
) </dev/null &
launcher=$!
# One that came before there was anybody to pass it on to.
[[ ! $asked ]] || kill -USR1 "$launcher"
code=0
while kill -0 "$launcher" 2>/dev/null; do
    wait "$launcher"
done
wait "$launcher" || code=$?

# Told to end, Open MPI's launcher returns 1 whatever its ranks did.
if ((code != 0)) && [[ $asked == *TERM* ]]; then
    say "told to end; submitted again, the study goes on"
    exit 75
elif ((code != 75)); then
    say "ended with exit code $code"
    exit "$code"
elif [[ -e {{ root }}/studies/{{ name }}/stop ]]; then
    say "stopped by the file 'stop' in the study's folder"
    exit 75
elif [[ $(reached) == "$before" ]]; then
    say "not started again, for this start has made no step"
    exit 75
fi
say "not done yet"
