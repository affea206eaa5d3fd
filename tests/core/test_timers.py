import time

import pytest

from mpisph.core.timers import Timers


def test_time_adds_up_by_name(monkeypatch):
    ticks = iter([0.0, 1.0, 10.0, 12.0, 20.0, 24.0])
    monkeypatch.setattr("mpisph.core.timers.perf_counter", lambda: next(ticks))
    timers = Timers()
    spent = []
    for name in ("halo", "reduction", "halo"):
        with timers.measure(name) as watch:
            pass
        spent.append(watch.spent)
    assert spent == [1.0, 2.0, 4.0]
    assert timers.seconds == {"halo": 5.0, "reduction": 2.0}


def test_phases_may_stand_inside_each_other():
    timers = Timers()
    with timers.measure("outer"), timers.measure("inner"):
        time.sleep(1e-4)
    assert timers.seconds["outer"] >= timers.seconds["inner"] >= 1e-4


def test_a_failed_block_counts_and_its_error_passes():
    timers = Timers()
    with pytest.raises(KeyError), timers.measure("halo"):
        raise KeyError
    assert timers.seconds["halo"] > 0.0
