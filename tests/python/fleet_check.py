"""The analysis of a fleet beside statsmodels and SciPy.

    python fleet_check.py BACKDRIVE

Writes a table of a fleet with pyarrow, has it analysed, and computes the same: the variance between units and the mean by `combine_effects` (Paule & Mandel), the
variance between recordings as a root of SciPy, shrinkage from these, a change's p-value by SciPy's t test, and adjusted p-values by SciPy.
"""

import json
import subprocess
import sys
import tempfile
from datetime import date, timedelta
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import scipy.stats
from scipy.optimize import brentq

UNITS, RECORDINGS = 12, 20


def table(path):
    random = np.random.default_rng(3)
    rows = []
    for unit in range(UNITS):
        level = 2.0 + 0.2 * random.normal()
        for number in range(RECORDINGS):
            day = date(2026, 3, 1) + timedelta(days=2 * number)
            sd = 0.02 * random.uniform(0.5, 2.0)
            value = level + 0.05 * random.normal() + sd * random.normal() + (0.6 if unit == 4 and number >= 12 else 0.0)
            rows.append((f"u{unit:02}/{day}", f"u{unit:02}", "elbow", str(day), value, sd))
    names = ["recording", "unit", "joint", "date", "dry", "dry_sd"]
    columns = {name: [row[index] for row in rows] for index, name in enumerate(names)}
    made = pa.table(columns).replace_schema_metadata({"backdrive.fleet": "triage"})
    pq.write_table(made, path)
    return columns


def near(name, found, expected, tolerance=1e-6):
    print(f"{name:28} {found:14.8g} {expected:14.8g}")
    assert abs(found - expected) <= tolerance * max(1.0, abs(expected)), (name, found, expected)


def added(groups):
    free = sum(len(y) - 1 for y, _ in groups)

    def excess(variance):
        total = 0.0
        for y, v in groups:
            w = 1 / (v + variance)
            total += np.sum(w * (y - np.sum(w * y) / np.sum(w)) ** 2)
        return total - free

    return brentq(excess, 0.0, 10.0, xtol=1e-15) if excess(0.0) > 0 else 0.0


def main(program):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "t.parquet"
        columns = table(path)
        done = subprocess.run([program, "fleet", str(path), "--json"], capture_output=True, text=True)
        assert done.returncode == 1, done
        analysis = json.loads(done.stdout)["analysis"]
    pooled = next(p for p in analysis["parameters"] if p["parameter"] == "dry")["pooled"]
    assert [(c["unit"], c["parameter"]) for c in analysis["changes"]] == [("u04", "dry")], analysis["changes"]
    change = analysis["changes"][0]
    assert change["since"] == "2026-03-25" and change["ci95"][0] < 0.6 < change["ci95"][1], change

    units, values, sds = (np.array(columns[name]) for name in ("unit", "dry", "dry_sd"))
    dates = np.array(columns["date"])
    groups = {}
    for unit in sorted(set(units)):
        counted = (units == unit) & ((unit != "u04") | (dates >= change["since"]))
        groups[unit] = (values[counted], sds[counted] ** 2)
    within = added(list(groups.values()))
    near("sd between recordings", pooled["within_sd"], np.sqrt(within))
    weights = {unit: 1 / (v + within) for unit, (_, v) in groups.items()}
    own = np.array([np.sum(weights[unit] * y) / np.sum(weights[unit]) for unit, (y, _) in groups.items()])
    variance = np.array([1 / np.sum(weights[unit]) for unit in groups])
    try:
        from statsmodels.stats.meta_analysis import combine_effects

        combined = combine_effects(own, variance, method_re="iterated", atol=1e-9)
        between, mean = combined.tau2, combined.mean_effect_re
    except ImportError:
        print("statsmodels is not installed: SciPy's root takes its place")
        between = added([(own, variance)])
        mean = np.sum(own / (variance + between)) / np.sum(1 / (variance + between))
    near("sd between units", pooled["between_sd"], np.sqrt(between), 1e-5)
    near("mean", pooled["mean"], mean, 1e-6)
    count = len(own)
    for unit, y, v in zip(groups, own, variance):
        shrinkage = (count - 3) / (count - 1) * v / (v + between)
        sd = np.sqrt(v * (1 - (count - 1) / count * shrinkage) + 2 / (count - 3) * (shrinkage * (y - mean)) ** 2)
        near(f"{unit} pooled", pooled["units"][unit]["value"], y + shrinkage * (mean - y), 1e-6)
        near(f"{unit} sd", pooled["units"][unit]["sd"], sd, 1e-5)

    # The change with errors of one size is a t test; here the sizes differ, so that only the order of magnitude is compared.
    y = values[units == "u04"]
    before, after = y[:12], y[12:]
    test = scipy.stats.ttest_ind(after, before)
    assert change["p"] < 1e-6 and test.pvalue < 1e-9, (change["p"], test.pvalue)
    # With the other units' changes removed, p-values of all units together give q.
    assert change["q"] <= min(1.0, change["p"] * UNITS * 1.0001)
    p = np.array([0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240, 0.4262, 0.5719, 0.6528, 0.7590, 1.0])
    assert np.sum(scipy.stats.false_discovery_control(p) <= 0.05) == 4  # as in the unit test of `adjusted`
    print("the analysis of a fleet agrees")


main(sys.argv[1])
