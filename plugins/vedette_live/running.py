"""A service while it runs: inputs in threads of their own, the tracker in this one, outputs in theirs."""

from __future__ import annotations

import sys
from collections import deque
from functools import partial
from threading import Event, Thread
from typing import Any, final

import numpy as np
from attrs import define, field

from vedette.errors import InputError, VedetteError
from vedette.streams import Saved, Storage, TrackReport, now
from vedette.tracking import State
from vedette.types import Recording
from vedette_files import DATED
from vedette_live import saving
from vedette_live.config import Service
from vedette_live.counters import Counters
from vedette_live.grouping import Formed
from vedette_live.health import Health, notify
from vedette_live.listening import Listening
from vedette_live.log import LOG
from vedette_live.recorder import Recorder
from vedette_live.reports import chosen, report_of
from vedette_live.sending import Sending
from vedette_live.window import Window
from vedette_report.lagging import FixedLag
from vedette_report.watching.page import LivePage

TOGETHER = 64
"""Scans that are taken at once if so many wait."""
_TICK = 0.05
"""s between looks at what silence completes."""
_UNSAVED = 10_000
"""Reports that wait for a store that cannot be written, as on a full disk; the oldest are dropped."""


@final
@define(eq=False)
class Running:
    """Runs a service until `stop` is set, or all its inputs have ended: then what waits is taken, saved and sent."""

    service: Service
    stop: Event = field(factory=Event)
    counters: Counters = field(factory=Counters)
    ails: dict[str, str] = field(factory=dict)
    listening: Listening = field(init=False)
    _window: Window | None = None
    _unsaved: deque[TrackReport] = field(factory=lambda: deque[TrackReport](maxlen=_UNSAVED))
    _sinks: list[Sending] = field(factory=list)
    _lagged: list[FixedLag | None] = field(factory=list)
    _store: Storage | None = None
    _recorder: Recorder | None = None
    _made: dict[str, Any] = field(factory=dict)
    _page: LivePage | None = None
    _came: float = 0.0

    def __attrs_post_init__(self) -> None:
        self.listening = Listening(self.service, self.counters, self.ails)

    @property
    def state(self) -> State | None:
        """The state after the latest scan; None before the first."""
        return None if self._window is None else self._window.state

    def run(self) -> None:
        """Run. InputError if an input, an output or the store can never be used."""
        conduct = self.service.parts.service
        sys.setswitchinterval(0.001)  # a thread that computes would hold up one that has a datagram for 5 ms
        try:
            self._restore()
        except BaseException:
            self._close()
            raise
        health = Health(conduct.port, self.counters.text, self._ailment) if conduct.port else None
        feeds = self.listening.threads(self.stop)
        tracker, seed = self.service.experiment.tracker, self.service.experiment.seed
        self._sinks = [Sending(sink, self.counters, i, self.ails) for i, sink in enumerate(self.service.parts.outputs)]
        lags = [sink.lag for sink in self.service.parts.outputs]
        self._lagged = [FixedLag(tracker, lag, seed) if lag else None for lag in lags]
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
        if fatal := [told for name, told in self.ails.items() if name.startswith("input") and told.startswith("!")]:
            raise InputError(fatal[0][1:])

    def _ailment(self) -> str:
        return "; ".join(f"{name}: {told.lstrip('!')}" for name, told in sorted(self.ails.items()))

    def _take_until_the_end(self, feeds: list[Thread]) -> None:
        every = self.service.parts.service.save
        saved_at = now()
        while True:
            formed = self.listening.scans.take(TOGETHER, _TICK)
            if formed:
                self._take(formed)
            elif self.stop.is_set() or not any(thread.is_alive() for thread in feeds):
                return
            self._close_silent()
            if self._store is None and self.listening.numbers.asked:
                self.listening.numbers.keep(self.listening.numbers.taken())
            if now() - saved_at >= every:
                self._save()
                saved_at = now()

    def _close_silent(self) -> None:
        """Take the scans that silence completes."""
        if due := self.listening.due():
            self._take(due)

    def _take(self, formed: list[Formed]) -> None:
        """Take scans, and tell what came of them."""
        if self._window is None:
            self._window = self._begun(min(one.scan.time for one in formed))
        window, came = self._window, {id(one): one for one in formed}
        again, late = window.again, window.late
        for one, told in window.take(formed):
            self.counters.add("scans_refused_total")
            if came.pop(id(one), None) is not None:
                self.counters.add("messages_refused_total", one.messages)
                self.listening.numbers.take(one.acknowledge)
            self.listening.leave_out(one, "refused")
            LOG.warning("scan refused", extra={"sensor": one.scan.sensor, "scan_time": one.scan.time, "why": told})
        done = now()
        for one in came.values():
            self.counters.add("scans_taken_total")
            self.counters.add("messages_taken_total", one.messages)
            self.counters.latencies.append(done - one.arrived)
            self.listening.numbers.take(one.acknowledge)
        self.counters.add("scans_late_total", window.late - late)
        self.counters.add("scans_stepped_again_total", window.again - again)
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
                sink.put(report, partial(report_of, self.service, state))
        self._settle()
        if self._store is None:
            self.listening.numbers.keep(self.listening.numbers.taken())

    def _show(self, window: Window, came: float) -> None:
        """Show the latest scan on the page."""
        conduct, experiment = self.service.parts.service, self.service.experiment
        if not conduct.page:
            return
        self._came = came
        latest, before = window.kept[-1], window.kept[-2].state if len(window.kept) > 1 else window.before
        if self._page is None:
            self._page = LivePage(
                experiment, Recording((), notes=self._notes()), before, lambda: self._came, port=conduct.page
            )
            LOG.info("page", extra={"address": self._page.server.address})
        tracker = experiment.tracker
        modes = tracker.estimator.mode_prob(latest.state.belief)
        self._page.take(latest.scan, before, latest.state, tracker.estimate(latest.state), modes)

    def _settle(self, *, all_of_it: bool = False) -> None:
        """Keep the scans and tracks that no late scan can change any more."""
        assert self._window is not None
        for taken in self._window.settled(all_of_it=all_of_it):
            for sink, lagged in zip(self._sinks, self._lagged, strict=True):
                if lagged is not None:
                    self._tell_late(sink, lagged.push(taken.state))
            if self._recorder is not None:
                self._recorder.write(taken)
            if self._store is not None:
                report = report_of(self.service, taken.state)
                if report.confirmed.any():
                    self._unsaved.append(chosen(report, report.confirmed))
        if self._recorder is not None:
            while self.listening.left_out:
                self._recorder.leave_out(*self.listening.left_out.popleft())
            if all_of_it or len(self._recorder.waiting) >= TOGETHER:
                self._write_record(self._recorder)

    def _tell_late(self, sink: Sending, states: list[State]) -> None:
        """Let an output tell of states that later scans smoothed."""
        for state in states:
            sink.put(report_of(self.service, state), partial(report_of, self.service, state))

    def _write_record(self, recorder: Recorder) -> None:
        """Write what waits of the record; a full disk does not end the service, and is told."""
        try:
            recorder.flush()
            self.ails.pop("record", None)
        except OSError as error:
            if "record" not in self.ails:
                LOG.error("not recorded", extra={"why": str(error)})
            self.ails["record"] = str(error)

    def _begun(self, time: float) -> Window:
        experiment, conduct = self.service.experiment, self.service.parts.service
        given = experiment.tracker.given(Recording(()))
        seeds = np.random.SeedSequence(experiment.seed).spawn(2)[1]
        start = experiment.tracker.start(given, -np.inf if given is None else time, seeds)
        return Window(experiment.tracker, start, conduct.horizon, conduct.window, experiment.preprocessors)

    # What is kept

    def _restore(self) -> None:
        """Open store and record, and go on from what was saved."""
        conduct, experiment = self.service.parts.service, self.service.experiment
        self._made = saving.made_by(experiment)
        if conduct.record:
            self._recorder = Recorder.append(conduct.record, experiment)
        if conduct.store is None:
            return
        self._store = conduct.store.open()
        for told in getattr(self._store, "told", ()):
            LOG.error("store", extra={"why": told})
        saved = self._store.load()
        if saved is None:
            return
        try:
            window = self._window_of(saved)
        except VedetteError as error:
            LOG.error("the saved state does not fit, and is left out", extra={"why": str(error)[:300]})
            return
        places, code = saving.changed(saved.states["made"], self._made)
        if places:
            LOG.warning("the saved state is of another config, and is used, as it fits", extra={"changed": places[:20]})
        if code:
            LOG.warning("the saved state was made by other code, and is used, as it fits", extra={"changed": code[:20]})
        self._window = window
        feeds = zip(self.listening.groupers, saved.states["clocks"], self.service.parts.inputs, strict=False)
        for grouper, clocks, feed in feeds:
            grouper.clocks = saving.clocks_from(clocks, feed.scans.clock, feed.scans.leap)
        self.listening.numbers.kept = dict(saved.acknowledged)
        if self._recorder is not None and "recorded" in saved.states:
            self._recorder.cut(saved.states["recorded"])
        for name, count in saved.counters.items():
            if name in self.counters.counts:
                self.counters.add(name, count)
        LOG.info("restored", extra={"scan_time": window.state.time, "tracks": len(window.state.ids)})

    def _window_of(self, saved: Saved) -> Window:
        """Return the states that were saved; InputError if they are of another kind of tracker."""
        conduct, experiment = self.service.parts.service, self.service.experiment
        before = saving.state_from(experiment.tracker, saved.states["before"], saved.states["made"]["axes"])
        window = Window(experiment.tracker, before, conduct.horizon, conduct.window, experiment.preprocessors)
        window.take(saving.formed_from(given) for given in saved.states["scans"])
        return window

    def _save(self) -> None:
        """Keep the state and the tracks since the last time; then acknowledge what they hold."""
        if self._recorder is not None:
            self._write_record(self._recorder)
        if self._store is None or self._window is None:
            return
        numbers = self.listening.numbers.taken()
        clocks = self.listening.of_groupers(lambda grouper: saving.clocks_data(grouper.clocks))
        states: dict[str, Any] = {
            "made": self._made,
            "before": self._window.before.to_data(),
            "scans": [saving.formed_data(one) for taken in self._window.kept for one in taken.formed],
            "clocks": clocks,
        }
        if self._recorder is not None:
            states["recorded"] = self._recorder.end
        try:
            if self._recorder is not None and self._recorder.waiting:
                raise OSError("the record cannot be written")
            saved = Saved(saving.digest_of(self._made), states, dict(self.counters.counts), numbers, self._notes())
            self._store.save(saved, list(self._unsaved))
        except OSError as error:
            self.counters.add("saves_failed_total")
            self.ails["store"] = str(error)
            LOG.error("not saved", extra={"why": str(error)})
            return
        self.ails.pop("store", None)
        self.counters.add("saves_total")
        self._unsaved.clear()
        self.listening.numbers.keep(numbers)

    def _notes(self) -> dict[str, str]:
        """Return what x, y and times mean, as a recording's notes say it."""
        parts = self.service.parts
        notes = {} if parts.service.origin is None else {"origin": str(parts.service.origin)}
        return notes | ({"time": DATED} if all(feed.scans.clock != "sensor" for feed in parts.inputs) else {})

    def _finish(self) -> None:
        """Take what waits, keep all, and close."""
        while formed := self.listening.scans.take(TOGETHER, 0.0):
            self._take(formed)
        if self._window is not None:
            self._save()
        if self._window is not None and (self._recorder is not None or any(self._lagged)):
            self._settle(all_of_it=True)  # after what the store knows of it: a restart cuts it off and takes it again
        for sink, lagged in zip(self._sinks, self._lagged, strict=True):
            self._tell_late(sink, [] if lagged is None else lagged.finish())
        self._close()

    def _close(self) -> None:
        """Close record and store."""
        if self._recorder is not None:
            self._recorder.close()
        if self._store is not None:
            self._store.close()
