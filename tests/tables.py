"""Tables of equations of state, made of closed forms, and the files that hold them."""

import numpy as np

from mpisph.physics.eos.table import States

GAS_GAMMA, GAS_HEAT = 1.4, 717.5
RHO0, C0, SLOPE, GAMMA, HEAT = 2703.0, 5240.0, 1.40, 1.97, 885.0


SOLID_CARD = """
rho0 = "2703 kg/m3"
eos = "table"
strength = "none"
table = { file = "solid.csv" }
"""


def ideal_gas():
    """An ideal gas of constant heat capacity; five densities and temperatures."""
    density = np.array([1e-3, 0.1, 1.0, 3.0, 20.0])
    temperature = np.array([10.0, 300.0, 1000.0, 3000.0, 1e5])
    energy = GAS_HEAT * temperature + 0.0 * density[:, None]
    return States(
        density, temperature, (GAS_GAMMA - 1.0) * density[:, None] * energy, energy
    )


def cold_energy(m):
    """Energy of the solid at 0 K [J/kg]: any curve that is smooth will do."""
    return 0.5 * C0**2 * m**2 / (1.0 + abs(m)) - HEAT * 300.0


def solid_pressure(m, E):
    """Pressure about the line U = c0 + s u with Gamma rho constant, and Gamma rho."""
    x = m / (1.0 + m)
    if m < 0.0:
        gamma_rho = GAMMA * RHO0 * (1.0 + m)
        return RHO0 * C0**2 * m + gamma_rho * E, gamma_rho
    P_H = RHO0 * C0**2 * x / (1.0 - SLOPE * x) ** 2
    return P_H + GAMMA * RHO0 * (E - 0.5 * P_H * x / RHO0), GAMMA * RHO0


def mie_grueneisen(densities=60):
    """That solid from 0 K on, of constant heat capacity, without energy at 300 K.

    Densities lie closer around rho0, which is one of them.
    """
    stretch = np.linspace(-1.0, 1.0, densities)
    below, above = stretch[stretch < 0.0], stretch[stretch > 0.0]
    x = np.concatenate([0.4 * below**3, [0.0], 0.45 * above**2])
    temperature = np.sort([0.0, 300.0, *np.geomspace(100.0, 5e4, 30)])
    m = x / (1.0 - x)
    energy = np.array([cold_energy(each) + HEAT * temperature for each in m])
    pressure = [
        solid_pressure(each, E)[0] for each, E in zip(m.tolist(), energy, strict=True)
    ]
    return States(RHO0 * (1.0 + m), temperature, np.array(pressure), energy)


def as_csv(states, header="density, temperature, pressure, energy"):
    """The table as a CSV file."""
    rows = [
        f"{rho!r},{T!r},{states.pressure[i, j]!r},{states.energy[i, j]!r}"
        for i, rho in enumerate(states.density.tolist())
        for j, T in enumerate(states.temperature.tolist())
    ]
    return "\n".join([header, *rows]).replace("np.float64(", "").replace(")", "") + "\n"


def as_sesame(states, flags=True, header=" 0  3720   301  1234   r 1 1 1"):
    """The table as SESAME's table 301, five words a line."""
    words = [states.density.size, states.temperature.size]
    words += (1e-3 * states.density).tolist() + states.temperature.tolist()
    words += (1e-9 * states.pressure).T.ravel().tolist()
    words += (1e-6 * states.energy).T.ravel().tolist()
    lines = [header] if header else []
    for first in range(0, len(words), 5):
        part = words[first : first + 5]
        line = "".join(f"{word:15.8E}" for word in part).ljust(75)
        lines.append(line + ("1" * len(part)).ljust(5, "0") * flags)
    return "\n".join(lines) + "\n"
