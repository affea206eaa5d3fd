"""The shared counters: no number is lost, none is given twice."""

import itertools

import pytest
from mpi4py import MPI
from oracles import agree

from mpisph.study.counter import SharedCounters


@pytest.mark.mpi
def test_every_number_is_given_once():
    comm = MPI.COMM_WORLD
    with SharedCounters(comm, 3) as counters:
        mine = [counters.add(1) for _ in range(200)]
        comm.Barrier()
        total = counters.add(1, 0)
        other = counters.add(2, 0)
    everything = sorted(itertools.chain(*comm.allgather(mine)))
    problems = []
    if everything != list(range(200 * comm.size)):
        problems.append("a number is missing, or there twice")
    if (total, other) != (200 * comm.size, 0):
        problems.append(f"at the end {total}, the other {other}")
    agree(comm, problems)


@pytest.mark.mpi(min_size=2)
def test_rank_0_sees_what_the_others_add():
    comm = MPI.COMM_WORLD
    with SharedCounters(comm, 2) as counters:
        if comm.rank > 0:
            counters.add(1, 5)
        comm.Barrier()
        seen = int(counters.here[1]) if comm.rank == 0 else 5 * (comm.size - 1)
        comm.Barrier()
    agree(comm, [] if seen == 5 * (comm.size - 1) else [f"saw {seen}"])
