"""How much verdicts depend on each entry of the tuning table.

    python sensitivity.py CASES TRUTH OUT --program PROGRAM [--entry NAME]... [--change x0.5 --change x2] [--pattern 'case-0*'] [--workers 2]
    python sensitivity.py CASES TRUTH OUT --program PROGRAM --run claim.alike=0 --run search.simpler=0,search.ripples=0

PROGRAM is `target/release/examples/diagnose`. Every case is diagnosed with the table as it is, then with one entry changed at a time (or with the
changes of each --run). What is counted: cases whose claim (the word, and the physics with their places) differs from the first, the points against
the truth, and the work. A case is worth one point: no false alarm where nothing is missing, the physics at its place where one is, the share of the
effects found where there are more. The truth is opened after the last verdict is written. Verdicts do not depend on the number of threads, so that
each run has one.
"""
import argparse
import concurrent.futures
import glob
import json
import os
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
SHARED = os.environ.get("BACKDRIVE_CONCEALED", os.path.normpath(os.path.join(HERE, "..", "..", "..", "..", "shared", "concealed")))


def entries(program):
    """Names of the table's entries."""
    said = subprocess.run([program, "--list-tuning"], capture_output=True, text=True, check=True).stdout
    return [line.split("\t")[0] for line in said.splitlines() if line]


def diagnose(program, case, out, changes):
    os.makedirs(out, exist_ok=True)
    if os.path.exists(os.path.join(out, "verdict.json")):
        return
    more = [word for change in changes for word in ("--tuning", change)]
    environment = {**os.environ, "RAYON_NUM_THREADS": "1"}
    done = subprocess.run([program, case, "--out", out, *more], capture_output=True, text=True, env=environment)
    with open(os.path.join(out, "log"), "w") as log:
        log.write(done.stdout + done.stderr)


def claim(out):
    """What is claimed, and the work it took."""
    try:
        with open(os.path.join(out, "verdict.json")) as file:
            v = json.load(file)
    except (OSError, ValueError):
        return None, 0
    found = sorted((f["physics"], str(f.get("between") or f.get("signal"))) for f in v.get("findings") or [])
    return (v["verdict"], tuple(found)), (v.get("searched") or {}).get("steps", 0)


def points(cases, verdicts, truth):
    """Points of each case."""
    marks = verdicts + ".json"
    command = [sys.executable, os.path.join(SHARED, "score.py"), cases, verdicts, truth, "--quiet", "--json", marks]
    subprocess.run(command, check=True, capture_output=True)
    with open(marks) as file:
        rows = json.load(file)
    each = {}
    for r in rows:
        if r["cls"] == "single":
            each[r["case"]] = float(r["exact"])
        elif r["cls"] == "double":
            each[r["case"]] = float(r["found"])
        elif r["cls"] == "outside":
            each[r["case"]] = float(r["verdict_right"])
        else:
            each[r["case"]] = float(not r["false_alarm"])
    return each


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases")
    parser.add_argument("truth")
    parser.add_argument("out")
    parser.add_argument("--program", required=True)
    parser.add_argument("--entry", action="append")
    parser.add_argument("--change", action="append")
    parser.add_argument("--run", action="append")
    parser.add_argument("--pattern", default="*")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    a = parser.parse_args()
    if a.run:
        runs = [run.split(",") for run in a.run]
    else:
        runs = [[f"{name}={change}"] for name in a.entry or entries(a.program) for change in a.change or ["x0.5", "x2"]]
    runs = [[]] + runs
    cases = sorted(glob.glob(os.path.join(a.cases, a.pattern)))
    folder = lambda run: os.path.join(a.out, "+".join(run) or "as-it-is")
    with concurrent.futures.ThreadPoolExecutor(a.workers) as pool:
        for run in runs:
            list(pool.map(lambda case: diagnose(a.program, case, os.path.join(folder(run), os.path.basename(case)), run), cases))
    names = [os.path.basename(case) for case in cases]
    base = {name: claim(os.path.join(folder([]), name)) for name in names}
    before = points(a.cases, folder([]), a.truth)
    print(f"{len(names)} cases")
    print(f"{'change':<52} {'claims that differ':>18} {'points':>8} {'won':>5} {'lost':>5} {'work':>6}")
    for run in runs:
        now = {name: claim(os.path.join(folder(run), name)) for name in names}
        after = points(a.cases, folder(run), a.truth)
        differ = sum(now[name][0] != base[name][0] for name in names)
        gains = [after[name] - before[name] for name in names]
        work = sum(now[name][1] for name in names) / max(1, sum(base[name][1] for name in names))
        won, lost = sum(g for g in gains if g > 0), -sum(g for g in gains if g < 0)
        print(f"{', '.join(run) or 'as it is':<52} {differ:>18} {sum(after[name] for name in names):>8g} {won:>5g} {lost:>5g} {work:>6.2f}", flush=True)


if __name__ == "__main__":
    main()
