"""Reproduction of published studies: tables with errors, verdicts on claims that follow from figures, data of pictures."""

from vedette.reproduction.cells import DECISIVE as DECISIVE
from vedette.reproduction.cells import Cell as Cell
from vedette.reproduction.cells import mean_cell as mean_cell
from vedette.reproduction.cells import ratio_cell as ratio_cell
from vedette.reproduction.cells import rms_cell as rms_cell
from vedette.reproduction.cells import share_cell as share_cell
from vedette.reproduction.cells import squared_distances as squared_distances
from vedette.reproduction.findings import Chart as Chart
from vedette.reproduction.findings import Curve as Curve
from vedette.reproduction.findings import Findings as Findings
from vedette.reproduction.findings import Panel as Panel
from vedette.reproduction.findings import Reproduction as Reproduction
from vedette.reproduction.findings import Table as Table
from vedette.reproduction.resuming import Keep as Keep
from vedette.reproduction.resuming import afresh as afresh
from vedette.reproduction.verdicts import Claim as Claim
from vedette.reproduction.verdicts import Condition as Condition
from vedette.reproduction.verdicts import Verdict as Verdict
from vedette.reproduction.verdicts import judged as judged
from vedette.reproduction.verdicts import remark as remark
