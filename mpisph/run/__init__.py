"""A whole run: started, resumed, stopped; what it writes and when."""
