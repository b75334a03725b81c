"""What confidence is worth: fits the logistic regression behind it on drawn cases, and judges it on others.

    python calibrate.py fit   CASES,TRUTH,VERDICTS [CASES,TRUTH,VERDICTS ...]     # prints the coefficients for tuning/claim.rs
    python calibrate.py judge CASES,TRUTH,VERDICTS [CASES,TRUTH,VERDICTS ...]     # reliability by tenths, Brier score, wrong ones
    python calibrate.py fit-family | judge-family ...                             # the same for `family_confidence`

VERDICTS is what measure.py wrote: a folder per case with verdict.json and the log, which holds the figures of every finding. A finding is right
where the scorer of shared/concealed takes physics and place for right; its family is right where that takes the family for right at that place. The sets that `fit` sees must not be those that `judge` sees.
It needs numpy and scipy.
"""
import glob
import json
import os
import sys

import numpy as np
from scipy.optimize import minimize

HERE = os.path.dirname(os.path.abspath(__file__))
SHARED = os.environ.get("BACKDRIVE_CONCEALED", os.path.normpath(os.path.join(HERE, "..", "..", "..", "..", "shared", "concealed")))
sys.path.insert(0, SHARED)
import score  # noqa: E402

NAMES = ["with", "over_rival", "over_kin", "preferred", "removes", "left", "correlated", "memory", "beside", "at_bound", "over_other"]
# What can only speak for a finding, and what only against it: a coefficient of the other sign would be chance.
SIGNS = np.array([1, 1, 1, 1, 1, -1, -1, -1, -1, -1, 1])
# Over other laws of its family in its place speaks for the law, and not for the family; where nothing of the family is nearest, `preferred` is the same as `over_other`.
ABOUT_THE_LAW = {False: {"over_other"}, True: {"over_kin", "preferred", "memory"}}
RIDGE = 0.5


def right(finding, truth):
    # An effect that the draw takes for invisible, and that is found, is right.
    effects = [e for e in truth["effects"] if e.get("accept")] if truth["class"] != "outside" else []
    lopsided = any(e["physics"] == "asymmetric_coulomb" and finding["physics"] in ("coulomb", "bias") and score.place(finding) == score.tplace(e) for e in effects)
    return any(score.exact(finding, e) for e in effects) or lopsided


def right_family(finding, truth):
    effects = [e for e in truth["effects"] if e.get("accept")] if truth["class"] != "outside" else []
    return right(finding, truth) or any(score.family(finding, e) and score.place(finding) in score.places(e) for e in effects)


def place_of(finding):
    return finding["signal"] if finding.get("signal") else "-".join(finding["between"])


def findings(sets, family):
    for one in sets:
        _, truths, verdicts = one.split(",")
        for path in sorted(glob.glob(os.path.join(truths, "*.json"))):
            with open(path) as file:
                truth = json.load(file)
            folder = os.path.join(verdicts, truth["case"])
            verdict, _ = score.load(verdicts, truth["case"])
            if verdict is None:
                continue
            figures = {}
            log = os.path.join(folder, "log")
            for line in open(log) if os.path.exists(log) else []:
                if line.startswith("figures\t"):
                    _, physics, place, *numbers = line.rstrip("\n").split("\t")
                    figures[physics, place] = [float(x) for x in numbers]
            for finding in verdict["findings"]:
                numbers = figures.get((finding["physics"], place_of(finding)))
                if numbers is not None:
                    yield f"{os.path.basename(verdicts)}/{truth['case']}", truth, verdict, finding, numbers, (right_family if family else right)(finding, truth)


def fit(sets, family):
    all_of = list(findings(sets, family))
    x = np.array([f[4] for f in all_of])
    y = np.array([f[5] for f in all_of], float)

    def cost(c):
        z = c[0] + x @ c[1:]
        return np.sum(np.logaddexp(0, z) - y * z) + RIDGE * np.sum(c[1:] ** 2)

    ends = [(0, 0) if name in ABOUT_THE_LAW[family] else (0, None) if s > 0 else (None, 0) for name, s in zip(NAMES, SIGNS)]
    bounds = [(None, None)] + ends
    c = minimize(cost, np.zeros(1 + x.shape[1]), bounds=bounds, method="L-BFGS-B").x
    p = 1 / (1 + np.exp(-(c[0] + x @ c[1:])))
    print(f"{len(y)} findings, {int(y.sum())} right; Brier score {np.mean((p - y) ** 2):.4f} on the cases it was fitted to")
    print("[" + ", ".join(f"{v:.3g}" for v in c) + "]")
    for name, v in zip(["constant"] + NAMES, c):
        print(f"  {name:<12} {v:8.3f}")


def judge(sets, family):
    all_of = list(findings(sets, family))
    key = "family_confidence" if family else "confidence"
    p = np.array([f[3][key] for f in all_of])
    y = np.array([f[5] for f in all_of], float)
    print(f"{len(y)} findings of {len({f[0] for f in all_of})} cases; Brier score {np.mean((p - y) ** 2):.4f}; always the mean: {np.mean(y) * (1 - np.mean(y)):.4f}")
    print("| confidence | findings | mean confidence | right |")
    print("|---|---|---|---|")
    for low in np.arange(0, 1, 0.1):
        inside = (p >= low) & ((p < low + 0.1) | (low > 0.85))
        if inside.any():
            print(f"| {low:.1f} to {low + 0.1:.1f} | {inside.sum()} | {p[inside].mean():.2f} | {y[inside].mean():.2f} |")
    for name, truth, verdict, finding, _, good in sorted(all_of, key=lambda f: -f[3][key]):
        if not good and finding[key] >= 0.5:
            hidden = "+".join(f"{e['physics']}@{e.get('signal') or '-'.join(e['between'])}" for e in truth["effects"]) or "-"
            print(f"wrong at {finding[key]:.2f}: {name} ({truth['class']}, {verdict['verdict']}): {finding['physics']}@{place_of(finding)} for {hidden}")


if __name__ == "__main__":
    what, _, family = sys.argv[1].partition("-") if len(sys.argv) > 2 else ("", "", "")
    if what not in ("fit", "judge") or family not in ("", "family"):
        sys.exit(__doc__)
    {"fit": fit, "judge": judge}[what](sys.argv[2:], family == "family")
