"""R2, R3, R7: what is made of the sums of the velocity gradient."""

import numpy as np
import pytest

from mpisph.sph.gradient import UNITY, corrected, inverse_moments, solid_share


def matrix(rr, tt, rz, zr, zz):
    return np.array([[rr, 0.0, rz], [0.0, tt, 0.0], [zr, 0.0, zz]])


def test_corrected_r2_is_the_product_of_tensors():
    A, (rr, tt, rz, zz) = (1.0, -2.0, 3.0, -5.0, 7.0), (0.9, 1.3, 0.2, 1.1)
    want = matrix(*A) @ matrix(rr, tt, rz, rz, zz)
    np.testing.assert_allclose(matrix(*corrected(A, (rr, tt, rz, zz))), want)
    assert corrected(A, UNITY) == A


def test_inverse_moments_r7_undo_the_moments():
    rr, tt, rz, zz = K = (0.6, 0.7, -0.2, 0.9)
    product = corrected((rr, tt, rz, rz, zz), inverse_moments(K))
    np.testing.assert_allclose(product, (1.0, 1.0, 0.0, 0.0, 1.0), atol=1e-15)


@pytest.mark.parametrize(
    ("just_enough", "too_few"),
    [
        # K_rr, K_tt, K_rz, K_zz: by the determinant, along the hoop, along r and z.
        # Two negative ones have a positive determinant.
        ((0.5, 1.0, 0.0, 0.2001), (0.5, 1.0, 0.0, 0.1999)),
        ((0.5, 1.0, 0.3999, 0.52), (0.5, 1.0, 0.4001, 0.52)),
        ((1.0, 0.1001, 0.0, 1.0), (1.0, 0.0999, 0.0, 1.0)),
        ((0.1001, 1.0, 0.0, 2.0), (0.0999, 1.0, 0.0, 2.0)),
        ((2.0, 1.0, 0.0, 0.1001), (2.0, 1.0, 0.0, 0.0999)),
        ((1.5, 1.0, 0.0, 1.0), (-1.5, 1.0, 0.0, -1.0)),
    ],
)
def test_inverse_moments_r7_need_enough_neighbours(just_enough, too_few):
    assert inverse_moments(just_enough) != UNITY
    assert inverse_moments(too_few) == UNITY
    assert inverse_moments((np.nan, 1.0, 0.0, 1.0)) == UNITY


def test_solid_share_r3_of_weak_and_strong_shocks():
    G = 26e9
    assert solid_share(0.0, G) == 1.0
    assert solid_share(0.04 * G, G) == pytest.approx(0.6)
    assert solid_share(-0.04 * G, G) == pytest.approx(0.6)
    assert solid_share(0.1 * G, G) == solid_share(3.0 * G, G) == 0.0
    assert solid_share(0.0, 0.0) == 0.0, "a fluid takes none"
