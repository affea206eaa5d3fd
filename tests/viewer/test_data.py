"""What a page shows of a run, beside its snapshots."""

import json
import math

import numpy as np
import pytest

from mpisph.diagnostics.cloud import cloud_definition
from mpisph.figures.dots import find_shadings
from mpisph.figures.fields import SHOWN_FIELDS, Chosen
from mpisph.figures.view import common_view, measure_cloud
from mpisph.io.snapshot import read_snapshot
from mpisph.io.stored_run import read_run
from mpisph.viewer import data
from mpisph.viewer.data import choose_sample, describe_run, shown_fields
from mpisph.viewer.packing import LEVELS, NO_VALUE, Quantised, restore, unpack


@pytest.fixture(scope="module")
def run(finished):
    return read_run(finished)


@pytest.fixture(scope="module")
def shown(run):
    return describe_run(run, choose_sample(run))


def columns_of(shown, frame):
    """The columns of a frame, in the units that are shown."""
    about = shown.description["frames"][frame]
    codes = unpack(shown.frames[frame], len(about["ranges"]))
    ends = zip(codes, about["ranges"], strict=True)
    return [restore(Quantised(c, *limits)) for c, limits in ends]


def test_every_particle_has_its_place_and_fields_at_every_time(run, shown):
    for k, (path, time) in enumerate(run.snapshots):
        about = shown.description["frames"][k]
        assert about["time"] == 1e6 * time
        arrays = read_snapshot(path).arrays
        order = np.argsort(arrays["id"])
        fields = shown_fields(run.case, list(arrays))
        wanted = [1e3 * arrays["z"], 1e3 * arrays["r"]]
        wanted += [field.shown(arrays, run.case) for field in fields]
        found = columns_of(shown, k)
        assert len(found) == len(wanted) == len(about["ranges"])
        for got, want, (low, high) in zip(found, wanted, about["ranges"], strict=True):
            off = np.abs(got - want[order])
            assert np.all(off <= (high - low) / (2 * LEVELS) * (1 + 1e-6) + 1e-12)


def test_what_stays_is_body_material_ring_and_number(run, shown):
    arrays = read_snapshot(run.snapshots[0][0]).arrays
    order = np.argsort(arrays["id"])
    body, material, ring, low, high = unpack(shown.fixed, 5)
    assert np.array_equal(body, arrays["body"][order])
    assert np.array_equal(material, arrays["material"][order])
    assert np.array_equal(low + 65536 * high.astype(int), np.arange(len(order)))
    # At rest density the particles of a body fill its section.
    section = restore(Quantised(ring, *shown.description["fixed"]["ring"]))
    section /= 1e3 * arrays["r"][order]
    sphere, plate = run.case.bodies
    half_disc = 0.5 * math.pi * (1e3 * sphere.radius) ** 2
    strip = 1e6 * plate.radius * plate.thickness
    found = [section[body == k].sum() for k in (0, 1)]
    assert found == pytest.approx([half_disc, strip], rel=0.03)


def test_scales_are_those_of_the_pictures(run, shown):
    paths = [path for path, _ in run.snapshots]
    view = common_view(paths, run.case)
    assert shown.description["view"] == pytest.approx(view._asdict())
    snapshots = [read_snapshot(path) for path in paths]
    for scale in shown.description["fields"]:
        chosen = [Chosen(SHOWN_FIELDS[scale["name"]])]
        [shading] = find_shadings(chosen, snapshots, view, run.case)
        assert (scale["low"], scale["high"]) == (shading.low, shading.high)
        assert len(scale["colours"]) % 6 == 0
        first = [int(scale["colours"][k : k + 2], 16) / 255 for k in (0, 2, 4)]
        assert first == pytest.approx(shading.colour_map(0.0)[:3], abs=0.003)


def test_limits_may_be_given(run):
    chosen = [Chosen(SHOWN_FIELDS["speed"], (1.0, 2.5))]
    about = describe_run(run, choose_sample(run), chosen).description
    [speed] = [field for field in about["fields"] if field["name"] == "speed"]
    assert (speed["low"], speed["high"]) == (1.0, 2.5)


def test_cloud_sizes_computed_and_measured(run, shown):
    definition = cloud_definition(run.case)
    exposed = 0
    for (path, _), about in zip(
        run.snapshots, shown.description["frames"], strict=True
    ):
        lines = {line["kind"]: line for line in about["lines"]}
        measure = measure_cloud(read_snapshot(path), run.case)
        assert ("computed" in lines) == (measure.mass > 0.0)
        if "computed" in lines:
            line = lines["computed"]
            assert line["radius"] == pytest.approx(1e3 * measure.radius)
            assert line["length"] == pytest.approx(1e3 * measure.length)
            rear, way = 1e3 * definition.rear, definition.direction * line["length"]
            assert (line["rear"], line["front"]) == pytest.approx((rear, rear + way))
        exposed += "measured" in lines
    assert exposed == 2, "the nominal time, and with the offset"


def test_a_shield_has_no_sizes_of_a_cloud(judged):
    run = read_run(judged)
    about = describe_run(run, choose_sample(run)).description
    assert not any(frame["lines"] for frame in about["frames"])
    assert [body["name"] for body in about["bodies"]] == [
        "projectile",
        "bumper",
        "wall",
    ]
    assert "damage" in [field["name"] for field in about["fields"]]


def test_rigid_planes_are_told(run):
    assert describe_run(run, choose_sample(run)).description["planes"] == [None, None]
    boundary = run.case.boundary.model_copy(update={"z_max": 0.08})
    case = run.case.model_copy(update={"boundary": boundary})
    sample = choose_sample(run)
    about = describe_run(run._replace(case=case), sample).description
    assert about["planes"] == [None, pytest.approx(80.0)]


def test_a_field_that_a_body_lacks_has_no_value_there(run, shown, monkeypatch):
    with monkeypatch.context() as patched:
        given = [True] + [False] * (len(run.case.bodies) - 1)
        patched.setattr(data.ShownField, "_given", lambda *_: given)
        frame = describe_run(run, choose_sample(run)).frames[0]
    codes = unpack(frame, len(shown.description["frames"][0]["ranges"]))
    body = unpack(shown.fixed, 5)[0]
    assert np.array_equal(codes[2] == NO_VALUE, body > 0)


def test_of_many_particles_some_are_shown_and_cover_the_others(run, shown):
    sample = choose_sample(run, most=50)
    some = describe_run(run, sample)
    total = shown.description["particles"]
    assert sample.text == f"50 of {total} particles are shown"
    assert some.description["note"] == sample.text
    assert np.array_equal(np.unique(sample.ids), sample.ids)
    assert len(np.unique(np.diff(sample.ids))) > 2, "no stripes"
    whole, part = (columns_of(x, 1)[0] for x in (shown, some))
    limits = shown.description["frames"][1]["ranges"][0]
    step = (limits[1] - limits[0]) / LEVELS
    assert part == pytest.approx(whole[sample.ids], abs=step)
    ranges = (x.description["fixed"]["ring"] for x in (shown, some))
    before, after = (
        restore(Quantised(unpack(x.fixed, 5)[2], *r))
        for x, r in zip((shown, some), ranges, strict=True)
    )
    want = before[sample.ids] * total / 50
    assert after == pytest.approx(want, rel=1e-3, abs=1e-3 * want.max())


def test_of_many_times_some_are_shown_and_the_last(run, monkeypatch):
    monkeypatch.setattr(data, "MOST_FRAMES", 3)
    sample = choose_sample(run)
    count = len(run.snapshots)
    middle = round((count - 1) / 2)
    assert sample.snapshots == [run.snapshots[k] for k in (0, middle, count - 1)]
    assert sample.text == f"3 of {count} snapshots are shown"


def test_a_page_has_room_for_so_many_numbers(run, monkeypatch):
    arrays = read_snapshot(run.snapshots[0][0]).arrays
    columns = 2 + len(shown_fields(run.case, list(arrays)))
    monkeypatch.setattr(data, "MOST_VALUES", 40 * columns * len(run.snapshots))
    assert choose_sample(run).ids.size == 40
    assert choose_sample(run, share=0.5).ids.size == 20
    both = choose_sample(run, most=7)
    assert both.ids.size == 7


def test_a_particle_that_broke_down_lies_nowhere(run, shown, monkeypatch):
    def broken(path):
        snapshot = read_snapshot(path)
        arrays = {name: values.copy() for name, values in snapshot.arrays.items()}
        for name in ("z", "u_z", "rho", "E"):
            arrays[name][arrays["id"] == 7] = np.nan
        return snapshot._replace(arrays=arrays)

    monkeypatch.setattr(data, "read_snapshot", broken)
    some = describe_run(run, choose_sample(run))
    assert json.loads(some.json)
    columns = len(some.description["frames"][0]["ranges"])
    for k, (got, want) in enumerate(
        zip(
            unpack(some.frames[1], columns),
            unpack(shown.frames[1], columns),
            strict=True,
        )
    ):
        if k == 0:
            assert got[7] == NO_VALUE
            assert (got == NO_VALUE).sum() == 1
        if k == 1:
            assert np.array_equal(got, want)


def test_the_description_is_json_without_odd_numbers(shown):
    def refuse(text):
        raise AssertionError(text)

    assert json.loads(shown.json, parse_constant=refuse) == shown.description
    assert all(math.isfinite(frame["time"]) for frame in shown.description["frames"])
