"""Logs in files that the official packages write: read equal to what was written, and identified to the same bits as the CSV."""

from __future__ import annotations

import collections
import contextlib
import importlib
import io
import json
import os
import pickle
import sqlite3
import sys
import threading
import types
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import dynid
import numpy as np
import pytest
from numpy.typing import NDArray

NAMES = [f"j{k + 1}" for k in range(6)]
# Nanoseconds since 1970 that an f64 cannot hold.
START = 1_700_000_000_000_000_123
STEP = 5_000_000


@pytest.fixture(scope="module")
def signals(made: dynid.Simulation) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    count = 1200
    return np.arange(count) * STEP / 1e9, made.q[:count], made.tau[:count]


Signals = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]


def result(robot: dynid.Robot, path: Path | str, **columns: Any) -> str:
    """What an identification found, without the name of the file."""
    found = json.loads(dynid.identify(robot, dynid.Log.read(path, columns=columns, name="log")).to_json())
    return json.dumps([found[key] for key in ("parameters", "base_parameters", "fit")])


@pytest.fixture(scope="module")
def of_csv(indy7: dynid.Robot, signals: Signals, tmp_path_factory: pytest.TempPathFactory) -> str:
    t, q, tau = signals
    path = tmp_path_factory.mktemp("csv") / "log.csv"
    header = ",".join(["t", *(f"q_{n}" for n in NAMES), *(f"tau_{n}" for n in NAMES)])
    lines = [",".join(repr(float(x)) for x in row) for row in np.column_stack([t, q, tau])]
    path.write_text("\n".join([header, *lines]) + "\n")
    return result(indy7, path)


def check(robot: dynid.Robot, path: Path | str, signals: Signals, of_csv: str | None, **columns: Any) -> None:
    """The signals are those that were written; so is the estimate, where one is asked for."""
    t, q, tau = signals
    read = dynid.read_columns(path, robot, columns=columns)
    np.testing.assert_array_equal(read["t"], t)
    for k, name in enumerate(NAMES):
        np.testing.assert_array_equal(read[f"q_{name}"], q[:, k])
        np.testing.assert_array_equal(read[f"tau_{name}"], tau[:, k])
    if of_csv is not None:
        assert result(robot, path, **columns) == of_csv


def test_numpy(indy7: dynid.Robot, signals: Signals, of_csv: str, tmp_path: Path) -> None:
    t, q, tau = signals
    np.savez(tmp_path / "a.npz", t=t, q=q, tau=tau)
    np.savez_compressed(tmp_path / "b.npz", t=t, q=np.asfortranarray(q), tau=tau.T, texts=np.array(["x"] * len(t)), limits=np.zeros(6))
    check(indy7, tmp_path / "a.npz", signals, of_csv)
    check(indy7, tmp_path / "b.npz", signals, None)
    np.save(tmp_path / "c.npy", np.column_stack([t, q, tau]))
    check(indy7, tmp_path / "c.npy", signals, None, names=["t", *(f"q{k}" for k in range(1, 7)), *(f"tau{k}" for k in range(1, 7))])
    np.savez(tmp_path / "big.npz", t=t.astype(">f8"), q=q.astype(">f8"), tau=tau)
    check(indy7, tmp_path / "big.npz", signals, None)
    np.savez(tmp_path / "objects.npz", t=t, q=np.array([None] * len(t)))
    with pytest.raises(dynid.LogError, match="objects"):
        dynid.read_columns(tmp_path / "objects.npz")


def test_types_of_numpy(tmp_path: Path) -> None:
    kinds = ["f2", "f4", "f8", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", ">i4", ">f4", "?"]
    rng = np.random.default_rng(3)
    arrays = {f"x{k}": rng.integers(0, 100, 50).astype(kind) for k, kind in enumerate(kinds)}
    np.savez(tmp_path / "kinds.npz", **arrays)  # type: ignore[arg-type]
    read = dynid.read_columns(tmp_path / "kinds.npz")
    for name, values in arrays.items():
        np.testing.assert_array_equal(read[name], values.astype(float))


def write_torch(path: Path, tensors: dict[str, NDArray[Any]]) -> None:
    """Writes tensors as `torch.save` does, which pickles names of functions that put them together; modules stand in for those of PyTorch."""
    torch, utils = types.ModuleType("torch"), types.ModuleType("torch._utils")

    def _rebuild_tensor_v2() -> None: ...

    _rebuild_tensor_v2.__module__, _rebuild_tensor_v2.__qualname__ = "torch._utils", "_rebuild_tensor_v2"
    utils._rebuild_tensor_v2 = _rebuild_tensor_v2  # type: ignore[attr-defined]
    kinds = {"f4": "FloatStorage", "f8": "DoubleStorage", "i8": "LongStorage"}
    for name in kinds.values():
        setattr(torch, name, type(name, (), {"__module__": "torch", "__qualname__": name}))

    class Storage:
        def __init__(self, key: int, values: NDArray[Any]) -> None:
            self.id = ("storage", getattr(torch, kinds[values.dtype.str[1:]]), str(key), "cpu", values.size)

    class Tensor:
        def __init__(self, storage: Storage, values: NDArray[Any]) -> None:
            self.parts: tuple[Any, ...] = (
                storage,
                0,
                values.shape,
                tuple(s // values.itemsize for s in values.strides),
                False,
                collections.OrderedDict(),
            )

        def __reduce__(self) -> Any:
            return _rebuild_tensor_v2, self.parts

    class Pickler(pickle.Pickler):
        def persistent_id(self, value: Any) -> Any:
            return value.id if isinstance(value, Storage) else None

    modules = {"torch": torch, "torch._utils": utils}
    sys.modules.update(modules)
    try:
        buffer = io.BytesIO()
        made = {name: Tensor(Storage(key, values), values) for key, (name, values) in enumerate(tensors.items())}
        Pickler(buffer, protocol=2).dump({**made, "note": "x", "rate": 200.0, "nested": {"more": [1, 2]}})
    finally:
        for name in modules:
            del sys.modules[name]
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as file:
        file.writestr("archive/data.pkl", buffer.getvalue())
        file.writestr("archive/byteorder", "little")
        for key, values in enumerate(tensors.values()):
            # Numbers as they lie: of a turned array, turned.
            file.writestr(f"archive/data/{key}", values.tobytes(order="A"))


def test_torch(indy7: dynid.Robot, signals: Signals, tmp_path: Path) -> None:
    t, q, tau = signals
    write_torch(tmp_path / "a.pt", {"time": t, "dof_pos": q, "torque": np.asfortranarray(tau), "step": np.arange(len(t))})
    columns = {"position": "dof_pos", "effort": "torque"}
    check(indy7, tmp_path / "a.pt", signals, None, **columns)
    np.testing.assert_array_equal(dynid.read_columns(tmp_path / "a.pt")["step"], np.arange(len(t)))
    write_torch(tmp_path / "b.pt", {"time": t.astype("f4"), "dof_pos": q.astype("f4")})
    np.testing.assert_array_equal(dynid.read_columns(tmp_path / "b.pt")["dof_pos[3]"], q[:, 3].astype("f4"))


@pytest.mark.parametrize("compressed", [False, True])
def test_matlab(indy7: dynid.Robot, signals: Signals, of_csv: str, tmp_path: Path, compressed: bool) -> None:
    scipy_io = pytest.importorskip("scipy.io")
    t, q, tau = signals
    path = tmp_path / "log.mat"
    scipy_io.savemat(path, {"t": t, "q": q, "tau": tau, "whole": np.arange(len(t))}, do_compression=compressed)
    check(indy7, path, signals, of_csv if compressed else None)
    np.testing.assert_array_equal(dynid.read_columns(path)["whole"], np.arange(len(t)))
    scipy_io.savemat(path, {"data": {"t": t, "q": q, "tau": tau, "name": "arm"}, "rate": 200.0}, do_compression=compressed)
    check(indy7, path, signals, None)


def test_hdf5(indy7: dynid.Robot, signals: Signals, of_csv: str, tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    t, q, tau = signals
    ways: list[dict[str, Any]] = [{}, {"compression": "gzip"}, {"compression": "lzf"}, {"compression": "gzip", "shuffle": True, "chunks": True}]
    for k, settings in enumerate(ways):
        path = tmp_path / f"{k}.h5"
        with h5py.File(path, "w") as file:
            for name, values in [("t", t), ("q", q), ("tau", tau)]:
                file.create_dataset(f"log/{name}", data=values, **settings)
        check(indy7, path, signals, of_csv if k == 1 else None)
    # MATLAB 7.3 has a block of its own in front, and axes turned.
    with h5py.File(tmp_path / "v73.mat", "w", userblock_size=512) as file:
        for name, values in [("t", t[None, :]), ("q", q.T), ("tau", tau.T)]:
            file[name] = values
    with open(tmp_path / "v73.mat", "r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    check(indy7, tmp_path / "v73.mat", signals, None)


def test_groups_of_hdf5(indy7: dynid.Robot, signals: Signals, tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    t, q, tau = signals
    path = tmp_path / "demos.hdf5"
    with h5py.File(path, "w") as file:
        for demo in range(3):
            group = file.create_group(f"data/demo_{demo}")
            for name, values in [("t", t), ("obs/q", q + demo), ("obs/tau", tau)]:
                group[name] = values
    check(indy7, f"{path}#data/demo_2", (t, q + 2, tau), None)
    with pytest.raises(dynid.LogError, match="data/demo_0, data/demo_1, data/demo_2"):
        dynid.read_columns(path)
    assert dynid.find_logs(f"{path}#data/*") == [f"{path}#data/demo_{demo}" for demo in range(3)]
    assert dynid.find_logs(f"{tmp_path}/*.hdf5#*[12]") == [f"{path}#data/demo_{demo}" for demo in (1, 2)]
    with pytest.raises(dynid.LogError, match="expected logs in"):
        dynid.find_logs(f"{path}#other*")
    # Groups of joints are one log.
    with h5py.File(tmp_path / "joints.h5", "w") as file:
        file["t"] = t
        for k, name in enumerate(NAMES):
            file[f"{name}/q"], file[f"{name}/tau"] = q[:, k], tau[:, k]
    check(indy7, tmp_path / "joints.h5", signals, None)
    # Of different lengths they are logs, unless it is said that they are not.
    with h5py.File(tmp_path / "parts.h5", "w") as file:
        for part in range(2):
            for name, values in [("t", t), ("q", q), ("tau", tau)]:
                file[f"part{part}/{name}"] = values[: len(t) - part]
    with pytest.raises(dynid.LogError, match="part0, part1"):
        dynid.read_columns(tmp_path / "parts.h5")
    check(indy7, f"{tmp_path / 'parts.h5'}#part0", signals, None)
    assert "part0/t" in dynid.read_columns(f"{tmp_path / 'parts.h5'}#/")


def test_parquet(indy7: dynid.Robot, signals: Signals, of_csv: str, tmp_path: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    pq = pytest.importorskip("pyarrow.parquet")
    t, q, tau = signals
    lists = pa.table({"t": t, "q": pa.array(list(q)), "tau": pa.FixedSizeListArray.from_arrays(tau.ravel(), 6), "text": ["x"] * len(t)})
    wide = pa.table({"t": t, **{f"q_{n}": q[:, k] for k, n in enumerate(NAMES)}, **{f"tau_{n}": tau[:, k] for k, n in enumerate(NAMES)}})
    for k, (table, settings) in enumerate(
        [
            *((lists, {"compression": name, "row_group_size": 500}) for name in ["none", "snappy", "gzip", "lz4", "zstd"]),
            (wide, {}),
            (lists, {"data_page_version": "2.0", "compression": "zstd", "data_page_size": 4096}),
            (wide, {"data_page_version": "2.0", "use_dictionary": False, "use_byte_stream_split": True}),
            (wide, {"version": "1.0", "write_statistics": True, "write_page_index": True}),
        ]
    ):
        pq.write_table(table, tmp_path / f"{k}.parquet", **settings)
        check(indy7, tmp_path / f"{k}.parquet", signals, of_csv if k == 4 else None)
    holes = pa.table({"t": t, "q": pa.array([None if k == 7 else list(row) for k, row in enumerate(q)]), "tau": pa.array(list(tau))})
    pq.write_table(holes, tmp_path / "holes.parquet")
    with pytest.raises(dynid.LogError, match=r"row 8, column `q\[0\]`: expected a value"):
        dynid.read_columns(tmp_path / "holes.parquet")
    read = dynid.read_columns(tmp_path / "holes.parquet", columns={"missing": "drop"})
    assert np.isnan(read["q[0]"][7]) and np.isnan(read["q[0]"]).sum() == 1


def test_arrow(indy7: dynid.Robot, signals: Signals, of_csv: str, tmp_path: Path) -> None:
    """Files of Feather and streams, as they are and compressed, in batches of any size."""
    pa = pytest.importorskip("pyarrow")
    feather = pytest.importorskip("pyarrow.feather")
    t, q, tau = signals
    lists = pa.table({"text": ["x", None] * (len(t) // 2), "t": t, "q": pa.array(list(q)), "tau": pa.FixedSizeListArray.from_arrays(tau.ravel(), 6)})
    wide = pa.table({"t": t, **{f"q_{n}": q[:, k] for k, n in enumerate(NAMES)}, **{f"tau_{n}": tau[:, k] for k, n in enumerate(NAMES)}})
    labels = pa.array(["a", "b"] * (len(t) // 2)).dictionary_encode()
    nested = pa.table(
        {
            "nothing": pa.nulls(len(t)),
            "label": labels,
            "images": pa.array([[[1.0, 2.0], [3.0]]] * len(t)),
            "t": t,
            "state": pa.StructArray.from_arrays([pa.array(["y"] * len(t)), pa.array(list(q), pa.large_list(pa.float64()))], ["mode", "q"]),
            "tau": pa.FixedSizeListArray.from_arrays(tau.ravel(), 6),
        }
    )
    cases: list[tuple[Any, dict[str, Any]]] = [
        (wide, {"compression": "lz4"}),
        (wide, {"compression": "zstd", "chunksize": 77}),
        (lists, {"compression": "uncompressed", "chunksize": 500}),
        (lists, {"compression": "lz4", "chunksize": 1}),
        (nested, {"compression": "zstd"}),
    ]
    for k, (table, settings) in enumerate(cases):
        path = tmp_path / f"{k}.feather"
        feather.write_feather(table, path, **settings)
        check(indy7, path, signals, of_csv if k == 1 else None, **({"position": "state/q[{}]"} if table is nested else {}))
    for k, options in enumerate([{}, {"compression": "zstd"}, {"compression": "lz4"}]):
        path = tmp_path / f"{k}.arrows"
        with pa.OSFile(str(path), "wb") as sink, pa.ipc.new_stream(sink, lists.schema, options=pa.ipc.IpcWriteOptions(**options)) as writer:
            writer.write_table(lists, max_chunksize=400)
        check(indy7, path, signals, of_csv if k == 0 else None)
        # Of a stream that was cut off the batches that are whole are read.
        (tmp_path / "cut.arrows").write_bytes(path.read_bytes()[: path.stat().st_size * 2 // 3])
        assert len(dynid.read_columns(tmp_path / "cut.arrows")["t"]) in (400, 800)
    # Texts as polars keeps them have another number of buffers in every batch.
    short, long = pa.array(["a"] * 1000, pa.string_view()), pa.array([f"text {k} of more than twelve letters" for k in range(1000)], pa.string_view())
    many = len(t) // 1000 * 1000
    views = pa.table({"note": pa.chunked_array([long, short] * (many // 2000) + [long] * (many // 1000 % 2)), "t": t[:many], "more": pa.chunked_array([short] * (many // 1000)), "q": pa.array(list(q[:many])), "tau": pa.array(list(tau[:many]))})
    feather.write_feather(views, tmp_path / "views.feather", chunksize=1000)
    check(indy7, tmp_path / "views.feather", (t[:many], q[:many], tau[:many]), None)
    kinds = {
        "i8": pa.array([1, None, -3], pa.int8()),
        "u16": pa.array([1, 2, 65535], pa.uint16()),
        "half": pa.array(np.array([1.5, 2, 3], np.float16)),
        "single": pa.array([0.1, None, 3], pa.float32()),
        "flag": pa.array([True, False, None]),
        "t": pa.array([START, START + 5, START + 9], pa.timestamp("ns")),
        "date": pa.array([1, 2, 3], pa.date32()),
    }
    for slice_ in (slice(0, 3), slice(1, 3)):
        table = pa.table(kinds).slice(slice_.start, 3 - slice_.start)
        feather.write_feather(table, tmp_path / "kinds.feather")
        read = dynid.read_columns(tmp_path / "kinds.feather", columns={"missing": "drop"})
        np.testing.assert_array_equal(read["i8"], [1, np.nan, -3][slice_])
        np.testing.assert_array_equal(read["u16"], [1, 2, 65535][slice_])
        np.testing.assert_array_equal(read["half"], [1.5, 2, 3][slice_])
        np.testing.assert_array_equal(read["single"], np.array([0.1, np.nan, 3], np.float32)[slice_].astype(float))
        np.testing.assert_array_equal(read["flag"], [1, 0, np.nan][slice_])
        np.testing.assert_array_equal(read["date"], [1, 2, 3][slice_])
        np.testing.assert_array_equal(read["t"], [START, START + 5, START + 9][slice_])
    (tmp_path / "old.feather").write_bytes(b"FEA1" + bytes(100))
    with pytest.raises(dynid.LogError, match="Feather of version 1"):
        dynid.read_columns(tmp_path / "old.feather")


def test_long_tables_are_reduced_group_by_group(tmp_path: Path) -> None:
    """Groups of rows of Parquet and batches of Arrow give the numbers of the text, stamps of many digits too."""
    pa = pytest.importorskip("pyarrow")
    pq = pytest.importorskip("pyarrow.parquet")
    feather = pytest.importorskip("pyarrow.feather")
    arm = dynid.Robot.parse(dynid.examples.TWO_LINKS, "arm.toml")
    made = dynid.simulate(arm, duration_s=200, rate_hz=1000, seed=4)
    names = arm.joints
    stamps = START + np.arange(len(made.q)) * 1_000_000
    columns = {"t": stamps, **{f"q_{n}": made.q[:, k] for k, n in enumerate(names)}, **{f"tau_{n}": made.tau[:, k] for k, n in enumerate(names)}}
    table = pa.table(columns)
    importlib.import_module("pyarrow.csv").write_csv(table, tmp_path / "log.csv")
    pq.write_table(table, tmp_path / "log.parquet", row_group_size=30_000)
    pq.write_table(table, tmp_path / "one.parquet", row_group_size=200_000, compression="zstd")
    feather.write_feather(table, tmp_path / "log.feather", chunksize=7_000)
    dynid_command = dynid._native.command_line
    (tmp_path / "arm.toml").write_text(dynid.examples.TWO_LINKS)
    (tmp_path / "run.toml").write_text('robot = "arm.toml"\n[[log]]\npath = "log.csv"\nrows = [1, 60000]\n')
    recipe = tmp_path / "type.factors"
    assert dynid_command(["dynid", "reduce", str(tmp_path / "run.toml"), "--out", str(recipe), "--quiet"]) == 0

    def found(name: str) -> bytes:
        """The triangles of a factor file: what stands behind its description, which names the file, and before its digest."""
        made = dynid.reduce_log(tmp_path / name, recipe, robot="r", name="log")
        assert made.startswith(b"dynid factors 1\n"), made[:500]
        behind = 24 + int.from_bytes(made[16:24], "little")
        assert f'"samples":{count}' in made[24:behind].decode().replace(" ", "")
        return made[behind:-32]

    count = len(stamps)

    expected = found("log.csv")
    assert len(expected) > 1000
    # A bag of one topic is read message by message.
    convert = ["dynid", "convert", str(tmp_path / "log.csv"), str(tmp_path / "log.mcap"), "--robot", str(tmp_path / "arm.toml"), "--quiet"]
    assert dynid_command(convert) == 0
    for name in ("log.parquet", "one.parquet", "log.feather", "log.mcap"):
        assert found(name) == expected, name
    # One message that cannot be taken apart is a row less, and is told.
    broken = 150_000
    with open(tmp_path / "log.mcap", "rb") as bag, open(tmp_path / "broken.mcap", "wb") as file:
        copy = pytest.importorskip("mcap.writer").Writer(file)
        copy.start()
        for k, (schema, channel, message) in enumerate(pytest.importorskip("mcap.reader").make_reader(bag).iter_messages()):
            if k == 0:
                own = copy.register_channel(channel.topic, channel.message_encoding, copy.register_schema(schema.name, schema.encoding, schema.data))
            data = message.data[:20] if k == broken else message.data
            copy.add_message(own, message.log_time, data, message.publish_time)
        copy.finish()
    lines = (tmp_path / "log.csv").read_text().splitlines(keepends=True)
    (tmp_path / "less.csv").write_text("".join(lines[: broken + 1] + lines[broken + 2 :]))
    # The clock fills the gap.
    assert found("broken.mcap") == found("less.csv")
    told = dynid.identify(arm, dynid.Log.read(tmp_path / "broken.mcap"))
    assert "broken messages: 1: they were left out" in told.to_json(), told


def test_episodes_of_lerobot(indy7: dynid.Robot, signals: Signals, tmp_path: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    pq = pytest.importorskip("pyarrow.parquet")
    t, q, tau = signals
    count = len(t)

    def episode(number: int) -> Any:
        return pa.table(
            {
                "observation.state": pa.array(list(q + number)),
                "action": pa.array(list(q)),
                "observation.effort": pa.array(list(tau)),
                "timestamp": t,
                "episode_index": np.full(count, number),
            }
        )

    data = tmp_path / "data" / "chunk-000"
    data.mkdir(parents=True)
    (tmp_path / "meta").mkdir()
    names = {"motors": [f"{name}.pos" for name in NAMES]}
    info = {"robot_type": "indy7", "features": {"observation.state": {"names": names}, "action": {"names": names}}}
    (tmp_path / "meta" / "info.json").write_text(json.dumps(info))
    # Version 3: several episodes in a file.
    pq.write_table(pa.concat_tables([episode(k) for k in range(3)]), data / "file-000.parquet", row_group_size=1000)
    check(indy7, f"{tmp_path}#1", (t, q + 1, tau), None)
    check(indy7, f"{data / 'file-000.parquet'}#2", (t, q + 2, tau), None)
    with pytest.raises(dynid.LogError, match="episodes 0, 1, 2"):
        dynid.read_columns(data / "file-000.parquet")
    # Version 2: a file each.
    (data / "file-000.parquet").unlink()
    for k in range(3):
        pq.write_table(episode(k), data / f"episode_{k:06d}.parquet")
    check(indy7, f"{tmp_path}#2", (t, q + 2, tau), None)


def stamp(ns: int) -> dict[str, int]:
    return {"sec": ns // 10**9, "nanosec": ns % 10**9}


TIME = "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec"
HEADER = "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id"
BAR = "\n" + "=" * 80 + "\n"
JOINT_STATE = "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort" + BAR + HEADER + BAR + TIME


def write_mcap(path: Path, signals: Signals, compression: Any, write: Callable[[Any, Any, int], None]) -> None:
    writer = pytest.importorskip("mcap_ros2.writer")
    with open(path, "wb") as file:
        mcap = writer.Writer(file, compression=compression, chunk_size=50_000)
        schema = mcap.register_msgdef("sensor_msgs/msg/JointState", JOINT_STATE)
        for row in range(len(signals[0])):
            write(mcap, schema, row)
        mcap.finish()


@pytest.mark.parametrize("compression", ["NONE", "LZ4", "ZSTD"])
def test_mcap(indy7: dynid.Robot, signals: Signals, of_csv: str, tmp_path: Path, compression: str) -> None:
    kinds = pytest.importorskip("mcap.writer").CompressionType
    _, q, tau = signals
    order = [2, 0, 1, 5, 4, 3]
    late = np.random.default_rng(1).integers(0, 2_000_000, len(q))

    def write(mcap: Any, schema: Any, row: int) -> None:
        ns = START + STEP * row
        message = {
            "header": {"stamp": stamp(ns), "frame_id": "base"},
            "name": [NAMES[k] for k in order],
            "position": q[row, order].tolist(),
            "velocity": [],
            "effort": tau[row, order].tolist(),
        }
        mcap.write_message("/joint_states", schema, message, log_time=ns + 3_000_000 + int(late[row]), publish_time=ns)

    path = tmp_path / "log.mcap"
    write_mcap(path, signals, kinds[compression], write)
    # Stamps of headers are even, times of receipt are not.
    check(indy7, path, signals, of_csv if compression == "ZSTD" else None)
    raw = dynid.read_columns(path)
    np.testing.assert_array_equal(raw["header_stamp"], START + STEP * np.arange(len(q)))
    np.testing.assert_array_equal(raw["receive_time"], START + STEP * np.arange(len(q)) + 3_000_000 + late)
    received = dynid.read_columns(path, indy7, columns={"time": "receive_time"})
    np.testing.assert_allclose(received["t"], STEP * 1e-9 * np.arange(len(q)) + (late - late[0]) * 1e-9, atol=1e-12)
    # Whatever a bag is cut to is read up to the cut, or refused. `DYNID_CUTS`: a cut at every so many bytes.
    whole = path.read_bytes()
    for end in range(1000, len(whole), int(os.environ.get("DYNID_CUTS", max(1000, len(whole) // 40)))):
        (tmp_path / "cut.mcap").write_bytes(whole[:end])
        try:
            cut = dynid.read_columns(tmp_path / "cut.mcap", indy7)
        except dynid.LogError:
            assert end < 60_000
        else:
            np.testing.assert_array_equal(cut["q_j1"], q[: len(cut["t"]), 0])


def test_mcap_in_json(indy7: dynid.Robot, signals: Signals, of_csv: str, tmp_path: Path) -> None:
    """Messages without a definition that is read, as Foxglove's tools write them."""
    writer = pytest.importorskip("mcap.writer")
    _, q, tau = signals
    path = tmp_path / "log.mcap"
    with open(path, "wb") as file:
        mcap = writer.Writer(file, compression=writer.CompressionType.LZ4)
        mcap.start("x-test", library="test")
        schema = mcap.register_schema(name="JointState", encoding="jsonschema", data=b'{"type": "object"}')
        channel = mcap.register_channel(topic="/joint_states", message_encoding="json", schema_id=schema)
        for row in range(len(q)):
            ns = START + STEP * row
            message: dict[str, Any] = {
                "header": {"stamp": {"sec": ns // 10**9, "nsec": ns % 10**9}, "frame_id": "base"},
                "name": NAMES,
                "position": q[row].tolist(),
                "effort": tau[row].tolist(),
                "extra": {"gain": 1.5, "ok": True, "mixed": [1, "a"], "label": "x"},
            }
            if row % 3 == 1:
                message = {"a first key": 7, **message}
            mcap.add_message(channel_id=channel, log_time=ns, publish_time=ns, data=json.dumps(message).encode())
        mcap.finish()
    check(indy7, path, signals, of_csv)
    raw = dynid.read_columns(path, columns={"missing": "drop"})
    assert (raw["/joint_states/extra/gain"] == 1.5).all() and (raw["/joint_states/extra/ok"] == 1).all()
    assert np.isnan(raw["/joint_states/a first key"]).sum() == len(q) - len(q) // 3


def test_topics_with_stamps_of_their_own_are_joined(indy7: dynid.Robot, signals: Signals, tmp_path: Path) -> None:
    kinds = pytest.importorskip("mcap.writer").CompressionType
    t, q, tau = signals

    def write(mcap: Any, schema: Any, row: int) -> None:
        for topic, ns, position, effort in [("/a", START + STEP * row, q[row], []), ("/b", START + STEP * row + 1_000_000, [], tau[row])]:
            message = {"header": {"stamp": stamp(ns)}, "name": NAMES, "position": list(position), "velocity": [], "effort": list(effort)}
            mcap.write_message(topic, schema, message, log_time=ns, publish_time=ns)

    path = tmp_path / "log.mcap"
    write_mcap(path, signals, kinds.ZSTD, write)
    read = dynid.read_columns(path, indy7)
    # Before the first effort there is none to interpolate, and the time begins with what is kept.
    kept = 1 + np.round(read["t"] / (STEP * 1e-9)).astype(int)
    np.testing.assert_array_equal(read["q_j3"], q[kept, 2])
    between = np.interp(t[kept], t + 1e-3, tau[:, 2])
    np.testing.assert_allclose(read["tau_j3"], between, atol=1e-9 * np.abs(tau).max())
    # One topic alone has no efforts.
    alone = dynid.read_columns(f"{path}#/a", indy7)
    assert "tau_j1" not in alone and len(alone["t"]) == len(t)


def test_publishers_that_share_a_topic_are_joined(tmp_path: Path, signals: Signals) -> None:
    """An arm and its gripper: no message has the positions of both."""
    kinds = pytest.importorskip("mcap.writer").CompressionType
    t, q, tau = signals
    robot = dynid.Robot.load(Path(__file__).resolve().parents[3] / "robots" / "indy7.toml")

    def write(mcap: Any, schema: Any, row: int) -> None:
        late = 0 if row % 2 else 1_000_000
        for part, ns in [(slice(0, 5), START + STEP * row), (slice(5, 6), START + STEP * row + late)]:
            if part.start and row % 3:
                continue
            message = {
                "header": {"stamp": stamp(ns)},
                "name": NAMES[part],
                "position": q[row, part].tolist(),
                "velocity": [],
                "effort": tau[row, part].tolist(),
            }
            mcap.write_message("/joint_states", schema, message, log_time=ns, publish_time=ns)

    path = tmp_path / "log.mcap"
    write_mcap(path, signals, kinds.NONE, write)
    read = dynid.read_columns(path, robot)
    kept = np.searchsorted(t, read["t"] + t[1] * 0.999)
    np.testing.assert_array_equal(read["q_j1"], q[kept, 0])
    heard = np.arange(0, len(t), 3)
    line = np.interp(t[kept], t[heard] + np.where(heard % 2, 0.0, 1e-3), q[heard, 5])
    np.testing.assert_allclose(read["q_j6"], line, atol=1e-9)
    assert len(kept) > 0.95 * len(t)


def test_a_pipe_is_no_file_with_an_index(signals: Signals, tmp_path: Path) -> None:
    t, q, tau = signals
    np.savez(tmp_path / "a.npz", t=t, q=q, tau=tau)
    os.mkfifo(tmp_path / "pipe")

    def quietly() -> None:
        with contextlib.suppress(BrokenPipeError):
            (tmp_path / "pipe").write_bytes((tmp_path / "a.npz").read_bytes())

    writer = threading.Thread(target=quietly)
    writer.start()
    with pytest.raises(dynid.LogError, match="found a pipe"):
        dynid.read_columns(tmp_path / "pipe")
    writer.join()


def test_bags_of_ros(indy7: dynid.Robot, signals: Signals, of_csv: str, tmp_path: Path) -> None:
    rosbag1 = pytest.importorskip("rosbags.rosbag1")
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    typesys = pytest.importorskip("rosbags.typesys")
    _, q, tau = signals
    empty = np.array([])
    for k, compression in enumerate([None, rosbag1.Writer.CompressionFormat.LZ4, rosbag1.Writer.CompressionFormat.BZ2]):
        store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
        joint_state, header, time = (store.types[n] for n in ("sensor_msgs/msg/JointState", "std_msgs/msg/Header", "builtin_interfaces/msg/Time"))
        writer = rosbag1.Writer(tmp_path / f"{k}.bag")
        if compression is not None:
            writer.set_compression(compression)
        with writer:
            connection = writer.add_connection("/joint_states", joint_state.__msgtype__, typestore=store)
            for row in range(len(q)):
                ns = START + STEP * row
                message = joint_state(header(row, time(ns // 10**9, ns % 10**9), ""), NAMES, q[row], empty, tau[row])
                writer.write(connection, ns + 2_000_000, store.serialize_ros1(message, joint_state.__msgtype__))
        check(indy7, tmp_path / f"{k}.bag", signals, of_csv if k == 1 else None)
    # SQLite of Humble does not say what messages hold.
    for version, plugin in [(8, "SQLITE3"), (9, "SQLITE3"), (9, "MCAP")]:
        store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
        joint_state, header, time = (store.types[n] for n in ("sensor_msgs/msg/JointState", "std_msgs/msg/Header", "builtin_interfaces/msg/Time"))
        folder = tmp_path / f"{plugin}{version}"
        with rosbag2.Writer(folder, version=version, storage_plugin=rosbag2.StoragePlugin[plugin]) as writer:
            connection = writer.add_connection("/joint_states", joint_state.__msgtype__, typestore=store)
            for row in range(len(q)):
                ns = START + STEP * row
                message = joint_state(header(time(ns // 10**9, ns % 10**9), ""), NAMES, q[row], empty, tau[row])
                writer.write(connection, ns + 2_000_000, store.serialize_cdr(message, joint_state.__msgtype__))
        check(indy7, folder, signals, of_csv if plugin == "SQLITE3" else None)


@pytest.mark.parametrize("ending", ["csv", "csv.gz", "parquet", "npz", "mcap"])
def test_what_convert_writes_is_read_by_others_and_by_dynid(indy7: dynid.Robot, signals: Signals, tmp_path: Path, ending: str) -> None:
    t, q, tau = signals
    np.savez(tmp_path / "log.npz", t=t, q=q, tau=tau)
    out = tmp_path / f"out.{ending}"
    robot = Path(__file__).resolve().parents[3] / "robots" / "indy7.toml"
    assert dynid._native.command_line(["dynid", "convert", str(tmp_path / "log.npz"), str(out), "--robot", str(robot), "--quiet"]) == 0
    check(indy7, out, signals, None)
    if ending == "npz":
        np.testing.assert_array_equal(np.load(out)["q_j2"], q[:, 1])
    if ending == "parquet":
        table = pytest.importorskip("pyarrow.parquet").read_table(out)
        np.testing.assert_array_equal(table["q_j2"].to_numpy(), q[:, 1])
    if ending == "mcap":
        messages = list(pytest.importorskip("mcap_ros2.reader").read_ros2_messages(str(out)))
        np.testing.assert_array_equal([m.ros_msg.position[1] for m in messages], q[:, 1])


def found(module: str) -> Any:
    """A module, if it is installed."""
    try:
        return importlib.import_module(module)
    except ImportError:
        return None


def small_files(folder: Path) -> list[Path]:
    """A small log in every format of which there is a writer."""
    count = 40
    t, q = np.arange(count) * 0.01, np.sin(np.arange(count * 2.0)).reshape(count, 2)
    out = []

    def made(name: str) -> Path:
        out.append(folder / name)
        return out[-1]

    np.savez(made("a.npz"), t=t, q=q, k=np.arange(count))
    np.savez_compressed(made("b.npz"), t=t, q=q)
    np.save(made("c.npy"), q)
    write_torch(made("a.pt"), {"t": t, "q": q})
    for ending in ["parquet", "npz", "csv.gz"]:
        target = made(f"own.{ending}")
        assert dynid._native.command_line(["dynid", "convert", str(folder / "a.npz"), str(target), "--quiet"]) == 0
    if scipy_io := found("scipy.io"):
        scipy_io.savemat(made("a.mat"), {"t": t, "q": q, "data": {"x": t, "name": "arm"}})
        scipy_io.savemat(made("b.mat"), {"t": t, "data": {"q": q}}, do_compression=True)
    if h5py := found("h5py"):
        for k, settings in enumerate([{}, {"compression": "gzip", "chunks": (10,)}]):
            with h5py.File(made(f"{k}.h5"), "w") as file:
                file.create_dataset("g/t", data=t, **settings)
                file["g/q"] = q
    if (pa := found("pyarrow")) and (pq := found("pyarrow.parquet")) and found("pyarrow.feather"):
        table = pa.table({"t": t, "q": pa.array(list(q)), "n": pa.array([None, *t[1:]]), "s": ["x"] * count})
        for name in ["none", "snappy", "gzip", "lz4", "zstd"]:
            pq.write_table(table, made(f"{name}.parquet"), compression=name, row_group_size=15)
        for name in ["uncompressed", "lz4", "zstd"]:
            pa.feather.write_feather(table, made(f"{name}.feather"), compression=name, chunksize=15)
        with pa.OSFile(str(made("a.arrows")), "wb") as sink, pa.ipc.new_stream(sink, table.schema) as writer:
            writer.write_table(table, max_chunksize=15)
    with sqlite3.connect(made("a.db3")) as base:
        base.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,serialization_format TEXT NOT NULL)")
        base.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,timestamp INTEGER NOT NULL, data BLOB NOT NULL)")
        base.execute("INSERT INTO topics VALUES(1,'/x','std_msgs/msg/Float64','cdr')")
        for row in range(300):
            data = b"\0\1\0\0" + np.float64(row).tobytes() + b"\0" * (6000 if row == 7 else 0)
            base.execute("INSERT INTO messages(topic_id,timestamp,data) VALUES(1,?,?)", (START + row, data))
    base.close()
    if (mcap := found("mcap.writer")) and (ros2 := found("mcap_ros2.writer")):
        with open(made("json.mcap"), "wb") as raw:
            plain = mcap.Writer(raw, compression=mcap.CompressionType.NONE)
            plain.start("x", library="x")
            channel = plain.register_channel(topic="/j", message_encoding="json", schema_id=0)
            for row in range(count):
                text = json.dumps({"t": {"sec": 1, "nsec": row}, "name": ["a", "b"], "q": list(q[row]), "list": [{"name": "c", "x": 1}]})
                plain.add_message(channel_id=channel, log_time=START + row, publish_time=START, data=text.encode())
            plain.finish()
        for compression in mcap.CompressionType:
            with open(made(f"{compression.name}.mcap"), "wb") as raw:
                writer = ros2.Writer(raw, compression=compression, chunk_size=1000)
                schema = writer.register_msgdef("sensor_msgs/msg/JointState", JOINT_STATE)
                for row in range(count):
                    message = {
                        "header": {"stamp": stamp(START + row)},
                        "name": ["a", "b"],
                        "position": list(q[row]),
                        "velocity": [],
                        "effort": [0.0, 1.0],
                    }
                    writer.write_message("/j", schema, message, log_time=START + row, publish_time=START)
                writer.finish()
    if (rosbag1 := found("rosbags.rosbag1")) and (typesys := found("rosbags.typesys")):
        store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
        number = store.types["std_msgs/msg/Float64"]
        for way in [None, rosbag1.Writer.CompressionFormat.LZ4, rosbag1.Writer.CompressionFormat.BZ2]:
            bag = rosbag1.Writer(made(f"{way}.bag"))
            if way is not None:
                bag.set_compression(way)
            with bag:
                connection = bag.add_connection("/x", number.__msgtype__, typestore=store)
                for row in range(count):
                    bag.write(connection, START + row, store.serialize_ros1(number(float(row)), number.__msgtype__))
    return out


def test_damaged_files_are_read_or_refused(tmp_path: Path) -> None:
    """Single bytes, words and ends of files changed at random: an answer or a `LogError`, never anything else. `DYNID_MUTATIONS`: how many of each file."""
    count = int(os.environ.get("DYNID_MUTATIONS", "150"))
    rng = np.random.default_rng(int(os.environ.get("DYNID_SEED", "1")))
    for path in small_files(tmp_path):
        whole = path.read_bytes()
        assert len(dynid.read_columns(path, columns={"missing": "drop"})) > 0, path
        target = tmp_path / f"damaged{''.join(path.suffixes)}"
        for _ in range(count):
            damaged = bytearray(whole)
            kind = rng.integers(0, 5)
            for _ in range(rng.integers(1, 4)):
                at = int(rng.integers(0, len(damaged)))
                if kind == 0:
                    damaged[at] ^= 1 << int(rng.integers(0, 8))
                elif kind == 1:
                    damaged[at] = int(rng.choice([0, 1, 0x7F, 0x80, 0xFF]))
                elif kind == 2:
                    damaged[at : at + 4] = rng.choice([b"\xff\xff\xff\xff", b"\0\0\0\0", b"\xff\xff\xff\x7f", b"\0\0\0\x80"])
                elif kind == 3:
                    del damaged[at:]
                    break
                else:
                    other = int(rng.integers(0, len(damaged)))
                    damaged[at:at] = damaged[other : other + int(rng.integers(1, 30))]
            target.write_bytes(damaged)
            try:
                dynid.read_columns(target, columns={"missing": "drop"})
            except dynid.LogError:
                pass
