"""IMM-PDAF beside CV-PDAF and CT-PDAF on real marine radar, tracks started by themselves: joyride and four Autoferry scenes.

python examples/marine_filters.py FOLDER     with FOLDER/joyride and FOLDER/autoferry
"""

import sys
from pathlib import Path

import vedette
from vedette.metrics import judge

HERE = Path(__file__).parent
ALONE = {"joyride": 1.5, "autoferry": 0.5}
"""m/s^2: a straight model alone must follow turns by its noise, v w for 10 m/s at 10 deg/s, and 4 m/s at 7 deg/s."""


def recordings(folder):
    """Name to the overrides of its config, and the config itself."""
    joyride = ["source.path=" + str(folder / "joyride"), "judge.last_scan=211"]
    yield "joyride", "joyride_marine.toml", joyride
    for number in (2, 5, 13, 16):
        path = "source.path=" + str(folder / "autoferry")
        own = [f"source.scenario={number}", "source.lag.radar=1.7", "associator.kind=pda"]
        own += ["retroactive=false", "lifecycle.confirm=0.999"]
        yield f"autoferry {number}", "autoferry.toml", [path, *own]


def filters(config, name):
    """Yield the three estimators: the config's IMM, its turning mode alone, and a straight mode alone with more noise."""
    imm = vedette.to_config(config)["estimator"]
    yield "IMM-PDAF", imm
    sigma = ALONE[name.split()[0]]
    yield "CV-PDAF", {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": sigma}}
    yield "CT-PDAF", imm["modes"][1]


def scores(folder):
    """Yield recording, filter and its score, one after the other."""
    for name, file, overrides in recordings(Path(folder)):
        loaded = vedette.load(HERE / file, overrides=overrides)
        for label, estimator in filters(loaded, name):
            experiment = vedette.load(vedette.to_config(loaded) | {"estimator": estimator})
            result = experiment.run()
            gate = experiment.tracker.gate.probability
            yield name, label, judge(result.tracks, result.recording.truth, result.scans, experiment.judge, gate)


def main(folder):
    """Print a table."""
    heads = f"{'coverage':>9}{'identity switches':>18}{'false':>7}{'RMSE m':>8}{'NEES':>8}{'GOSPA m':>9}"
    print(f"{'recording':14}{'filter':10}{heads}")
    for name, label, score in scores(folder):
        print(
            f"{name:14}{label:10}{score.coverage:9.3f}{score.id_switches:18d}{score.false_tracks:7.2f}"
            f"{score.position_rmse_m:8.2f}{score.nees_position:8.2f}{score.gospa_m:9.2f}"
        )


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
