"""Draws docs/verdict.svg: what the README hides from a model, and what a diagnosis finds; after the README's commands on logs of a motor, in their folder.

    backdrive fit out/motor/model.toml out/motor --out out/motor/refitted.toml
    for m in motor/refitted verdict/model.diagnosed; do
        backdrive simulate out/$m.toml out/motor/unseen.csv --out out/$(basename $m).csv --columns out/motor/set.toml; done
    python3 docs/plot_verdict.py out docs/verdict.svg      # needs matplotlib and numpy
"""
import json
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy

folder, out = sys.argv[1:3]
read = lambda path: numpy.genfromtxt(f"{folder}/{path}", delimiter=",", names=True)
seen, refitted, diagnosed = read("motor/unseen.csv"), read("refitted.csv"), read("model.diagnosed.csv")
verdict = json.load(open(f"{folder}/verdict/verdict.json"))
found = verdict["findings"][0]["parameters"]["force"]

matplotlib.rcParams.update({"font.size": 9, "svg.hashsalt": "backdrive", "axes.spines.top": False, "axes.spines.right": False})
figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), width_ratios=(1, 1))
left.plot(seen["t"], seen["angle"], color="#999999", lw=3, label="recorded, seen by no fit")
left.plot(refitted["t"], refitted["angle"], color="#b03a2e", lw=1, label="the user's model, refitted")
left.plot(diagnosed["t"], diagnosed["angle"], color="#1f4e79", lw=1, label="with what was found")
left.set_xlabel("time, s")
left.set_ylabel("angle, rad")
left.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)

# The force that the user's model lacks along the recorded motion: torque less inertia and damping.
model = {line.split("=")[0].strip(): line for line in open(f"{folder}/verdict/model.diagnosed.toml") if "=" in line}
number = lambda key: float(model[key].split("=")[1].split("#")[0])
step = seen["t"][1] - seen["t"][0]
smooth = lambda x: numpy.convolve(x, numpy.hanning(15) / numpy.hanning(15).sum(), mode="same")
speed = numpy.gradient(smooth(seen["angle"]), step)
missing = smooth(seen["torque"]) - number("body") * numpy.gradient(speed, step) - number("damping") * speed
inside = slice(60, -60)
right.plot(speed[inside][::2], 1e3 * missing[inside][::2], ".", color="#bbbbbb", ms=2, label="missing along the motion")
sides = numpy.array([-1.0, 0.0, 0.0, 1.0]) * numpy.abs(speed[inside]).max()
right.plot(sides, [-4, -4, 4, 4], color="#2e7d32", lw=3, alpha=0.5, label="hidden: 4 mN m")
right.plot(sides, 1e3 * found["value"] * numpy.array([-1, -1, 1, 1]), color="#1f4e79", lw=1, label=f"found: {1e3 * found['value']:.2f} mN m")
right.set_xlabel("speed, rad/s")
right.set_ylabel("torque, mN m")
right.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
figure.tight_layout()
figure.savefig(out, metadata={"Date": None})
