"""What the author of an estimator builds on."""
