"""A short run of each shot against stored numbers: a change of physics shows here.

Unintended, it is a fault; meant, it is stated by storing the numbers anew, as
``python tests/solver/test_golden.py`` prints them. Processors and compilers may round
differently, and a hundred and more steps let that grow to some 1e-12; a change of a
coefficient by a hundredth moves these numbers by 1e-4 and more.
"""

import sys
from pathlib import Path

import pytest
from mpi4py import MPI

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))

from launch import CASES

from mpisph.case import load_case
from mpisph.diagnostics.cloud import measure_cloud
from mpisph.run.loop import make_step
from mpisph.solver.start import start
from mpisph.solver.step import reduce_state

TOLERANCE = 1e-8
NPR, END = 6, 2e-6

GOLDEN = {
    "4-1283": {
        "radius": 0.009108288344834958,
        "length": 0.012735316995364041,
        "radius_robust": 0.009108288344834958,
        "length_robust": 0.011775990864007227,
        "front_velocity": 7255.475913156253,
        "mass": 0.0015486416959061414,
        "kinetic_energy": 24167.868673926976,
        "internal_energy": 3174.360069200815,
        "plastic_strain": 0.14398992231924393,
        "steps": 130,
    },
    "4-1291": {
        "radius": 0.009087922434366496,
        "length": 0.010764549725194524,
        "radius_robust": 0.009087922434366496,
        "length_robust": 0.010425384371379446,
        "front_velocity": 6065.592244845255,
        "mass": 0.001839870722787433,
        "kinetic_energy": 22604.590957426666,
        "internal_energy": 4655.882143408081,
        "plastic_strain": 0.17457277746366293,
        "steps": 141,
    },
    "4-1352": {
        "radius": 0.01017371963069473,
        "length": 0.009197922339666948,
        "radius_robust": 0.01017371963069473,
        "length_robust": 0.008930302416754696,
        "front_velocity": 5669.661094455366,
        "mass": 0.002009494273752941,
        "kinetic_energy": 20410.4530924421,
        "internal_energy": 6284.235426978155,
        "plastic_strain": 0.2017403743442723,
        "steps": 155,
    },
    "4-1353": {
        "radius": 0.010761493519954151,
        "length": 0.006099982991399982,
        "radius_robust": 0.010761493519954151,
        "length_robust": 0.005909140695269461,
        "front_velocity": 4262.652003460778,
        "mass": 0.002199015630193027,
        "kinetic_energy": 17359.955053997226,
        "internal_energy": 9657.493825047384,
        "plastic_strain": 0.23465151798587902,
        "steps": 179,
    },
}


def measured(shot):
    """Sizes of the cloud [m], its front [m/s] and mass [kg], energies [J]; steps."""
    case = load_case(CASES / f"piekutowski-{shot}.toml", [f"resolution.npr={NPR}"])
    sim = start(case, MPI.COMM_SELF)
    while sim.time < END:
        found = reduce_state(sim)
        make_step(sim, found, min(sim.rule.allowed(found.limit), END - sim.time))
    series = reduce_state(sim).series
    cloud = measure_cloud(MPI.COMM_SELF, sim.particles, sim.cloud)
    return {
        **cloud._asdict(),
        "kinetic_energy": series["kinetic_energy"],
        "internal_energy": series["internal_energy"],
        "plastic_strain": float(sim.particles.plastic_strain.mean()),
        "steps": sim.step,
    }


@pytest.mark.parametrize("shot", GOLDEN)
def test_a_shot_gives_its_stored_numbers(shot):
    assert measured(shot) == pytest.approx(GOLDEN[shot], rel=TOLERANCE, abs=0.0)


def test_every_shot_has_its_numbers():
    shots = {
        p.stem.removeprefix("piekutowski-") for p in CASES.glob("piekutowski*.toml")
    }
    assert shots == set(GOLDEN)


if __name__ == "__main__":
    for path in sorted(CASES.glob("piekutowski-*.toml")):
        name = path.stem.removeprefix("piekutowski-")
        print(f'    "{name}": {measured(name)},')
