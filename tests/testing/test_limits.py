"""How long a law may take: a limit holds also where its signal is swallowed, and leaves nothing behind."""

import signal
from contextlib import suppress
from time import process_time

import pytest

from vedette.testing.limits import TooLong, at_most

pytestmark = pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="this system has no such timers")


def work(seconds):
    end = process_time() + seconds
    while process_time() < end:
        pass


def swallowed_once(seconds, then):
    with at_most(seconds):
        with suppress(TooLong):
            work(2.0)
        work(then)


@pytest.mark.parametrize("then", [2.0, 0.0])
def test_it_holds_where_its_signal_is_swallowed(then):
    """As by a callback of the garbage collector, whose exceptions are ignored; also where little was left to do."""
    with pytest.raises(TooLong):
        swallowed_once(0.03, then)


def test_nothing_is_left_of_it():
    before = signal.getsignal(signal.SIGPROF)
    with at_most(0.05):
        pass
    work(0.1)
    assert signal.getitimer(signal.ITIMER_PROF) == (0.0, 0.0)
    assert signal.getsignal(signal.SIGPROF) is before
