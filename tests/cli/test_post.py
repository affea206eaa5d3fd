"""What the commands say and draw of runs."""

import pytest
from launch import CASES, MPISPH, call, launch

SHOT = CASES / "piekutowski-4-1353.toml"
SHORT = ("--set", "resolution.npr=4", "--set", "time.end=1.2us")


def test_figures_are_drawn_again(tmp_path):
    options = (*SHORT, "--set", "output.figures=false", "-o", tmp_path)
    assert call("run", SHOT, *options).returncode == 0
    assert not (tmp_path / "figures").exists()
    done = call("figures", tmp_path)
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.split()) == len(list(tmp_path.glob("figures/*.png"))) == 3
    options = ("--field", "speed", "--field", "h", "--range", "0", "7 km/s")
    done = call("figures", tmp_path, *options)
    assert done.returncode == 0, done.stderr
    assert len(list(tmp_path.glob("figures/speed_h_*us.png"))) == 3
    done = call("figures", tmp_path, "--zoom", "plate")
    assert done.returncode == 0, done.stderr
    assert len(list(tmp_path.glob("figures/cloud_plate_*us.png"))) == 3
    done = call("figures", tmp_path, "--zoom", "wall")
    assert done.returncode == 2
    assert "--zoom wall: no such body; there are sphere, plate" in done.stderr
    done = call("figures", tmp_path, "--field", "melt")
    assert done.returncode == 2
    assert "no melt: no material has a model that gives it" in done.stderr


@pytest.mark.parametrize(
    ("command", "text"),
    [("figures", "no snapshots to draw"), ("clock", "no case.toml")],
)
def test_a_folder_of_no_run_is_an_error(tmp_path, command, text):
    done = launch(2, MPISPH, command, tmp_path)
    assert done.returncode == 2
    assert done.stderr.count(text) == 1


@pytest.fixture(scope="module")
def clocked(tmp_path_factory):
    """Runs at NPR 4 and 5 that pass an early stand-in for the exposures."""
    top = tmp_path_factory.mktemp("clocked")
    text = SHOT.read_text()
    for old, new in (
        ('time = "6 us"', 'time = "1 us"'),
        ('time = "19 us"', 'time = "2 us"'),
        ('radius = "15.3 mm"', 'radius = "9.5 mm"'),
        ('length = "31.7 mm"', 'length = "4 mm"'),
        ('radius = "37.5 mm"', 'radius = "10 mm"'),
        ('length = "98.0 mm"', 'length = "9 mm"'),
        ('"0.89 us"', '"0.1 us"'),
        ('end = "22 us"', 'end = "4 us"'),
    ):
        assert old in text
        text = text.replace(old, new)
    cases = [top / "npr4.toml", top / "npr5.toml"]
    for path in cases:
        path.write_text(text.replace("npr = 10\n", f"npr = {path.stem[3:]}\n"))
    options = ("--set", "output.figures=false", "-o", top)
    done = call("run", *cases, *options)
    assert done.returncode == 0, done.stderr
    return top


def test_clock_fits_one_run_and_draws_into_its_folder(clocked):
    folder = clocked / "npr4"
    done = launch(2, MPISPH, "clock", folder)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("clock offset ") == 1
    assert "unknown from one run" in done.stdout
    assert "predictions" in done.stdout
    assert f"figure in {folder / 'clock.png'}" in done.stdout
    assert (folder / "clock.png").stat().st_size > 10_000


def test_clock_of_two_runs_has_a_numerical_uncertainty(clocked, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folders = clocked / "npr5", clocked / "npr4"
    done = call("clock", *folders)
    assert done.returncode == 0, done.stderr
    assert "of NPR 5 (the finest)" in done.stdout
    assert "half of the spread of two runs" in done.stdout
    assert (tmp_path / "clock.png").exists()
    done = call("clock", *folders, "--npr", "4", "-o", "here/c.png")
    assert "of NPR 4 (as asked)" in done.stdout
    assert (tmp_path / "here" / "c.png").exists()


def test_clock_says_what_it_cannot_use(clocked, tmp_path):
    done = launch(2, MPISPH, "clock", clocked / "npr4", clocked / "npr4")
    assert done.returncode == 1
    assert done.stderr.count("name one run for each resolution") == 1
    assert "Traceback" not in done.stderr
    (tmp_path / "case.toml").write_text((clocked / "npr4" / "case.toml").read_text())
    done = call("clock", clocked / "npr4", tmp_path)
    assert done.returncode == 1
    assert f"{tmp_path}: not a completed run" in done.stderr
