"""The scheme's parameters in the form that the jitted functions take."""

from typing import NamedTuple

from mpisph.physics.artificial_stress import ArtificialStress


class SchemeConstants(NamedTuple):
    """Numerical parameters of R1-R10 and R21.

    Attributes
    ----------
    lee2003 : bool
        Whether forces and work are weighted as in eqs (5), (6) (R3, R4).
    alpha, beta, epsilon : float
        Artificial viscosity (R5).
    printed : bool
        Whether N is taken as printed in eq (12) (R5).
    g1, g2 : float
        Artificial heat (R6); both zero switch it off.
    kappa : float
        Cut of the kernel in units of h (R1).
    self_term : bool
        Whether a ring acts on itself (R1).
    smoothing : int
        One of `smoothing.MODES` (R10).
    sound_speed_floor : float
        Smallest sound speed in units of the bulk sound speed (R8).
    artificial_stress : ArtificialStress
        Of the consistent form alone (R21).
    """

    lee2003: bool
    alpha: float
    beta: float
    epsilon: float
    printed: bool
    g1: float
    g2: float
    kappa: float
    self_term: bool
    smoothing: int
    sound_speed_floor: float
    artificial_stress: ArtificialStress
