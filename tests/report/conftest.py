"""One small run that the tests of reports read."""

import pytest
from small_runs import EXPOSED, small_run


@pytest.fixture(scope="session")
def finished(tmp_path_factory):
    """The folder of a completed run; not to be written into."""
    folder = tmp_path_factory.mktemp("runs") / "finished"
    small_run(folder, *EXPOSED)
    return folder
