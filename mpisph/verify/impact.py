"""A sphere on a plate, as coarse as it may be: for what holds at every resolution."""

from typing import Any

from mpisph.case import Case, case_from_dict

END = 2e-6
# [s]; the sphere has gone through the plate.


def impact_case(title: str, npr: int, frame: float = 0.0) -> Case:
    """Return an impact at 6.7 km/s with the program's defaults.

    Parameters
    ----------
    title : str
    npr : int
        Particles along the radius of the sphere.
    frame : float, optional
        Axial velocity that is added to all bodies [m/s].
    """
    sphere: dict[str, Any] = {"name": "sphere", "shape": "sphere", "radius": 5e-3}
    plate: dict[str, Any] = {"name": "plate", "shape": "plate", "thickness": 2e-3}
    sphere |= {"position": -5e-3, "velocity": frame + 6700.0, "material": "al-2024-t4"}
    plate |= {"radius": 20e-3, "velocity": frame, "material": "al-6061-t6"}
    return case_from_dict(
        {
            "title": title,
            "bodies": [sphere, plate],
            "resolution": {"npr": npr},
            "output": {"figures": False},
            "time": {"end": END},
        }
    )
