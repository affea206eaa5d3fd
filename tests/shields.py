"""Shields for tests: the case of a shield, and walls to measure."""

import copy

import numpy as np

from mpisph.case import case_from_dict

SHIELD = {
    "title": "a shield",
    "shield": {
        "projectile": {
            "diameter": "3.175 mm",
            "velocity": "6.5 km/s",
            "material": "al-2017-t4",
        },
        "bumpers": [
            {
                "thickness": "0.787 mm",
                "standoff": "50.8 mm",
                "material": "al-6061-t6",
            }
        ],
        "wall": {"thickness": "3.18 mm", "material": "al-6061-t6"},
    },
}
"""Of Ryan 2011, at one of its tests."""


def shield_data(**tables):
    """Return the raw case of the shield with parts of its tables changed."""
    data = copy.deepcopy(SHIELD)
    for name, changes in tables.items():
        if name in data["shield"]:
            part = data["shield"][name]
            (part[0] if isinstance(part, list) else part).update(changes)
        else:
            data[name] = changes
    return data


def shield_case(**tables):
    """Return the case of the shield with parts of its tables changed."""
    return case_from_dict(shield_data(**tables))


QUIET = {"figures": False, "every": "3 us", "history_every": 20}


def coarse(**tables):
    """A thin shield near its projectile: it takes 12 us to be torn."""
    near = {"standoff": "8 mm", "radius": "5 mm"}
    thin = {"thickness": "1.6 mm", "radius": "9 mm"}
    given = {
        "projectile": {"velocity": "4 km/s"},
        "bumpers": near,
        "wall": thin,
        "resolution": {"npr": 4},
        "time": {"end": "12 us"},
        "output": QUIET,
    }
    return shield_case(**{**given, **tables})


def wall_particles(layout, displacement=None, damage=None, extra=()):
    """Return particles of a wall whose columns are displaced along z.

    Parameters
    ----------
    layout : Layout
    displacement : ndarray, shape (columns,), optional
        [m].
    damage : ndarray, shape (rows, columns), optional
    extra : sequence of tuple
        Particles of another body: m, r, z, u_z.
    """
    shape = layout.z.size, layout.r.size
    n = shape[0] * shape[1]
    r = np.tile(layout.r, shape[0])
    z = np.repeat(layout.z, shape[1])
    if displacement is not None:
        z = z + np.tile(displacement, shape[0])
    cell = layout.spacing**2
    fields = {
        "id": layout.first_id + np.arange(n),
        "body": np.full(n, layout.body),
        "m": 2.0 * np.pi * r * cell * 2700.0,
        "r": r,
        "z": z,
        "u_z": np.zeros(n),
        "damage": np.zeros(n) if damage is None else damage.ravel(),
    }
    for m, r_of, z_of, u_z in extra:
        new = {"id": 0, "body": 0, "m": m, "r": r_of, "z": z_of, "u_z": u_z}
        new["damage"] = 1.0
        fields = {k: np.append(v, new[k]) for k, v in fields.items()}
    order = np.random.default_rng(1).permutation(fields["id"].size)
    return {name: values[order] for name, values in fields.items()}
