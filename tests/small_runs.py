"""Small runs that take less than a second, for what is made of a run's folder."""

import json
import shutil

from launch import CASES
from mpi4py import MPI
from rich.console import Console

from mpisph.case import load_case
from mpisph.run.session import run
from mpisph.run.signals import SignalHandler

SHOT = CASES / "piekutowski-4-1353.toml"

EXPOSED = (
    "resolution.npr=4",
    "time.end=2us",
    "output.every=0.25us",
    "output.figures=false",
    "measured.clock_offset=0.35us",
    "measured.exposures.0.time=1us",
    "measured.exposures.0.radius=7 mm",
    "measured.exposures.0.length=2.1 mm",
)
"""Shot 4-1353, coarse and short: 10 snapshots, an exposure reached, one not."""

ALLOYS = (
    "bodies.sphere.material=al-2017-t4",
    "bodies.plate.material=al-6061-t6",
    "scheme.thermal=heat-capacity",
    "scheme.heat.g1=0",
)
"""Those of the experiment, with temperatures."""

BREAKING = (
    *EXPOSED,
    *ALLOYS,
    "materials.al-2017-t4.failure=none",
    "materials.al-6061-t6.failure=spall",
    "scheme.ductile=none",
)
"""The same of alloys that melt, of which the plate's breaks."""

MODELS = (
    *ALLOYS,
    "bodies.sphere.velocity=4 km/s",
    "materials.al-2017-t4.strength=steinberg-guinan",
    "materials.al-2017-t4.failure=grady-kipp",
    "materials.al-2017-t4.grady-kipp.k=4e35",
    "materials.al-2017-t4.grady-kipp.m=9",
    "materials.al-6061-t6.strength=johnson-cook",
    "materials.al-6061-t6.failure=spall",
    "materials.al-6061-t6.spall.criterion=principal",
    "materials.al-6061-t6.spall.crack_energy=20 kJ/m2",
    "materials.al-6061-t6.ductile=johnson-cook-damage",
)
"""Slower metals that harden, melt and break, by models of all kinds."""


def small_run(folder, *overrides, case=SHOT):
    """Run a case on this rank alone and return its result."""
    with open("/dev/null", "w") as silent:
        console = Console(file=silent)
        return run(load_case(case, overrides), MPI.COMM_SELF, folder, console)


class StopAt(SignalHandler):
    """A handler to whom a signal comes before the n-th step that it sees."""

    def __init__(self, n):
        super().__init__()
        self.left = n

    def signal_request(self):
        self.left -= 1
        return 115 if self.left == 0 else 0


def unended(folder, source, **changes):
    """Copy a run as if it had not ended, with changes to its status."""
    shutil.copytree(source, folder)
    (folder / "result.json").unlink()
    path = folder / "status.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **changes}))
    return folder
