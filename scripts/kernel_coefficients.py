"""Print the coefficients of the polynomials in mpisph/physics/kernel.py.

Each is the interpolant through the Chebyshev nodes of its range, computed at 60 digits,
with the fewest coefficients whose relative error stays below 1.2e-12. The coefficient
of the constant comes first. Run it with the Python of the environment:
``.venv/bin/python scripts/kernel_coefficients.py``.
"""

from mpmath import besseli, chebyfit, exp, linspace, log, mp, mpf, pi, polyval, sqrt

from mpisph.physics.kernel import XI_FAR

TOLERANCE = mpf("1.2e-12")

mp.dps = 60


def i0_far(x: mpf) -> mpf:
    """Return pi^(-3/2) sqrt(xi) exp(-xi) I0(xi), x = 1/xi."""
    return besseli(0, 1 / x) * exp(-1 / x) / sqrt(x * pi**3)


def ratio_far(x: mpf) -> mpf:
    """Return xi (1 - I1(xi)/I0(xi)), x = 1/xi."""
    return (1 - besseli(1, 1 / x) / besseli(0, 1 / x)) / x


def i0_near(w: mpf) -> mpf:
    """Return I0(xi), w = xi^2/4."""
    return besseli(0, 2 * sqrt(w))


def i1_near(w: mpf) -> mpf:
    """Return I1(xi)/xi, w = xi^2/4."""
    return besseli(1, 2 * sqrt(w)) / (2 * sqrt(w))


HALF_LN2 = log(mpf(2)) / 2
FAR = (mpf(0), 1 / mpf(XI_FAR))
NEAR = (mpf(0), mpf(XI_FAR) ** 2 / 4)

FITS = {
    "exp_minus": (exp, (-HALF_LN2, HALF_LN2)),
    "i0_far": (i0_far, FAR),
    "ratio_far": (ratio_far, FAR),
    "i0_near": (i0_near, NEAR),
    "i1_near": (i1_near, NEAR),
}
"""The function and the range of the polynomial in each function of the kernel."""


def fit(name: str) -> tuple[list[float], float]:
    """Return the coefficients of a polynomial of the kernel, and its relative error."""
    function, (low, high) = FITS[name]
    inset = (high - low) / 10**9  # at the ends some of the functions are limits
    places = linspace(low + inset, high - inset, 101)
    values = [(x, function(x)) for x in places]
    count, error = 1, mpf(1)
    while error > TOLERANCE:
        count += 1
        fitted = chebyfit(function, [low, high], count, asc=True)
        error = max(
            abs(polyval(fitted, x, asc=True) / value - 1) for x, value in values
        )
    return [float(c) for c in fitted], float(error)


if __name__ == "__main__":
    for name in FITS:
        coefficients, error = fit(name)
        print(f"{name}: relative error {error:.1e}")
        print(*(f"    {c!r}" for c in coefficients), sep="\n")
