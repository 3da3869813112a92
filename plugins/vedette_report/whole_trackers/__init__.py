"""Whether the covariances of a whole tracker fit its errors, on truth drawn from its own models or from other ones."""
