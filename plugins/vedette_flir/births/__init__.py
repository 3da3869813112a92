"""How tracks start in images."""
