"""What a service keeps while it runs: a record of its scans, and in a store its state and its tracks, for a restart."""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Mapping
from typing import Any, final

import numpy as np
from attrs import define, field

from vedette.errors import InputError
from vedette.streams import Saved, Storage, TrackReport
from vedette_files import Terms
from vedette_live import saving
from vedette_live.config import Service
from vedette_live.counters import Counters
from vedette_live.listening import Listening
from vedette_live.log import LOG
from vedette_live.recorder import Recorder
from vedette_live.reports import chosen, report_of
from vedette_live.window import Leap, Taken, Window

TOGETHER = 64
"""Scans that are taken, and written, at once if so many wait."""
_COPY = "copy of the store"
_UNSAVED = 10_000
"""Reports that wait for a store that cannot be written, as on a full disk; the oldest are dropped."""


@final
@define(eq=False)
class Keeping:
    """Keeps what a service took; a full disk does not end the service, and is told.

    `born`: the tracks begun by a state that was left out, or before the times of now, whose ids the store holds.
    """

    service: Service
    counters: Counters
    ails: dict[str, str]
    listening: Listening
    store: Storage | None = None
    recorder: Recorder | None = None
    made: dict[str, Any] = field(factory=dict)
    born: int = 0
    _unsaved: deque[TrackReport] = field(factory=lambda: deque[TrackReport](maxlen=_UNSAVED))
    _dropped: int = 0
    _until: tuple[int, float] = (0, -np.inf)

    def open(self) -> Window | None:
        """Open store and record, and return what was saved, to go on from; None if nothing that fits was."""
        conduct, experiment = self.service.parts.service, self.service.experiment
        self.made = saving.made_by(experiment)
        if conduct.record:
            self.recorder = Recorder.append(conduct.record, experiment, self.service.notes)
        if conduct.store is None:
            return None
        self.store = conduct.store.open()
        saved = self.store.load()
        if saved is None:
            return None
        try:
            window = self._window_of(saved)
            feeds = zip(saved.states["clocks"], self.service.parts.inputs, strict=False)
            clocks = [saving.clocks_from(given, feed.scans.clock, feed.scans.leap) for given, feed in feeds]
            changed, code = saving.changed(saved.states["made"], self.made)
            known = {key: int(number) for key, number in saved.acknowledged.items()}
            runs = saved.states.get("missed", {}).items()  # the data of an older Vedette lack it
            missed = {key: [(int(first), int(last)) for first, last in of] for key, of in runs}
            begins = {key: int(number) for key, number in saved.states.get("begins", {}).items()}
            counts = {name: int(count) for name, count in saved.counters.items() if name in self.counters.counts}
            places = [place and (place[0], dict(place[1])) for place in saved.states.get("places", [])]
            recorded, record = int(saved.states.get("recorded", -1)), saved.states.get("record")
        except Exception as error:  # another Vedette's data may be others, in any way
            why = f"{type(error).__name__}: {error}"[:300]
            LOG.error("the saved state does not fit, and is left out", extra={"why": why})
            born = saved.states.get("born")  # the data of an older Vedette lack it
            self.born = born if isinstance(born, int) else 0
            return None
        if changed:
            LOG.warning("the saved state is of another config, and is used, as it fits", extra={"changed": changed[:20]})
        if code:
            LOG.warning("the saved state was made by other code, and is used, as it fits", extra={"changed": code[:20]})
        for grouper, those in zip(self.listening.groupers, clocks, strict=False):
            grouper.clocks, grouper.came = those, OrderedDict.fromkeys(window.came)
        numbers = self.listening.numbers
        numbers.kept, numbers.missed, numbers.begins = known, missed, begins
        for reading, place in zip(self.listening.readings, places, strict=False):
            reading.kept = place
        if self.recorder is not None and recorded >= 0 and not saved.older and record in (None, str(self.recorder.path)):
            self.recorder.cut(recorded)
        for name, count in counts.items():
            self.counters.add(name, count)
        self._until = (self.counters.counts["scans_taken_total"], window.state.time)
        LOG.info("restored", extra={"scan_time": window.state.time, "tracks": len(window.state.ids)})
        return window

    def _window_of(self, saved: Saved) -> Window:
        """Return the states that were saved; InputError if they are of another kind of tracker, or x and y elsewhere."""
        conduct, experiment = self.service.parts.service, self.service.experiment
        notes = saved.states.get("notes", self.service.notes)  # the data of an older Vedette lack them
        if not Terms.of(notes).stay(Terms.of(self.service.notes)):
            raise InputError(f"state: its x and y are of {notes or 'no origin'}, and here of {self.service.notes or 'none'}")
        before = saving.state_from(experiment.tracker, saved.states["before"], saved.states["made"]["axes"])
        window = Window(experiment.tracker, before, conduct.horizon, conduct.window, experiment.preprocessors)
        window.take(saving.formed_from(given) for given in saved.states["scans"])
        window.came |= saved.states.get("copies", {})  # an older Vedette's data lack these
        window.heard |= saved.states.get("heard", {})
        if leap := saved.states.get("leap"):
            state = saving.state_from(experiment.tracker, leap["before"], saved.states["made"]["axes"])
            window.leap = Leap(state, leap["time"], frozenset(leap["sensors"]))
        return window

    def save(self, window: Window | None, *, due: bool = True, last: bool = False) -> None:
        """Keep, if it is due, the state and the tracks since the last time; answer what is kept, or all where nothing is.

        At the `last` time the tracks within the horizon, too: a restart keeps them anew, as late scans made them.

        It is due, too, as soon as the record was moved away: after a kill, what is in another file would come again.
        """
        due = due or (self.recorder is not None and "record" not in self.ails and self.recorder.moved)
        if due and self.recorder is not None:
            self._write_record(self.recorder)
        acknowledging = self.listening.numbers
        if self.store is None or window is None:
            acknowledging.keep(acknowledging.taken())
            return
        if not due:
            return
        numbers = acknowledging.taken()
        states = self._states(window, numbers)
        try:
            if self.recorder is not None and self.recorder.waiting:
                raise OSError("the record cannot be written")
            saved = Saved(states, dict(self.counters.counts), numbers, self.service.notes)
            within = (self._confirmed(taken) for taken in window.kept) if last else ()
            ailment = self.store.save(saved, [*self._unsaved, *(report for report in within if report is not None)])
        except OSError as error:
            self.counters.add("saves_failed_total")
            if "store" not in self.ails:
                LOG.error("not saved", extra={"why": str(error)})
            self.ails["store"] = str(error)
            return
        self.ails.pop("store", None)
        if ailment is None:
            self.ails.pop(_COPY, None)
        else:
            self.ails[_COPY] = ailment
        self.counters.add("saves_total")
        self._until = (self.counters.counts["scans_taken_total"], window.state.time)
        self._unsaved.clear()
        if self._dropped:
            LOG.error("the store lacks tracks, as it could not be written for long", extra={"reports": self._dropped})
            self._dropped = 0
        acknowledging.keep(numbers)

    def _states(self, window: Window, numbers: Mapping[str, int]) -> dict[str, Any]:
        """Return what a restart goes on from, as plain data; `numbers` are those taken of each input and sensor."""
        states: dict[str, Any] = {
            "made": self.made,
            "notes": self.service.notes,
            "before": window.before.to_data(),
            "born": window.state.born,
            "scans": [saving.formed_data(one) for taken in window.kept for one in taken.formed],
            "copies": window.came,
            "heard": window.heard,
            "clocks": self.listening.of_groupers(lambda grouper: saving.clocks_data(grouper.clocks)),
            "missed": self.listening.numbers.untaken(numbers),
            "begins": self.listening.numbers.begins,
            "places": [reading.taken(numbers) for reading in self.listening.readings],
        }
        if (leap := window.settled_leap) is not None:
            states["leap"] = {"before": leap.before.to_data(), "time": leap.time, "sensors": sorted(leap.sensors)}
        if self.recorder is not None:
            states |= {"recorded": self.recorder.end, "record": str(self.recorder.path)}
        return states

    def take(self, taken: Taken) -> None:
        """Keep a scan and the tracks after it, which no late scan can change any more."""
        if self.recorder is not None:
            self.recorder.write(taken)
        if self.store is not None:
            report = self._confirmed(taken)
            if report is not None:
                self._dropped += len(self._unsaved) == self._unsaved.maxlen
                self._unsaved.append(report)

    def _confirmed(self, taken: Taken) -> TrackReport | None:
        """Return the confirmed tracks after a scan; None if there is none."""
        report = report_of(self.service, taken.state)
        return chosen(report, report.confirmed) if report.confirmed.any() else None

    def record(self, *, all_of_it: bool) -> None:
        """Write the record once enough waits, or `all_of_it`; one that was moved away is begun anew by `save`."""
        if self.recorder is None:
            return
        while self.listening.left_out:
            self.recorder.leave_out(*self.listening.left_out.popleft())
        if all_of_it or (len(self.recorder.waiting) >= TOGETHER and not self.recorder.moved):
            self._write_record(self.recorder)

    def set_aside(self) -> None:
        """Give the record another name, as times go back; what follows is recorded anew."""
        if self.recorder is not None:
            LOG.warning("the record is set aside", extra={"path": str(self.recorder.set_aside())})

    def _write_record(self, recorder: Recorder) -> None:
        """Write what waits of the record; a full disk does not end the service, and is told."""
        try:
            recorder.flush()
            self.ails.pop("record", None)
            if recorder.dropped:
                LOG.error("the record lacks lines, as it could not be written for long", extra={"lines": recorder.dropped})
                recorder.dropped = 0
        except OSError as error:
            if "record" not in self.ails:
                LOG.error("not recorded", extra={"why": str(error)})
            self.ails["record"] = str(error)

    def lacks(self) -> list[str]:
        """Return what store and record lack at the end, as they cannot be written."""
        told, (kept, since) = list[str](), self._until
        if "store" in self.ails:
            lost = self.counters.counts["scans_taken_total"] - kept
            after = "" if since == -np.inf else f" after {since:.6f} s"
            told.append(f"service.store: {lost} scans{after} are not kept: {self.ails['store']}")
        if self.recorder is not None and (lost := len(self.recorder.waiting) + self.recorder.dropped):
            told.append(f"service.record: lacks {lost} lines: {self.ails.get('record', '')}")
        return told

    def close(self) -> None:
        """Close record and store."""
        if self.recorder is not None:
            self.recorder.close()
        if self.store is not None:
            self.store.close()
