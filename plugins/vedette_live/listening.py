"""What the inputs of a service do, each in a thread of its own: decode, group into scans, queue, and count."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from contextlib import suppress
from threading import Event, Lock, Thread
from typing import Any, final

from attrs import define, evolve, field

from vedette.errors import VedetteError
from vedette.streams import Arrival, Decoded, Message, now
from vedette.tracking import raw_sensors
from vedette_live.acknowledging import Acknowledging, Number
from vedette_live.config import Feed, Service
from vedette_live.counters import Counters
from vedette_live.grouping import Formed, Grouper
from vedette_live.log import LOG, Sparing
from vedette_live.placing import Placing
from vedette_live.queues import BoundedQueue
from vedette_live.reading import Reading
from vedette_live.rhythm import Rhythms
from vedette_live.setback import Again


@final
@define(eq=False)
class Listening:
    """The inputs of a service, and the `scans` that wait for its tracker; `ails` names what ails each input.

    `left_out`: the scans that were not taken, and why, for the record of the run.
    """

    service: Service
    counters: Counters
    ails: dict[str, str]
    numbers: Acknowledging = field(factory=Acknowledging)
    left_out: deque[tuple[Formed, str]] = field(factory=deque)
    scans: BoundedQueue[Formed] = field(init=False)
    groupers: list[Grouper] = field(init=False)
    locks: list[Lock] = field(init=False)
    rhythms: Rhythms = field(factory=Rhythms)
    _again: Again = field(factory=Again)
    readings: list[Reading] = field(init=False)
    log: Sparing = field(factory=lambda: Sparing(""))
    logs: list[Sparing] = field(init=False)

    def __attrs_post_init__(self) -> None:
        parts, experiment = self.service.parts, self.service.experiment
        sensors = raw_sensors(experiment.preprocessors, experiment.tracker.sensors)
        self.scans = BoundedQueue(parts.service.queue)
        where = parts.service.origin, parts.service.frame, parts.service.sites
        self.groupers = [Grouper(feed.scans, Placing(sensors, feed.names, *where)) for feed in parts.inputs]
        self.locks = [Lock() for _ in parts.inputs]
        for i in range(len(parts.inputs)):
            self.counters.tell("input_well", str(i), 1.0)
            self.counters.tell("input_messages_total", str(i), 0.0)
        for name in sensors:
            self.counters.tell("sensor_scans_total", name, 0.0)
        self.readings = [Reading(i, self.numbers) for i in range(len(parts.inputs))]
        self.logs = [Sparing(f"input {i}") for i in range(len(parts.inputs))]

    def threads(self, stop: Event) -> list[Thread]:
        """Return a thread for each input, to be started: it ends with the input, or when `stop` is set."""
        inputs = enumerate(self.service.parts.inputs)
        return [Thread(target=self._listen, args=(i, feed, stop), name=f"input {i}", daemon=True) for i, feed in inputs]

    def put(self, formed: Formed, feed: Feed) -> None:
        """Queue a scan; where the queue is full, drop the oldest, or wait, as the config says; who is answered waits."""
        full = self.service.parts.service.full
        answered = any(stream in self.numbers.replies for stream, *_ in formed.acknowledge)
        wait = full == "wait" or (not feed.input.datagrams and (full is None or answered))
        for dropped in self.scans.put(formed, wait=wait):
            self.drop(dropped)

    def drop(self, formed: Formed) -> None:
        """Count and tell a scan that is not taken, as the tracker is behind."""
        self.counters.add("scans_dropped_total")
        self.counters.add("messages_dropped_total", formed.messages)
        self.numbers.drop(formed.acknowledge)
        self.leave_out(formed, "dropped")
        self.ails["tracker"] = "it is behind, and scans are dropped"
        self.log.warn("scan dropped", f"time {formed.scan.time:.6f}: the tracker is behind", "")

    def leave_out(self, formed: Formed, why: str) -> None:
        """Let the record tell of a scan that was not taken."""
        if self.service.parts.service.record:
            self.left_out.append((formed, why))

    def tell(self, *, last: bool = False) -> None:
        """Let the log tell what it has left out, once it is time to."""
        for log in (self.log, *self.logs):
            log.tell(last=last)
        self._tell_silent()

    def _tell_silent(self) -> None:
        """Let the health tell of a sensor that comes no more, though we waited for nothing else meanwhile."""
        for i, sensor, told in self.rhythms.silences(bool(self.scans.items)):
            name = f"sensor {sensor!r} of input {i}"
            if not told:
                self.ails.pop(name, None)
                continue
            if name not in self.ails:
                LOG.warning("sensor silent", extra={"input": i, "sensor": sensor, "why": told})
            self.ails[name] = told

    def due(self) -> list[Formed]:
        """Return the scans that silence completes."""
        return [formed for due in self.of_groupers(lambda grouper: grouper.due(now())) for formed in due]

    def of_groupers(self, asked: Callable[[Grouper], Any]) -> list[Any]:
        """Return what each grouper answers while its input waits."""
        answers = list[Any]()
        for grouper, lock in zip(self.groupers, self.locks, strict=True):
            with lock:
                answers.append(asked(grouper))
        return answers

    def _listen(self, i: int, feed: Feed, stop: Event) -> None:
        """Decode and group what an input brings, until it ends."""
        memories = dict[str, Any]()
        try:
            self.readings[i].begin()
            kept = self.readings[i].kept
            for arrival in feed.input.listen(stop) if kept is None else feed.input.go_on(stop, kept[0]):
                self._arrived(i, feed, memories, arrival)
        except VedetteError as error:
            self._fail(i, f"!inputs[{i}]: {error}")
            LOG.error("input failed", extra={"input": i, "why": str(error)})
        except Exception as error:  # a plugin's: one input must not end the others
            self._fail(i, f"!inputs[{i}]: {type(error).__name__}: {error}")
            LOG.exception("input failed", extra={"input": i})
        for name, memory in memories.items():
            left = feed.format.end(memory)
            if stop.is_set():  # the rest of a message that we did not wait for is no fault of it
                left = evolve(left, refused=())
            self._messages(i, feed, left, Arrival(b"", now(), name))
        with self.locks[i]:
            rest = list(self.groupers[i].due())
        for formed in rest:
            self.put(formed, feed)

    def _fail(self, i: int, told: str) -> None:
        """Let the health tell of an input by which nothing can come, for now or, after "!", for good."""
        self.ails[f"input {i}"] = told
        self.counters.tell("input_well", str(i), 0.0)

    def _arrived(self, i: int, feed: Feed, memories: dict[str, Any], arrival: Arrival) -> None:
        reading = self.readings[i]
        reading.placed |= arrival.place is not None
        if arrival.lost is not None:
            self.counters.values["datagrams_lost_known"] = 1.0
            self.counters.add("datagrams_lost_total", arrival.lost)
        if arrival.unwell:
            self._fail(i, arrival.unwell)
            self.logs[i].warn("input waits", arrival.unwell, arrival.stream)
        elif self.ails.pop(f"input {i}", None):
            self.counters.tell("input_well", str(i), 1.0)
        if arrival.unwell or not (arrival.data or arrival.ended or reading.placed or feed.input.datagrams):
            return
        self.counters.add("pieces_total")
        whole = feed.input.datagrams
        memory = feed.format.start() if whole else memories.get(arrival.stream, feed.format.start())
        decoded = feed.format.decode(memory, arrival.data)
        self._messages(i, feed, decoded, arrival)
        if whole or arrival.ended:
            memories.pop(arrival.stream, None)
            self._messages(i, feed, feed.format.end(decoded.memory), arrival)
        else:
            memories[arrival.stream] = decoded.memory
        if arrival.ended:
            reading.begin(anew=True)
        elif arrival.place is not None and decoded.memory == feed.format.start() and self.service.parts.service.store:
            reading.mark(arrival.place)
        if arrival.ended:
            self.numbers.end(f"{i} {arrival.stream}", arrival.reply)

    def _messages(self, i: int, feed: Feed, decoded: Decoded, arrival: Arrival) -> None:
        """Group messages, and count what cannot be used."""
        count = len(decoded.messages) + len(decoded.refused)
        self.counters.add("messages_total", count)
        self.counters.tell("input_messages_total", str(i), count, more=True)
        for message in decoded.messages:
            self._message(i, feed, message, arrival)
        for told in decoded.refused:
            self._refuse(i, told, arrival)
            if arrival.reply is not None:
                self.numbers.refuse_line(f"{i} {arrival.stream}", told)

    def _message(self, i: int, feed: Feed, message: Message, arrival: Arrival) -> None:
        """Group a message, unless it came before, and queue the scans that it completes."""
        number = self._number(i, message, arrival)
        if number is not None and self._came(i, feed, message, number, arrival):
            return
        try:
            with self.locks[i]:
                numbered = message if number is None or number[2] == message.number else evolve(message, number=number[2])
                done = list(self.groupers[i].add(numbered, arrival.time, f"{i} {arrival.stream}"))
        except ValueError as error:
            self._refuse(i, str(error), arrival)
            if number is not None and self.readings[i].placed:
                self.numbers.mark(number)
                self.numbers.note(number)
            elif number is not None:
                self.numbers.refuse(number, str(error))
            self._hear(i, message.sensor, arrival)
            return
        if number is not None:
            if message.marker and done:
                done[-1] = evolve(done[-1], acknowledge=(*done[-1].acknowledge, number))
            elif message.marker:
                self.numbers.mark(number)
            self.numbers.note(number)
            self.ails.pop(f"numbers of {message.sensor!r}", None)
        self._hear(i, message.sensor, arrival)
        self._feel(i, message, arrival.time)
        if message.marker:
            self.counters.add("messages_taken_total")
        for formed in done:
            self.put(formed, feed)

    def _number(self, i: int, message: Message, arrival: Arrival) -> Number | None:
        """Return the number of a message, by its place in a file or its sender's, which is answered; None if it has none."""
        stream, sensor, number = f"{i} {arrival.stream}", message.sensor, message.number
        if self.readings[i].placed and self._is_known(i, sensor):
            number = self.readings[i].next_number(sensor)
        elif number is not None:
            number += self.numbers.raised(stream, sensor)
        if number is not None and arrival.reply is not None:
            self.numbers.begin(stream, arrival.reply)
        return None if number is None else (stream, sensor, number)

    def _came(self, i: int, feed: Feed, message: Message, number: Number, arrival: Arrival) -> bool:
        """Return whether a message came before, by its number, or is refused, as this does not rise with its time.

        A row of these that come as from a clock that was set back is of a sender that counts anew: those that counted as
        come before are taken after all.
        """
        placed, last, key, told = self.readings[i].placed, self.numbers.last(number), (i, message.sensor), ""
        if number[2] > last:
            self._again.forget(key)
            return False
        if not placed and self._is_new(i, message):
            told = f"n: must rise, got {message.number} after {last - self.numbers.raised(*number[:2])}, with a later time"
            self.ails[f"numbers of {message.sensor!r}"] = told
            self._refuse(i, told, arrival)
            self.numbers.refuse((*number[:2], -1), told)
        elif (placed or not message.refused) and self.numbers.came(number):
            self.counters.add("messages_repeated_total")
            self.counters.add("messages_taken_total")
        else:
            return False
        if not placed and (held := self._again.add(key, message, arrival, kept=not told)) is not None:
            self._count_anew(i, feed, number, held)
        return True

    def _count_anew(self, i: int, feed: Feed, number: Number, held: Iterable[tuple[Message, Arrival]]) -> None:
        """Take the messages of a sender that counts anew: its clock may be another one, too."""
        stream, sensor, _ = number
        LOG.warning("a sender counts anew", extra={"input": i, "sensor": sensor, "after": self.numbers.last(number)})
        self.numbers.count_anew(stream, sensor)
        with self.locks[i]:
            self.groupers[i].clocks.pop(sensor, None)
        for message, arrival in held:
            self._messages(i, feed, Decoded(None, [message]), arrival)

    def _feel(self, i: int, message: Message, came: float) -> None:
        """Feel the rhythm of a sensor that names no objects."""
        if message.identity is None:
            latest = self.groupers[i].clocks[message.sensor].latest
            self.rhythms.hear(i, message.sensor, came if latest is None else latest, came, len(message.z))

    def _hear(self, i: int, sensor: str, arrival: Arrival) -> None:
        """Let the health, and once the log, tell of a clock that stands still or is not in s."""
        clock, name = self.groupers[i].clocks.get(sensor), f"clock of {sensor!r}"
        if told := "" if clock is None else clock.ailment(arrival.time):
            if name not in self.ails:
                self.logs[i].warn("clock", f"{sensor!r}: {told}", arrival.stream)
            self.ails[name] = told
        else:
            self.ails.pop(name, None)

    def _is_known(self, i: int, sensor: str) -> bool:
        """Return whether a sensor in a stream is one of the tracker's: others may have very many names."""
        with suppress(ValueError):
            return bool(self.groupers[i].placing.sensor(sensor))
        return False

    def _is_new(self, i: int, message: Message) -> bool:
        """Return whether a message is later than all that came of its sensor, so that it is none of them again."""
        clock = self.groupers[i].clocks.get(message.sensor)
        if clock is None or clock.by == "receiver" or clock.latest is None or message.time is None:
            return False
        return message.time > clock.latest  # not the last one, which may have come late

    def _refuse(self, i: int, told: str, arrival: Arrival) -> None:
        self.counters.add("messages_refused_total")
        self.logs[i].warn("message refused", told, arrival.stream)
