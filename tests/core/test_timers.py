import time

import pytest

from mpisph.core.timers import Phases


def test_time_adds_up_by_name(monkeypatch):
    ticks = iter([0.0, 1.0, 10.0, 12.0, 20.0, 24.0])
    monkeypatch.setattr("mpisph.core.timers.perf_counter", lambda: next(ticks))
    phases = Phases()
    spent = []
    for name in ("halo", "survey", "halo"):
        with phases.measure(name) as watch:
            pass
        spent.append(watch.spent)
    assert spent == [1.0, 2.0, 4.0]
    assert phases.seconds == {"halo": 5.0, "survey": 2.0}


def test_phases_may_stand_inside_each_other():
    phases = Phases()
    with phases.measure("outer"), phases.measure("inner"):
        time.sleep(1e-4)
    assert phases.seconds["outer"] >= phases.seconds["inner"] >= 1e-4


def test_a_failed_block_counts_and_its_error_passes():
    phases = Phases()
    with pytest.raises(KeyError), phases.measure("halo"):
        raise KeyError
    assert phases.seconds["halo"] > 0.0
