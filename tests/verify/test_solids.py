"""Problems of solids: given the exact solution, all checks pass; given others, not."""

import math
from io import BytesIO

import numpy as np
import pytest

from mpisph.case.discretise import discretise
from mpisph.case.initial import complete_particles
from mpisph.verify.exact.elasticity import bar_stress, spun_section
from mpisph.verify.exact.taylor import final_length
from mpisph.verify.problem import Solved
from mpisph.verify.problems import (
    contact,
    plates,
    precursor,
    rotation,
    sphere,
    spin,
    taylor,
    tension,
    torus,
    verney,
)
from mpisph.verify.solids import ALUMINIUM, zero_crossings

NONE_AT_REST = ("u_r", "E", "P", "S_rr", "S_zz", "S_rz", "plastic_strain")


WIDTH = 0.1e-3


class Snapshot(dict):
    """Fields at one time, as of an opened run."""

    def __init__(self, case, time, fields):
        super().__init__(fields)
        self.case, self.time = case, time

    def body(self, name):
        return self["body"] == [body.name for body in self.case.bodies].index(name)


class Run:
    """An opened run whose later snapshots are made by a function of time and start."""

    def __init__(self, setup, later):
        self.case = setup.case
        if setup.particles is None:
            fields = discretise(self.case).fields()
        else:
            fields = complete_particles(self.case, setup.particles, "test").fields()
        still = np.zeros_like(fields["r"])
        fields = {name: still for name in NONE_AT_REST} | fields
        times = [0.0, *sorted({*self.case.output.times, self.case.time.end})]
        self.snapshots = [
            Snapshot(self.case, time, fields | (later(self.case, fields, time)))
            for time in times
        ]


def solved(problem, later, quick=True):
    setups = problem.setups(quick)
    return [Solved(setup.label, Run(setup, later)) for setup in setups]


def failed(problem, runs):
    return [check.quantity for check in problem.check(runs) if not check.passed]


def behind(fields, states, distance, front, sign=1.0):
    """Fields of matter that waves pass: a state and the distance of its front each."""
    out = {name: fields[name].copy() for name in ("z", "u_z", "rho", "E", "P", "S_zz")}
    before = {"u_z": 0.0, "rho": fields["rho"][0], "E": 0.0, "P": 0.0, "S_zz": 0.0}
    for state, way in zip(states, front, strict=True):
        # Fronts two layers wide, so that their places are no whole layers.
        share = np.clip(0.5 + 0.5 * (way - distance) / WIDTH, 0.0, 1.0)
        for name, value in (
            ("u_z", sign * state.velocity),
            ("rho", state.density),
            ("E", state.energy),
            ("P", state.pressure),
            ("S_zz", state.pressure - state.stress),
        ):
            out[name] += share * (value - before[name])
            before[name] = value
    return out


def shocked_plates(states_of):
    """Return what waves do to a flyer and a target, in their own frames."""

    def later(case, start, time):
        if time == 0.0:
            return {}
        fields = {}
        velocity = case.bodies[0].velocity
        flyer = start["body"] == 0
        for part, states, sign in zip(
            (flyer, ~flyer), states_of(case), (-1.0, 1.0), strict=True
        ):
            fields_of = {name: values[part] for name, values in start.items()}
            distance = np.abs(fields_of["z"])
            ways = [state.speed * time for state in states]
            found = behind({**fields_of, "u_z": 0 * distance}, states, distance, ways)
            # Matter moves from when each front has passed it.
            moved, last = np.zeros_like(distance), 0.0
            for state, way in zip(states, ways, strict=True):
                since = np.maximum(way - distance, 0.0) / state.speed
                moved += (state.velocity - last) * since
                last = state.velocity
            base = 0.0 if sign > 0 else velocity
            found["z"] = fields_of["z"] + base * time + sign * moved
            found["u_z"] = base + sign * found["u_z"]
            for name, values in found.items():
                fields.setdefault(name, start[name].copy())[part] = values
        return fields

    return later


def off(later, **factors):
    """Return a solution with some fields multiplied, as a wrong one."""

    def wrong(case, start, time):
        fields = later(case, start, time)
        whole = {**start, **fields}
        return fields | {name: f * whole[name] for name, f in factors.items()}

    return wrong


def test_plates():
    exact = shocked_plates(lambda case: [[plates._exact(case)]] * 2)
    runs = solved(plates.PROBLEM, exact)
    assert failed(plates.PROBLEM, runs) == []
    plates.PROBLEM.draw(runs, BytesIO())
    wrong = solved(plates.PROBLEM, off(exact, E=1.03))
    assert [name.split(": ")[1] for name in failed(plates.PROBLEM, wrong)] == [
        "energy",
        "energy nearer to the contact",
    ]


def test_plates_are_measured_in_groups():
    exact = shocked_plates(lambda case: [[plates._exact(case)]] * 2)
    runs = solved(plates.PROBLEM, exact, quick=False)
    checks = plates.PROBLEM.check(runs)
    assert all(check.passed for check in checks)
    # Two equations of state, three velocities; the line is that of one of them. Pores.
    assert len(checks) == 2 * 3 * 5 + 3 + 5


def test_contact():
    def states(case):
        return [[state] for state in contact._exact(case).states]

    exact = shocked_plates(states)
    runs = solved(contact.PROBLEM, exact)
    assert failed(contact.PROBLEM, runs) == []
    contact.PROBLEM.draw(runs, BytesIO())
    wrong = solved(contact.PROBLEM, off(exact, P=1.06))
    assert len(failed(contact.PROBLEM, wrong)) == 2

    def overlapping(case, start, time):
        fields = exact(case, start, time)
        shift = 0.3 * case.spacing * (start["body"] == 0)
        return fields | {"z": fields.get("z", start["z"]) + shift * (time > 0)}

    (overlap,) = failed(contact.PROBLEM, solved(contact.PROBLEM, overlapping))
    assert overlap.startswith("largest overlap")


def test_precursor():
    exact = shocked_plates(lambda case: [precursor._exact(case)] * 2)
    runs = solved(precursor.PROBLEM, exact)
    assert failed(precursor.PROBLEM, runs) == []
    precursor.PROBLEM.draw(runs, BytesIO())
    wrong = solved(precursor.PROBLEM, off(exact, P=1.06, S_zz=1.06))
    assert len(failed(precursor.PROBLEM, wrong)) == 2


def test_spin():
    def turned(_, start, time):
        angle, rate = spun_section(ALUMINIUM, spin._RING, spin._RATE, time)
        x, z = start["r"] - spin._RING, start["z"]
        x, z = (
            x * math.cos(angle) - z * math.sin(angle),
            x * math.sin(angle) + z * math.cos(angle),
        )
        return {"r": spin._RING + x, "z": z, "u_r": -rate * z, "u_z": rate * x}

    for quick in (True, False):
        runs = solved(spin.PROBLEM, turned, quick)
        assert failed(spin.PROBLEM, runs) == []
    spin.PROBLEM.draw(runs, BytesIO())

    def slowed(case, start, time):
        fields = turned(case, start, time)
        share = 1.0 - 0.02 * time / spin._TURN
        return fields | {name: share * fields[name] for name in ("u_r", "u_z")}

    assert len(failed(spin.PROBLEM, solved(spin.PROBLEM, slowed, False))) == 2


def test_rotation():
    def turned(_, start, __):
        """Return the stresses at the start: as invariants they stay."""
        rho0, K = ALUMINIUM.density, ALUMINIUM.bulk_modulus
        return {"P": K * (start["rho"] / rho0 - 1.0)}

    runs = solved(rotation.PROBLEM, turned)
    checks = rotation.PROBLEM.check(runs)
    assert max(check.measured for check in checks) < 1e-5
    rotation.PROBLEM.draw(runs, BytesIO())
    wrong = solved(rotation.PROBLEM, off(turned, S_rr=1.3))
    assert len(failed(rotation.PROBLEM, wrong)) == 1


@pytest.mark.parametrize("module", [sphere, torus])
def test_vibrations(module):
    def swung(period):
        def later(_, start, time):
            part = math.cos(2.0 * math.pi * time / period)
            stress = {"P": np.ones_like(start["r"])}
            return {name: part * start[name] for name in ("u_r", "u_z")} | stress

        return later

    problem = module.PROBLEM
    runs = solved(problem, swung(module._PERIOD))
    assert failed(problem, runs) == []
    problem.draw(runs, BytesIO())
    wrong = failed(problem, solved(problem, swung(1.03 * module._PERIOD)))
    assert len(wrong) == 1
    assert wrong[0].startswith("frequency")


def test_flight_may_make_no_difference():
    def stressed(case, start, _):
        flying = start["u_z"].max() > 1.0
        return {"P": np.full_like(start["r"], 1e8 * (1.0 + 1e-5 * flying))}

    runs = solved(torus.PROBLEM, stressed)
    assert torus.PROBLEM.check(runs)[1].measured == pytest.approx(1e-5, rel=1e-4)


def test_tension():
    def stretched(_, start, time):
        rate, length = tension._RATE, tension._LENGTH
        return {"S_zz": bar_stress(ALUMINIUM, rate, length, start["z"], time)}

    runs = solved(tension.PROBLEM, stretched)
    assert failed(tension.PROBLEM, runs) == []
    tension.PROBLEM.draw(runs, BytesIO())

    def clumped(case, start, time):
        z = start["z"].copy()
        z[np.abs(z).argmin()] += 0.2 * case.spacing * (time > 0.0)
        return stretched(case, start, time) | {"z": z}

    (name,) = failed(tension.PROBLEM, solved(tension.PROBLEM, clumped))
    assert name.startswith("closest particles")


def test_taylor():
    exact = final_length(
        taylor._LENGTH, taylor._DENSITY, taylor._YIELD, taylor._VELOCITY
    )

    def shortened(_, start, time):
        # The free ends keep their spacing, and all kinetic energy becomes plastic work.
        beyond = taylor._LENGTH - start["z"].max()
        share = (exact - beyond) / (taylor._LENGTH - beyond)
        strain = 0.5 * taylor._DENSITY * taylor._VELOCITY**2 / taylor._YIELD
        return {
            "z": start["z"] * (share if time else 1.0),
            "plastic_strain": np.full_like(start["r"], strain),
        }

    runs = solved(taylor.PROBLEM, shortened)
    checks = taylor.PROBLEM.check(runs)
    assert [check.measured for check in checks] == pytest.approx(
        [check.exact for check in checks]
    )
    taylor.PROBLEM.draw(runs, BytesIO())
    wrong = solved(taylor.PROBLEM, off(shortened, plastic_strain=0.9))
    assert failed(taylor.PROBLEM, wrong) == ["plastic work over kinetic energy"]
    still = solved(taylor.PROBLEM, lambda *_: {})
    assert "final length" in failed(taylor.PROBLEM, still)


@pytest.mark.parametrize("lattice", ["square", "polar"])
def test_verney(lattice):
    stop = 0.05

    def imploded(_, start, time):
        s = np.hypot(start["r"], start["z"])
        now = np.cbrt(s**3 + stop**3 - verney._SHELL.inner**3) if time else s
        return {name: start[name] * now / s for name in ("r", "z")}

    run = Run(verney._setup(lattice, stop, 2e-3), imploded)
    checks = verney.PROBLEM.check([Solved(f"{lattice}, 5 cm", run)])
    assert all(check.measured == pytest.approx(check.exact) for check in checks)
    checks = verney.PROBLEM.check([Solved(f"{lattice}, 6 cm", run)])
    assert not any(check.passed for check in checks)
    verney.PROBLEM.draw([Solved(f"{lattice}, 6 cm", run)], BytesIO())


def test_zeros_lie_between_their_neighbours():
    times = np.array([0.0, 1.0, 2.0, 3.0])
    assert zero_crossings(times, np.array([1, -1, -3, 1.0])) == [0.5, 2.75]
