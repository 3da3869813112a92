"""A service while it runs: inputs in threads of their own, the tracker in this one, outputs in theirs."""

from __future__ import annotations

import sys
from functools import partial
from threading import Event, Thread
from typing import final

import numpy as np
from attrs import define, evolve, field

from vedette.errors import InputError
from vedette.streams import now
from vedette.tracking import State
from vedette.types import Recording, Scan
from vedette_files import replaced
from vedette_live.config import Service
from vedette_live.counters import Counters
from vedette_live.grouping import Formed
from vedette_live.health import Health, notify
from vedette_live.keeping import TOGETHER, Keeping
from vedette_live.listening import Listening
from vedette_live.log import LOG
from vedette_live.reports import report_of
from vedette_live.sending import Sending
from vedette_live.window import Window
from vedette_report.running.lagging import FixedLag
from vedette_report.watching.page import LivePage

_TICK = 0.05
"""s between looks at what silence completes."""
_LAST = 2.0
"""s, at the stop, for what has come to be formed into scans."""
_BEHIND = 60.0
"""s from the bytes that complete a scan to its tracks, of which the health tells."""
_AGAIN = 1.0
"""s after which a second signal is not the first one, that a shell and a wrapper have both sent."""
_LAST_TOLD = ("scans_taken_total", "messages_refused_total", "messages_dropped_total", "reports_merged_total")
"""Counts that the last line of the log tells."""
_DEAF = 10
"""Scans of a sensor, refused one after the other, of which the health tells."""


@final
@define(eq=False)
class Running:
    """Runs a service until `stop` is set, or all its inputs have ended: then what waits is taken, saved and sent.

    Where it is `hurried`, what waits is dropped.
    """

    service: Service
    stop: Event = field(factory=Event)
    hurried: Event = field(factory=Event)
    counters: Counters = field(factory=Counters)
    ails: dict[str, str] = field(factory=dict)
    listening: Listening = field(init=False)
    kept: Keeping = field(init=False)
    _window: Window | None = None
    _sinks: list[Sending] = field(factory=list)
    _lagged: list[FixedLag | None] = field(factory=list)
    _page: LivePage | None = None
    _came: float = 0.0
    _deaf: dict[str, int] = field(factory=dict)
    _posed: set[str] = field(factory=set)
    _asked: float = np.inf
    _saved: float = field(factory=now)
    _lacks: list[str] = field(factory=list)

    def __attrs_post_init__(self) -> None:
        self.listening = Listening(self.service, self.counters, self.ails)
        self.kept = Keeping(self.service, self.counters, self.ails, self.listening)

    @property
    def state(self) -> State | None:
        """The state after the latest scan; None before the first."""
        return None if self._window is None else self._window.state

    def end(self) -> None:
        """Stop, as a signal asks; asked once more, hurry."""
        if now() - self._asked > _AGAIN:
            self.hurried.set()
        self._asked = min(self._asked, now())
        self.stop.set()

    def run(self) -> None:
        """Run. InputError if an input, an output or the store can never be used, or if scans are not kept at the end."""
        conduct = self.service.parts.service
        sys.setswitchinterval(0.001)  # a thread that computes would hold up one that has a datagram for 5 ms
        try:
            self._window = self.kept.open()
            if conduct.page:
                self._page = self._opened(conduct.page)
        except BaseException:
            self.kept.close()
            raise
        health = Health(conduct.port, self.counters.text, self._ailment) if conduct.port else None
        feeds = self.listening.threads(self.stop)
        self._sinks = [Sending(sink, self.counters, i, self.ails) for i, sink in enumerate(self.service.parts.outputs)]
        self._lagged = self._lags()
        try:
            for thread in feeds:
                thread.start()
            LOG.info("serving", extra={"port": health.port if health else 0})
            notify("READY=1")
            self._take_until_the_end(feeds)
        finally:
            notify("STOPPING=1")
            self.stop.set()
            self.listening.scans.close()
            for thread in feeds:
                thread.join(2.0)
            self._finish()
            for sink in self._sinks:
                sink.close()
            if self._page is not None:
                self._page.end(interrupted=False, wait=1.0)
            if health is not None:
                health.close()
            self.listening.tell(last=True)
            LOG.info("stopped", extra={name.removesuffix("_total"): self.counters.counts[name] for name in _LAST_TOLD})
        fatal = [told[1:] for name, told in self.ails.items() if name.startswith("input") and told.startswith("!")]
        if told := [*fatal[:1], *self._lacks]:
            raise InputError("\n".join(told))

    def _lags(self) -> list[FixedLag | None]:
        """Return what smooths the reports of each output; None where nothing does."""
        tracker, seed = self.service.experiment.tracker, self.service.experiment.seed
        return [FixedLag(tracker, sink.lag, seed) if sink.lag else None for sink in self.service.parts.outputs]

    def _ailment(self) -> str:
        return "; ".join(f"{name}: {told.lstrip('!')}" for name, told in sorted(self.ails.items()))

    def _take_until_the_end(self, feeds: list[Thread]) -> None:
        end = np.inf
        while now() < end and not self.hurried.is_set():
            if self.stop.is_set() and end == np.inf:
                end = now() + _LAST
                LOG.info("stopping", extra={"waiting": len(self.listening.scans.items)})
            formed = self.listening.scans.take(TOGETHER, _TICK)
            if len(formed) < TOGETHER:
                self.ails.pop("tracker", None)
            self._take(formed)
            if not formed and not any(thread.is_alive() for thread in feeds) and self.stop.is_set() == (end < np.inf):
                return  # a stop is told first
            self._take(self.listening.due())
            self.listening.tell()
            self._save_if_due()

    def _save_if_due(self) -> None:
        due = now() - self._saved >= self.service.parts.service.save
        self.kept.save(self._window, due=due)
        if due:
            self._saved = now()

    def _take(self, formed: list[Formed]) -> None:
        """Take scans, and tell what came of them."""
        if not formed:
            return
        if self._window is None:
            self._window = self._begun(min(one.scan.time for one in formed))
        window, again, late = self._window, self._window.again, self._window.late
        refused = window.take(formed)
        formed = formed[: len(formed) - len(window.left)]
        came = {id(one): one for one in formed}
        for one, told in refused:
            self._refuse(one, told, now=came.pop(id(one), None) is not None)
        for of, problems in window.flawed:
            if any(id(one) in came for one in of):  # not one that was only stepped again
                self.counters.add("returns_left_out_total", len(problems))
                self.listening.log.warn("return left out", f"time {of[-1].scan.time:.6f}: {problems[0]}", "")
        if window.gave_up:
            LOG.warning("scans given up", extra={"why": window.gave_up})
            self._lagged = self._lags()
        self._hear(formed, {id(one): told for one, told in refused})
        done = now()
        for one in came.values():
            self.counters.add("scans_taken_total")
            self.counters.add("messages_taken_total", one.messages)
            self.counters.tell("sensor_scans_total", one.scan.sensor, 1.0, more=True)
            self.counters.tell("sensor_came_seconds", one.scan.sensor, one.arrived)
            self.counters.latencies.append(done - one.arrived)
            self.listening.numbers.take(one.acknowledge)
            self._tell_replaced(one.scan)
        self.counters.add("scans_late_total", window.late - late)
        self.counters.add("scans_stepped_again_total", window.again - again)
        if window.set_back:
            self._begin_anew(window, formed[-1].scan.time)
            self._take(window.left)
            return
        if came and (behind := done - min(one.arrived for one in came.values())) > _BEHIND:
            self.ails["tracker"] = f"it is {behind:.0f} s behind"
        if not came or not window.kept:
            return
        state = window.state
        self._show(window, max(one.arrived for one in came.values()))
        values = self.counters.values
        values["tracks"], values["tracks_confirmed"] = len(state.ids), int(np.count_nonzero(state.confirmed))
        values["scan_time_seconds"], values["scans_waiting"] = state.time, len(self.listening.scans.items)
        if prompt := [sink for sink, lagged in zip(self._sinks, self._lagged, strict=True) if lagged is None]:
            report = report_of(self.service, state)
            for sink in prompt:
                sink.put(report, partial(report_of, self.service, state), len(came))
        self._settle()

    def _begin_anew(self, window: Window, time: float) -> None:
        """Keep what there is, and go on without tracks from a time before it."""
        LOG.warning("tracks begin anew", extra={"why": window.set_back})
        self._settle(all_of_it=True)
        self.kept.set_aside()
        self.kept.born, self._lagged = window.state.born, self._lags()
        self._window = self._begun(time)

    def _refuse(self, one: Formed, told: str, *, now: bool) -> None:
        """Tell of a scan that is refused, `now` or as it was stepped again, when its messages have been answered."""
        self.counters.add("scans_refused_total")
        if now:
            self.counters.add("messages_refused_total", one.messages)
            self.listening.numbers.take(one.acknowledge)
            for number in one.acknowledge:
                self.listening.numbers.refuse(number, told)
        self.listening.leave_out(one, "refused")
        self.listening.log.warn(f"scan of {one.scan.sensor} refused", f"time {one.scan.time:.6f}: {told}", "")

    def _tell_replaced(self, scan: Scan) -> None:
        """Let the log tell, once, that a sensor does not stand where its parameters say, as the poses of its scans do."""
        if scan.pose is not None and scan.sensor not in self._posed:
            self._posed.add(scan.sensor)
            for told in replaced(self.listening.groupers[0].placing.sensors, [scan]):
                LOG.warning("sensor placed by its poses", extra={"sensor": scan.sensor, "why": told})

    def _hear(self, formed: list[Formed], refused: dict[int, str]) -> None:
        """Let the health tell of a sensor of which no scan is taken any more, as where its clock is wrong."""
        for one in formed:
            sensor, told = one.scan.sensor, refused.get(id(one))
            self._deaf[sensor] = 0 if told is None else self._deaf.get(sensor, 0) + 1
            if self._deaf[sensor] >= _DEAF:
                self.ails[f"sensor {sensor}"] = f"its last {self._deaf[sensor]} scans were refused: {told}"
            else:
                self.ails.pop(f"sensor {sensor}", None)

    def _opened(self, port: int) -> LivePage:
        """Return the page, at its port."""
        state = (self._window or self._begun(0.0)).state
        page = LivePage(
            self.service.experiment, Recording((), notes=self.service.notes), state, lambda: self._came, port=port
        )
        LOG.info("page", extra={"address": page.server.address})
        return page

    def _show(self, window: Window, came: float) -> None:
        """Show the latest scan on the page."""
        if self._page is None:
            return
        self._came = came
        latest, before = window.kept[-1], window.kept[-2].state if len(window.kept) > 1 else window.before
        tracker = self.service.experiment.tracker
        modes = tracker.estimator.mode_prob(latest.state.belief)
        self._page.take(latest.scan, before, latest.state, tracker.estimate(latest.state), modes)

    def _settle(self, *, all_of_it: bool = False) -> None:
        """Keep the scans and tracks that no late scan can change any more."""
        assert self._window is not None
        for taken in self._window.settled(all_of_it=all_of_it):
            for sink, lagged in zip(self._sinks, self._lagged, strict=True):
                if lagged is not None:
                    self._tell_late(sink, lagged.push(taken.state))
            self.kept.take(taken)
        for sink, lagged in zip(self._sinks, self._lagged, strict=True):
            if all_of_it and lagged is not None:
                self._tell_late(sink, lagged.finish())
        self.kept.record(all_of_it=all_of_it)

    def _tell_late(self, sink: Sending, states: list[State]) -> None:
        """Let an output tell of states that later scans smoothed."""
        for state in states:
            sink.put(report_of(self.service, state), partial(report_of, self.service, state))

    def _begun(self, time: float) -> Window:
        experiment, conduct = self.service.experiment, self.service.parts.service
        given = experiment.tracker.given(Recording(()))
        seeds = np.random.SeedSequence(experiment.seed).spawn(2)[1]
        start = experiment.tracker.start(given, -np.inf if given is None else time, seeds)
        start = evolve(start, born=max(start.born, self.kept.born))
        return Window(experiment.tracker, start, conduct.horizon, conduct.window, experiment.preprocessors)

    def _finish(self) -> None:
        """Take what waits, or drop it, keep all, and close."""
        while not self.hurried.is_set() and (formed := self.listening.scans.take(TOGETHER, 0.0)):
            self._take(formed)
            self._save_if_due()
        for one in self.listening.scans.take(self.service.parts.service.queue, 0.0):
            self.listening.drop(one)
        self.kept.save(self._window, last=True)
        if self._window is not None and (self.kept.recorder is not None or any(self._lagged)):
            self._settle(all_of_it=True)  # after what the store knows of it: a restart cuts it off and takes it again
        self._lacks = self.kept.lacks()
        for told in self._lacks:
            LOG.error("not kept", extra={"why": told})
        self.kept.close()
