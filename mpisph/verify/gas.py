"""Runs of an ideal gas, and what is measured on them.

Units of speed and time are km/s and ms, so that pressures are in MPa: the numbers are
those of the literature, and the program's are of the size that it is meant for.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from mpisph.case import case_from_dict
from mpisph.verify.exact.riemann import GasState
from mpisph.verify.problem import Setup

SHOCK_PLACE = 0.4
"""How near a shock must come to its place, in particle spacings: .005 at 1/80."""


MS = 1e-3
"""A millisecond [s]."""

KM_S = 1e3
"""A kilometre a second [m/s]."""

MPA = 1e6
"""A megapascal [Pa]."""


class GasBody(NamedTuple):
    """A body of gas in one state.

    Attributes
    ----------
    shape : mapping
        The body as in a case, without name and material. What it says itself, such as
        its `energy`, counts instead of the state's.
    state : GasState
        In km/s and MPa; its velocity is along z.
    """

    shape: Mapping[str, Any]
    state: GasState


def gas_setup(
    label: str,
    title: str,
    bodies: Sequence[GasBody],
    spacing: float,
    times: Sequence[float],
    gamma: float,
    **sections: Any,
) -> Setup:
    """Return a run of bodies of gas.

    Parameters
    ----------
    label, title : str
    bodies : sequence of GasBody
    spacing : float
        Of the particles [m].
    times : sequence of float
        Of snapshots; the run ends with the last [ms].
    gamma : float
        Ratio of specific heats.
    **sections
        Of the case, or single keys of them; the smoothing length is 1.5 spacings, the
        viscosity has alpha = 1 and beta = 2, and there is no artificial heat unless
        they say otherwise.
    """
    data: dict[str, Any] = {
        "title": title,
        "bodies": [
            {
                "velocity": KM_S * body.state.u,
                "energy": MPA * body.state.P / ((gamma - 1.0) * body.state.rho),
                **body.shape,
                "name": f"gas-{k}",
                "material": f"gas-{k}",
            }
            for k, body in enumerate(bodies)
        ],
        "materials": {
            f"gas-{k}": _matter(body.state, gamma) for k, body in enumerate(bodies)
        },
        "resolution": {"spacing": spacing, "nph": 1.5},
        "scheme": {
            "viscosity": {"alpha": 1.0, "beta": 2.0},
            "heat": {"enabled": False},
            "sound_speed_floor": 1e-3,
        },
        "output": {"times": [MS * time for time in times], "figures": False},
        # Strong shocks compress and heat a gas without limit.
        "limits": {"density_ratio_max": 1e4, "energy_ratio_max": 1e6},
    }
    for key, section in sections.items():
        data[key] = {**data.get(key, {}), **section}
    return Setup(label, case_from_dict(data))


def _matter(state: GasState, gamma: float) -> dict[str, Any]:
    sound = KM_S * math.sqrt(gamma * state.P / state.rho)
    # The floor of the sound speed must be small beside what happens.
    typical = max(sound, 10.0)
    return {
        "rho0": state.rho,
        "eos": "ideal-gas",
        "strength": "none",
        "ideal-gas": {"gamma": gamma, "c0": typical},
    }
