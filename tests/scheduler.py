"""Stand-ins for Slurm and PBS, as far as the batch scripts see them.

They read the script's directives, run a copy of it with their variables, tell it that
time is nearly up, end all its processes, and run it again where that was asked for. The
commands `scontrol`, `srun`, `qsub` and `qstat` lie in a folder on the PATH of the jobs.
Jobs run one after the other.
"""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import textwrap
import time
from dataclasses import dataclass, field
from pathlib import Path

from launch import PATIENCE, environment

LONGEST = 120.0
"""Longest that a start of a job may take [s]."""


@dataclass
class Job:
    """A job, or an element of a job array, and what became of it."""

    name: str
    script: Path
    arguments: list = field(default_factory=list)
    options: dict = field(default_factory=dict)
    variables: dict = field(default_factory=dict)
    log: Path = Path()
    restarts: int = 0
    timed_out: bool = False
    code: int | None = None

    def text(self):
        """What the job has printed."""
        return self.log.read_text()


class Scheduler:
    """Runs jobs below a folder; `work` in it is the folder of submission.

    Attributes
    ----------
    clock : callable
        How much time has passed, in the unit of the jobs' limits.
    meanwhile : callable
        Called again and again while a job runs, with the job, the process of its shell
        and the time passed since it started.
    """

    commands = ()

    def __init__(self, folder, clock=time.monotonic, **variables):
        self.folder = folder
        self.clock = clock
        self.variables = variables
        self.meanwhile = lambda job, shell, elapsed: None
        self.work = folder / "work"
        self.bin = folder / "bin"
        for made in (self.work, self.bin):
            made.mkdir(parents=True)
        for command in self.commands:
            path = self.bin / command
            here = str(Path(__file__).parent)
            path.write_text(
                f"#!{sys.executable}\nimport sys\nsys.path.insert(0, {here!r})\n"
                f"import scheduler\nsys.exit(scheduler.{command}(*sys.argv[1:]))\n"
            )
            path.chmod(0o755)

    def environment(self, **more):
        path = f"{self.bin}{os.pathsep}{os.environ['PATH']}"
        own = {"PATH": path, "SCHEDULER": str(self.folder), PATIENCE: "1"}
        return environment(**{**own, **self.variables, **more})

    def start(self, job, cwd, **variables):
        """Run a job once, to its end or to that of its time."""
        spool = self.folder / "spool" / job.name
        spool.mkdir(parents=True, exist_ok=True)
        copy = spool / "script"
        shutil.copy(job.script, copy)
        copy.chmod(0o700)
        with job.log.open(job.options.get("open-mode", "append")[0]) as log:
            shell = subprocess.Popen(
                [copy, *job.arguments],
                cwd=cwd,
                env={**self.environment(), **variables, **job.variables},
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        try:
            self.watch(job, shell)
        finally:
            kill(processes(shell.pid), signal.SIGKILL)
            job.code = shell.wait()

    def watch(self, job, shell):
        began, given_up = self.clock(), time.monotonic() + LONGEST
        while shell.poll() is None:
            time.sleep(0.02)
            assert time.monotonic() < given_up, job.text()
            elapsed = self.clock() - began
            self.meanwhile(job, shell, elapsed)
            self.look_after(job, shell, elapsed)

    def look_after(self, job, shell, elapsed):
        raise NotImplementedError


class Slurm(Scheduler):
    """Warns the shell alone, and starts a job again under its own number."""

    commands = ("scontrol", "srun")
    grace = 10.0
    """Time between SIGTERM and SIGKILL [s]; with 0, there is no SIGTERM."""

    def submit(self, script, *arguments, **options):
        """Submit as sbatch does and return the jobs, one for each element."""
        options = {**directives(script, "#SBATCH --", "="), **options}
        elements = elements_of(options.get("array"))
        names = ["7"] if elements is None else [f"7_{k}" for k in elements]
        return [
            Job(
                name,
                Path(script),
                [str(x) for x in arguments],
                options,
                log=self.work / f"slurm-{name}.out",
            )
            for name in names
        ]

    def run(self, *jobs):
        """Run jobs until none wants to run again."""
        for job in jobs:
            again = True
            while again:
                again = self.run_once(job)

    def run_once(self, job):
        """Run a job once and say whether it is to run again."""
        self.warned = False
        self.request.unlink(missing_ok=True)
        whole, _, element = job.name.partition("_")
        tasks = job.options["ntasks"]
        variables = {
            # An element has a number of its own beside that of the array.
            "SLURM_JOB_ID": whole if not element else str(100 + int(element)),
            "SLURM_JOBID": whole if not element else str(100 + int(element)),
            "SLURM_SUBMIT_DIR": str(self.work),
            "SLURM_NTASKS": tasks,
            "SLURM_JOB_END_TIME": str(int(time.time()) + 3600),
            # For Open MPI.
            "SLURM_NODELIST": os.uname().nodename,
            "SLURM_TASKS_PER_NODE": tasks,
        }
        if element:
            variables["SLURM_ARRAY_JOB_ID"] = whole
            variables["SLURM_ARRAY_TASK_ID"] = element
        if job.restarts:
            variables["SLURM_RESTART_COUNT"] = str(job.restarts)
        command = " ".join([str(job.script), *job.arguments])
        current = {"name": job.name, "id": variables["SLURM_JOB_ID"]}
        write(self.folder / "current.json", {**current, "command": command})
        self.start(job, self.work, **variables)
        again = "requeue" in job.options and self.request.exists()
        job.restarts += again
        return again

    @property
    def request(self):
        return self.folder / "requeue"

    def look_after(self, job, shell, elapsed):
        limit = float(job.options.get("limit", "inf"))
        kind, _, before = job.options["signal"].partition("@")
        if not self.warned and elapsed >= limit - float(before):
            self.warned = True
            if kind == "B:USR1":
                kill([shell.pid], signal.SIGUSR1)
        if self.request.exists():
            self.end(shell)
        elif elapsed >= limit:
            job.timed_out = True
            self.end(shell)

    def end(self, shell):
        """End a job as scancel does."""
        if self.grace:
            kill(processes(shell.pid), signal.SIGTERM)
        end = time.monotonic() + self.grace
        while shell.poll() is None and time.monotonic() < end:
            time.sleep(0.02)
        kill(processes(shell.pid), signal.SIGKILL)


class Pbs(Scheduler):
    """Gives no warning, and knows no job that starts again by its own wish."""

    commands = ("qsub", "qstat")
    slack = 10.0
    """It looks only now and then whether a job's time is up [s]."""

    def submit(self, *arguments, **variables):
        """Submit with the command qsub, from the folder of submission."""
        subprocess.run(
            [self.bin / "qsub", *map(str, arguments)],
            cwd=self.work,
            env=self.environment(**variables),
            check=True,
            stdout=subprocess.DEVNULL,
        )

    def run(self):
        """Run all jobs, and those that they submit, and return them."""
        jobs = []
        while queue := sorted(self.folder.glob("queue/*.json")):
            waiting = json.loads(queue[0].read_text())
            queue[0].unlink()
            for element in elements_of(waiting.get("-J")) or [None]:
                jobs.append(self.run_once(waiting, element))
        return jobs

    def run_once(self, waiting, element):
        number = waiting["number"]
        name = str(number) if element is None else f"{number}[{element}]"
        job = Job(
            f"{name}.server",
            Path(waiting["script"]),
            options=waiting,
            variables=waiting["variables"],
            log=self.work / f"{waiting['-N']}.o{name}",
        )
        nodes = self.folder / "nodes"
        ranks = int(re.search(r"mpiprocs=(\d+)", waiting["-l"]["select"])[1])
        nodes.write_text(f"{os.uname().nodename}\n" * ranks)
        variables = {
            "PBS_JOBID": job.name,
            "PBS_JOBNAME": waiting["-N"],
            "PBS_O_WORKDIR": waiting["workdir"],
            "PBS_O_QUEUE": waiting.get("-q", "workq"),
            "PBS_NODEFILE": str(nodes),
        }
        if element is not None:
            variables["PBS_ARRAY_INDEX"] = str(element)
        write(self.folder / "current.json", {**waiting, "name": job.name})
        home = self.folder / "home"
        home.mkdir(exist_ok=True)
        self.start(job, home, **variables)
        return job

    def look_after(self, job, shell, elapsed):
        hours, minutes, seconds = map(int, job.options["-l"]["walltime"].split(":"))
        limit = 3600 * hours + 60 * minutes + seconds
        if elapsed >= limit + self.slack:
            job.timed_out = True
            kill(processes(shell.pid), signal.SIGKILL)


def directives(script, prefix, separator):
    """The options in the comments at the head of a script."""
    found = {}
    for line in Path(script).read_text().splitlines():
        if not line.startswith("#"):
            break
        if line.startswith(prefix):
            name, _, value = line.removeprefix(prefix).partition(separator)
            found[name] = value
    return found


def elements_of(array):
    """The numbers of an array such as 0-3, or None."""
    if array is None:
        return None
    first, last = map(int, array.split("-"))
    return range(first, last + 1)


def processes(session):
    """All processes of a session."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[3]) == session:
            found.append(int(path.parent.name))
    return found


def kill(pids, number):
    for pid in pids:
        try:
            os.kill(pid, number)
        except ProcessLookupError:
            pass


def write(path, content):
    path.write_text(json.dumps(content))


# The commands. Each is called in a process of its own, by a job.


def _state():
    folder = Path(os.environ["SCHEDULER"])
    return folder, json.loads((folder / "current.json").read_text())


def scontrol(action, *arguments):
    folder, job = _state()
    if action == "show" and arguments == ("job", job["id"]):
        print(f"JobId={job['id']} JobName=mpisph\n   Priority=1")
        print(f"   Command={job['command']}\n   WorkDir=/")
        return 0
    # The number of an array's element would do too, but for one of them.
    if action == "requeue" and arguments == (job["name"],):
        (folder / "requeue").touch()
        return 0
    print("scontrol: error: Invalid job id specified", file=sys.stderr)
    return 1


def srun(*command):
    tasks = os.environ["SLURM_NTASKS"]
    os.execvp("mpirun", ["mpirun", "--quiet", "-n", tasks, *command])


def qsub(*arguments):
    folder = Path(os.environ["SCHEDULER"])
    *options, script = arguments
    given = {"-l": {}, "-N": Path(script).name, "variables": {}}
    head = [
        word
        for line in Path(script).read_text().splitlines()
        if line.startswith("#PBS ")
        for word in line.split()[1:]
    ]
    words = iter([*head, *options])
    for name in words:
        value = next(words)
        if name == "-l":
            key, _, text = value.partition("=")
            given["-l"][key] = text
        elif name == "-v":
            for part in value.split(","):
                key, has_value, text = part.partition("=")
                if has_value or key in os.environ:
                    given["variables"][key] = text if has_value else os.environ[key]
        else:
            given[name] = value
    spool = folder / "queue"
    spool.mkdir(exist_ok=True)
    number = 1 + len(list(spool.glob("*.SC")))
    copy = spool / f"{number:04}.SC"
    shutil.copy(script, copy)
    more = {"number": number, "script": str(copy), "workdir": os.getcwd()}
    write(spool / f"{number:04}.json", {**given, **more})
    print(f"{number}.server")


def qstat(option, name):
    _, job = _state()
    if option != "-f" or name != job["name"]:
        print("qstat: Unknown Job Id", file=sys.stderr)
        return 153
    print(f"Job Id: {name}\n    Job_Name = {job['-N']}")
    for key, value in job["-l"].items():
        line = f"    Resource_List.{key} = {value}"
        # Long lines are folded, even in the midst of a word.
        print("\n\t".join(textwrap.wrap(line, 40, drop_whitespace=False)))
    print(f"    Variable_List = PBS_O_WORKDIR={job['workdir']}\n")
    return 0
