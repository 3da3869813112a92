"""Pictures: their common parts, and each of them."""
