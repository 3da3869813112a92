"""What the tracks of a recording say of a tracker's covariances: their innovations and, with truth, their errors."""

from vedette_report.recorded.beside import beside_truth as beside_truth
from vedette_report.recorded.foreign import of_estimates as of_estimates
from vedette_report.recorded.foreign import of_table as of_table
from vedette_report.recorded.objects import Pooled as Pooled
from vedette_report.recorded.objects import pooled as pooled
from vedette_report.recorded.table import sentences as sentences
from vedette_report.recorded.table import table as table
from vedette_report.recorded.tracks import Recorded as Recorded
from vedette_report.recorded.tracks import recorded as recorded
from vedette_report.recorded.tracks import recorded_consistency as recorded_consistency
from vedette_report.recorded.used import Innovations as Innovations
