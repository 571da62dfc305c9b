"""Reader of classic NetCDF files with 64-bit offsets that trusts nothing in them.

Every length is checked against the bytes there are before anything is read or allocated, so that the work and the
memory that a file can cost are bounded by its size. Only what this program writes is read: fixed dimensions, text,
variables in double precision. Format: Unidata, NetCDF Classic Format Specification.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vrsopt.surrogate.correlation import Array

MAGIC = b"CDF\x02"
DIMENSIONS, VARIABLES, ATTRIBUTES = 10, 11, 12
TEXT, DOUBLE = 2, 6
NUMBERS = {3: ">i2", 4: ">i4", 5: ">f4", DOUBLE: ">f8"}
MOST = 10_000  # dimensions, variables, attributes of one list: each
LONGEST_NAME, HIGHEST_RANK = 256, 8

Attributes = dict[str, str | float | Array]


class UnreadableError(ValueError):
    """The bytes are no classic NetCDF file that this program could have written."""


@dataclass(frozen=True)
class Variable:
    """``values`` as float64, with the names of their dimensions."""

    dimensions: tuple[str, ...]
    attributes: Attributes
    values: Array


def read(content: bytes) -> tuple[Attributes, dict[str, Variable]]:
    """The attributes of the file and its variables by name; raises :class:`UnreadableError`.

    ``content``: of the file.
    """
    if content[:4] != MAGIC:
        raise UnreadableError("no NetCDF file of the classic format with 64-bit offsets")
    stream = _Stream(content, 4)
    if stream.integer() != 0:
        raise UnreadableError("it has records")
    dimensions = [(stream.name(), stream.count(len(content))) for _ in range(stream.list_of(DIMENSIONS))]
    attributes = stream.attributes()
    headers = []
    for _ in range(stream.list_of(VARIABLES)):
        name = stream.name()
        own = [stream.chosen(dimensions) for _ in range(stream.count(HIGHEST_RANK))]
        described = stream.attributes()
        kind, _, begin = stream.integer(), stream.integer(), stream.integer(">q")
        headers.append((name, own, described, kind, begin))
    variables: dict[str, Variable] = {}
    left = len(content)
    for name, own, described, kind, begin in headers:
        shape = tuple(length for _, length in own)
        if name in variables or kind != DOUBLE or 0 in shape:
            raise UnreadableError(f"variable {name}: there twice, empty or not in double precision")
        # Variables that share bytes could make much memory of a small file.
        left -= 8 * math.prod(shape)
        if left < 0:
            raise UnreadableError(f"variable {name}: longer than the file")
        values = _Stream(content, begin).numbers(kind, math.prod(shape)).reshape(shape)
        variables[name] = Variable(tuple(dimension for dimension, _ in own), described, values)
    return attributes, variables


class _Stream:
    def __init__(self, content: bytes, position: int) -> None:
        self.content, self.position = content, position

    def take(self, count: int) -> bytes:
        begin, end = self.position, self.position + count
        if not 0 <= begin <= end <= len(self.content):
            raise UnreadableError("it ends too early")
        self.position = end
        return self.content[begin:end]

    def padded(self, count: int) -> bytes:
        data = self.take(count)
        self.take(-count % 4)
        return data

    def integer(self, form: str = ">i") -> int:
        return int(struct.unpack(form, self.take(struct.calcsize(form)))[0])

    def count(self, most: int) -> int:
        value = self.integer()
        if not 0 <= value <= most:
            raise UnreadableError(f"a length of {value}: 0 to {most}")
        return value

    def list_of(self, kind: int) -> int:
        """Length of a list of this kind; an absent list is two zeros."""
        found, count = self.integer(), self.count(MOST)
        if found not in (0, kind) or (found == 0 and count > 0):
            raise UnreadableError(f"a list of kind {found} for {kind}")
        return count

    def text(self, count: int) -> str:
        try:
            text = self.padded(count).decode("ascii")
        except UnicodeDecodeError:
            raise UnreadableError("text that is not ASCII") from None
        if not text.isprintable():
            raise UnreadableError("text with control characters")
        return text

    def name(self) -> str:
        return self.text(self.count(LONGEST_NAME))

    def numbers(self, kind: int, count: int) -> Array:
        if kind not in NUMBERS:
            raise UnreadableError(f"a type {kind}: {', '.join(map(str, NUMBERS))}")
        form = np.dtype(NUMBERS[kind])
        data: NDArray[np.generic] = np.frombuffer(self.padded(count * form.itemsize), form)
        return data.astype(np.float64)

    def chosen(self, dimensions: list[tuple[str, int]]) -> tuple[str, int]:
        return dimensions[self.count(len(dimensions) - 1)]

    def attributes(self) -> Attributes:
        result: Attributes = {}
        for _ in range(self.list_of(ATTRIBUTES)):
            name, kind, count = self.name(), self.integer(), self.count(len(self.content))
            if name in result:
                raise UnreadableError(f"attribute {name}: there twice")
            if kind == TEXT:
                result[name] = self.text(count)
            else:
                values = self.numbers(kind, count)
                result[name] = float(values[0]) if count == 1 else values
        return result
