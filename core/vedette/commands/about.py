"""What each command does, in a sentence or two: the descriptions that `--help` shows."""

RUN = (
    "Run a tracker over all scans of its source, compare the tracks with the truth where it is known, and write tracks, "
    "recording, config, summary and pictures into a folder. Ctrl-C ends the run and keeps the results so far."
)
WATCH = (
    "Run a tracker and show it live: on a page, which only this machine can open and whose address is printed, or in the "
    "terminal. A recording is played as fast as it was recorded, or at --speed. Ctrl-C ends the run."
)
NEW = "Write a first version of a config for your own data, or of a package for your own plugin."
NEW_CONFIG = (
    "Read a file of returns; guess its columns, units, scan interval and noise; write a config that tracks its targets, "
    "with a comment on each guess."
)
NEW_PLUGIN = (
    "Write a Python package with a working component of one role, the test of all laws of that role, and the entry point."
)
EXPLAIN = (
    "Say in plain words what a config composes, which gates, errors and track lives follow from it, and what is out of "
    "proportion. Reads the first scans of the source, and tracks nothing."
)
REPORT = (
    "Write one HTML file that shows a run scan by scan, with map, errors, NEES, NIS, modes and the history of its tracks; "
    "or several runs side by side; or a study with its worst runs. The page needs no network and no other file."
)
EXPORT = (
    "Write the confirmed tracks of a run, with their times, covariances and ellipses, for maps (KML, GeoJSON), as a table "
    "(CSV, Parquet), or the whole run for the viewer Rerun (needs vedette[rerun])."
)
CHECK = (
    "Test a component against every law of its role, with parameters drawn within their limits, and print which laws held, "
    "which failed and for which example, and which did not apply. Exit code 1 if one failed. Needs vedette[testing]."
)
CONSISTENCY = (
    "Run a tracker on its recording and print, for each object or track, whether its covariances fit: size and whiteness of "
    "the innovations, how often it was detected and, with truth, its errors. It gives no verdict."
)
REPRODUCE = (
    "Run the whole study of a paper and print its tables, published values beside measured ones, with a verdict on each "
    "claim: reproduced, not reproduced, not decided with this number of runs, or a remark. The exit code is 0 in any case."
)
STUDY = (
    "Run every point of a grid of trackers many times on the same drawn scenes, and print means with their standard errors "
    "and paired differences. With --out it keeps finished chunks, and --resume continues from them."
)
COMPONENTS = (
    "List what is installed, one line for each kind. With a role, a kind or a table, describe it in full: distribution, and "
    "parameters with units, bounds and defaults."
)
INFO = "Print the versions of Vedette and its libraries, which kernels it uses and why, and the installed plugins."
COMPLETIONS = 'Print a script that makes a shell complete commands after TAB. In bash: eval "$(vedette completions bash)".'
SCHEMA = "Print the JSON Schema of all that is installed, for editors that complete and check a config."
