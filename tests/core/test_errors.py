"""Errors read as sentences."""

from mpisph.core.errors import UnstableError


def test_unstable_error_reads_as_a_sentence():
    error = UnstableError("energy_drift", 12, 1.5e-6, 7, "0.06 exceeds 0.05")
    assert str(error) == (
        "unstable (energy_drift) at step 12, t = 1.5000 µs, particle 7: "
        "0.06 exceeds 0.05"
    )
