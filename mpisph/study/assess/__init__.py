"""Published tests of shields, computed and compared: `mpisph assess`."""
