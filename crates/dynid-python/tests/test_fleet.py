"""Fleets: single logs to bytes, bytes to folders, folders to a fleet, whoever did the work."""

from __future__ import annotations

import importlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from datetime import date, datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import dynid
import pytest
from conftest import ROOT
from dynid import ManifestRow

PROGRAM = [sys.executable, "-c", "from dynid._command_line import main; raise SystemExit(main())"]
SETTINGS = "duration_s = 6\nrate_hz = 100\n[fleet]\nrobots = 6\nlogs = 8\nfaults = 1\n"
# What workers find on the way to the tests and the examples.
PLACES = [str(ROOT / "examples/fleet"), str(Path(__file__).parent)]


def program(folder: Path, *arguments: str) -> None:
    ended = subprocess.run([*PROGRAM, *arguments, "--quiet"], cwd=folder, capture_output=True, check=False)
    assert ended.returncode == 0, ended.stderr.decode()


class Prepared:
    """Logs of a virtual fleet, a broken one among them, a recipe, and what the program makes of them."""

    def __init__(self, folder: Path) -> None:
        (folder / "arm.toml").write_text(dynid.examples.TWO_LINKS)
        (folder / "fleet.toml").write_text(SETTINGS)
        program(folder, "simulate", "arm.toml", "--config", "fleet.toml", "--seed", "5", "--out", "made")
        learned = ("--log", "made/logs/r001-001.csv.gz", "--log", "made/logs/r004-001.csv.gz")
        program(folder, "reduce", "arm.toml", *learned, "--out", "type.factors")
        (folder / "made/logs/broken.csv").write_text("t,q_shoulder\n0,x\n")
        with (folder / "made/manifest.csv").open("a") as manifest:
            manifest.write("logs/broken.csv,r002,1780000000,20\n")
        program(folder, "reduce", "type.factors", "--manifest", "made/manifest.csv", "--out", "factors")
        program(folder, "fleet", "factors", "--out", "whole", "--robot", "r001")
        self.folder = folder
        self.recipe = folder / "type.factors"
        self.rows = dynid.read_manifest(folder / "made/manifest.csv")
        self.whole = without_command((folder / "whole/fleet.json").read_text())


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Prepared:
    return Prepared(tmp_path_factory.mktemp("fleet"))


def without_command(text: str) -> dict[str, Any]:
    record: dict[str, Any] = json.loads(text)
    record["provenance"].pop("command_line", None)
    record["provenance"].pop("revision", None)
    return record


def files(folder: Path) -> dict[str, bytes]:
    """The files of a store by their names in it."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.glob("*/*")) if p.is_file()}


def reduced(row: ManifestRow, recipe: bytes | Path) -> bytes:
    return dynid.reduce_log(row["path"], recipe, robot=row["robot"], start=row["start"], covariates=row["covariates"], name=row["log"])


def test_bytes_of_single_logs_fill_the_folder_of_the_program(prepared: Prepared, tmp_path: Path) -> None:
    store = dynid.FactorStore(tmp_path / "store", prepared.recipe)
    made = [reduced(row, store.recipe) for row in prepared.rows]
    failures = [failure for one in reversed(made) if (failure := store.put(one))]
    assert [(f["log"], f["robot"], f["code"]) for f in failures] == [("logs/broken.csv", "r002", "malformed")]
    assert [store.put(one) for one in made[:-1]] == [None] * 48 and len(store) == 48
    assert files(store.folder) == files(prepared.folder / "factors")
    assert store.failures.rows() == dynid.FactorStore(prepared.folder / "factors").failures.rows()
    # Nothing of where logs lie, and the same bytes from elsewhere.
    assert not any(str(prepared.folder).encode() in one for one in made)
    elsewhere = tmp_path / "other" / "copy.gz"
    elsewhere.parent.mkdir()
    shutil.copy(prepared.rows[0]["path"], elsewhere)
    again = dynid.reduce_log(
        elsewhere,
        prepared.recipe,
        robot="r001",
        start=prepared.rows[0]["start"],
        covariates=prepared.rows[0]["covariates"],
        name=prepared.rows[0]["log"],
    )
    assert again == made[0]
    # The same from rows, in one go.
    whole = dynid.FactorStore(tmp_path / "rows", dynid.Factor.from_bytes(prepared.recipe.read_bytes()))
    told: list[str] = []
    found = whole.reduce([*prepared.rows[:3], prepared.rows[-1]], progress=told.append)
    assert (found["logs"], found["reduced"], found["known"], len(found["failures"])) == (4, 3, 0, 1) and len(told) == 4
    assert whole.reduce(prepared.folder / "made/manifest.csv", threads=1)["known"] == 3
    assert files(whole.folder) == files(store.folder)


def test_a_fleet_is_that_of_the_program(prepared: Prepared) -> None:
    found = dynid.fleet(prepared.folder / "factors")
    assert without_command(found.to_json()) == prepared.whole
    page = (prepared.folder / "whole/robots/r001.html").read_text(encoding="utf-8")
    assert found.robot_page("r001") == page
    assert found.report() == (prepared.folder / "whole/report.html").read_text(encoding="utf-8")
    truth = json.loads((prepared.folder / "made/truth.json").read_text())
    (change,) = truth["changes"]
    (told,) = [row for row in found.changes.rows() if row["robot"] == change["robot"]]
    assert told["parameter"] == change["parameter"] and abs(told["size"] - change["size"]) < 4 * told["sd"]
    assert told["from_s"] <= change["date_s"] <= told["to_s"]
    assert found.robots.height == 6 and found.robot(change["robot"])["state"] == "changed"
    value = next(p for p in found.parameters.rows() if p["name"] == told["parameter"])
    assert value["low"] < value["value"] < value["high"] and value["between_robots"] > 0
    assert found.failures["log"] == ["logs/broken.csv"]
    assert change["robot"] in found._repr_html_() and found.headline in repr(found)
    with pytest.raises(KeyError):
        found.robot_page("r999")
    # Models of the type and of a robot, as the program writes them.
    for name, file in ((None, "type.json"), (change["robot"], f"robots/{change['robot']}.json")):
        estimate = found.estimate(name)
        assert without_command(estimate.to_json()) == without_command((prepared.folder / "whole" / file).read_text())
    names, covariance = estimate.covariance
    assert covariance.shape == (len(names), len(names)) and f"{change['parameter']}" in names
    with pytest.raises(KeyError):
        found.estimate("r999")
    fixed = dynid.fleet([prepared.folder / "factors"], between_robots=["fc"], covariates=[], threads=1)
    assert fixed.record["covariates"] == [] and "shoulder.fv" not in [p["name"] for p in fixed.parameters.rows() if p["between_robots"]]
    with pytest.raises(dynid.DynidError, match="fq"):
        dynid.fleet(prepared.folder / "factors", between_logs=["fq"])
    with pytest.raises(TypeError, match="list of names"):
        dynid.fleet(prepared.folder / "factors", covariates="temperature")


def test_what_logs_carried(prepared: Prepared, tmp_path: Path) -> None:
    (tmp_path / "arm.toml").write_text(dynid.examples.TWO_LINKS)
    (tmp_path / "fleet.toml").write_text("duration_s = 4\nrate_hz = 100\n[fleet]\nrobots = 4\nlogs = 6\npayload = 2\n")
    program(tmp_path, "simulate", "arm.toml", "--config", "fleet.toml", "--seed", "2", "--out", "made")
    truth = {log["file"].split(".")[0]: log.get("payload", 0.0) for log in json.loads((tmp_path / "made/truth.json").read_text())["logs"]}
    bare = [("--log", f"made/logs/{log}.csv.gz") for log, mass in truth.items() if log.startswith("r001") and not mass]
    program(tmp_path, "reduce", "arm.toml", *bare[0], "--payload", "fore", "--out", "type.factors")
    store = dynid.FactorStore(tmp_path / "factors", tmp_path / "type.factors")
    assert not store.reduce(tmp_path / "made/manifest.csv")["failures"]
    found = dynid.fleet(store).payload
    masses = [row for row in found.rows() if row["parameter"] == "fore.m"]
    mean = sum(truth.values()) / len(truth)
    assert len(masses) == len(truth) == 24
    for row in masses:
        carried = truth[Path(row["log"]).name.split(".")[0]] - mean
        assert abs(row["difference"] - carried) < 0.1 and 0 < row["sd"] < 0.1, (row, carried)
    assert not dynid.fleet(prepared.folder / "factors").payload.rows()


def test_a_log_from_arrays_or_a_file_counts_once(prepared: Prepared, tmp_path: Path) -> None:
    row = prepared.rows[0]
    columns = dynid.read_columns(row["path"])
    log = dynid.Log.from_table(columns)
    store = dynid.FactorStore(tmp_path / "store", prepared.recipe)
    store.reduce(prepared.rows)
    for same in (log, dynid.Log.read(row["path"])):
        made = dynid.reduce_log(same, prepared.recipe, robot="r001", start=row["start"], covariates=row["covariates"], name=row["log"])
        assert store.put(made) is None
    found = without_command(dynid.fleet(store).to_json())
    assert found["repeated"] >= 1
    assert {**found, "repeated": 0} == prepared.whole
    # Dates in their forms are one date.
    noon = datetime(2026, 3, 1, 13, tzinfo=timezone(timedelta(hours=1)))
    days: list[Any] = [noon, "2026-03-01T12:00:00Z", 1772366400, "1772366400"]
    assert len({dynid.reduce_log(log, prepared.recipe, robot="a", start=day) for day in days}) == 1
    midnights: list[Any] = [date(2026, 3, 1), "2026-03-01", 1772323200.0]
    assert len({dynid.reduce_log(log, prepared.recipe, robot="a", start=day) for day in midnights}) == 1


def test_bad_logs_are_results_and_bad_arguments_are_not(prepared: Prepared, tmp_path: Path) -> None:
    recipe = prepared.recipe.read_bytes()
    first = prepared.rows[0]["path"]

    def code(log: Any, **more: Any) -> str:
        return str(json.loads(dynid.reduce_log(log, recipe, robot="r", **more))["code"])

    assert code(tmp_path / "none.csv") == "unreadable"
    columns = dynid.read_columns(first)
    assert code(dynid.Log.from_table({**columns, "t": 3 * columns["t"]})) == "recipe_mismatch"
    assert code(dynid.Log.from_table({name: values[:20] for name, values in columns.items()})) in ("malformed", "no_rows", "preflight")
    assert code(dynid.Log.read(tmp_path / "none.csv")) in ("unreadable", "malformed")
    store = dynid.FactorStore(tmp_path / "store", recipe)
    failure = store.put(dynid.reduce_log(tmp_path / "none.csv", recipe, robot="r"))
    assert failure is not None and failure["code"] == "unreadable" and store.failures.height == 0, "it may come"
    with pytest.raises(dynid.EstimateError):
        dynid.reduce_log(first, b"no recipe", robot="r")
    with pytest.raises(FileNotFoundError):
        dynid.reduce_log(first, tmp_path / "none.factors", robot="r")
    with pytest.raises(ValueError, match="robot"):
        dynid.reduce_log(first, recipe, robot="")
    with pytest.raises(ValueError, match="load: expected a finite number"):
        dynid.reduce_log(first, recipe, robot="r", covariates={"load": float("nan")})
    for start in ("soon", float("inf"), datetime(2026, 3, 1)):  # noqa: DTZ001
        with pytest.raises(ValueError, match="start"):
            dynid.reduce_log(first, recipe, robot="r", start=start)
    with pytest.raises(ValueError, match="found strat"):
        store.reduce([{"log": first, "robot": "r", "strat": 1}])
    made = dynid.reduce_log(first, recipe, robot="r")
    for wrong in (b"", b"{}", made[:-9], recipe, made.replace(b"dynid", b"dinyd")):
        with pytest.raises(dynid.DynidError):
            store.put(wrong)
    with pytest.raises(dynid.DynidError, match="recipe.factors"):
        dynid.FactorStore(tmp_path / "nowhere")
    with pytest.raises(dynid.DynidError, match="column `robot`"):
        (tmp_path / "m.csv").write_text("log\na.csv\n")
        dynid.read_manifest(tmp_path / "m.csv")
    program(prepared.folder, "reduce", "arm.toml", "--log", "made/logs/r002-001.csv.gz", "--out", str(tmp_path / "other.factors"))
    with pytest.raises(dynid.DynidError, match="recipe"):
        dynid.FactorStore(store.folder, tmp_path / "other.factors")
    with pytest.raises(dynid.DynidError, match="recipe"):
        store.put(dynid.reduce_log(first, tmp_path / "other.factors", robot="r"))


def test_a_lost_log_is_named_until_it_is_there(prepared: Prepared, tmp_path: Path) -> None:
    store = dynid.FactorStore(tmp_path / "store", prepared.recipe)
    row = prepared.rows[0]
    assert store.fail(row["log"], row["robot"], "its worker was lost")["code"] == "worker_lost"
    store.fail(row["log"], row["robot"], "its worker was lost")
    assert store.failures["log"] == [row["log"]] and len(store) == 0
    store.put(reduced(row, store.recipe))
    assert store.failures.height == 0 and len(store) == 1


def killer(rows: list[ManifestRow], recipe: bytes) -> list[bytes]:
    """Work that one log ends for good, and that is killed once beside."""
    if any(row["log"] == "logs/killer.csv" for row in rows):
        os.kill(os.getpid(), signal.SIGKILL)
    mark = Path(os.environ["DYNID_TEST_MARK"])
    if any(row["log"] == "logs/r003-004.csv.gz" for row in rows) and not mark.exists():
        mark.touch()
        os._exit(9)
    return [reduced(row, recipe) for row in rows]


def check_engine(prepared: Prepared, folder: Path, run: Any) -> None:
    """Any order and any batches give the fleet of one process; who dies loses nothing and counts nothing twice."""
    expected = files(prepared.folder / "factors")
    for batch, rows in ((7, prepared.rows), (1, prepared.rows[::-1])):
        store = dynid.FactorStore(folder / f"store{batch}", prepared.recipe)
        failures = run(rows, store, batch=batch)
        assert [f["log"] for f in failures] == ["logs/broken.csv"]
        assert files(store.folder) == expected
        assert without_command(dynid.fleet(store).to_json()) == prepared.whole
    store = dynid.FactorStore(folder / "killed", prepared.recipe)
    poison: ManifestRow = {"log": "logs/killer.csv", "path": "killer.csv", "robot": "r005", "start": None, "covariates": {}}
    failures = run([*prepared.rows[:20], poison, *prepared.rows[20:]], store, batch=10, work=killer)
    assert sorted((f["log"], f["code"]) for f in failures) == [("logs/broken.csv", "malformed"), ("logs/killer.csv", "worker_lost")]
    assert store.failures["log"] == ["logs/broken.csv", "logs/killer.csv"] and len(store) == 48
    kept = files(store.folder)
    assert {name: kept[name] for name in expected} == expected and len(kept) == len(expected) + 1
    found = without_command(dynid.fleet(store).to_json())
    told = {key: value for key, value in found.items() if key not in ("failures", "headline")}
    assert told == {key: value for key, value in prepared.whole.items() if key not in ("failures", "headline")}


@pytest.fixture
def workers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """What worker processes need to know."""
    monkeypatch.setenv("DYNID_TEST_MARK", str(tmp_path / "mark"))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([*PLACES, os.environ.get("PYTHONPATH", "")]))
    for place in PLACES:
        monkeypatch.syspath_prepend(place)
    yield


@pytest.mark.usefixtures("workers")
def test_fleet_on_dask(prepared: Prepared, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    dask = pytest.importorskip("dask")
    engine = importlib.import_module("dask_fleet")
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, local_directory=tmp_path) as cluster,
        distributed.Client(cluster) as client,
    ):
        check_engine(prepared, tmp_path, lambda *a, **k: engine.dask_fleet(client, *a, **k))


@pytest.mark.usefixtures("workers")
def test_fleet_on_ray(prepared: Prepared, tmp_path: Path) -> None:
    ray = pytest.importorskip("ray")
    engine = importlib.import_module("ray_fleet")
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False, configure_logging=False)
    try:
        check_engine(prepared, tmp_path, engine.ray_fleet)
    finally:
        ray.shutdown()


def page() -> list[str]:
    """Python of the page on engines: a program of one's own, Spark, object stores."""
    text = (ROOT / "docs/book/src/commands/fleet-engines.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    assert len(blocks) == 3
    return blocks


def test_page_of_the_book_on_engines(prepared: Prepared, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copy(prepared.recipe, tmp_path)
    (tmp_path / "made").symlink_to(prepared.folder / "made")
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    exec(page()[0], names)  # noqa: S102
    assert without_command((tmp_path / "fleet.json").read_text()) == prepared.whole
    assert files(tmp_path / "factors") == files(prepared.folder / "factors")
    pytest.importorskip("fsspec")
    exec(page()[2], names)  # noqa: S102
    row = prepared.rows[0]
    url = Path(row["path"]).resolve().as_uri()
    made = names["reduce_url"](url, names["store"].recipe, "r001")
    assert made == dynid.reduce_log(row["path"], names["store"].recipe, robot="r001", name=url)


@pytest.mark.usefixtures("workers")
def test_fleet_on_spark(prepared: Prepared, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pyspark")
    if shutil.which("java") is None:
        pytest.skip("no Java")
    shutil.copy(prepared.recipe, tmp_path)
    (tmp_path / "made").symlink_to(prepared.folder / "made")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYSPARK_PYTHON", sys.executable)
    monkeypatch.setenv("SPARK_LOCAL_IP", "127.0.0.1")
    names: dict[str, Any] = {}
    exec(page()[1], names)  # noqa: S102
    names["spark"].stop()
    assert without_command(dynid.fleet("spark-factors").to_json()) == prepared.whole
    assert files(tmp_path / "spark-factors") == files(prepared.folder / "factors")


@pytest.mark.parametrize("engine", ["dask", "ray"])
def test_examples_run_as_the_book_says(prepared: Prepared, tmp_path: Path, engine: str) -> None:
    pytest.importorskip({"dask": "distributed", "ray": "ray"}[engine])
    example = str(ROOT / f"examples/fleet/{engine}_fleet.py")
    arguments = ["type.factors", "made/manifest.csv", str(tmp_path / "factors"), "--out", str(tmp_path / "report"), "--workers", "2", "--batch", "9"]
    ended = subprocess.run([sys.executable, example, *arguments], cwd=prepared.folder, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.splitlines()[0].startswith("failed: logs/broken.csv (r002): ")
    assert ended.stdout.splitlines()[1] == "48 factors of 49 logs"
    assert without_command((tmp_path / "report/fleet.json").read_text()) == prepared.whole
    assert (tmp_path / "report/report.html").is_file()
