"""The view of one body, and of all."""

import numpy as np
import pytest

from mpisph.core.errors import InputError
from mpisph.figures.cloud import draw_run
from mpisph.figures.fields import choose_fields
from mpisph.figures.view import body_view, common_view
from mpisph.io.snapshot import read_series, read_snapshot
from mpisph.io.stored_run import read_run


@pytest.fixture(scope="module")
def run(judged):
    return read_run(judged)


def paths_of(run):
    return [path for path, _ in run.snapshots]


@pytest.mark.parametrize("name", ["projectile", "bumper", "wall"])
def test_a_body_is_held_at_all_times_but_for_strays(run, name):
    paths = paths_of(run)
    view, whole = body_view(paths, run.case, name), common_view(paths, run.case)
    which = [body.name for body in run.case.bodies].index(name)
    for path in paths:
        a = read_snapshot(path).arrays
        mine = a["body"] == which
        z, r = 1e3 * a["z"][mine], 1e3 * a["r"][mine]
        near = whole.shows(z, r)
        shown = view.shows(z, r) & near
        # A hundredth at either end of z, and of r.
        assert shown.sum() >= near.sum() - 0.03 * mine.sum() - 1
    assert whole.z_low <= view.z_low < view.z_high <= whole.z_high
    assert view.r_high <= whole.r_high


def test_the_wall_alone_is_shown_larger(run):
    paths = paths_of(run)
    view, whole = body_view(paths, run.case, "wall"), common_view(paths, run.case)
    assert view.z_high - view.z_low < 0.7 * (whole.z_high - whole.z_low)


def test_a_body_that_is_not_there_is_refused(run):
    with pytest.raises(InputError, match="--zoom plate: no such body; there are proj"):
        body_view(paths_of(run), run.case, "plate")


def test_pictures_of_a_body_bear_its_name_and_leave_the_others(judged, monkeypatch):
    drawn = []
    monkeypatch.setattr(
        "mpisph.figures.cloud.draw_cloud", lambda *given: drawn.append(given)
    )
    draw_run(judged, choose_fields(["damage"], []), "wall")
    times = [time for _, time in read_series(judged)]
    names = [given[2].name for given in drawn]
    assert len(names) == len(times)
    assert all(name.startswith("damage_wall_") for name in names)
    views = {given[5] for given in drawn}
    paths = [path for path, _ in read_series(judged)]
    assert views == {body_view(paths, read_run(judged).case, "wall")}
    assert all(given[4] is None for given in drawn), "no exposures"
    assert np.unique(names).size == len(names)
