"""Merged returns: two targets that a sensor does not resolve give one. Shapes: p pairs, k returns, m measured axes."""
