"""Slow implementations that share no formula with mpisph, and small helpers.

The kernel comes in 50 decimal digits, or by quadrature over the angle; the pair loop
as a Cartesian sum over rings of many points with 3x3 tensors; pressures accept complex
numbers, so that a derivative is an imaginary part without rounding error.
"""

import cmath
import math
from collections.abc import Mapping
from decimal import Decimal, localcontext
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest

from mpisph.core.particles import Particles
from mpisph.materials.model import TABLES
from mpisph.parallel.decomposition import Level
from mpisph.physics.artificial_stress import artificial_stress
from mpisph.physics.kernel import XI_FAR
from mpisph.physics.response import (
    KINDS,
    MaterialModels,
    material_table,
    respond_rows,
)
from mpisph.physics.scheme import SchemeConstants
from mpisph.physics.smoothing import AXISYMMETRIC, CLASSIC, PRINTED
from mpisph.physics.viscosity import FAR_NODES, near_nodes
from mpisph.sph.integrator import predict
from mpisph.sph.neighbours import make_lattice
from mpisph.sph.pair_records import RECORD_FIELDS
from mpisph.sph.rates import update_rates
from mpisph.sph.sources import (
    AHEAD,
    EXCHANGED,
    LAST,
    OF_AHEAD,
    ROW,
    look_ahead,
    sort_fields,
)

DIGITS = 60
PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459")
SERIES_UP_TO = 2000.0


class Matter(NamedTuple):
    """A material, its constants side by side, and the models that it is used with.

    Constants of models that are not among them stand in `more`, by the model's name.
    """

    rho0: float = 2710.0
    c0: float = 5350.0
    slope: float = 1.49
    slope2: float = 0.0
    slope3: float = 0.0
    gamma: float = 1.7
    gamma_slope: float = 0.0
    K: float = 72e9
    mu: float = 25e9
    Y: float = 55e6
    a: float = 0.5
    b: float = 1.63
    A: float = 78.5e9
    B: float = 65e9
    E0: float = 5e6
    Es: float = 2.76e6
    Es_prime: float = 14.1e6
    alpha: float = 5.0
    beta: float = 5.0
    gas_gamma: float = 1.4
    gas_c0: float = 340.0
    P_min: float = -math.inf
    P_min_mode: str = "off"
    eos: str = "mie-grueneisen"
    porosity: str = "none"
    thermal: str = "none"
    strength: str = "elastic-plastic"
    failure: str = "minimum-pressure"
    ductile: str = "none"
    more: Mapping[str, Mapping[str, Any]] = {}

    @property
    def models(self):
        """The same as mpisph takes it."""
        names = {kind: getattr(self, kind) for kind in KINDS}
        tillotson = ("a", "b", "A", "B", "E0", "Es", "Es_prime", "alpha", "beta")
        constants = {
            "mie-grueneisen": {
                "c0": self.c0,
                "slope": self.slope,
                "slope2": self.slope2,
                "slope3": self.slope3,
                "gamma0": self.gamma,
                "gamma_slope": self.gamma_slope,
            },
            "linear": {"bulk_modulus": self.K},
            "ideal-gas": {"gamma": self.gas_gamma, "c0": self.gas_c0},
            "tillotson": {name: getattr(self, name) for name in tillotson},
            "elastic-plastic": {"shear_modulus": self.mu, "yield_strength": self.Y},
            "minimum-pressure": {"value": self.P_min, "mode": self.P_min_mode},
            **self.more,
        }
        tables = {name: TABLES[name](**numbers) for name, numbers in constants.items()}
        return MaterialModels("matter", self.rho0, names, tables)


ALUMINIUM = Matter()
COPPER = ALUMINIUM._replace(rho0=8930.0, c0=3940.0, mu=46e9, Y=120e6, K=140e9)


def table_of(*matter):
    """The table of constants of some materials."""
    return material_table([each.models for each in matter])


SCHEME = SchemeConstants(
    lee2003=False,
    alpha=2.5,
    beta=1.5,
    epsilon=0.001,
    printed=False,
    g1=0.5,
    g2=1.0,
    kappa=3.0,
    self_term=True,
    smoothing=AXISYMMETRIC,
    sound_speed_floor=0.01,
    artificial_stress=artificial_stress(0.2, 1.5, 3.0),
)


# -- The kernel


def scaled_bessel(xi):
    """Return exp(-xi) I0, exp(-xi) I1 and 1 - I1/I0 as decimals of 50 digits."""
    with localcontext() as context:
        context.prec = DIGITS
        x = Decimal(xi)
        if xi <= SERIES_UP_TO:
            i0, i1 = (n * (-x).exp() for n in _power_series(x))
        else:
            i0, i1 = (_asymptotic_series(x, n) for n in (0, 1))
        return i0, i1, 1 - i1 / i0


def _power_series(x):
    """Return I0 and I1: all terms are positive, nothing cancels."""
    w = x * x / 4
    term = Decimal(1)
    i0 = term
    i1 = term
    k = 0
    while term > i0 * Decimal(10) ** -DIGITS:
        k += 1
        term *= w / (k * k)
        i0 += term
        i1 += term / (k + 1)
    return i0, i1 * x / 2


def _asymptotic_series(x, n):
    """Return exp(-x) I_n; the terms fall to exp(-2 x) of the first one."""
    term = Decimal(1)
    total = term
    for k in range(1, 60):
        term *= -Decimal(4 * n * n - (2 * k - 1) ** 2) / (8 * k * x)
        total += term
    return total / (2 * PI * x).sqrt()


def ring_averages_decimal(d2, h, xi):
    """Return A0, A1, s2 and q (R1) of the floats given, to 50 digits."""
    i0, i1, q = scaled_bessel(xi)
    with localcontext() as context:
        context.prec = DIGITS
        G = (-Decimal(d2)).exp() / (PI * PI.sqrt() * Decimal(h) ** 3)
        s2 = G * (i1 / Decimal(xi) if xi > 0 else Decimal("0.5"))
        return G * i0, G * i1, s2, q


def ring_points(r, n):
    """Return the Cartesian positions x, y of `n` points on a ring."""
    t = 2.0 * np.pi * np.arange(n) / n
    return r * np.cos(t), r * np.sin(t), np.cos(t), np.sin(t)


def gaussian_3d(distance2, h):
    return np.exp(-distance2 / h**2) / (np.pi**1.5 * h**3)


# -- Equations of state; each accepts complex rho and E


def linear_pressure(rho, E, mat):
    return mat.K * (rho - mat.rho0) / mat.rho0


def mie_grueneisen_pressure(rho, E, mat):
    """Reference: the Hugoniot, P = P_H + Gamma rho (E - E_H), or cold expansion."""
    if rho.real < mat.rho0:
        return mat.c0**2 * (rho - mat.rho0) + mat.gamma * rho * E
    m, end = rho / mat.rho0 - 1.0, last_compression(mat._replace(more=None))
    if m.real <= end:
        return at_zero_energy(m, mat) + gamma_rho(m, mat) * E
    slope = at_zero_energy(complex(end, 1e-30), mat).imag / 1e-30
    return at_zero_energy(end, mat) + slope * (m - end) + gamma_rho(end, mat) * E


def gamma_rho(m, mat):
    """Return Gamma rho of Gamma = (gamma0 + b m)/(1 + m)."""
    return mat.rho0 * (mat.gamma + mat.gamma_slope * m)


def hugoniot_of(m, mat):
    """Return P_H and E_H by the strain x = u/U, from U (1 - s x - ...) = c0."""
    x = m / (1.0 + m)
    U = mat.c0 / (1.0 - mat.slope * x - mat.slope2 * x**2 - mat.slope3 * x**3)
    return mat.rho0 * U * (U * x), 0.5 * (U * x) ** 2


def at_zero_energy(m, mat):
    P_H, E_H = hugoniot_of(m, mat)
    return P_H - gamma_rho(m, mat) * E_H


@cache
def last_compression(mat):
    """Return 0.8 of the least m at a pole or a maximum, by bisection; or infinity."""

    def rises(x):
        m = x / (1.0 - x)
        share = 1.0 - mat.slope * x - mat.slope2 * x**2 - mat.slope3 * x**3
        return share > 0.0 and at_zero_energy(complex(m, 1e-30), mat).imag > 0.0

    x = np.linspace(0.0, 1.0, 20_001)[:-1].tolist()
    past = next((k for k, one in enumerate(x) if not rises(one)), None)
    if past is None:
        return math.inf
    low, high = x[past - 1], x[past]
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if rises(middle) else (low, middle)
    return 0.8 * low / (1.0 - low)


def tillotson_pressure(rho, E, mat):
    eta = rho / mat.rho0
    # A negative energy, which integration may leave, does not reach the pole.
    bracket = mat.b / ((E if E.real > 0.0 else 0.0) / mat.E0 / eta**2 + 1.0)
    cold = (mat.a + bracket) * rho * E + mat.A * (eta - 1)
    if eta.real > 1.0:
        cold += mat.B * (eta - 1) ** 2
    fade = 1.0 / eta - 1.0
    hot = mat.a * rho * E + (
        bracket * rho * E + mat.A * (eta - 1.0) * cmath.exp(-mat.beta * fade)
    ) * cmath.exp(-mat.alpha * fade**2)
    if eta.real >= 1.0 or E.real <= mat.Es:
        return cold
    if E.real >= mat.Es_prime:
        return hot
    return ((E - mat.Es) * hot + (mat.Es_prime - E) * cold) / (mat.Es_prime - mat.Es)


def gas_pressure(rho, E, mat):
    return rho * E * (mat.gas_gamma - 1.0)


PRESSURES = {
    "ideal-gas": gas_pressure,
    "linear": linear_pressure,
    "mie-grueneisen": mie_grueneisen_pressure,
    "tillotson": tillotson_pressure,
}


def pressure_and_slopes(rho, E, mat):
    """Return P, dP/drho, dP/dE; the slopes as imaginary parts (complex step)."""
    law, step = PRESSURES[mat.eos], 1e-30
    return (
        complex(law(rho, E, mat)).real,
        complex(law(complex(rho, step), complex(E), mat)).imag / step,
        complex(law(complex(rho), complex(E, step), mat)).imag / step,
    )


def pressure_and_sound_speed(rho, E, mat, scheme):
    P, P_rho, P_E = pressure_and_slopes(rho, E, mat)
    bulk = {
        "linear": math.sqrt(mat.K / mat.rho0),
        "mie-grueneisen": mat.c0,
        "ideal-gas": mat.gas_c0,
        "tillotson": math.sqrt(mat.A / mat.rho0),
    }[mat.eos]
    floor = scheme.sound_speed_floor * bulk
    if mat.P_min_mode != "off" and mat.P_min > P:
        P = {"clamp": mat.P_min, "zero": 0.0}[mat.P_min_mode]
    c2 = P_rho + P * P_E / rho**2
    c = math.sqrt(c2) if c2 > floor**2 else floor
    return P, c


def is_torn(rho, E, mat):
    """Say whether the tensile limit acts: such matter carries no shear."""
    limited = mat.P_min_mode != "off"
    return limited and pressure_and_slopes(rho, E, mat)[0] < mat.P_min


# -- Tensors in the order r (or x), theta (or y), z


def deviator(S_rr, S_zz, S_rz):
    return np.array([[S_rr, 0, S_rz], [0, -(S_rr + S_zz), 0], [S_rz, 0, S_zz]])


def jaumann(L, S, mu):
    """Return dS/dt of 3x3 tensors: 2 mu dev(D) + W S - S W."""
    D, W = 0.5 * (L + L.T), 0.5 * (L - L.T)
    return 2.0 * mu * (D - np.trace(D) / 3.0 * np.eye(3)) + W @ S - S @ W


def inverse_or_unity(K):
    """Return the inverse of the moments, or unity where there is too little of them."""
    enough = np.linalg.det(K[::2, ::2]) > 0.1 and np.diag(K).min() > 0.1
    return np.linalg.inv(K) if enough else np.eye(3)


# -- Particles


def cloud(
    n, seed, r_min=0.0, extent=12e-3, h=2e-3, h_spread=1.5, n_materials=1, section=1e-6
):
    """Return particles at random places with random states.

    The smoothing lengths lie between `h` and ``h * h_spread``, the radii between
    `r_min` and ``r_min + extent``, the sections between half and twice `section`.
    """
    rng = np.random.default_rng(seed)
    p = Particles.zeros(n)
    p.id[:] = rng.permutation(n)
    p.material[:] = rng.integers(0, n_materials, n)
    p.r[:] = r_min + rng.uniform(0.0, extent, n)
    p.z[:] = rng.uniform(-0.5 * extent, 0.5 * extent, n)
    p.h[:] = h * h_spread ** rng.uniform(0.0, 1.0, n)
    rho0 = np.array([ALUMINIUM.rho0, COPPER.rho0])[p.material]
    p.rho[:] = rho0 * rng.uniform(0.9, 1.2, n)
    p.m[:] = 2.0 * np.pi * p.r * p.rho * section * rng.uniform(0.5, 2.0, n)
    p.E[:] = rng.uniform(-1e5, 3e6, n)
    p.u_r[:], p.u_z[:] = rng.uniform(-4e3, 4e3, (2, n))
    p.stress[:] = rng.uniform(-5e9, 5e9, (3, n))
    p.div[:] = rng.uniform(-1e6, 1e6, n)
    unity = np.array([1.0, 1.0, 0.0, 1.0])[:, None]
    p.correction[:] = unity + rng.uniform(-0.3, 0.3, (4, n))
    return p


def predicted_fields(p, tau):
    """Return the integrated fields of particles a time `tau` ahead."""
    predicted = np.empty_like(p.integrated)
    predict(p, tau, predicted)
    return predicted


def sent_fields(p, scheme=SCHEME, table=None):
    """Return the exchanged fields and the shear modulus of particles as they are."""
    table = table_of(ALUMINIUM) if table is None else table
    ahead = np.empty((len(AHEAD), p.n))
    look_ahead(p, 0.0, 0.0, ahead, np.empty((len(LAST), p.n)))
    integrated = slice(ROW.u_r, ROW.h + 1)
    before = ahead[integrated].copy()
    floor = scheme.sound_speed_floor
    respond_rows(p.id, p.material, ahead, OF_AHEAD, table, floor, 0.0)
    ahead[integrated] = before  # the stress as it is, outside of the yield surface too
    return ahead[: len(EXCHANGED)].copy(), ahead[ROW.G]


def evaluate(
    p,
    scheme=SCHEME,
    materials=(ALUMINIUM,),
    h0=2e-3,
    ghosts=None,
    skip_quiescent=True,
):
    """Let mpisph evaluate the rates of `p`, as one step does on one rank."""
    table = table_of(*materials)
    fields, G = sent_fields(p, scheme, table)
    if ghosts is not None:
        fields = np.concatenate([fields, ghosts], axis=1)
    lattice = make_lattice(h0, scheme.kappa)
    cells = sort_fields(fields, lattice)
    records = np.empty((fields.shape[1], RECORD_FIELDS))
    update_rates(fields, cells, lattice, table, scheme, G, p, records, skip_quiescent)
    return p


class BruteForce:
    """Rates of all particles as Cartesian sums over rings of points (R2-R7, R10).

    Attributes
    ----------
    L, dS : ndarray, shape (n, 3, 3)
        Velocity gradient and rate of the stress deviator.
    K : ndarray, shape (n, 3, 3)
        Moments: the velocity gradient of u = x.
    du, dE, drho, dh : ndarray
        Rates; du has shape (n, 3), the others (n,).
    damping, crowding : ndarray, shape (n,)
        Viscous signal speed, and kernel sum over density.
    count : ndarray, shape (n,)
        Number of rings in each sum.
    """

    def __init__(self, p, scheme=SCHEME, materials=(ALUMINIUM,), points=400):
        self.p, self.scheme, self.points = p, scheme, points
        mats = [materials[k] for k in p.material]
        P, self.c = np.array(
            [
                pressure_and_sound_speed(*state, scheme)
                for state in zip(p.rho.tolist(), p.E.tolist(), mats, strict=True)
            ]
        ).T
        S = np.array([deviator(*stress) for stress in p.stress.T])
        self.sigma = P[:, None, None] * np.eye(3) - S
        rr, tt, rz, zz = p.correction
        self.B = np.zeros((p.n, 3, 3))
        self.B[:, 0, 0], self.B[:, 1, 1], self.B[:, 2, 2] = rr, tt, zz
        self.B[:, 0, 2] = self.B[:, 2, 0] = rz
        closing = np.where(p.div < 0.0, -2.0 * p.div, 0.0)
        self.zeta = scheme.g1 * p.h * self.c + scheme.g2 * p.h**2 * closing
        self.eta = p.rho / np.array([mat.rho0 for mat in mats])
        gas = np.array([mat.eos == "ideal-gas" for mat in mats])
        self.by_mass = (p.div < 0.0) | (gas & (self.eta > 1.0))
        self.stress = self.sigma @ self.B
        sums = [self._ring(a) for a in range(p.n)]
        self.L, self.K, self.du, self.dE, self.damping, self.crowding, self.count = (
            np.array(x) for x in zip(*sums, strict=True)
        )
        D = self.L @ self.B
        div, hoop = np.trace(D, axis1=1, axis2=2), D[:, 1, 1]
        crowded = (self.crowding > 1.1) & (div > 0.0)
        self.div = np.where(crowded, 0.0, div)
        expanded = gas & (self.eta < 1.0) & (p.E > 0.0)
        settled = np.where(expanded, (self.crowding - 1.0) * self.c / p.h, 0.0)
        self.drho = -p.rho * (self.div - settled)
        state = zip(p.rho.tolist(), p.E.tolist(), mats, strict=True)
        mu = [
            0.0 if is_torn(*each) or each[2].strength == "none" else each[2].mu
            for each in state
        ]
        inverse = [inverse_or_unity(K) for K in self.K]
        self.dS = np.array(
            [
                jaumann(L @ B, s, G)
                for L, B, s, G in zip(self.L, inverse, S, mu, strict=True)
            ]
        )
        solid = np.array(mu) > (np.inf if scheme.lee2003 else 0.0)
        share = np.clip(1.0 - 10.0 * np.abs(P) / np.maximum(mu, 1.0), 0.0, 1.0) * solid
        self.next_B = np.eye(3) + share[:, None, None] * (inverse - np.eye(3))
        relative = {
            CLASSIC: self.div - settled,
            AXISYMMETRIC: np.where(crowded, 0.0, div - hoop) - settled,
            PRINTED: self.div - settled - p.u_r / p.r,
        }
        self.dh = 0.5 * p.h * relative.get(scheme.smoothing, np.zeros(p.n))

    def _ring(self, a):
        """Return all that is summed for particle a, and the number of rings it sees."""
        p, scheme = self.p, self.scheme
        h = 0.5 * (p.h[a] + p.h)
        apart2 = (p.r[a] - p.r) ** 2 + (p.z[a] - p.z) ** 2
        seen = apart2 < (scheme.kappa * h) ** 2
        seen[a] = scheme.self_term
        b = np.flatnonzero(seen)
        h = h[b]

        # Ring b as points (b, angle, axis); a itself stands at angle zero.
        x_b, y_b, cos, sin = ring_points(p.r[b, None], self.points)
        zero = np.zeros_like(x_b)
        frame = np.zeros((self.points, 3, 3))
        frame[:, 0, 0], frame[:, 0, 1], frame[:, 1, 0] = cos, -sin, sin
        frame[:, 1, 1] = cos
        frame[:, 2, 2] = 1.0
        apart = -np.stack([x_b - p.r[a], y_b, zero + p.z[b, None] - p.z[a]], axis=-1)
        speed = np.stack([p.u_r[b], 0.0 * p.u_r[b], p.u_z[b]], axis=-1)
        u_b = np.einsum("tij,bj->bti", frame, speed)
        closing = np.array([p.u_r[a], 0.0, p.u_z[a]]) - u_b
        stress_b = np.einsum("tij,bjk,tlk->btil", frame, self.stress[b], frame)

        W = gaussian_3d((apart**2).sum(-1), h[:, None])
        grad = -2.0 / h[:, None, None] ** 2 * apart * W[..., None]
        mean = W.mean(1)

        m, rho, eta = p.m[b], p.rho[b], self.eta[b] / self.eta[a]
        n = self.points
        if scheme.lee2003:
            by_volume = m / rho
            own, other = m / p.rho[a] ** 2, m / rho**2
        else:
            by_volume = m / rho * (eta if self.by_mass[a] else 1.0)
            own = by_volume / p.rho[a]
            other = m / rho / p.rho[a] * np.where(self.by_mass[b], 1.0 / eta, 1.0)
        L = np.einsum("b,bti,btj->ij", by_volume / n, -closing, grad)
        K = np.einsum("b,bti,btj->ij", by_volume / n, -apart, grad)
        du = -np.einsum("b,ij,btj->i", own / n, self.stress[a], grad)
        du -= np.einsum("b,btij,btj->i", other / n, stress_b, grad)
        dE = np.einsum("b,ij,bti,btj->", own / n, self.stress[a], closing, grad)

        F = -2.0 / h**2
        rho_ab = 0.5 * (p.rho[a] + rho)
        c_ab = 0.5 * (self.c[a] + self.c[b])
        damping = 0.0
        for share, N, x, D in self._approach(a, b, h, W, mean):
            mu = np.where(N < 0.0, h * N / (D + scheme.epsilon * h**2), 0.0)
            Pi = share * (-scheme.alpha * c_ab * mu + scheme.beta * mu**2) / rho_ab
            du[[0, 2]] -= (m * F * mean * Pi) @ x
            dE += 0.5 * (m * F * mean * Pi * N).sum()
            speed = share * (scheme.alpha * c_ab - scheme.beta * mu)
            damping += (m / rho_ab * mean * speed).sum()

        if not scheme.lee2003:
            held, u = self._held_apart(a, b, h)
            held *= np.stack([(cos * W).mean(1), mean], axis=-1)
            weight = m / rho / p.rho[a] * F
            du[[0, 2]] -= weight @ held
            dE += 0.5 * (weight * (held * u).sum(1)).sum()

        zeta = 0.5 * (self.zeta[a] + self.zeta[b])
        flow = 2.0 * zeta / rho_ab * (p.E[a] - p.E[b]) * F * mean
        crowding = (m / rho * eta * mean).sum()
        return L, K, du, dE + (m * flow).sum(), damping, crowding, b.size

    def _held_apart(self, a, b, h):
        """Return tractions that are taken back (R21), and differences of velocity."""
        p, s = self.p, self.scheme.artificial_stress
        x = np.stack([p.r[a] - p.r[b], p.z[a] - p.z[b]], axis=-1)
        stress = (self.stress[a] + self.stress[b])[:, ::2, ::2]
        t = np.einsum("bij,bj->bi", stress, x)
        size = np.linalg.norm(x, axis=1) * np.linalg.norm(t, axis=1)
        cosine = (t * x).sum(1) / np.where(size > 0.0, size, 1.0)
        spacings2 = (x**2).sum(1) / h**2 * s.per_spacing
        near = np.clip((2.25 - spacings2) / 1.25, 0.0, None)
        share = s.strength * (s.g - near**2) * np.where(cosine < 0.0, cosine**2, 0.0)
        held = share[:, None] * t
        u = np.stack([p.u_r[a] - p.u_r[b], p.u_z[a] - p.u_z[b]], axis=-1)
        return held, u

    def _approach(self, a, b, h, W, mean):
        """Yield the nodes of each pair (R5): weight, N, r-z distance, its square.

        Away from the axis a node is a point of ring b, at the angle that it states.
        """
        p, printed = self.p, self.scheme.printed
        cos = ring_points(p.r[b, None], self.points)[2]
        q = ((1.0 - cos) * W).mean(1) / mean
        xi = 2.0 * p.r[a] * p.r[b] / h**2
        near = np.array([near_nodes.py_func(each) for each in q]).T
        nodes = np.where(xi < XI_FAR, near, np.array(FAR_NODES)[:, None])
        if printed:
            nodes = np.ones_like(nodes)
        for tau, share in ((nodes[0], nodes[2]), (nodes[1], 1.0 - nodes[2])):
            cos = 1.0 - tau * q
            x = np.array([p.r[a] - p.r[b] * cos, p.z[a] - p.z[b]])
            # (u_a - u_b).(x_a - x_b) of points at these angles.
            N = p.r[a] * p.u_r[a] + p.r[b] * p.u_r[b]
            N = N - (p.r[a] * p.u_r[b] + p.r[b] * p.u_r[a]) * cos
            if printed:
                N = (p.r[a] * p.u_r[a] + p.r[b] * p.u_r[b]) * q
                N += (p.r[a] - p.r[b]) * (p.u_r[a] - p.u_r[b])
            N = N + x[1] * (p.u_z[a] - p.u_z[b])
            D = p.r[a] ** 2 + p.r[b] ** 2 - 2.0 * p.r[a] * p.r[b] * cos + x[1] ** 2
            yield share, N, x.T, D


# -- Comparisons


def approx(want, rel=2e-15, abs=0.0):
    """Return pytest.approx without its absolute tolerance of 1e-12."""
    return pytest.approx(want, rel=rel, abs=abs)


# -- Ranks


def numbered(ids):
    """Particles whose fields are functions of the id, in the order given."""
    ids = np.asarray(ids, np.int64)
    p = Particles.zeros(len(ids))
    p.id[:] = ids
    p.body[:] = ids % 2
    p.material[:] = ids % 3
    p.values[:] = np.sin(0.1 + ids + np.arange(len(p.values))[:, None]) * 1e3
    return p


def share(comm, n, seed=3):
    """Return this rank's share of 0..n-1, dealt at random; rank 0 gets none."""
    rng = np.random.default_rng(seed)
    owner = rng.integers(min(1, comm.size - 1), comm.size, n)
    ids = rng.permutation(n)
    return ids[owner[ids] == comm.rank]


def cut_at(*edges, along_r=False):
    """Return a cut at edges in ascending order, all in one direction."""
    groups, cut = [(0, len(edges) + 1)], []
    while len(groups) <= len(edges):
        at, halves, below = [], [], []
        for first, end in groups:
            halves.append(len(below))
            middle = (first + end) // 2
            at.append(edges[middle - 1] if middle > first else np.nan)
            below += [(first, middle), (middle, end)][middle == first :]
        cut.append(Level(np.full(len(at), along_r), np.array(at), np.array(halves)))
        groups = below
    return tuple(cut)


def agree(comm, problems):
    """Fail on every rank if any rank has problems; one that fails alone blocks all."""
    everyone = comm.allgather([str(problem) for problem in problems])
    assert not any(everyone), everyone


def bits(array):
    """Return an array's bits as integers, so that NaN equals NaN and -0 is not 0."""
    return np.ascontiguousarray(array).view(np.int64)
