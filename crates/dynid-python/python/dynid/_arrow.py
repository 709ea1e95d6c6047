"""Tables of other libraries through Arrow's C interface: what offers `__arrow_c_stream__` is read without any library beside NumPy."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray


class _Schema(ctypes.Structure):
    pass


class _Array(ctypes.Structure):
    pass


class _Stream(ctypes.Structure):
    pass


_Schema._fields_ = [
    ("format", ctypes.c_char_p),
    ("name", ctypes.c_char_p),
    ("metadata", ctypes.c_char_p),
    ("flags", ctypes.c_int64),
    ("n_children", ctypes.c_int64),
    ("children", ctypes.POINTER(ctypes.POINTER(_Schema))),
    ("dictionary", ctypes.POINTER(_Schema)),
    ("release", ctypes.CFUNCTYPE(None, ctypes.POINTER(_Schema))),
    ("private_data", ctypes.c_void_p),
]
_Array._fields_ = [
    ("length", ctypes.c_int64),
    ("null_count", ctypes.c_int64),
    ("offset", ctypes.c_int64),
    ("n_buffers", ctypes.c_int64),
    ("n_children", ctypes.c_int64),
    ("buffers", ctypes.POINTER(ctypes.c_void_p)),
    ("children", ctypes.POINTER(ctypes.POINTER(_Array))),
    ("dictionary", ctypes.POINTER(_Array)),
    ("release", ctypes.CFUNCTYPE(None, ctypes.POINTER(_Array))),
    ("private_data", ctypes.c_void_p),
]
_Stream._fields_ = [
    ("get_schema", ctypes.CFUNCTYPE(ctypes.c_int, ctypes.POINTER(_Stream), ctypes.POINTER(_Schema))),
    ("get_next", ctypes.CFUNCTYPE(ctypes.c_int, ctypes.POINTER(_Stream), ctypes.POINTER(_Array))),
    ("get_last_error", ctypes.CFUNCTYPE(ctypes.c_char_p, ctypes.POINTER(_Stream))),
    ("release", ctypes.CFUNCTYPE(None, ctypes.POINTER(_Stream))),
    ("private_data", ctypes.c_void_p),
]

_TYPES = {"g": "f8", "f": "f4", "e": "f2", "l": "i8", "L": "u8", "i": "i4", "I": "u4", "s": "i2", "S": "u2", "c": "i1", "C": "u1"}


def columns(table: Any) -> dict[str, NDArray[np.float64]]:
    """The columns of a table by name, NaN where there is no value.

    Raises `TypeError` for a column that holds no numbers.
    """
    get = ctypes.pythonapi.PyCapsule_GetPointer
    get.restype, get.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    # The capsule owns the stream until it is released here; the capsule must not go before.
    capsule = table.__arrow_c_stream__()
    stream = _Stream.from_address(get(capsule, b"arrow_array_stream"))
    schema, parts = _Schema(), []

    def done(code: int) -> None:
        if code:
            said = stream.get_last_error(ctypes.byref(stream))
            raise ValueError(f"table: its stream fails: {said.decode(errors='replace') if said else f'error {code}'}")

    def released(what: Any) -> None:
        if what.release:
            what.release(ctypes.byref(what))

    try:
        done(stream.get_schema(ctypes.byref(stream), ctypes.byref(schema)))
        if schema.format != b"+s":
            raise TypeError("table: expected columns with names")
        names = [schema.children[k].contents.name.decode() for k in range(schema.n_children)]
        readers = [_reader(names[k], schema.children[k].contents) for k in range(schema.n_children)]
        while True:
            batch = _Array()
            done(stream.get_next(ctypes.byref(stream), ctypes.byref(batch)))
            if not batch.release:
                break
            try:
                if batch.null_count and batch.buffers[0]:
                    raise TypeError("table: expected rows that are there, found some that are null as a whole")
                parts.append([read(batch.children[k].contents, batch.offset, batch.length) for k, read in enumerate(readers)])
            finally:
                released(batch)
    finally:
        released(schema)
        released(stream)
    empty = [np.zeros(0)]
    return {name: np.concatenate([part[k] for part in parts] or empty) for k, name in enumerate(names)}


def _reader(name: str, schema: Any) -> Callable[[Any, int, int], NDArray[np.float64]]:
    """What copies a part of a column out: the array, the first row and their number."""
    kind = schema.format.decode()
    if schema.dictionary or kind not in _TYPES and kind != "b":
        raise TypeError(f"column `{name}`: expected numbers, found Arrow's format `{kind}`")

    def bits(address: int, first: int, count: int) -> NDArray[np.uint8]:
        whole = (ctypes.c_uint8 * ((first + count + 7) // 8)).from_address(address)
        return np.unpackbits(np.frombuffer(memoryview(whole), np.uint8), bitorder="little")[first : first + count]

    def read(array: Any, first: int, count: int) -> NDArray[np.float64]:
        if count == 0:
            return np.zeros(0)
        first += array.offset
        if kind == "b":
            out = bits(array.buffers[1], first, count).astype(np.float64)
        else:
            size = np.dtype(_TYPES[kind]).itemsize
            whole = (ctypes.c_char * ((first + count) * size)).from_address(array.buffers[1])
            out = np.frombuffer(memoryview(whole).cast("B"), _TYPES[kind])[first : first + count].astype(np.float64)
        if array.null_count and array.buffers[0]:
            out[bits(array.buffers[0], first, count) == 0] = np.nan
        return out

    return read
