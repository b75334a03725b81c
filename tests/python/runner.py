"""Runs `backdrive simulate` on models given as tables, and says how far two solutions are from each other.

A model is a dict in the shape of its TOML file: {"bodies": {...}, "elements": [...], "inputs": [...], "outputs": [...]}.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np


def value(x):
    """A number, a text or a list as TOML writes it, with every digit."""
    if isinstance(x, str):
        return json.dumps(x)
    if isinstance(x, (list, tuple)):
        return "[" + ", ".join(value(part) for part in x) + "]"
    return repr(float(x))


def toml(model):
    lines = ['name = "check"', 'title = "A check"', 'source = "made up"', 'motion = "translation"', "", "[bodies]"]
    lines += [f"{name} = {value(inertia)}" for name, inertia in model["bodies"].items()]
    for section in ("elements", "inputs", "outputs"):
        for entry in model.get(section, []):
            lines += ["", f"[[{section}]]"] + [f"{key} = {value(x)}" for key, x in entry.items()]
    return "\n".join(lines) + "\n"


class Backdrive:
    """The command line program, working in a directory of its own."""

    def __init__(self, program):
        self.program = program
        self.home = tempfile.TemporaryDirectory(prefix="backdrive-check-")
        self.here = Path(self.home.name)

    def simulate(self, model, inputs, period, step=None):
        """Outputs by name. `inputs` are arrays by name; `step` sets the substep (s), else the program chooses it."""
        names = [entry["name"] for entry in model["inputs"]]
        columns = np.column_stack([period * np.arange(len(inputs[names[0]]))] + [inputs[name] for name in names])
        (self.here / "model.toml").write_text(toml(model))
        drive = self.here / "drive.csv"
        np.savetxt(drive, columns, fmt="%.17g", delimiter=",", header=",".join(["t"] + names), comments="")
        return self.simulate_files(self.here / "model.toml", drive, None if step is None else max(1, round(period / step)))

    def simulate_files(self, model, drive, substeps=None):
        """Every column of the prediction, for files that exist."""
        out = self.here / "out.csv"
        command = [self.program, "simulate", str(model), str(drive), "--out", str(out), "--overwrite"]
        command += [] if substeps is None else ["--substeps", str(substeps)]
        done = subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL)
        if done.returncode != 0:
            raise RuntimeError(f"{' '.join(command)}\n{done.stderr}")
        return columns_of(out)


def columns_of(path):
    with open(path) as file:
        names = file.readline().strip().split(",")
        data = np.loadtxt(file, delimiter=",", ndmin=2)
    return {name: data[:, index] for index, name in enumerate(names)}


def share_of_range(found, expected):
    """Largest difference, as a share of the range of what is expected."""
    spread = np.ptp(expected)
    difference = np.max(np.abs(found - expected))
    return float(difference / spread) if spread > 0.0 else float(difference)


class Table:
    """Rows of measured agreement with their limits; remembers whether one was broken."""

    def __init__(self, first, columns):
        self.broken, self.reasons = [], set()
        self.head(first, columns)

    def head(self, first, columns):
        """A line with the names of the columns."""
        self.columns = columns
        print(f"{first:<46}" + "".join(f"{name:>14}" for name in columns) + "   limits", flush=True)

    def row(self, name, numbers, limits, why=""):
        """The first `len(limits)` numbers must each be at most their limit; `why` says, once, why one is what it is."""
        above = [i for i, limit in enumerate(limits) if not numbers[i] <= limit]
        self.broken += [f"{name}, {self.columns[i]}: {numbers[i]:.2e} is above {limits[i]:.0e}" for i in above]
        cells = "".join(f"{number:>14.1e}" for number in numbers)
        shown = ", ".join(f"{limit:.0e}" for limit in dict.fromkeys(limits))
        print(f"{name:<46}{cells}   {shown}{'  <-- ABOVE' if above else ''}", flush=True)
        if why and why not in self.reasons:
            self.reasons.add(why)
            print(f"    {why}", flush=True)

    def verdict(self):
        """Ends the script: 0 when every row held."""
        for line in self.broken:
            print(line, file=sys.stderr)
        sys.exit(1 if self.broken else 0)
