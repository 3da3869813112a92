"""Process and measurement noise, detection, clutter and transitions from a recording's detections, without truth."""

from vedette_tools.tuning.said import data as data
from vedette_tools.tuning.said import summary as summary
from vedette_tools.tuning.said import text as text
from vedette_tools.tuning.tuned import Found as Found
from vedette_tools.tuning.tuned import Tuned as Tuned
from vedette_tools.tuning.tuned import tune as tune
from vedette_tools.tuning.written import toml as toml
