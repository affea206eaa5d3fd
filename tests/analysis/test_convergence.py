"""Richardson extrapolation and the grid convergence index, on made-up sequences."""

import math

import numpy as np
import pytest
from scipy.optimize import fixed_point

from mpisph.analysis.convergence import (
    ORDERS,
    UNVERIFIED,
    VERIFIED,
    _log_ratio,
    converge,
    explain,
    observed_order,
)

LIMIT = 3.0

EVEN = (10.0, 20.0, 40.0)
UNEVEN = (10.0, 13.0, 29.0)


def power(npr, p, c=1.0, sign=1.0):
    """f = f0 + C h^p, of alternating sign where sign is -1."""
    return [LIMIT + c * sign**k * n**-p for k, n in enumerate(npr)]


@pytest.mark.parametrize("npr", [EVEN, UNEVEN, (4.0, 5.0, 6.0), (10.0, 100.0, 110.0)])
@pytest.mark.parametrize("p", [0.55, 0.75, 1.0, 1.7, 2.0, 2.9])
@pytest.mark.parametrize("c", [2.0, -0.3])
def test_order_and_limit_that_were_put_in_are_found(npr, p, c):
    values = power(npr, p, c)
    found = converge(npr, values)
    assert found.kind == "monotone"
    assert found.order == pytest.approx(p, rel=1e-6)
    assert found.extrapolated == pytest.approx(LIMIT, rel=1e-9)
    # The uncertainty is the true error, times the factor of safety.
    assert found.uncertainty == pytest.approx(
        VERIFIED * abs(values[-1] - LIMIT), rel=1e-6
    )
    assert found.gci == pytest.approx(100 * found.uncertainty / values[-1])
    assert (found.safety, found.order_used) == (VERIFIED, found.order)


def iterate(r21, r32, f1, f2, f3):
    """Celik et al. (2008), equation 3, by iteration as they do it."""
    e32, e21 = f3 - f2, f2 - f1
    s = np.sign(e32 / e21)

    def order(p):
        q = np.log((r21**p - s) / (r32**p - s))
        return abs(np.log(abs(e32 / e21)) + q) / np.log(r21)

    p = float(fixed_point(order, 1.0, xtol=1e-12, maxiter=500))
    return p, (r21**p * f1 - f2) / (r21**p - 1), abs(e21 / f1) / (r21**p - 1) * 125


# Table 1 of Celik et al.: cells of plane grids, the finest first; p, the extrapolated
# value and the index [%] as printed there.
TABLE = [
    ((18000, 8000, 4500), (6.063, 5.972, 5.863), 1.53, 6.1685, 2.2),
    ((18000, 4500, 980), (10.7880, 10.7250, 10.6050), 0.75, 10.8801, 1.1),
    ((18000, 4500, 980), (6.0042, 5.9624, 6.0909), 1.51, 6.0269, 0.5),
]


@pytest.mark.parametrize(("cells", "f", "p", "limit", "gci"), TABLE)
def test_worked_example_of_celik(cells, f, p, limit, gci):
    npr = np.sqrt(cells)
    r21, r32 = npr[0] / npr[1], npr[1] / npr[2]
    order, extrapolated, index = iterate(r21, r32, *f)
    # What is printed there follows from their equations.
    assert round(order, 2) == p
    assert extrapolated == pytest.approx(limit, abs=5e-4)
    assert round(index, 1) == gci
    found = converge(npr, f)
    assert found.order == pytest.approx(order, abs=1e-9)
    if found.kind == "monotone":
        assert found.extrapolated == pytest.approx(extrapolated, rel=1e-9)
        assert found.gci == pytest.approx(index, rel=1e-9)
    else:
        assert found.kind == "oscillatory"
        assert math.isnan(found.extrapolated)
        assert found.uncertainty == pytest.approx(6.0909 - 5.9624)


@pytest.mark.parametrize("npr", [EVEN, UNEVEN])
@pytest.mark.parametrize("p", [0.6, 1.0, 2.0])
def test_an_oscillation_has_its_order_and_its_range(npr, p):
    values = power(npr, p, 2.0, sign=-1.0)
    found = converge(npr, values)
    assert found.kind == "oscillatory"
    assert found.order == pytest.approx(p, rel=1e-6)
    assert math.isnan(found.extrapolated)
    assert math.isnan(found.order_used)
    assert found.uncertainty == pytest.approx(max(values) - min(values))
    assert min(values) <= LIMIT <= max(values)


@pytest.mark.parametrize("npr", [EVEN, UNEVEN])
@pytest.mark.parametrize(("p", "sign"), [(-0.5, 1.0), (-2.0, 1.0), (-0.5, -1.0)])
def test_divergence_is_not_taken_for_convergence(npr, p, sign):
    values = power(npr, p, 0.1, sign)
    found = converge(npr, values)
    assert found.kind == "divergent"
    assert found.order == pytest.approx(p, rel=1e-6)
    assert math.isnan(found.extrapolated)
    assert found.uncertainty == pytest.approx(UNVERIFIED * np.ptp(values))
    assert "no bound" in explain(found)


def test_uneven_levels_of_a_logarithm_diverge():
    """Their changes shrink where the ratio does, and yet there is no limit."""
    npr = (10.0, 40.0, 60.0)
    values = [math.log(n) for n in npr]
    assert values[2] - values[1] < values[1] - values[0]
    assert observed_order(np.array(npr), np.array(values)) == pytest.approx(0, abs=1e-9)
    assert converge(npr, [math.log(n) + 1e-3 * n for n in npr]).kind == "divergent"


def test_the_equation_of_the_order_has_no_gap_at_zero():
    at_zero, beside = (_log_ratio(p, 0.3, 0.8, False) for p in (0.0, 1e-9))
    assert at_zero == pytest.approx(beside, abs=1e-8)


def test_an_order_too_low_is_limited_and_tripled():
    values = power(EVEN, 0.2, 2.0)
    found = converge(EVEN, values)
    assert found.kind == "monotone"
    assert found.order == pytest.approx(0.2, rel=1e-6)
    assert (found.order_used, found.safety) == (ORDERS[0], 3.0)
    error = abs(values[1] - values[2]) / (2**0.5 - 1)
    assert found.uncertainty == pytest.approx(3 * error)
    assert abs(found.extrapolated - values[2]) == pytest.approx(error)
    assert "limited to 0.5, safety factor 3" in explain(found)


@pytest.mark.parametrize(
    ("npr", "values", "uncertainty"),
    [
        # Two values that agree by chance: the range of the three.
        (EVEN, (1.0, 2.0, 2.001), 1.001),
        (EVEN, (1.0, 2.0, 2.0), 1.0),
        # Ratios of 1.1: three times (2.1 - 2)/(1.1^3 - 1) is more.
        ((100.0, 110.0, 121.0), (1.8, 2.0, 2.1), 3 * 0.1 / (1.1**3 - 1)),
    ],
)
def test_an_order_too_high_is_limited(npr, values, uncertainty):
    found = converge(npr, values)
    assert found.order > 3.0
    assert (found.kind, found.order_used) == ("monotone", 3.0)
    assert found.uncertainty == pytest.approx(uncertainty)


def test_bounds_of_the_order_that_is_believed():
    for p, believed in [(0.49, False), (0.51, True), (2.99, True), (3.01, False)]:
        found = converge(EVEN, power(EVEN, p))
        assert (found.safety == VERIFIED) is believed
        assert (found.order_used == found.order) is believed


def test_two_levels_take_order_one_and_the_factor_three():
    found = converge([10, 15], [2.0, 2.2])
    assert found.kind == "two levels"
    assert math.isnan(found.order)
    assert (found.order_used, found.safety) == (1.0, 3.0)
    assert found.extrapolated == pytest.approx(2.2 + 0.2 / 0.5)
    assert found.uncertainty == pytest.approx(3 * 0.2 / 0.5)
    assert found.gci == pytest.approx(100 * 1.2 / 2.2)
    assert found.orders.size == 0
    assert found.asymptotic is None
    assert explain(found) == "two levels, order 1 assumed, safety factor 3"


def test_constant_values_are_certain():
    found = converge(EVEN, [0.1 + 0.2, 0.3, 0.3])
    assert (found.kind, found.uncertainty, found.gci) == ("constant", 0.0, 0.0)
    assert found.extrapolated == 0.3
    assert math.isnan(found.order)


def test_a_change_after_none_diverges():
    assert converge(EVEN, [1.0, 1.0, 2.0]).kind == "divergent"
    assert converge(EVEN, [1.0, 1.0, 2.0]).order == -math.inf


def test_levels_come_in_any_order_and_with_gaps():
    npr = [40, 5, 20, 80, 10]
    values = [power([n], 1.5)[0] for n in npr]
    values[3] = math.nan
    values[1] = None
    found = converge(npr, values)
    assert found.npr.tolist() == [10, 20, 40]
    assert found.values == pytest.approx(power(EVEN, 1.5))
    assert found.order == pytest.approx(1.5, rel=1e-6)


@pytest.mark.parametrize("values", [[], [1.0], [1.0, None], [math.nan, math.inf]])
def test_too_few_levels_say_nothing(values):
    found = converge(range(1, 1 + len(values)), values)
    assert found.kind == "too few"
    assert math.isnan(found.uncertainty)
    assert math.isnan(found.extrapolated)
    assert math.isnan(found.gci)
    assert explain(found)


def test_every_triplet_has_its_order():
    npr = [5, 10, 20, 40]
    mixed = [LIMIT + 2.0 / n + 3.0 / n**2 for n in npr]
    found = converge(npr, mixed)
    expected = [
        observed_order(np.array(npr[k : k + 3]), np.array(mixed[k : k + 3]))
        for k in (0, 1)
    ]
    assert found.orders.tolist() == expected
    # Towards the leading order, one.
    assert 2.0 > expected[0] > expected[1] > 1.0
    assert found.order == expected[1]
    assert found.kinds == ("monotone", "monotone")
    assert found.asymptotic is True


@pytest.mark.parametrize(
    ("values", "asymptotic"),
    [
        # Changes in the ratios of 2^p, from the coarsest.
        ((2**1.0, 2**1.0), True),
        ((2**1.0, 2**1.6), False),
        ((2**1.0, 2**1.4), True),
        ((2**3.2, 2**3.0), False),
        ((-(2**1.0), 2**1.0), False),
        ((-(2**1.0), -(2**1.0)), False),
        ((2**0.3, 2**0.3), False),
    ],
)
def test_asymptotic_are_orders_that_agree_over_two_triplets(values, asymptotic):
    changes = np.cumprod([1.0, *(1 / v for v in values)])
    found = converge([5, 10, 20, 40], np.concatenate([[0.0], np.cumsum(changes)]))
    assert found.asymptotic is asymptotic


def test_the_index_of_a_value_of_zero_is_unknown():
    found = converge(EVEN, [0.3, 0.1, 0.0])
    assert math.isnan(found.gci)
    assert found.uncertainty > 0.0


@pytest.mark.parametrize(
    ("npr", "values", "text"),
    [
        ((10, 20), (1.0,), "2 resolutions but 1 values"),
        ((10, 0), (1.0, 2.0), "not positive"),
        ((10, math.nan), (1.0, 2.0), "not positive"),
        ((10, 10), (1.0, 2.0), "given twice"),
    ],
)
def test_bad_levels_are_refused(npr, values, text):
    with pytest.raises(ValueError, match=text):
        converge(npr, values)
