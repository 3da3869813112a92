"""Process and measurement noise, detection, clutter and transitions from a recording's detections, without truth."""

from vedette.tuning.said import data as data
from vedette.tuning.said import summary as summary
from vedette.tuning.said import text as text
from vedette.tuning.tuned import Found as Found
from vedette.tuning.tuned import Tuned as Tuned
from vedette.tuning.tuned import tune as tune
from vedette.tuning.written import toml as toml
