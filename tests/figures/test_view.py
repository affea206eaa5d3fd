"""Views of one body: what they hold at all times, and what they leave out."""

import numpy as np
import pytest
from launch import CASES
from pictures import store

from mpisph.case import load_case
from mpisph.core.errors import InputError
from mpisph.core.particles import Particles
from mpisph.figures import view as module
from mpisph.figures.view import View, body_view, common_view


@pytest.fixture(scope="module")
def case():
    return load_case(CASES / "piekutowski-4-1353.toml")


def write(folder, case, index, z, size=3e-3, bodies=(0, 1), strays=0):
    """A ball of the sphere's matter about z, and a plate that it has left behind."""
    x, y = (v.ravel() for v in np.meshgrid(*2 * [np.linspace(-1, 1, 41)]))
    ball = (np.hypot(x, y) <= 1.0) & (y >= 0.0)
    r, where = size * y[ball], z + size * x[ball]
    where[:strays] = 0.4
    plate = np.linspace(0.0, 40e-3, 200)
    body = np.repeat([0, 1], [r.size, plate.size])
    kept = np.isin(body, bodies)
    p = Particles.zeros(int(kept.sum()))
    p.id[:], p.body[:], p.m[:] = np.arange(p.n), body[kept], 1e-9
    p.r[:] = np.append(r, plate)[kept]
    p.z[:] = np.append(where, np.full(200, 2e-3))[kept]
    p.u_z[:] = np.where(p.body == 0, 5000.0, 0.0)
    return store(folder, case, index, p)


def test_a_body_is_held_at_all_times_with_a_margin(tmp_path, case):
    paths = [write(tmp_path, case, k, z) for k, z in enumerate((10e-3, 30e-3))]
    view, whole = body_view(paths, case, "sphere"), common_view(paths, case)
    assert whole.z_low < view.z_low < 7.0
    assert view.z_low > 3.0
    assert 33.0 < view.z_high <= whole.z_high
    assert view.z_high < 37.0
    assert 3.0 < view.r_high < 10.0
    assert body_view(paths[::-1], case, "sphere") == view
    early = body_view(paths[:1], case, "sphere")
    assert 6.0 < early.z_high - early.z_low < 9.0


def test_strays_do_not_set_it(tmp_path, case):
    paths = [write(tmp_path, case, 0, 10e-3), write(tmp_path, case, 1, 10e-3, strays=2)]
    assert body_view(paths, case, "sphere").z_high < 15.0


def test_a_strip_is_not_taller_than_a_page_and_not_wider_than_the_whole(tmp_path, case):
    paths = [write(tmp_path, case, 0, 60e-3, size=25e-3)]
    view, whole = body_view(paths, case, "plate"), common_view(paths, case, False)
    assert view.aspect <= 1.6 + 1e-9
    assert view.z_low < 2.0 < view.z_high
    assert view.r_high == pytest.approx(min(40.0, whole.r_high), rel=0.15)
    assert view.r_high <= whole.r_high
    assert whole.z_low <= view.z_low
    assert view.z_high <= whole.z_high


def test_a_body_that_the_whole_does_not_show_is_shown(tmp_path, case, monkeypatch):
    path = write(tmp_path, case, 0, -0.3)
    monkeypatch.setattr(module, "common_view", lambda *_, **__: View(-10, 50, 30))
    view = body_view([path], case, "sphere")
    assert view.z_low < -303.0 < -297.0 < view.z_high


def test_without_particles_of_it_the_whole_is_shown(tmp_path, case):
    paths = [write(tmp_path, case, 0, 20e-3, bodies=(0,))]
    assert body_view(paths, case, "plate") == common_view(paths, case, False)


def test_an_unknown_body_is_refused_with_those_there_are(case):
    with pytest.raises(InputError, match="no such body; there are sphere, plate"):
        body_view([], case, "wall")
