"""Print the nodes of the viscous average in mpisph/physics/viscosity.py.

For each xi two nodes and their weights follow from three conditions: the mean of
1 - cos(theta), and the hoop part of the viscous stress of a uniform strain rate, of the
linear and of the quadratic term (mpisph/physics/README.md, R5). They are fitted by
polynomials in q, of which the first coefficient is that of xi to infinity. Run it with
the Python of the environment: ``.venv/bin/python scripts/viscosity_nodes.py``.
"""

import numpy as np
from scipy.optimize import least_squares

DEGREE = 6
S = np.geomspace(1e-7, 40.0, 6000)
"""Squared distances in the r-z plane over h^2, at which the integrals are summed."""
DS = np.gradient(S) * np.exp(-S)


def hoop_parts(y2: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Return <s y^2/D> and <s^2 y^2/D^2>, D = s + y^2, of nodes y^2 (over h^2)."""
    D = S[:, None] + y2
    linear = (DS * S * (w * y2 / D).sum(1)).sum()
    quadratic = (DS * S * S * (w * y2 / D**2).sum(1)).sum()
    return np.array([linear, quadratic])


def angles(xi: float, n: int = 2000) -> tuple[np.ndarray, np.ndarray]:
    """Return 1 - cos(theta) at `n` angles and their weights exp(xi cos(theta))."""
    top = min(np.pi, 9.0 / np.sqrt(xi))
    t = 1.0 - np.cos((np.arange(n) + 0.5) / n * top)
    w = np.exp(-xi * t)
    return t, w / w.sum()


def nodes(xi: float, guess: np.ndarray) -> tuple[float, np.ndarray]:
    """Return q, and tau of the first node with its weight."""
    t, w = angles(xi)
    q = float((w * t).sum())
    exact = hoop_parts(xi * t, w)

    def errors(x: np.ndarray) -> np.ndarray:
        tau, share = x
        other = (1.0 - share * tau) / (1.0 - share)
        y2 = xi * q * np.array([tau, other])
        return hoop_parts(y2, np.array([share, 1.0 - share])) / exact - 1.0

    tight = {"xtol": 1e-14, "ftol": 1e-14, "gtol": 1e-14}
    return q, least_squares(errors, guess, x_scale=[0.01, 0.01], **tight).x


def main() -> None:
    """Print the coefficients, lowest power of q first, and the error of each fit."""
    _, far = nodes(1e8, np.array([0.2305, 0.7297]))
    found, guess = [], far
    for xi in np.geomspace(400.0, 2e-3, 60):
        q, guess = nodes(xi, guess)
        found.append((q, *guess))
    q, *columns = np.array(found).T
    for name, values, first in zip(("tau", "w"), columns, far, strict=True):
        powers = q[:, None] ** np.arange(1, DEGREE + 1)
        rest, *_ = np.linalg.lstsq(powers, values - first, rcond=None)
        error = np.abs(powers @ rest - (values - first)).max()
        print(f"{name}: {[float(f'{x:.8g}') for x in (first, *rest)]}, {error:.1e}")


if __name__ == "__main__":
    main()
