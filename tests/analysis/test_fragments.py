"""Fragments: against a brute-force search of all pairs, and by hand."""

import numpy as np
import pytest

import mpisph.analysis.fragments
from mpisph.analysis.fragments import CONTACT, find_fragments
from mpisph.diagnostics.cloud import CloudDefinition

DEFINITION = CloudDefinition(rear=0.0, min_velocity=500.0, quantile=0.99)
DX = 0.5e-3


def particles(r, z, **fields):
    r, z = np.asarray(r, float), np.asarray(z, float)
    rho = np.full(r.shape, 2700.0)
    arrays = {
        "r": r,
        "z": z,
        "rho": rho,
        "m": 2 * np.pi * r * rho * DX**2,
        "u_z": np.full(r.shape, 4000.0),
        "u_r": np.zeros(r.shape),
        "body": np.zeros(r.shape, np.int64),
    }
    return {**arrays, **fields}


def block(nr, nz, r_low, z_low):
    r, z = np.meshgrid(r_low + np.arange(nr) * DX, z_low + np.arange(nz) * DX)
    return r.ravel(), z.ravel()


def joined(*blocks):
    return (np.concatenate(x) for x in zip(*blocks, strict=True))


def random_cloud(n=600):
    rng = np.random.default_rng(5)
    r, z = rng.uniform(2e-3, 30e-3, n), rng.uniform(-2e-3, 20e-3, n)
    size = DX * 10 ** rng.uniform(-1, 0.5, n)
    rho = rng.uniform(100.0, 2700.0, n)
    return particles(
        r,
        z,
        rho=rho,
        m=2 * np.pi * r * rho * size**2,
        u_z=rng.uniform(-500.0, 6000.0, n),
        u_r=rng.normal(0.0, 800.0, n),
        body=rng.integers(0, 3, n),
    )


def brute_force(arrays, sizes, factor):
    """Clusters as sets of particles, the links followed one by one."""
    cloud = np.flatnonzero((arrays["z"] > 0.0) & (arrays["u_z"] > 500.0)).tolist()
    left, clusters = set(cloud), []
    while left:
        found, front = set(), {left.pop()}
        while front:
            a = front.pop()
            found.add(a)
            near = {
                b
                for b in left
                if np.hypot(
                    arrays["r"][a] - arrays["r"][b], arrays["z"][a] - arrays["z"][b]
                )
                < factor * (sizes[a] + sizes[b]) / 2
            }
            left -= near
            front |= near
        clusters.append(frozenset(found))
    return set(clusters)


def clusters_of(found):
    return {
        frozenset(np.flatnonzero(found.fragment_of == k).tolist())
        for k in range(len(found.mass))
    }


@pytest.mark.parametrize("factor", [0.8, CONTACT, 2.2])
@pytest.mark.parametrize("chunk", [10, 10_000])
def test_clusters_are_those_of_all_pairs(monkeypatch, factor, chunk):
    monkeypatch.setattr(mpisph.analysis.fragments, "_CHUNK", chunk)
    arrays = random_cloud()
    sizes = np.sqrt(arrays["m"] / (2 * np.pi * arrays["r"] * arrays["rho"]))
    found = find_fragments(arrays, DEFINITION, factor)
    wanted = brute_force(arrays, sizes, factor)
    assert 20 < len(wanted) < 550
    assert clusters_of(found) == wanted


def test_blocks_apart_are_fragments_and_the_heavier_is_first():
    r, z = joined(block(4, 4, 5e-3, 1e-3), block(5, 4, 12e-3, 8e-3))
    body = (np.arange(r.size) % 5 == 0).astype(np.int64)
    velocity = np.linspace(1000.0, 3000.0, r.size)
    arrays = particles(r, z, body=body, u_r=velocity)
    found = find_fragments(arrays, DEFINITION)
    assert found.particles.tolist() == [20, 16]
    assert found.fragment_of.tolist() == [1] * 16 + [0] * 20
    m = arrays["m"]
    for k, part in enumerate((slice(16, None), slice(None, 16))):
        assert found.mass[k] == pytest.approx(m[part].sum())
        for name, x in (("z", z), ("r", r), ("u_r", velocity)):
            mean = np.average(x[part], weights=m[part])
            assert getattr(found, name)[k] == pytest.approx(mean), name
        assert found.u_z[k] == pytest.approx(4000.0)
        masses = [m[part][body[part] == b].sum() for b in (0, 1)]
        assert found.body_mass[k] == pytest.approx(masses)


@pytest.mark.parametrize(
    ("distance", "pieces"),
    [(1.0, 1), (np.sqrt(2), 1), (1.49, 1), (1.51, 2), (2.0, 2)],
)
def test_what_touches(distance, pieces):
    arrays = particles([8e-3, 8e-3], [1e-3, 1e-3 + distance * DX])
    assert len(find_fragments(arrays, DEFINITION).mass) == pieces


def test_a_flow_that_expands_stays_linked_and_one_that_tears_does_not():
    r, z = block(1, 6, 8e-3, 1e-3)
    z = z * 3.0
    thin = particles(r, z)
    thin["rho"] = thin["rho"] / 9.0  # and sections three times as wide
    assert len(find_fragments(thin, DEFINITION).mass) == 1
    torn = particles(r, z)
    assert len(find_fragments(torn, DEFINITION).mass) == 6


def test_sizes_may_be_given():
    arrays = particles([8e-3, 8e-3], [1e-3, 3e-3])
    assert len(find_fragments(arrays, DEFINITION, 1.5).mass) == 2
    sizes = np.array([1.0e-3, 1.7e-3])
    assert len(find_fragments(arrays, DEFINITION, 1.5, sizes).mass) == 1


def test_only_the_cloud_counts():
    arrays = particles([8e-3] * 4, [1e-3, 1.4e-3, -0.1e-3, 1.2e-3])
    arrays["u_z"][3] = 400.0
    found = find_fragments(arrays, DEFINITION)
    assert found.fragment_of.tolist() == [0, 0, -1, -1]
    assert found.particles.tolist() == [2]


def test_no_cloud_no_fragments():
    arrays = particles([8e-3], [-1e-3])
    found = find_fragments(arrays, DEFINITION)
    assert found.mass.shape == found.u_r.shape == (0,)
    assert found.body_mass.shape == (0, 1)
    assert found.fragment_of.tolist() == [-1]
    nothing = {name: x[:0] for name, x in arrays.items()}
    assert find_fragments(nothing, DEFINITION).fragment_of.shape == (0,)


def test_equal_masses_stand_in_the_order_of_their_particles():
    arrays = particles([8e-3] * 3, [9e-3, 5e-3, 1e-3])
    assert find_fragments(arrays, DEFINITION).fragment_of.tolist() == [0, 1, 2]


def test_one_large_particle_does_not_make_all_pairs():
    """All pairs of 40 000 particles would take 20 GB."""
    rng = np.random.default_rng(2)
    n = 40_000
    arrays = particles(rng.uniform(0.5, 1.5, n), rng.uniform(0.5, 1.5, n))
    sizes = np.full(n, 1e-4)
    sizes[17] = 5.0
    assert find_fragments(arrays, DEFINITION, 1.5, sizes).particles.tolist() == [n]


def test_what_is_broken_is_in_no_fragment_and_links_none():
    """A strip of which the middle is broken: two pieces, and what is damaged a bit."""
    r, z = block(1, 9, 8e-3, 1e-3)
    damage = np.array([0.0, 0.5, 0.999, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    arrays = particles(r, z, damage=damage)
    found = find_fragments(arrays, DEFINITION)
    assert found.fragment_of.tolist() == [1, 1, 1, -1, -1, 0, 0, 0, 0]
    assert found.broken == pytest.approx(arrays["m"][3:5].sum())
    assert found.broken + found.mass.sum() == pytest.approx(arrays["m"].sum())
    arrays["damage"][:] = 1.0
    nothing = find_fragments(arrays, DEFINITION)
    assert nothing.mass.size == 0
    assert nothing.broken == pytest.approx(arrays["m"].sum())
    # Elsewhere it does not count.
    arrays["z"] -= 1.0
    assert find_fragments(arrays, DEFINITION).broken == 0.0


def test_without_damage_nothing_is_broken():
    arrays = random_cloud()
    plain = find_fragments(arrays, DEFINITION)
    sound = find_fragments({**arrays, "damage": np.zeros(600)}, DEFINITION)
    assert plain.broken == sound.broken == 0.0
    assert plain.fragment_of.tolist() == sound.fragment_of.tolist()
