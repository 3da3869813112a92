"""How tracks are started."""
