"""Studies of many runs: a grid of trackers, run in lock-step or run by run, in threads, processes or on a cluster."""
