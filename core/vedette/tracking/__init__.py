"""The loop from scans to tracks: validation, gating, states, and the tracks' histories."""

from vedette.tracking.clusters import Pairs, by_cluster
from vedette.tracking.components import parts
from vedette.tracking.expected import Expected
from vedette.tracking.faults import check_again, explained
from vedette.tracking.history import History, from_the_start
from vedette.tracking.identity import weighed
from vedette.tracking.intake import Came, Intake
from vedette.tracking.meeting import Meeting, scores_of_few
from vedette.tracking.preprocessing import open_source, preprocess, preprocessed, raw_sensors
from vedette.tracking.pytrees import Common, join, take
from vedette.tracking.smoothing import check_smoothing, smooth, smoothed
from vedette.tracking.state import State
from vedette.tracking.tracker import Tracker
from vedette.tracking.validation import without_bad_returns
