"""Verification: problems with known solutions, run and compared with them."""
