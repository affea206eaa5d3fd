"""A short run of each shot in both pair forms against stored numbers.

A change of physics shows here: unintended, it is a fault; meant, it is stated by
storing the numbers anew, as ``python tests/solver/test_golden.py`` prints them.
Processors and compilers may round
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
from mpisph.sph.timestep import allowed_step

TOLERANCE = 1e-8
NPR, END = 6, 2e-6

GOLDEN = {
    "4-1283": {
        "radius": 0.00897238305632209,
        "length": 0.012699451541029222,
        "radius_robust": 0.00897238305632209,
        "length_robust": 0.012329711213781507,
        "front_velocity": 7128.557571471131,
        "mass": 0.0015486416959061414,
        "kinetic_energy": 24037.09663666634,
        "internal_energy": 3308.097930970388,
        "plastic_strain": 0.13129391396598225,
        "steps": 105,
    },
    "4-1283 consistent": {
        "radius": 0.008986392545914665,
        "length": 0.012763613100636,
        "radius_robust": 0.008986392545914665,
        "length_robust": 0.01238835168520946,
        "front_velocity": 7172.081895601334,
        "mass": 0.0015486416959061414,
        "kinetic_energy": 24051.404692480886,
        "internal_energy": 3293.7898751558414,
        "plastic_strain": 0.13060757000711462,
        "steps": 106,
    },
    "4-1291": {
        "radius": 0.00894600644022325,
        "length": 0.011786310187294806,
        "radius_robust": 0.00894600644022325,
        "length_robust": 0.011131112372123003,
        "front_velocity": 6708.270149834128,
        "mass": 0.001839870722787433,
        "kinetic_energy": 22377.46977537204,
        "internal_energy": 4886.400838572053,
        "plastic_strain": 0.1685052625329029,
        "steps": 110,
    },
    "4-1291 consistent": {
        "radius": 0.008961696144365549,
        "length": 0.011891411467161756,
        "radius_robust": 0.008961696144365549,
        "length_robust": 0.011211709804515137,
        "front_velocity": 6781.2132868088775,
        "mass": 0.001839870722787433,
        "kinetic_energy": 22405.73141800096,
        "internal_energy": 4858.13919594313,
        "plastic_strain": 0.16447661179053158,
        "steps": 111,
    },
    "4-1352": {
        "radius": 0.010127484739456913,
        "length": 0.010178272284606887,
        "radius_robust": 0.010127484739456913,
        "length_robust": 0.009666399893860278,
        "front_velocity": 6013.7050550157155,
        "mass": 0.002023650314308235,
        "kinetic_energy": 20090.60157753985,
        "internal_energy": 6607.392381707512,
        "plastic_strain": 0.19749678300764106,
        "steps": 117,
    },
    "4-1352 consistent": {
        "radius": 0.009676198419502225,
        "length": 0.010301472882783307,
        "radius_robust": 0.009676198419502225,
        "length_robust": 0.009843721139492917,
        "front_velocity": 6086.9243888677665,
        "mass": 0.0019307032378349314,
        "kinetic_energy": 20035.289306722614,
        "internal_energy": 6662.704652524754,
        "plastic_strain": 0.17514352788453236,
        "steps": 116,
    },
    "4-1353": {
        "radius": 0.01074493909898808,
        "length": 0.007147064788807402,
        "radius_robust": 0.01074493909898808,
        "length_robust": 0.006740409765656674,
        "front_velocity": 4843.28022423864,
        "mass": 0.0021350501909625065,
        "kinetic_energy": 16757.68811193459,
        "internal_energy": 10262.937288321247,
        "plastic_strain": 0.19964444006995327,
        "steps": 129,
    },
    "4-1353 consistent": {
        "radius": 0.010755658359465056,
        "length": 0.007205322762120345,
        "radius_robust": 0.010755658359465056,
        "length_robust": 0.006809281009877772,
        "front_velocity": 4866.958186458579,
        "mass": 0.0021307858283471383,
        "kinetic_energy": 16746.48905233722,
        "internal_energy": 10274.136347918615,
        "plastic_strain": 0.19058196113751807,
        "steps": 126,
    },
}


def measured(name):
    """Sizes of the cloud [m], its front [m/s] and mass [kg], energies [J]; steps."""
    shot, *form = name.split()
    overrides = [f"resolution.npr={NPR}", *(f"scheme.pair_form={x}" for x in form)]
    case = load_case(CASES / f"piekutowski-{shot}.toml", overrides)
    sim = start(case, MPI.COMM_SELF)
    while sim.time < END:
        found = reduce_state(sim)
        make_step(sim, found, min(allowed_step(sim.rule, found.limit), END - sim.time))
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
    assert shots == {name.split()[0] for name in GOLDEN}


if __name__ == "__main__":
    for path in sorted(CASES.glob("piekutowski-*.toml")):
        shot = path.stem.removeprefix("piekutowski-")
        for name in (shot, f"{shot} consistent"):
            print(f'    "{name}": {measured(name)},')
