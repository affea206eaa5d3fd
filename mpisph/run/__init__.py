"""A whole run: begun, continued, stopped; what it writes and when."""
