"""Process and measurement noise, detection, clutter and transitions from a recording's detections, without truth."""

from vedette_tools.tuning.config_text import toml as toml
from vedette_tools.tuning.summary import data as data
from vedette_tools.tuning.summary import summary as summary
from vedette_tools.tuning.summary import text as text
from vedette_tools.tuning.tuner import Found as Found
from vedette_tools.tuning.tuner import Tuned as Tuned
from vedette_tools.tuning.tuner import tune as tune
