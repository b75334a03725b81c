"""Verdicts of the servo joints that draw_servos.py drew: right kinds, false alarms, held-out errors.

    python score_servos.py CASES VERDICTS     (VERDICTS/NNN/verdict.json)
"""

import json
import sys
from pathlib import Path

ALIKE = [{"coulomb", "stribeck", "dead_band", "backlash"}, {"saturation", "speed_limit", "acceleration_limit"}, {"payload", "gravity", "gain"}]


def family(kind):
    return next((i for i, group in enumerate(ALIKE) if kind in group), kind)


def main():
    cases, verdicts = Path(sys.argv[1]), Path(sys.argv[2])
    exact = kinds = effects = alarms = nulls = extra = claims = sure = sure_right = 0
    errors = []
    for case in sorted(cases.iterdir()):
        file = verdicts / case.name / "verdict.json"
        if not file.exists():
            continue
        truth = [e["kind"] for e in json.loads((case / "truth.json").read_text())["effects"]]
        verdict = json.loads(file.read_text())
        found = [f["physics"] for f in verdict["findings"] if f["confidence"] >= 0.5]
        families = {family(k) for k in truth}
        for f in verdict["findings"]:
            claims += 1
            extra += family(f["physics"]) not in families
            if f["confidence"] >= 0.9:
                sure += 1
                sure_right += f["physics"] in truth
        if not truth:
            nulls += 1
            alarms += bool(verdict["findings"])
        for kind in truth:
            effects += 1
            exact += kind in found
            kinds += family(kind) in {family(f["physics"]) for f in verdict["findings"]}
        errors.append(verdict["held_out"]["nrmse_after"])
        told = ", ".join(f"{f['physics']} {f['confidence']:.2f}" for f in verdict["findings"])
        print(f"{case.name}  hidden: {', '.join(truth) or '-':<32} found: {told or '-'}   nrmse {errors[-1]:.3f}")
    errors.sort()
    print(f"effects {effects}: law named {exact}, kind found {kinds}; claims {claims}, of another kind {extra}; sure {sure}, right {sure_right}")
    print(f"nulls {nulls}, with a finding {alarms}; held-out nrmse median {errors[len(errors) // 2]:.4f}, worst {errors[-1]:.3f}")


if __name__ == "__main__":
    main()
