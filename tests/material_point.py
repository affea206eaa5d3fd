"""A single particle that is strained as one wishes: the drivers of material tests."""

import numpy as np

from mpisph.core.particles import Particles
from mpisph.materials.model import TABLES
from mpisph.physics.response import MaterialModels, material_table, respond
from mpisph.physics.stress import equivalent_stress, jaumann_rate

NAMES = {
    "eos": "linear",
    "porosity": "none",
    "thermal": "none",
    "strength": "none",
    "failure": "none",
    "ductile": "none",
}
"""The models of a material that chooses none."""

RHO0, BULK = 2700.0, 75e9


def models(choices=None, rho0=RHO0, **constants):
    """A material: models by kind, and their constants by name with ``_`` for ``-``."""
    tables = {"linear": {"bulk_modulus": BULK}}
    tables |= {name.replace("_", "-"): table for name, table in constants.items()}
    checked = {name: TABLES[name](**table) for name, table in tables.items()}
    return MaterialModels("matter", rho0, NAMES | (choices or {}), checked)


class Point:
    """One particle of a material, in a given state.

    Attributes
    ----------
    p : Particles
        Of one particle; the derived fields answer to the state.
    """

    def __init__(self, material, size=1e-4, number=0, **state):
        self.table = material_table([material])
        self.p = Particles.zeros(1)
        self.p.id[0] = number
        rest = {"rho": material.rest_density, "distension": material.initial_distension}
        self.set(**rest | {"r": 1.0} | state)
        self.p.m[0] = 2.0 * np.pi * self.p.rho[0] * size**2
        self.p.h[0] = 1.5 * size
        self.respond(0.0)

    def set(self, **state):
        """Set fields to numbers."""
        for name, value in state.items():
            getattr(self.p, name)[0] = value

    def get(self, *names):
        """The numbers of fields; a single one bare."""
        found = [float(getattr(self.p, name)[0]) for name in names]
        return found if len(found) > 1 else found[0]

    def respond(self, dt):
        """Bring the response up to the state."""
        respond(self.p.material_state(), self.table, 0.01, dt)

    def strain(self, L, dt, heat=True):
        """Strain by a velocity gradient (L_rr, L_tt, L_rz, L_zr, L_zz) for a time.

        The internal energy takes up the work of the stress that there is afterwards in
        the middle between both times (iterated), unless `heat` is off.
        """
        L = np.array(L)
        div = L[0] + L[1] + L[4]
        before = self.p.values.copy()
        power = self._power(L)
        for _ in range(1 if not heat else 20):
            self.p.values[:] = before
            S = [self.get(n) for n in ("S_rr", "S_zz", "S_rz")]
            rates = jaumann_rate(*L, *S, self.get("G"))
            for name, rate in zip(("S_rr", "S_zz", "S_rz"), rates, strict=True):
                getattr(self.p, name)[0] += dt * rate
            self.p.rho[0] *= np.exp(-div * dt)
            first = power if not heat else 0.5 * (power + self._start_power)
            self.p.E[0] += dt * first if heat else 0.0
            self.respond(dt)
            new = self._power(L)
            if new == power:
                break
            power = new
        self._start_power = power

    _start_power = 0.0

    def _power(self, L):
        """Work of the stress a mass and time [W/kg]."""
        P, rr, zz, rz, rho = self.get("P", "S_rr", "S_zz", "S_rz", "rho")
        tt = -(rr + zz)
        work = (rr - P) * L[0] + (tt - P) * L[1] + (zz - P) * L[4]
        return (work + rz * (L[2] + L[3])) / rho

    @property
    def stress(self):
        """Equivalent stress [Pa]."""
        return equivalent_stress(*self.get("S_rr", "S_zz", "S_rz"))


def pure_shear(rate):
    """The gradient of a pure shear of an engineering rate [1/s], without spin."""
    return (0.0, 0.0, 0.5 * rate, 0.5 * rate, 0.0)


def uniaxial_strain(rate):
    """The gradient of a strain along z alone [1/s]."""
    return (0.0, 0.0, 0.0, 0.0, rate)


def isochoric(rate):
    """The gradient of a bar that lengthens along z and keeps its volume [1/s]."""
    return (-0.5 * rate, -0.5 * rate, 0.0, 0.0, rate)
