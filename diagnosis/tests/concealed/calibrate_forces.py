"""How sure a law on forces is: a logistic regression of the figures of what is claimed on whether it is right.

    calibrate_forces.py EXAMPLE CASES TRUTH [CASES TRUTH ...]

EXAMPLE is target/release/examples/forces. CASES are folders of cases as real_residual.py draws them (laws hidden in the noise of real machines), TRUTH what it hid. Prints the
coefficients of `equation_error.confidence` and `equation_error.kind_confidence`, and how many of the claims of machines that were left out of a regression are right.
"""
import glob, json, os, subprocess, sys
import numpy as np

KINDS = {
    "friction": {"coulomb", "asymmetric_coulomb", "stribeck", "dahl", "friction_deficit"},
    "viscous": {"quadratic_drag", "damper", "asymmetric_damper"},
    "position": {"cogging"},
    "constant": {"bias", "offset", "asymmetric_coulomb"},
    "elastic": {"spring", "cubic_spring"},
}
# The same force under other names.
ALIKE = {"asymmetric_coulomb": [{"coulomb", "offset"}], "stribeck": [{"friction_deficit"}], "bias": [{"offset"}, {"spring"}]}
WEIGHT_OF_SMALL = 0.3
# Of the numbers of a law no coefficient is fitted: it would be one of which laws were drawn.
USED = np.array([1, 1, 1, 1, 0, 1.0])


def claims(example, cases, truth):
    for case in sorted(glob.glob(f"{cases}/case-*")):
        hidden = json.load(open(f"{truth}/{os.path.basename(case)}.json"))
        found = json.loads(subprocess.run([example, f"{case}/set.toml"], capture_output=True, text=True, check=True).stdout)["claimed"]
        names = {law["physics"] for law in found}
        right = {effect["physics"] for effect in hidden["effects"]}
        kinds = set().union(*[KINDS[effect["family"]] for effect in hidden["effects"]], set())
        for effect in list(right):
            for other in ALIKE.get(effect, []):
                if other <= names:
                    right, kinds = right | other, kinds | other
        for law in found:
            yield hidden["source"], law["law"], law["kind"], law["physics"] in right, law["physics"] in kinds


def with_constant(x):
    return np.column_stack([np.ones(len(x)), np.array(x) * USED])


def regression(x, y):
    x = with_constant(x)
    small = WEIGHT_OF_SMALL * np.array([0.05] + [1.0] * (x.shape[1] - 1))
    w = np.zeros(x.shape[1])
    for _ in range(200):
        p = 1 / (1 + np.exp(-x @ w))
        w = w + np.linalg.solve((x.T * (p * (1 - p))) @ x + np.diag(small), x.T @ (y - p) - small * w)
    return w


def main():
    example, folders = sys.argv[1], sys.argv[2:]
    rows = [row for cases, truth in zip(folders[::2], folders[1::2]) for row in claims(example, cases, truth)]
    sources = np.array([row[0] for row in rows])
    for name, figures, is_right in (("confidence", 1, 3), ("kind_confidence", 2, 4)):
        x, y = np.array([row[figures] for row in rows]), np.array([float(row[is_right]) for row in rows])
        print(name, [round(float(c), 3) for c in regression(x, y)])
        p = np.zeros(len(y))
        for source in set(sources):
            own = sources == source
            p[own] = 1 / (1 + np.exp(-with_constant(x[own]) @ regression(x[~own], y[~own])))
        for least in (0.5, 0.9):
            print(f"  machines left out: of {int((p >= least).sum())} claims at {least} and more {int(y[p >= least].sum())} are right")


if __name__ == "__main__":
    main()
