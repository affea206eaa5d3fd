# shellcheck shell=bash
# Sourced by scripts/slurm.sh and scripts/pbs.sh, which set `home` to the checkout: what
# they share. One start of a job runs one case, until it ends or time is up.
# shellcheck source=scripts/mpi.sh
source "${home:?}/scripts/mpi.sh"
home=$(cd "$home" && pwd)

bad_input() {
    say "$*"
    exit 2
}

# choose_case INDEX CASE... [-- OPTION...]: sets `case`, `folder` and `options` for the
# element INDEX of a job array, or for a single job, whose INDEX is empty.
choose_case() {
    local index=$1 cases=() output='' twice
    shift
    while (($#)) && [[ $1 != -- ]]; do
        cases+=("$1")
        shift
    done
    options=()
    while (($# > 1)); do
        shift
        case $1 in
        -o | --output)
            (($# > 1)) || bad_input "$1 needs a folder"
            output=$2
            shift
            ;;
        --output=*) output=${1#*=} ;;
        -o*) output=${1#-o} ;;
        --force) bad_input "--force: each start of a job would start over; remove the folder" ;;
        *) options+=("$1") ;;
        esac
    done

    ((${#cases[@]})) || bad_input "no CASE given"
    if [[ ! $index ]]; then
        ((${#cases[@]} == 1)) ||
            bad_input "${#cases[@]} cases need a job array, one element for each"
        index=0
    fi
    ((index < ${#cases[@]})) ||
        bad_input "element $index of the job array has no case: the first has number 0," \
            "and there are ${#cases[@]} cases"
    case=${cases[index]}
    twice=$(for name in "${cases[@]}"; do stem "$name"; done | sort | uniq -d | head -n 1)
    [[ ! $twice ]] || bad_input "two of the cases would be run in one folder, $twice"
    # As 'mpisph run' does: -o is the folder of the run, or of the folders of several.
    if [[ $output && ${#cases[@]} == 1 ]]; then
        folder=$output
    else
        check_names "${cases[@]}"
        folder=${output:-${MPISPH_RUNS:-runs}}/$(stem "$case")
    fi
}

# check_names CASE...: ends this script where a run's folder cannot be named after a CASE.
check_names() {
    local path name
    for path in "$@"; do
        name=$(stem "$path")
        [[ $name && $name != [.-]* && $path != *[[:cntrl:]]* ]] ||
            bad_input "$(printf '%q' "$path"): no folder can be named after this file"
    done
}

# stem PATH: the name of a case file without its ending.
stem() {
    local name=${1##*/}
    printf '%s\n' "${name%.*}"
}

# status KEY: what status.json of the run says, or nothing.
status() {
    sed -n "s/^ *\"$1\": \"\{0,1\}\([^\",]*\).*/\1/p" 2>/dev/null \
        <"$folder/status.json" || true
}

find_mpisph() {
    mpisph=$home/.venv/bin/mpisph
    [[ -x $mpisph ]] || mpisph=$(command -v mpisph) ||
        bad_input "no mpisph in $home/.venv/bin nor on PATH: see scripts/setup"
}

# run_case RESTARTED SECONDS LAUNCHER...: runs the chosen case, or continues its run, for
# at most SECONDS where that is not empty. Returns if the job is to be started again,
# and otherwise ends this script with the code of mpisph.
run_case() {
    local restarted=$1 command before code=0
    limit_walltime "$2"
    shift 2
    # At first 'run', also into a folder with a run in it: it makes sure that it is one
    # of this case. Later 'resume', which asks for no case file any more.
    command=(run "${walltime[@]}" "${options[@]}" -o "$folder" -- "$case")
    if [[ $restarted && -f $folder/case.toml ]]; then
        command=(resume "${walltime[@]}" -- "$folder")
    fi
    find_mpisph
    before=$(status step)
    say "$(date '+%F %T'), $(uname -n): mpisph ${command[*]}"
    launch "$@" "${patient[@]}" "$mpisph" "${command[@]}" || code=$?
    # Where the scheduler tells all processes to end, Open MPI's launcher among them, that
    # returns 1 whatever its ranks did.
    if told_to_end && [[ $(status state) == stopped ]]; then
        code=75
    fi
    check_again "$code" "$folder" "$folder" "${before:-0}" "$(status step)"
}
