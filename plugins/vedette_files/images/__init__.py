"""Pictures looked at without decoding them."""
