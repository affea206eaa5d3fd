"""What may change in a run that goes on longer."""

import pytest

from mpisph.case import case_from_dict
from mpisph.case.extension import extended_case, is_extension
from mpisph.core.errors import CaseError


@pytest.fixture
def make(data):
    """Return a function that makes a case with these sections."""

    def case(end, **more):
        return case_from_dict({**data, "time": {"end": end}, **more})

    return case


def test_a_later_end_keeps_the_earlier_one_as_a_time_of_output(make):
    old, new = make("2 us"), make("3 us")
    case = extended_case(old, new)
    assert case.output_times == (2e-6, 3e-6)
    assert case.output.times == (2e-6,)
    assert is_extension(old, case)
    assert not is_extension(old, new)


@pytest.mark.parametrize("end", ["2 us", "2.2 us", "22 us", "7.05 us"])
def test_an_end_that_is_a_multiple_of_the_interval_need_not_be_named(make, end):
    every = {"every": "1 us"}
    case = extended_case(make(end, output=every), make("30 us", output=every))
    assert len(case.output.times) == (end not in {"2 us", "22 us"})
    assert len(case.output_times) == 30 + len(case.output.times)


def test_times_of_output_so_far_stay(make):
    old = make("2 us", output={"every": "0.5 us", "times": ["0.7 us"]})
    new = make("6 us", output={"every": "2 us", "times": ["5 us"]})
    case = extended_case(old, new)
    assert case.output_times == (
        5e-7, 7e-7, 1e-6, 1.5e-6, 2e-6, 4e-6, 5e-6, 6e-6
    )  # fmt: skip
    # The case in the folder of the run is complete: it may be extended again.
    assert extended_case(case, make("8 us")).output_times == (*case.output_times, 8e-6)


def test_an_exposure_beyond_the_end_is_reached_later(make):
    measured = {"exposures": [{"time": "2.5 us", "radius": "1 mm", "source": "x"}]}
    old = make("2 us", measured=measured)
    assert extended_case(old, make("3 us", measured=measured)).output_times == (
        2e-6, 2.5e-6, 3e-6
    )  # fmt: skip


@pytest.mark.parametrize("more", [{"every": "0.3 us"}, {"times": ["1.9 us"]}])
def test_no_snapshot_can_be_added_to_what_is_past(make, more):
    old = make("2 us", output={"every": "1 us"})
    with pytest.raises(CaseError, match="no snapshot can be added at"):
        extended_case(old, make("4 us", output={"every": "1 us", **more}))


def test_an_earlier_end_is_refused(make):
    with pytest.raises(CaseError, match=r"time.end = 1e-06: a run that is to end at"):
        extended_case(make("2 us"), make("1 us"))


@pytest.mark.parametrize(
    ("section", "value", "key"),
    [
        ("resolution", {"npr": 11}, "resolution.npr"),
        ("limits", {"energy_drift": 0.5}, "limits.energy_drift"),
        ("scheme", {"alpha": 2.0}, "scheme"),
        ("output", {"history_every": 2}, "output.history_every"),
        ("measured", {"clock_offset": "1 us"}, "measured"),
    ],
)
def test_nothing_else_may_change(make, section, value, key):
    try:
        new = make("4 us", **{section: value})
    except CaseError:
        new = make("4 us", scheme={"viscosity": {"alpha": 2.0}})
    with pytest.raises(CaseError, match="cannot change in a run that is extended") as e:
        extended_case(make("2 us"), new)
    assert all(problem.key.startswith(key) for problem in e.value.problems)


def test_what_changes_no_bit_may_change(make):
    new = make("4 us", checkpoints={"interval": "1 us"}, title="longer")
    case = extended_case(make("2 us"), new)
    assert (case.checkpoints.interval, case.title) == (1e-6, "longer")


def test_too_many_times_are_refused(make):
    old = make("2 us", output={"every": "0.001 us"})
    with pytest.raises(CaseError, match=r"output.times.* at most 1000"):
        extended_case(old, make("3 us"))
