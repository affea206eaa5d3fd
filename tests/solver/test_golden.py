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

TOLERANCE = 1e-8
NPR, END = 6, 2e-6

GOLDEN = {
    "4-1283": {
        "radius": 0.008972372885150483,
        "length": 0.01270156432075422,
        "radius_robust": 0.008972372885150483,
        "length_robust": 0.01232773772355415,
        "front_velocity": 7128.661544864957,
        "mass": 0.0015486416959061414,
        "kinetic_energy": 24037.088987423125,
        "internal_energy": 3308.1055802136066,
        "plastic_strain": 0.1312515826018197,
        "steps": 105,
    },
    "4-1283 consistent": {
        "radius": 0.008993610878811203,
        "length": 0.012851804944164037,
        "radius_robust": 0.008993610878811203,
        "length_robust": 0.012472698251565014,
        "front_velocity": 7218.148249886974,
        "mass": 0.0015486416959061414,
        "kinetic_energy": 24075.47977843845,
        "internal_energy": 3269.714789198284,
        "plastic_strain": 0.13084710666601718,
        "steps": 105,
    },
    "4-1291": {
        "radius": 0.00894600244987509,
        "length": 0.011788001234293608,
        "radius_robust": 0.00894600244987509,
        "length_robust": 0.011133167994133213,
        "front_velocity": 6708.124381289551,
        "mass": 0.001839870722787433,
        "kinetic_energy": 22377.46010786462,
        "internal_energy": 4886.410506079476,
        "plastic_strain": 0.16850492276844944,
        "steps": 111,
    },
    "4-1291 consistent": {
        "radius": 0.00896890921052845,
        "length": 0.011972584371354138,
        "radius_robust": 0.00896890921052845,
        "length_robust": 0.011224261989173078,
        "front_velocity": 6825.084478095628,
        "mass": 0.001839870722787433,
        "kinetic_energy": 22426.129076046007,
        "internal_energy": 4837.741537898084,
        "plastic_strain": 0.1657178872804946,
        "steps": 110,
    },
    "4-1352": {
        "radius": 0.010127485394092408,
        "length": 0.010180301624173651,
        "radius_robust": 0.010127485394092408,
        "length_robust": 0.009663721832500636,
        "front_velocity": 6013.746108673652,
        "mass": 0.002023650314308235,
        "kinetic_energy": 20090.630693668314,
        "internal_energy": 6607.363265579056,
        "plastic_strain": 0.19750853135587063,
        "steps": 117,
    },
    "4-1352 consistent": {
        "radius": 0.009677572649839277,
        "length": 0.010326542085340118,
        "radius_robust": 0.009677572649839277,
        "length_robust": 0.009864497154183699,
        "front_velocity": 6094.761699999121,
        "mass": 0.0018781679337413252,
        "kinetic_energy": 20033.520003924004,
        "internal_energy": 6664.473955323357,
        "plastic_strain": 0.1750110793184332,
        "steps": 116,
    },
    "4-1353": {
        "radius": 0.010744941669266178,
        "length": 0.00714710447202153,
        "radius_robust": 0.010744941669266178,
        "length_robust": 0.006739806566010135,
        "front_velocity": 4841.859033076616,
        "mass": 0.0021350501909625065,
        "kinetic_energy": 16757.69883305167,
        "internal_energy": 10262.926567204173,
        "plastic_strain": 0.1996807674178239,
        "steps": 129,
    },
    "4-1353 consistent": {
        "radius": 0.010756065724844508,
        "length": 0.007207645195075785,
        "radius_robust": 0.010756065724844508,
        "length_robust": 0.006808651017002276,
        "front_velocity": 4865.563968853623,
        "mass": 0.0021307858283471383,
        "kinetic_energy": 16751.470846748773,
        "internal_energy": 10269.154553507073,
        "plastic_strain": 0.19143478194548513,
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
    assert shots == {name.split()[0] for name in GOLDEN}


if __name__ == "__main__":
    for path in sorted(CASES.glob("piekutowski-*.toml")):
        shot = path.stem.removeprefix("piekutowski-")
        for name in (shot, f"{shot} consistent"):
            print(f'    "{name}": {measured(name)},')
