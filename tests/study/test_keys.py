"""The keys of a study's cases, kept beside its tables."""

import json

import pytest
from studies import ALPHA, small_study

import mpisph.study.keys
from mpisph.study.keys import KEYS_FILE, keep_keys, keyed_cases
from mpisph.study.model import load_study
from mpisph.study.store import study_folder


def write_study(folder):
    path = folder / "small.toml"
    path.write_text(small_study("0.3 us", nph=(1.5, 2.0, 2.5)) + ALPHA)
    return path


@pytest.fixture
def study(tmp_path):
    """A study with its folder, as a run of it makes them."""
    study = load_study(write_study(tmp_path))
    study_folder(tmp_path, study).mkdir(parents=True)
    return study


def of(cases):
    return [(case.variant, case.settings, case.key, case.name()) for case in cases]


def forbid(*_):
    pytest.fail("the cases are made")


def test_kept_keys_are_those_of_the_cases(study, tmp_path, monkeypatch):
    keep_keys(study, tmp_path)
    monkeypatch.setattr(mpisph.study.keys, "load_study", forbid)
    assert of(keyed_cases(study.path, tmp_path)) == of(study.cases)


def test_keys_are_kept_by_the_first_look(study, tmp_path, monkeypatch):
    assert of(keyed_cases(study.path, tmp_path)) == of(study.cases)
    monkeypatch.setattr(mpisph.study.keys, "load_study", forbid)
    assert of(keyed_cases(study.path, tmp_path)) == of(study.cases)


def test_a_look_makes_no_folder(tmp_path):
    path = write_study(tmp_path)
    assert len(keyed_cases(path, tmp_path / "runs")) == 6
    assert not (tmp_path / "runs").exists()


def test_a_change_of_the_files_makes_the_keys_anew(study, tmp_path):
    keep_keys(study, tmp_path)
    text = study.path.read_text()
    study.path.write_text(text.replace("1.5", "1.6"))
    assert study.path.read_text() != text
    assert of(keyed_cases(study.path, tmp_path)) == of(load_study(study.path).cases)


@pytest.mark.parametrize(
    "content", ["", "{}", "[]", '{"of": 1, "keys": 2}', "wrong keys", "fewer keys"]
)
def test_keys_that_are_not_sound_are_made_anew(study, tmp_path, content):
    keep_keys(study, tmp_path)
    path = study_folder(tmp_path, study) / KEYS_FILE
    if "keys" in content and "of" not in content:
        kept = json.loads(path.read_text())
        keys = ["0" * 12] * 6 if content == "wrong keys" else kept["keys"][1:]
        content = json.dumps({**kept, "keys": keys})
    path.write_text(content)
    assert of(keyed_cases(study.path, tmp_path)) == of(study.cases)
    assert json.loads(path.read_text())["keys"] == [c.key for c in study.cases]
