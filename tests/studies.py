"""Small studies to run in tests."""

from launch import CASES

SHOT = CASES / "piekutowski-4-1353.toml"

UNSTABLE = 'set = { "limits.energy_drift" = 1e-18 }'
"""Settings of a variant that breaks down in its first steps."""

ALPHA = """
[[parameters]]
name = "alpha"
key = "scheme.viscosity.alpha"
values = [2.5, 5.0]
"""


def small_study(end, *settings, nph=(2.0, 2.5), variants=()):
    """A study of shot 4-1353 at NPR 4 up to `end`, as TOML."""
    lines = "".join(f"{setting}\n" for setting in settings)
    text = f"""
title = "small"
base = "{SHOT}"

[set]
"output.every" = ""
"output.figures" = false
"time.end" = "{end}"
"resolution.npr" = 4
{lines}
[[parameters]]
name = "nph"
key = "resolution.nph"
values = {list(nph)}
"""
    for name, more in variants:
        text += f'\n[[variants]]\nname = "{name}"\n{more}\n'
    return text
