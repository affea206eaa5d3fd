"""How the particles are shared among ranks, and what ranks tell each other."""
