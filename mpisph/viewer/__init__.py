"""Pages that play runs: the particles in a browser, by field, with their values."""
