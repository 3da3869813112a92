"""Written by docs/write_stub.py."""

from vedette.testing.comparisons import Broken as Broken
from vedette.testing.comparisons import Closed as Closed
from vedette.testing.comparisons import Misuse as Misuse
from vedette.testing.kit import Outcome as Outcome
from vedette.testing.kit import conformance as conformance
from vedette.testing.kit import examine as examine
from vedette.testing.kit import laws_of as laws_of
from vedette.testing.kit import own_laws as own_laws
from vedette.testing.law import FAST as FAST
from vedette.testing.law import NIGHTLY as NIGHTLY
from vedette.testing.law import Law as Law
from vedette.testing.law import Profile as Profile
from vedette.testing.strategies import components as components
from vedette_report.whole_trackers.judging import Report as Report
from vedette_report.whole_trackers.judging import assert_consistent as assert_consistent
from vedette_report.whole_trackers.judging import consistency as consistency
from vedette_report.whole_trackers.world import Errors as Errors
from vedette_report.whole_trackers.world import World as World
