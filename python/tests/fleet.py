"""`backdrive.map` over every executor that is installed: the same table to the byte.

    python fleet.py PROGRAM FOLDER
"""

import os
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path

PROGRAM, FOLDER = sys.argv[1:3]
sys.path.insert(0, FOLDER)
import backdrive  # noqa: E402

MODEL = Path(__file__).resolve().parents[2] / "plant/models/small-motor.toml"


def logs(folder):
    for unit in range(3):
        for day in range(1, 5):
            seed = 10 * unit + day
            drive = f"multisine:rms=0.015,from=0.5,to=20,period=2,periods=2,seed={seed}"
            out = folder / f"unit-{unit}/2026-11-{day:02}.csv"
            out.parent.mkdir(parents=True, exist_ok=True)
            subprocess.run([PROGRAM, "simulate", MODEL, drive, "--rate", "500", "--noise", str(seed), "--out", out], check=True, capture_output=True)


def main():
    place = Path(FOLDER) / "fleet"
    logs(place / "logs")
    tables = {}

    def mapped(name, executor):
        survey = backdrive.map(place / "logs", MODEL, executor=executor, out=place / name, shards=5, progress=False)
        assert survey.failed == {} and survey.changes == [] and survey.analysis["recordings"] == 12, survey
        tables[name] = Path(survey.table_path).read_bytes()
        return survey

    survey = mapped("here", None)
    assert len(survey.table) == 12 and set(survey.table["unit"]) == {"unit-0", "unit-1", "unit-2"}
    with ThreadPoolExecutor(2) as executor:
        mapped("threads", executor)
    with ProcessPoolExecutor(2) as executor:
        mapped("processes", executor)
    os.environ["PYTHONPATH"] = FOLDER  # for workers that are started anew
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        print("SKIPPED: dask and distributed are not installed")
    else:
        with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
            mapped("dask", client.get_executor())
    try:
        import ray
    except ImportError:
        print("SKIPPED: ray is not installed")
    else:
        ray.init(num_cpus=2, include_dashboard=False, logging_level="ERROR", runtime_env={"env_vars": {"PYTHONPATH": FOLDER}})
        mapped("ray", ray)
        ray.shutdown()
    program = place / "program"
    done = subprocess.run([PROGRAM, "fleet", place / "logs", "--model", MODEL, "--out", program], capture_output=True, text=True)
    assert done.returncode == 0, done
    tables["program"] = (program / "triage.parquet").read_bytes()
    assert len(set(tables.values())) == 1, {name: len(table) for name, table in tables.items()}
    listed = [{"file": place / f"logs/unit-0/2026-11-0{day}.csv", "unit": 7, "date": f"2026-11-0{day}"} for day in range(1, 5)]
    survey = backdrive.map(listed, MODEL, out=place / "listed", progress=False)
    assert set(survey.table["unit"]) == {"7"}, survey.table
    try:
        backdrive.map(place / "logs", MODEL, what="everything")
    except backdrive.UsageError as error:
        assert "triage" in str(error)
    else:
        raise AssertionError("a wrong question is not refused")
    print("the same table from", ", ".join(tables))


if __name__ == "__main__":
    main()
