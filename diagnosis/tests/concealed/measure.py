"""Run the tool over sealed cases and sum up what it says.

    python measure.py CASES TRUTH OUT [--program PROGRAM] [--without] [--pattern 'case-0*'] [--row NAME] [-- ARGUMENTS FOR THE PROGRAM]

PROGRAM diagnoses one case: `PROGRAM CASE --out DIR`; without one, `cargo run --release --example diagnose` builds it. Every case is
diagnosed first; the truth is opened after the last verdict is written. After the score it says which verdicts are confidently wrong: a finding of
confidence 0.9 or more whose place or family is wrong, or one of 0.5 or more where nothing is missing. With --row the last line is a row of a
Markdown table: name, cases, right verdicts, confidently wrong ones, median and 90 % quantile of the time. With --without the truth is opened
before, by this script alone: each single effect's own physics is withheld from the tool, and what it says then is honest when it is
`unexplained`, `ambiguous`, `cannot_tell`, or below even odds.
"""
import argparse
import glob
import json
import math
import os
import statistics
import subprocess
import sys
import time
import tomllib

HERE = os.path.dirname(os.path.abspath(__file__))
WORKSPACE = os.path.normpath(os.path.join(HERE, "..", "..", ".."))
SHARED = os.environ.get("BACKDRIVE_CONCEALED", os.path.join(WORKSPACE, "..", "shared", "concealed"))


def program():
    command = ["cargo", "build", "--release", "--locked", "-p", "backdrive-diagnosis", "--example", "diagnose"]
    subprocess.run(command, cwd=WORKSPACE, check=True)
    target = os.environ.get("CARGO_TARGET_DIR", os.path.join(WORKSPACE, "target"))
    return os.path.join(target, "release", "examples", "diagnose")


def diagnose(run, case, out, more):
    os.makedirs(out, exist_ok=True)
    began = time.monotonic()
    done = subprocess.run([run, case, "--out", out, "-v", *more], capture_output=True, text=True)
    with open(os.path.join(out, "log"), "w") as log:
        log.write(done.stdout + done.stderr)
    return time.monotonic() - began


def read(path):
    with open(path) as file:
        return json.load(file)


def verdict(out):
    try:
        return read(os.path.join(out, "verdict.json"))
    except (OSError, ValueError):
        return None


def honest(v):
    """Whether a verdict claims no wrong physics with confidence."""
    if v is None:
        return False
    findings = v.get("findings") or []
    return v["verdict"] in ("unexplained", "ambiguous", "cannot_tell") or bool(findings) and findings[0].get("confidence", 1.0) < 0.5


def named(finding):
    return f"{finding['physics']}@{finding.get('signal') or '-'.join(finding.get('between') or ['?'])}"


def boldly_wrong(score, truth, findings):
    """The findings that are confidently wrong."""
    if truth["class"] in ("none", "parameters", "not_visible"):
        return [f for f in findings if f.get("confidence", 1.0) >= 0.5]
    right = [f for f in findings for e in truth["effects"] if score.place(f) in score.places(e) and score.family(f, e)]
    return [f for f in findings if f.get("confidence", 1.0) >= 0.9 and f not in right]


def summary(cases, truths, out, row):
    """What the score does not say: verdicts that are confidently wrong, and how long the slow ones take."""
    sys.path.insert(0, SHARED)
    import score
    right, wrong, seconds = 0, [], []
    paths = sorted(glob.glob(os.path.join(truths, "*.json")))
    for truth in map(read, paths):
        model = os.path.join(cases, truth["case"], "model.toml")
        if os.path.exists(model):
            with open(model, "rb") as file:
                truth = score.absorb(truth, tomllib.load(file))
        v = verdict(os.path.join(out, truth["case"]))
        if v is None:
            continue
        right += v["verdict"] in truth["accept_verdicts"]
        if bold := boldly_wrong(score, truth, v.get("findings") or []):
            hidden = "+".join(named(e) for e in truth["effects"]) or "nothing"
            wrong.append(f"  {truth['case']}: {', '.join(named(f) + ' %.2f' % f.get('confidence', 1.0) for f in bold)} for {hidden}")
        try:
            with open(os.path.join(out, truth["case"], "time.txt")) as file:
                seconds.append(float(file.read().split()[0]))
        except (OSError, ValueError, IndexError):
            pass
    seconds = sorted(seconds) or [float("nan")]
    middle, slow = statistics.median(seconds), seconds[math.ceil(0.9 * len(seconds)) - 1]
    print("\n== confidence and time ==", *wrong, sep="\n")
    print(f"verdict right {right} of {len(paths)}, confidently wrong {len(wrong)}, time median {middle:.1f} s, 90 % {slow:.1f} s, most {seconds[-1]:.1f} s")
    if row:
        print(f"| {row} | {len(paths)} | {right} | {len(wrong)} | {middle:.1f} | {slow:.1f} |")


def margin(truth):
    o = truth["oracle"]
    return max((o[a] or 1e9) / o[b] for a, b in (("held_out_retuned", "held_out_floor"), ("fit_retuned", "fit_floor")))


def withheld(run, cases, truths, out, more):
    """The true physics withheld, of each single effect that stays three floors away from a re-tuned nominal model."""
    sums = {}
    for truth in map(read, sorted(glob.glob(os.path.join(truths, "*.json")))):
        case = os.path.join(cases, truth["case"])
        if truth["class"] != "single" or not os.path.isdir(case) or margin(truth) < 3:
            continue
        physics = truth["effects"][0]["physics"]
        into = os.path.join(out, truth["case"])
        seconds = diagnose(run, case, into, ["--without", physics, *more])
        v = verdict(into)
        said = "+".join(f["physics"] for f in (v or {}).get("findings") or []) or "-"
        word = v["verdict"] if v else "FAILED"
        sums.setdefault(honest(v), []).append(word)
        print(f"{truth['case']:<10} without {physics:<20} {word:<16} {said:<40} {'honest' if honest(v) else 'WRONG'}   {seconds:.1f} s", flush=True)
    good, bad = len(sums.get(True, [])), len(sums.get(False, []))
    if good + bad:
        print(f"\nhonest where its own physics was withheld: {good} of {good + bad} ({100 * good / (good + bad):.0f} %)")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases")
    parser.add_argument("truth")
    parser.add_argument("out")
    parser.add_argument("--program")
    parser.add_argument("--without", action="store_true")
    parser.add_argument("--pattern", default="*")
    parser.add_argument("--row", metavar="NAME")
    own, more = sys.argv[1:], []
    if "--" in own:
        at = own.index("--")
        own, more = own[:at], own[at + 1:]
    a = parser.parse_args(own)
    score = os.path.join(SHARED, "score.py")
    if not a.without and not os.path.exists(score):
        print(f"SKIPPED: {score} is not there; BACKDRIVE_CONCEALED names its folder")
        return
    run = a.program or program()
    if a.without:
        withheld(run, a.cases, a.truth, a.out, more)
        return
    for case in sorted(glob.glob(os.path.join(a.cases, a.pattern))):
        diagnose(run, case, os.path.join(a.out, os.path.basename(case)), more)
    # The simulator of the score knows no irregular clocks, no input that nobody measured and no law of the second simulator.
    again = all(read(path).get("resim", True) for path in glob.glob(os.path.join(a.truth, "*.json")))
    subprocess.run([sys.executable, score, a.cases, a.out, a.truth, *(["--resim"] if again else [])], check=True)
    summary(a.cases, a.truth, a.out, a.row)


if __name__ == "__main__":
    main()
