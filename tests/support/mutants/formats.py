"""Formats with one thing wrong."""

from attrs import define, evolve, field

from support.mutants.parts import CALLS
from vedette.streams import Decoded
from vedette_live.formats.json_lines import JsonLines

J = JsonLines


def careless(self, memory, data):
    decoded = J.decode(self, memory, data)
    data.decode()
    return decoded


def forgetful(self, memory, data):
    return evolve(J.decode(self, self.start(), data), memory=self.start())


def silent(self, memory, data):
    return evolve(J.decode(self, memory, data), refused=("",) * data.count(b"\xff"))


def counting(self, memory, data):
    decoded = J.decode(self, memory, data)
    return evolve(decoded, refused=(*decoded.refused, f"call {next(CALLS)}"))


def hoarding(self, memory, data):
    memory = (memory or b"") + data
    done, end, rest = memory.rpartition(b"\n")
    return evolve(J.decode(self, J.start(self), done + end), memory=rest)


@define
class Hidden:
    """A memory that holds what no parameter of its own is."""

    rest: bytes = field(init=False, default=b"")


def hiding(self, memory, data):
    decoded, kept = hoarding(self, memory.rest, data), Hidden()
    kept.rest = decoded.memory
    return evolve(decoded, memory=kept)


FORMATS = [
    ("refusals count the calls", J, "pure", {"decode": counting}),
    ("raises on bytes that are no text", J, "no_bytes_make_it_raise", {"decode": careless}),
    ("refuses in silence", J, "no_bytes_make_it_raise", {"decode": silent}),
    ("forgets half a line", J, "split_anywhere", {"decode": forgetful}),
    ("keeps a line that never ends", J, "its_memory_is_bounded",
     {"start": lambda s: b"", "decode": hoarding, "end": lambda s, memory: Decoded(b"", (), ())}),
    ("hides a line that never ends", J, "its_memory_is_bounded",
     {"start": lambda s: Hidden(), "decode": hiding, "end": lambda s, memory: Decoded(memory, (), ())}),
    ("a sample that it refuses", J, "its_sample_is_read", {"sample": lambda s: b"{}\n"}),
    ("says nothing of tracks", J, "writes_as_declared", {"encode": lambda s, report: b""}),
]  # fmt: skip
