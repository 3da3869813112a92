"""The journal: every reader gets every scan in order, however slow it is, and nobody waits for it."""

from threading import Thread

from vedette_report.watching.journal import EVENT, Journal


def filled(records=10, scans=3, size=24, **options):
    journal = Journal(**options)
    for i in range(records):
        journal.add(bytes([i]) * size, scans)
    return journal


def test_a_reader_gets_all_records_in_their_order():
    journal = filled()
    taken = journal.after(0, 0.0)
    assert (taken.text, taken.next, taken.lost) == (b"".join(bytes([i]) * 24 for i in range(10)), 30, 0)
    assert journal.after(27, 0.0).text == b"\t" * 24
    assert journal.after(30, 0.0).text == b""


def test_a_reader_gets_no_more_at_once_than_an_event_and_goes_on_where_it_was():
    journal = filled(8, size=EVENT // 3)
    numbers = [0]
    while numbers[-1] < journal.count:
        taken = journal.after(numbers[-1], 0.0)
        assert len(taken.text) <= EVENT + EVENT // 3
        numbers.append(taken.next)
    assert numbers == [0, 12, 24] or numbers == [0, 9, 18, 24]


def test_beyond_its_bytes_the_oldest_go_and_the_reader_is_told_how_many():
    journal = filled(10, size=1000, most=4000)
    taken = journal.after(0, 0.0)
    assert (taken.lost, len(taken.text), taken.next) == (18, 4000, 30)
    assert journal.after(24, 0.0).lost == 0


def test_one_record_larger_than_all_is_kept():
    assert filled(2, size=5000, most=4000).after(3, 0.0).text == b"\x01" * 5000


def test_a_reader_that_waits_is_woken_by_the_next_record_and_by_the_end():
    journal, found = Journal(), []

    def read():
        number = 0
        while True:
            taken = journal.after(number, 30.0)
            found.append((taken.text, taken.ended))
            number = taken.next
            if taken.ended:
                return

    reader = Thread(target=read)
    reader.start()
    journal.add(b"x" * 24, 1)
    journal.end("interrupted")
    reader.join(10)
    assert not reader.is_alive()
    assert b"".join(text for text, _ in found) == b"x" * 24
    assert found[-1][1] == "interrupted"


def test_the_end_is_told_only_once_all_is_read():
    journal = filled(4, size=EVENT)
    journal.end("ended")
    assert journal.after(0, 0.0).ended is None
    assert journal.after(9, 0.0).ended == "ended"
