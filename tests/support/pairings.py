"""Enumeration of pairings."""

from itertools import combinations, permutations


def pairings(rows, columns):
    """Every one-to-one pairing of some rows with some columns."""
    for size in range(min(rows, columns) + 1):
        for some in combinations(range(rows), size):
            for others in permutations(range(columns), size):
                yield list(zip(some, others, strict=True))
