"""What each command does, in a sentence or two: the descriptions that `--help` shows."""

RUN = (
    "Run a tracker over all scans of its source, judge the tracks where the truth is known, and write tracks, recording, "
    "config, summary and pictures into a folder. Ctrl-C ends the run and keeps what is done."
)
WATCH = (
    "Run a tracker and show what it does while it does it: on a page that this machine alone can open, whose address is "
    "printed, or in the terminal. Recordings go at their own pace, or at --speed. Ctrl-C ends it."
)
NEW = "Write a first version of what you need to begin: a config for your own data, a package for your own plugin."
NEW_CONFIG = (
    "Read the header and the rows of a file of detections; guess its columns, units, rates and noise; write a config that "
    "tracks its targets, with a comment on each guess."
)
NEW_PLUGIN = (
    "Write a Python package with a component of one role that works, its test against all laws of that role, and its entry "
    "point."
)
EXPLAIN = (
    "Say in plain words what a config composes, which gates, errors and lives of tracks follow from it, and what is out of "
    "proportion, each with its place. The source is opened for its first scans; nothing is tracked."
)
REPORT = (
    "Write one HTML file that shows a run scan by scan: map, errors, NEES, NIS, modes and the life of its tracks; or "
    "several runs side by side, or a study with its worst runs. It needs no network and no other file."
)
EXPORT = (
    "Write the confirmed tracks of a run, with their times, covariances and ellipses, for maps (KML, GeoJSON), as a table "
    "(CSV, Parquet), or all of the run for the viewer Rerun (needs vedette[rerun])."
)
CHECK = (
    "Test a component against every law of its role, with parameters drawn by its fields, and print which laws held, which "
    "failed and on what, and which did not apply. Exit code 1 if one failed. Needs vedette[testing]."
)
CONSISTENCY = (
    "Run a tracker on its recording and print what its tracks say of their own covariances: size and whiteness of "
    "innovations, how often they were detected, and with truth the errors. It reports and does not judge."
)
REPRODUCE = (
    "Run the whole study of a paper and print its tables, published figures beside measured ones, with a verdict on each "
    "claim: reproduced, not reproduced, not decided with so many runs, or a remark. Exits 0 whatever the verdicts."
)
STUDY = (
    "Run every point of a grid of trackers many times on the same drawn scenes, and print means with their standard errors "
    "and paired differences. With --out, finished chunks are kept, and --resume continues from them."
)
COMPONENTS = (
    "List what is installed, a line for each kind; of a role, a kind or a table all: distribution, parameters with units, "
    "bounds and defaults."
)
INFO = "Say which versions run here, whether the kernels are the compiled ones and why, and which plugins are installed."
COMPLETIONS = 'Print what a shell offers after TAB, as a script: bash and zsh: eval "$(vedette completions bash)".'
SCHEMA = "Print the JSON Schema of all that is installed, for editors that complete and check a config."
