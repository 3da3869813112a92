"""A run and the files that it leaves: whole, as it goes, or gone on with."""
