"""The particles that a run started from, kept beside its ``case.toml``."""

import io
from pathlib import Path

import h5py

from mpisph.case.discretise import InitialParticles
from mpisph.case.model import INITIAL_FILE
from mpisph.core.particles import FIELDS
from mpisph.io.files import write_bytes


def write_initial(folder: Path, particles: InitialParticles) -> Path:
    """Write ``initial.h5``: a dataset for each field; call it on one rank.

    Parameters
    ----------
    folder : Path
        Folder of the run.
    particles : InitialParticles
        All of them.

    Returns
    -------
    Path
        The file. A case may name it as its ``initial.file``.

    Raises
    ------
    OSError
        If it cannot be written. What had the name is then unharmed.
    """
    content = io.BytesIO()  # HDF5 does not bear a disk that is full
    units = {field.name: field.unit for field in FIELDS}
    with h5py.File(content, "w") as file:
        for name, values in particles.fields().items():
            file.create_dataset(name, data=values).attrs["unit"] = units[name]
    path = folder / INITIAL_FILE
    write_bytes(path, content.getvalue())
    return path
