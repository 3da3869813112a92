"""Reproduction of published studies: tables with errors, verdicts on claims that follow from figures, data of pictures."""

from vedette.reproduction.cells import (
    DECISIVE,
    Cell,
    less_often_cell,
    mean_cell,
    ratio_cell,
    rms_cell,
    share_cell,
    squared_distances,
)
from vedette.reproduction.findings import Chart, Curve, Element, Findings, Panel, Reproduction, Table
from vedette.reproduction.resuming import Keep, afresh
from vedette.reproduction.verdicts import Claim, Condition, Place, Verdict, judged, over, remark
