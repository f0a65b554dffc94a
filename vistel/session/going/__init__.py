"""How a conference goes, in figures: what its parts tell about themselves, what flows between them, and what is wrong."""
