"""What the reproduction of a published study finds: tables with errors, verdicts on claims, data of pictures."""

from vedette_report.findings.cells import (
    DECISIVE,
    Cell,
    less_often_cell,
    mean_cell,
    ratio_cell,
    rms_cell,
    share_cell,
    squared_distances,
)
from vedette_report.findings.study import Chart, Curve, Element, Findings, Keep, Panel, Table, afresh
from vedette_report.findings.verdicts import Claim, Condition, Place, Verdict, judged, over, remark
