"""Studies: a case, varied over a grid of settings, run and set beside measurements."""
