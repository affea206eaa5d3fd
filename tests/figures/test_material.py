"""The figure of a material, read back from its axes."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from mpisph.core.errors import CaseError
from mpisph.figures.material import draw_material
from mpisph.materials import Material, card_names, load_card


@pytest.fixture
def drawn(monkeypatch):
    """Draws a card and returns the axes."""
    figures = []
    monkeypatch.setattr(Figure, "savefig", lambda self, *_, **__: figures.append(self))

    def draw(name, tmp_path):
        draw_material(load_card(name), tmp_path / f"{name}.png")
        return figures[-1].axes

    return draw


def lines(axes):
    """The lines of an axes by their labels."""
    return {line.get_label(): line.get_xydata() for line in axes.lines}


@pytest.mark.parametrize("name", card_names())
def test_every_card_can_be_drawn(drawn, tmp_path, name):
    panels = drawn(name, tmp_path)
    assert len(panels) >= 2
    for axes in panels:
        assert axes.get_xlabel()
        assert axes.get_ylabel()
        for line in axes.lines:
            assert np.all(np.isfinite(line.get_xydata()))


def test_the_weakest_flaw_of_a_large_piece_is_weaker(drawn, tmp_path):
    """Of basalt, 1 cm: ``(k V)^(-1/m)`` is 5.16e-4, times Young's modulus."""
    _, _, flaws, _ = drawn("basalt", tmp_path)
    size, tension = flaws.lines[0].get_xydata().T
    young = 9.0 * 26.7 * 22.7 / (3.0 * 26.7 + 22.7)
    wanted = 1e3 * young * (4e35 * 1e-6) ** (-1.0 / 9.0)
    assert np.interp(10.0, size, tension) == pytest.approx(wanted, rel=0.01)
    assert np.all(np.diff(tension) < 0.0)


def test_a_gas_has_no_curves(tmp_path):
    gas = Material(name="air", rho0=1.2, **{"ideal-gas": {"gamma": 1.4, "c0": 340.0}})
    with pytest.raises(CaseError, match="no curves to draw"):
        draw_material(gas, tmp_path / "air.png")


def test_an_unknown_format_is_told(tmp_path):
    with pytest.raises(CaseError, match=r"expected a name that ends in .*\.png"):
        draw_material(load_card("ta"), tmp_path / "ta.xyz")


def test_curves_of_aluminium(drawn, tmp_path):
    velocities, pressures, temperatures, melting, cook, guinan, fracture = drawn(
        "al-6061-t6", tmp_path
    )
    u_p, u_s = lines(velocities)["Mie-Grüneisen"].T
    assert u_s == pytest.approx(5.24 + 1.4 * u_p, rel=1e-6)
    shocks = lines(pressures)["Mie-Grüneisen shocks"]
    cold = lines(pressures)["Mie-Grüneisen isentrope"]
    assert cold[-1, 0] == shocks[-1, 0]
    assert cold[-1, 1] < shocks[-1, 1]
    assert lines(temperatures)["melting"][0, 1] == pytest.approx(0.925, rel=0.02)
    assert "melt at 123 to 134 GPa" in melting.get_legend_handles_labels()[1]
    assert lines(cook)["300 K"][0, 1] == pytest.approx(324.0, rel=0.01)
    assert lines(guinan)["300 K"][0, 1] == pytest.approx(290.0)
    assert "1/s" in lines(cook)
    assert "1/s" not in lines(guinan)
    triaxiality, strain = lines(fracture)["300 K"].T
    tension = np.interp(1.0 / 3.0, triaxiality, strain)
    assert tension == pytest.approx(-0.77 + 1.45 * np.exp(-0.47 / 3.0), rel=0.01)
