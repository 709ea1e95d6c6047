"""From arrays to an estimate, and what is done with it."""

from __future__ import annotations

import json
import os
import pickle
import signal
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import dynid
import numpy as np
import pytest
from conftest import ROOT

# Names of the numbers that stand for an estimate; provenance tells files and arrays apart.
NUMBERS = ("parameters", "base_parameters", "shape_parameters", "fit", "validation", "conditioning")


def same(a: dynid.Estimate, b: dynid.Estimate) -> None:
    for key in NUMBERS:
        assert _without_names(a.record[key]) == _without_names(b.record[key]), key


def _without_names(value: object) -> object:
    if isinstance(value, dict):
        return {k: _without_names(v) for k, v in value.items() if k not in ("log", "choices", "reason")}
    return [_without_names(v) for v in value] if isinstance(value, list) else value


# The Stewart platform takes as long as the others together.
@pytest.mark.parametrize("name", sorted(p.stem for p in (ROOT / "robots").glob("*.toml") if p.stem != "stewart"))
def test_arrays_give_the_bits_of_files(name: str, tmp_path: Path) -> None:
    file = ROOT / "robots" / f"{name}.toml"
    robot = dynid.Robot.load(file)
    logs = []
    for seed in (1, 2):
        made = dynid.simulate(robot, duration_s=12, rate_hz=200, seed=seed)
        columns = [made.t, *made.q.T, *made.tau.T, *made.channels.values()]
        head = ["t", *(f"q_{j}" for j in made.joints), *(f"tau_{j}" for j in made.joints), *made.channels]
        rows = [",".join(head), *(",".join(repr(float(x)) for x in row) for row in zip(*columns, strict=True))]
        (tmp_path / f"{seed}.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
        logs.append(made.log)
    (tmp_path / "run.toml").write_text(f'robot = "{file}"\n[[log]]\npath = "1.csv"\n[[validation]]\npath = "2.csv"\n', encoding="utf-8")
    by_arrays = dynid.identify(robot, logs[0], validation=logs[1])
    by_file = dynid.identify_file(tmp_path / "run.toml")
    same(by_arrays, by_file)
    same(dynid.identify(robot, logs[0], validation=logs[1], threads=1), by_arrays)
    by_reading = dynid.identify(robot, dynid.Log.read(tmp_path / "1.csv"), validation=dynid.Log.read(tmp_path / "2.csv"))
    same(by_reading, by_file)
    # The program of the package writes the same.
    program = [sys.executable, "-c", "from dynid._command_line import main; raise SystemExit(main())", "identify", "run.toml", "--quiet"]
    ended = subprocess.run([*program, "--out", "out"], cwd=tmp_path, capture_output=True, check=False)
    assert ended.returncode in (0, 1), ended.stderr
    written = dynid.Estimate.load(tmp_path / "out" / "estimate.json")
    same(written, by_file)
    if not written._native.channels:
        q, v, a = made.clean_q[:20], made.clean_v[:20], made.clean_a[:20]
        assert (written.predict(q, v, a) == by_arrays.predict(q, v, a)).all()


def test_estimate(found: dynid.Estimate, made: dynid.Simulation, unseen: dynid.Simulation, tmp_path: Path) -> None:
    q, v, a = unseen.clean_q, unseen.clean_v, unseen.clean_a
    tau = found.predict(q, v, a)
    assert np.sqrt(np.mean((tau - unseen.clean_tau) ** 2)) < 0.005 * np.sqrt(np.mean(unseen.clean_tau**2))
    assert (found.predict(q[3], v[3], a[3]) == tau[3]).all() and (found.feedforward(q[3], v[3], a[3]) == tau[3]).all()
    assert (found.predict(q.astype(np.float32), v, a) != tau).any()
    assert (found.predict(np.asfortranarray(q), v, a, threads=2) == tau).all()
    again = pickle.loads(pickle.dumps(found))
    assert (again.predict(q, v, a) == tau).all() and again.record == found.record
    names, covariance = again.covariance
    assert covariance.shape == (len(names), len(names)) and np.linalg.eigvalsh(covariance)[0] > -1e-12 * np.trace(covariance)
    table = found.parameters
    assert table.height == len(found.record["parameters"]) and table["name"][0] == "link1.m"
    assert found.value("link1.m") == table["value"][0]
    assert found.headline in found._repr_html_() and "<table>" in found._repr_html_()
    fit = found.validate(unseen.log)[0]
    assert fit["filtered"] == found.record["validation"][0]["filtered"]
    found.save(tmp_path / "estimate.json")
    read = dynid.Estimate.load(tmp_path / "estimate.json")
    assert read.to_json() == found.to_json() and [p.name for p in tmp_path.iterdir()] == ["estimate.json"]
    assert "<html" in found.report(tmp_path / "report.html").lower()
    with pytest.raises(dynid.UnsupportedError, match="without the samples"):
        read.report()
    assert "<robot" in found.to_urdf() and "<mujoco" in found.to_mjcf()
    assert json.loads(found.to_model_json())


def test_factors_travel_and_merge(found: dynid.Estimate, made: dynid.Simulation, unseen: dynid.Simulation) -> None:
    first = found.reduce(made.log)
    second = dynid.Factor.from_bytes(first.to_bytes()).reduce(unseen.log)
    both, turned = first + second, pickle.loads(pickle.dumps(second)) + first
    assert both.to_bytes() == turned.to_bytes()
    q, v, a = made.clean_q, made.clean_v, made.clean_a
    alone = first.solve().predict(q, v, a)
    assert np.abs(alone - found.predict(q, v, a)).max() < 1e-9 * np.abs(alone).max()
    assert both.solve(unseen.log).record["samples"] == 2 * found.record["samples"]


def test_logs_of_tables(indy7: dynid.Robot, made: dynid.Simulation, found: dynid.Estimate, unseen: dynid.Simulation) -> None:
    table = (
        {"t": made.t} | {f"q_{j}": made.q[:, k] for k, j in enumerate(made.joints)} | {f"tau_{j}": made.tau[:, k] for k, j in enumerate(made.joints)}
    )
    same(dynid.identify(indy7, dynid.Log.from_table(table), validation=unseen.log), found)
    pandas = pytest.importorskip("pandas")
    same(dynid.identify(indy7, dynid.Log.from_table(pandas.DataFrame(table)), validation=unseen.log), found)
    assert list(found.parameters.to_pandas().columns)[0] == "name"


def test_paths_stand_for_robots_and_logs() -> None:
    folder = ROOT / "examples" / "indy7"
    robot, train, valid = dynid.Robot.load(folder / "robot.toml"), folder / "train.csv.gz", folder / "valid.csv.gz"
    read = dynid.identify(robot, dynid.Log.read(train), validation=dynid.Log.read(valid))
    assert dynid.identify(robot, str(train), validation=[valid]).to_json() == read.to_json()
    assert dynid.identify(folder / "robot.toml", train, validation=valid).to_json() == read.to_json()
    file = str(folder / "robot.toml")
    assert dynid.read_columns(train, file).keys() == dynid.read_columns(train, robot).keys()
    by_path, by_value = (dynid.simulate(of, duration_s=2.0, rate_hz=100.0).q for of in (file, robot))
    assert np.array_equal(by_path, by_value)
    dynid.Online(file)
    with pytest.raises(dynid.RobotError, match="nowhere.urdf"):
        dynid.check("nowhere.urdf", train)
    no_robot: Any = {"name": "arm"}
    for call in (dynid.identify, dynid.check, dynid.servo, dynid.friction):
        with pytest.raises(TypeError, match="a `dynid.Robot` or the path of one, found dict"):
            call(no_robot, train)
    with pytest.raises(TypeError, match="found dict"):
        dynid.design(no_robot)
    assert repr(dynid.check(robot, [train])) == repr(dynid.check(robot, dynid.Log.read(train)))
    assert read.validate(valid) == read.validate(dynid.Log.read(valid))
    with pytest.raises(dynid.LogError, match="nowhere.csv"):
        dynid.identify(robot, "nowhere.csv")
    with pytest.raises(dynid.SettingError, match="columns"):
        dynid.identify(robot, train, columns={"position": "q{}"})


def test_bad_input_is_told(indy7: dynid.Robot, made: dynid.Simulation) -> None:
    log = made.log
    with pytest.raises(dynid.SettingError, match="unknown field `methd`"):
        dynid.identify(indy7, log, estimator={"methd": "iv"})
    with pytest.raises(dynid.SettingError, match="`log`"):
        dynid.identify(indy7, log, log=[])
    with pytest.raises(dynid.LogError, match="look like degrees") as caught:
        dynid.identify(indy7, dynid.Log(made.t, np.degrees(made.q), made.tau))
    assert caught.value.hint and caught.value.hint in str(caught.value)
    with pytest.raises(dynid.RobotError, match="cannot be read"):
        dynid.Robot.load("nowhere.urdf")
    with pytest.raises(dynid.SettingError, match="unknown field `duration`"):
        dynid.simulate(indy7, duration=3)
    with pytest.raises(dynid.SettingError, match="those of files"):
        dynid.Log(made.t, made.q, made.tau, rows=[1, 2])
    with pytest.raises(dynid.DynidError):
        dynid.identify(indy7, [])
    with pytest.raises(dynid.SettingError, match="elbow"):
        dynid.identify(indy7, dynid.Log(made.t, made.q[:, :1], made.tau[:, :1], joints=["elbow"]))
    wrongs: list[dict[str, Any]] = [{"q": np.zeros(5)}, {"v": np.zeros((2, 6))}, {"q": np.full(6, np.nan)}]
    for wrong in wrongs:
        with pytest.raises(ValueError, match=f"^{next(iter(wrong))}"):
            arguments: dict[str, Any] = {"q": np.zeros(6), "v": np.zeros(6), "a": np.zeros(6)} | wrong
            indy7.inverse_dynamics(**arguments)
    with pytest.raises(ValueError, match="t: expected"):
        dynid.Log(np.zeros((2, 2)), made.q, made.tau)
    tables: list[Any] = [3, None, made.q, {"t": made.t}, [{"t": made.t}], Stream(None)]
    for no_log in tables:
        with pytest.raises(TypeError, match="a `dynid.Log` or the path of one, found"):
            dynid.identify(indy7, no_log)


def test_progress_and_interrupt(indy7: dynid.Robot, made: dynid.Simulation) -> None:
    steps: list[str] = []
    dynid.identify(indy7, made.log, progress=steps.append)
    assert "finding base parameters" in steps and "judging parameters" in steps

    def stop(step: str) -> None:
        raise RuntimeError(step)

    with pytest.raises(RuntimeError, match="examining logs"):
        dynid.identify(indy7, made.log, progress=stop)
    long = dynid.simulate(indy7, duration_s=300, rate_hz=1000, seed=3)
    # What a shell starts in the background has no interrupt.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT))
    steps.clear()
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        dynid.identify(indy7, long.log, progress=steps.append)
    assert "judging parameters" not in steps
    signal.signal(signal.SIGINT, before)


def test_threads_do_not_disturb_each_other(indy7: dynid.Robot, made: dynid.Simulation, unseen: dynid.Simulation, found: dynid.Estimate) -> None:
    results: list[dynid.Estimate] = []
    work = [threading.Thread(target=lambda: results.append(dynid.identify(indy7, made.log, validation=unseen.log))) for _ in range(2)]
    for thread in work:
        thread.start()
    for thread in work:
        thread.join()
    assert len(results) == 2
    for result in results:
        same(result, found)


def test_many_calls_leak_nothing(indy7: dynid.Robot, made: dynid.Simulation, found: dynid.Estimate) -> None:
    resource = pytest.importorskip("resource")

    def work(times: int) -> None:
        for _ in range(times):
            indy7.regressor(made.clean_q[:200], made.clean_v[:200], made.clean_a[:200])
            indy7.reduce(made.q[:50], made.q[:50], made.q[:50], made.tau[:50])
            found.predict(made.q[:50], made.q[:50], made.q[:50])
            dynid.Log(made.t, made.q, made.tau)
            dynid.Robot.parse(dynid.examples.TWO_LINKS, "arm.toml")

    work(100)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    work(1000)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    # A call that kept its arrays would have kept 600 MB.
    assert grown < 20_000, f"{grown} kB"


def test_the_program_of_the_package() -> None:
    ended = subprocess.run(
        [sys.executable, "-c", "from dynid._command_line import main; raise SystemExit(main())", "--version"], capture_output=True, check=True
    )
    assert ended.stdout.decode().split()[:2] == ["dynid", dynid.__version__]


def test_no_states_and_one(indy7: dynid.Robot) -> None:
    none, one = np.zeros((0, 6)), np.full(6, 0.3)
    assert indy7.inverse_dynamics(none, none, none).shape == (0, 6)
    assert indy7.regressor(none, none, none).shape == (0, 6, 60)
    r, z, rho = indy7.reduce(none, none, none, none)
    assert r.shape == (60, 60) and not r.any() and not z.any() and rho == 0
    rows, tau = indy7.regressor(one, one, one), indy7.inverse_dynamics(one, one, one)
    assert rows.shape == (6, 60) and np.abs(rows @ indy7.parameters - tau).max() < 1e-12 * np.abs(tau).max()
    heavier = indy7.parameters * 2
    assert np.abs(indy7.inverse_dynamics(one, one, one, parameters=heavier) - 2 * tau).max() < 1e-12 * np.abs(tau).max()
    r, z, rho = indy7.reduce(one, one, one, tau, base=True)
    assert (
        abs(np.sum((indy7.regressor(one, one, one, base=True) @ np.ones(len(z)) - tau) ** 2) - np.sum((r @ np.ones(len(z)) - z) ** 2) - rho**2) < 1e-9
    )


def test_what_an_arm_carries() -> None:
    bare = dynid.examples.TWO_LINKS
    stated = "mass = 2\ncom = [0, 0.01, 0.15]\ninertia_com = [0.02, 0, 0, 0.02, 0, 0.004]"
    assert stated in bare
    # 1.5 kg at 0.3 m on the axis of the forearm.
    com = "[0, 0.005714285714285714, 0.21428571428571427]"
    about = "[0.039371428571428574, 0, 0, 0.039285714285714285, 0.0012857142857142856, 0.004085714285714286]"
    heavy = bare.replace(stated, f"mass = 3.5\ncom = {com}\ninertia_com = {about}")
    logs = []
    for seed, text in enumerate((bare, heavy)):
        made = dynid.simulate(dynid.Robot.parse(text, "arm.toml"), duration_s=40, rate_hz=250, seed=seed + 1)
        carries: dict[str, Any] = {"payload": "tool"} if seed else {}
        logs.append(dynid.Log(made.t, made.q, made.tau, name=f"log{seed}", **carries))
    found = dynid.identify(dynid.Robot.parse(bare, "arm.toml"), logs, payload=[{"name": "tool"}])
    (tool,) = found.payloads
    mass, z = tool["mass"], tool["com"][2]
    assert mass["interval"][0] < 1.5 < mass["interval"][1] and mass["std"] < 0.05, mass
    assert z["interval"][0] < 0.3 < z["interval"][1] and "`tool` weighs 1.5" in tool["sentence"], tool
    known = dynid.identify(
        dynid.Robot.parse(bare, "arm.toml"), logs, payload=[{"name": "tool", "mass": 1.5, "com": [0, 0, 0.3], "inertia": [0, 0, 0, 0, 0, 0]}]
    )
    assert known.payloads == []


def test_doubts_about_a_robot_are_warnings() -> None:
    odd = dynid.examples.TWO_LINKS.replace("inertia_com = [0.02, 0, 0, 0.02", "inertia_com = [0.02, 0.02, 0, 0")
    with pytest.warns(dynid.DynidWarning, match="negative principal moment"):
        robot = dynid.Robot.parse(odd, "arm.toml")
    assert any("`fore`" in w for w in robot.warnings)


def test_settings_may_be_numbers_of_numpy(indy7: dynid.Robot, made: dynid.Simulation, unseen: dynid.Simulation, found: dynid.Estimate) -> None:
    same(dynid.identify(indy7, made.log, validation=unseen.log, seed=np.int64(1)), found)
    with pytest.raises(TypeError, match="found object"):
        dynid.identify(indy7, made.log, seed=object())


def test_pickled_robots_are_as_they_were() -> None:
    robot = dynid.Robot.parse(dynid.examples.TWO_LINKS, "arm.toml", gravity=[0.1, 0.2, -3], locked={"elbow": 0.4})
    again = pickle.loads(pickle.dumps(robot))
    q, v, a = np.array([0.3]), np.array([1.0]), np.array([-2.0])
    assert again.joints == ["shoulder"] and again.gravity_vector == robot.gravity_vector == [0.1, 0.2, -3]
    assert again.inverse_dynamics(q, v, a) == robot.inverse_dynamics(q, v, a)


def test_settings_that_arrays_have_no_use_for(indy7: dynid.Robot, made: dynid.Simulation) -> None:
    for key, value in (("online", {"learn_s": 3}), ("period_s", 5.0), ("trajectory", "x.json")):
        settings: dict[str, Any] = {key: value}
        with pytest.raises(dynid.SettingError, match=f"`{key}`"):
            dynid.identify(indy7, made.log, **settings)


class Stream:
    """A table of which nothing is known but Arrow's C interface."""

    def __init__(self, table: Any) -> None:
        self.table = table

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        return self.table.__arrow_c_stream__(requested_schema)


def test_tables_by_the_c_interface_of_arrow() -> None:
    pa = pytest.importorskip("pyarrow")
    arm = dynid.Robot.parse(dynid.examples.TWO_LINKS, "arm.toml")
    made = dynid.simulate(arm, duration_s=20, rate_hz=100, seed=5)
    table = {"t": made.t, **{f"{s}_{j}": x[:, k] for s, x in (("q", made.q), ("tau", made.tau)) for k, j in enumerate(arm.joints)}}
    whole = pa.table(table)
    # Parts of different lengths, one of them the middle of another table, whose buffers begin before it.
    parts = pa.concat_tables([whole.slice(0, 700), whole.slice(700, 1), whole.slice(701)])
    expected = dynid.identify(arm, dynid.Log.from_table(table)).to_json()
    for given in (Stream(whole), Stream(parts), whole):
        assert dynid.identify(arm, dynid.Log.from_table(given)).to_json() == expected

    from dynid._arrow import columns

    odd = pa.table({"i": pa.array([1, None, 3], pa.int16()), "b": pa.array([True, False, None]), "f": pa.array([0.5, None, 2.5], pa.float32())})
    found = columns(Stream(pa.concat_tables([odd, odd.slice(1, 2), odd.slice(3)])))
    nan = np.nan
    np.testing.assert_array_equal(found["i"], [1, nan, 3, nan, 3])
    np.testing.assert_array_equal(found["b"], [1, 0, nan, 0, nan])
    np.testing.assert_array_equal(found["f"], [0.5, nan, 2.5, nan, 2.5])
    assert columns(Stream(odd.slice(0, 0)))["i"].shape == (0,)
    with pytest.raises(TypeError, match="column `name`: expected numbers"):
        columns(Stream(pa.table({"name": ["a"]})))
    whole_rows = pa.StructArray.from_arrays([pa.array([1.0, 2.0])], ["x"], mask=pa.array([True, False]))
    with pytest.raises(TypeError, match="null as a whole"):
        columns(Stream(pa.chunked_array([whole_rows])))
    with pytest.raises(TypeError, match="columns with names"):
        columns(Stream(pa.chunked_array([[1.0, 2.0]])))

    def batches() -> Any:
        yield whole.to_batches()[0]
        raise RuntimeError("the disk is gone")

    with pytest.raises(ValueError, match="the disk is gone"):
        columns(Stream(pa.RecordBatchReader.from_batches(whole.schema, batches())))

    # Results go out the same way.
    out = columns(Stream(dynid.Table({"x": [1.0, 2.5], "n": [3, None]})))
    np.testing.assert_array_equal(out["x"], [1.0, 2.5])
    np.testing.assert_array_equal(out["n"], [3, nan])


def test_a_law_of_friction_of_ones_own() -> None:
    arm = dynid.Robot.parse(dynid.examples.TWO_LINKS, "arm.toml")
    law = {"columns": {"hc": "sign(v) * (1 - 1/(1 + (v/hv)**2))", "hs": "sign(v) / (1 + (v/hv)**2)"}, "shape": {"hv": [0.02, 1.5]}}
    rng = np.random.default_rng(3)
    t = np.arange(8000) / 250
    w = np.array([[1.1, 1.7], [2.9, 2.3]])
    q = sum(0.5 / (k + 1) * np.sin(w[k] * t[:, None] + k) for k in range(2))
    v = sum(0.5 / (k + 1) * w[k] * np.cos(w[k] * t[:, None] + k) for k in range(2))
    a = sum(-0.5 / (k + 1) * w[k] ** 2 * np.sin(w[k] * t[:, None] + k) for k in range(2))
    friction = np.sign(v) * (2 + 1.5 / (1 + (v / 0.2) ** 2)) + 0.7 * v
    # The bodies are those of the file; its own friction has no part in it.
    bodies = [0.0 if name.startswith(tuple(f"{joint}." for joint in arm.joints)) else x for name, x in zip(arm.parameter_names, arm.parameters, strict=True)]
    tau = arm.inverse_dynamics(q, v, a, parameters=bodies) + friction
    log = dynid.Log(t, q, tau + 0.02 * rng.normal(size=tau.shape))
    own = {joint: ["hess_soom", "viscous"] for joint in arm.joints}
    settings: dict[str, Any] = {"law": {"hess_soom": law}, "elements": {"joint": own, "friction": "given"}}
    found = dynid.identify(arm, log, **settings)
    value = {p["name"]: (p["value"], p["std"]) for p in found.record["parameters"] + found.record["shape_parameters"]}
    for joint in arm.joints:
        for symbol, true in {"hc": 2.0, "hs": 3.5, "fv": 0.7, "hv": 0.2}.items():
            x, std = value[f"{joint}.{symbol}"]
            assert abs(x - true) < 5 * std + 0.01, (joint, symbol, x, std)
    again = pickle.loads(pickle.dumps(found))
    assert (again.predict(q[:50], v[:50], a[:50]) == found.predict(q[:50], v[:50], a[:50])).all()
    assert np.abs(found.predict(q, v, a) - tau).max() < 0.3
    with pytest.raises(dynid.SettingError, match=r"law `hess_soom`: column `hc`: `sgn\(v\)`, character 1"):
        dynid.identify(arm, log, **{**settings, "law": {"hess_soom": {"columns": {"hc": "sgn(v)"}}}})
    with pytest.raises(dynid.SettingError, match="which none does"):
        dynid.identify(arm, log, law={"hess_soom": law})


def test_files_tell_what_they_lose(tmp_path: Path) -> None:
    arm = dynid.Robot.parse(dynid.examples.TWO_LINKS, "arm.toml")
    made = dynid.simulate(arm, duration_s=20, rate_hz=200, seed=1)
    found = dynid.identify(arm, made.log, elements={"default": ["viscous", "rotor"], "joint": {"shoulder": ["viscous", "rotor"]}})
    with pytest.warns(dynid.DynidWarning, match="rotor inertia"):
        found.to_urdf(tmp_path / "arm.urdf")
    assert found.to_loops() is None and [p.name for p in tmp_path.iterdir()] == ["arm.urdf"]
    file = tmp_path / "bar.toml"
    file.write_text((ROOT / "robots/fivebar.toml").read_text(encoding="utf-8"), encoding="utf-8")
    bar = dynid.Robot.load(file)
    linkage = dynid.identify(bar, dynid.simulate(bar, duration_s=20, rate_hz=200, seed=1).log)
    linkage.to_urdf(tmp_path / "made.urdf")
    closed = dynid.Robot.load(tmp_path / "made.loops.toml")
    q = np.array([[2.2, 0.8], [2.25, 0.85]])
    rest = np.zeros_like(q)
    offset = {p["joint"]: p["value"] for p in linkage.record["parameters"] if p["name"].endswith(".fo")}
    bodies = linkage.predict(q, rest, rest) - [offset[joint] for joint in linkage.joints]
    assert np.abs(closed.gravity(q) - bodies).max() < 1e-9 * np.abs(bodies).max()
    file.write_text(file.read_text(encoding="utf-8") + "# changed\n", encoding="utf-8")
    with pytest.warns(dynid.DynidWarning, match="has changed since"):
        linkage.to_urdf()


def test_joints_that_were_held_stay_so_in_other_logs(made: dynid.Simulation) -> None:
    arm = dynid.Robot.parse(dynid.examples.TWO_LINKS, "arm.toml")
    one = dynid.simulate(arm, duration_s=20, rate_hz=200, seed=1)
    log = dynid.Log(one.t, one.q[:, :1], one.tau[:, :1], joints=["shoulder"])
    found = dynid.identify(arm, log)
    assert found.joints == ["shoulder"]
    again = pickle.loads(pickle.dumps(found))
    assert again.validate(log) == found.validate(log)
    with pytest.raises(dynid.SettingError, match="elbow"):
        again.validate(one.log)
