"""Batch scripts that run a study in a job array of Slurm or PBS."""

import re
import shlex
import sys
from pathlib import Path
from typing import NamedTuple

import jinja2


class Job(NamedTuple):
    """What a batch script is to run.

    Attributes
    ----------
    name : str
        Of the study.
    study, root : Path
        The study file, and the folder of runs and tables.
    jobs : int
        Elements of the array.
    ranks : int
        Of each element.
    ranks_per_case : int
    minutes : int
        Longest time of one start [min].
    """

    name: str
    study: Path
    root: Path
    jobs: int
    ranks: int
    ranks_per_case: int
    minutes: int


def batch_script(job: Job, system: str) -> str:
    """Return a batch script, to be submitted from anywhere.

    Parameters
    ----------
    job : Job
        Relative paths count from the current folder.
    system : {"slurm", "pbs"}

    Returns
    -------
    str
        A script for bash.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("mpisph.study"),
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
    )
    paths = {
        "name": job.name,
        "study": job.study,
        "root": job.root,
        "folder": Path.cwd(),
        "job_sh": Path(__file__).with_name("job.sh"),
    }
    texts = {key: shlex.quote(str(path)) for key, path in paths.items()}
    # -P: what lies in the current folder is not to be imported.
    texts["mpisph"] = f"{shlex.quote(sys.executable)} -P -m mpisph"
    texts["job_name"] = re.sub(r"[^A-Za-z0-9._-]", "-", f"mpisph-{job.name}")
    return environment.get_template(f"{system}.sh").render(**job._asdict() | texts)
