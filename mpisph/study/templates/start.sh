
# How far the runs have come.
reached() {
    # By way of xargs: the names of all runs may be too many for one command.
    printf '%s\0' {{ root }}/cases/*/status.json | xargs -0 cat -- 2>/dev/null |
        grep '"step"' | cksum
}

before=$(reached)
limit_walltime "$left"
say "$(date '+%F %T'), $(uname -n): part $part of the study, ${left:-no} s left"
code=0
launch "${starter[@]}" "${patient[@]}" {{ mpisph }} study run -o {{ root }} \
    --ranks-per-case {{ ranks_per_case }} --part "$part" "${walltime[@]}" \
    -- {{ study }} || code=$?
# Told to end, Open MPI's launcher returns 1 whatever its ranks did.
if ((code != 0)) && told_to_end; then
    code=75
fi
check_again "$code" "study" {{ root }}/studies/{{ name }} "$before" "$(reached)"
say "study: not done yet"
