"""Arrays that are kept from one step to the next."""

from mpisph.core.workspace import SPARE, Workspace


def test_room_is_kept_and_grows_with_some_to_spare():
    workspace = Workspace()
    first = workspace.room("a", 4, 25)
    assert first.shape == (4, 25)
    assert first.flags.c_contiguous
    spare = workspace.room("a", int(100 * (1 + SPARE)))
    assert spare.base is first.base
    assert workspace.room("a", 3).base is first.base
    larger = workspace.room("a", 1000)
    assert larger.base is not first.base
    assert workspace.room("b", 1000).base is not larger.base


def test_room_for_nothing():
    assert Workspace().room("a", 16, 0).shape == (16, 0)
