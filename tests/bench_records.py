"""Records of a bench, as tests make them up."""

from mpisph.bench.record import BenchRecord, Machine, Measurement, Spread, Traffic


def measurement(scene, step_ms):
    one = Spread.of([step_ms])
    return Measurement(
        scene=scene, scaling="strong", ranks=1, npr=4, time=0.0, particles=100,
        neighbours=50.0, steps=1, repeats=1, interactions=5000.0, step_ms=one,
        interaction_ns=one, timers={}, imbalance=0.0, snapshot_ms=1.0, memory=None,
        traffic=Traffic(messages=0.0, bytes=0.0, ghosts=0.0),
    )  # fmt: skip


def record(**times):
    return BenchRecord(
        case="a case",
        measurements=tuple(measurement(*each) for each in times.items()),
        start_up=None,
        machine=Machine(cpu="a processor", cores=2, load=(0.0, 0.0, 0.0)),
        versions={},
        revision="a revision",
    )
