"""Diagnoses sealed arms and scores the verdicts against what was hidden.

    python tests/python/score_arms.py OUT COMMAND...

OUT is what draw_arms.py wrote. COMMAND is run for each case with the set's folder and a folder for the verdict behind it, such as
`target/release/examples/diagnose_arm`, or `sh -c 'target/release/backdrive diagnose "$0" --out "$1" --no-report'`. The truth is opened after every verdict is
written.

detected: something is hidden, and the verdict claims that physics is missing. joint: a claimed finding names its joint (of a payload and of gravity: the
arm's end and base). physics: it names its physics there. false alarm: physics is claimed where none is hidden. beside: findings that are claimed beside all that is hidden.
"""
import json
import statistics
import subprocess
import sys
import time
from pathlib import Path

# Names under which a hidden physics may be found: the same force, or one that contains it.
SAME = {
    "damper": {"damper", "asymmetric_damper"},
    "stribeck": {"stribeck"},
    "gravity_direction": {"gravity_direction"},
}


def place(finding):
    if "signal" in finding:
        return finding["signal"].split(".")[0]
    return finding["between"][0]


def main():
    out, command = Path(sys.argv[1]), sys.argv[2:]
    cases = sorted((out / "cases").iterdir())
    seconds, verdicts = [], {}
    for case in cases:
        folder = out / "verdicts" / case.name
        folder.mkdir(parents=True, exist_ok=True)
        began = time.monotonic()
        done = subprocess.run([*command, str(case), str(folder)], capture_output=True, text=True, timeout=600)
        seconds.append(time.monotonic() - began)
        file = folder / "verdict.json"
        verdicts[case.name] = json.loads(file.read_text()) if file.exists() else None
        if verdicts[case.name] is None:
            print(f"{case.name}: no verdict: {done.stderr.strip()[:200]}")
    (out / "seconds.json").write_text(json.dumps(dict(zip(verdicts, seconds))))
    effects = detected = joint = physics = beside = nulls = alarms = 0
    arms = found_arms = 0
    for case in cases:
        truth = json.loads((out / "truth" / f"{case.name}.json").read_text())
        verdict = verdicts[case.name] or dict(verdict="none", findings=[])
        claims = verdict["verdict"] in ("missing", "ambiguous")
        findings = verdict["findings"] if claims else []
        last = f"joint{truth['joints']}"
        if truth["null"]:
            nulls += 1
            alarms += claims
            if claims:
                print(f"{case.name}: {truth['null']}, and found", [(f["physics"], place(f)) for f in findings])
            continue
        arms += 1
        found_arms += claims
        left = list(findings)
        for hidden in truth["hidden"]:
            where = {"payload": last, "gravity_direction": "base"}.get(hidden["physics"], hidden["joint"])
            names = SAME.get(hidden["physics"], {hidden["physics"]})
            effects += 1
            detected += claims
            there = [f for f in findings if place(f) == where]
            right = [f for f in there if f["physics"] in names]
            joint += bool(there)
            physics += bool(right)
            if right:
                left.remove(right[0])
            else:
                print(f"{case.name}: {truth['kind']}, hidden {hidden['physics']} at {where}; found", [(f["physics"], place(f), round(f["confidence"], 2)) for f in findings])
        beside += len(left)
        if left and all(any(f["physics"] in SAME.get(h["physics"], {h["physics"]}) for f in findings) for h in truth["hidden"]):
            print(f"{case.name}: beside what is hidden found", [(f["physics"], place(f), round(f["confidence"], 2)) for f in left])
    share = lambda a, b: f"{a} of {b} ({100 * a / max(b, 1):.0f} %)"
    print(f"arms with something hidden that were claimed: {share(found_arms, arms)}")
    print(f"effects: {effects}; detected {share(detected, effects)}, joint {share(joint, effects)}, physics {share(physics, effects)}; findings beside them {beside}")
    print(f"nulls: {nulls}; false alarms {share(alarms, nulls)}")
    print(f"seconds: median {statistics.median(seconds):.1f}, longest {max(seconds):.1f}")


if __name__ == "__main__":
    main()
