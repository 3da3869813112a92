"""The contenders: one module each, imported in a process and an environment of its own by `benchmarks.worker`.

A module offers ENTRIES: {problem family: {level: Problem -> Job}}, and VERSION. It needs no more than numpy and its library.
"""
