"""Draws docs/contact.svg: the contact task without and with the canceller, from two bags exported as CSV.

    cargo run --release -- run launch/contact.toml --lambda 3 --limits ignored --canceller none --bag without.mcap
    cargo run --release -- run launch/contact.toml --lambda 3 --limits ignored --bag with.mcap
    for k in without with; do cargo run --release -- bag export $k.mcap --csv $k.csv; done
    python3 docs/plot_contact.py without.csv with.csv docs/contact.svg      # needs matplotlib
"""
import csv
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def read(path):
    with open(path) as f:
        rows = csv.reader(f)
        head = next(rows)
        columns = list(zip(*[[float(x) for x in row] for row in rows]))
    pick = lambda part: columns[next(i for i, name in enumerate(head) if part in name)]
    return pick("t"), pick("/slave/measured_js.effort"), pick("/slave/servo_jp.position"), pick("setpoint_js.position")


matplotlib.rcParams.update({"font.size": 9, "svg.hashsalt": "backdrive", "axes.spines.top": False, "axes.spines.right": False})
figure, axes = plt.subplots(2, 2, figsize=(9, 4), sharex=True, sharey="row")
for column, (path, title) in enumerate(zip(sys.argv[1:3], ("nothing cancelled", "induced motion predicted and subtracted"))):
    t, force, command, intent = read(path)
    axes[0][column].set_title(title)
    axes[0][column].plot(t, [1e3 * x for x in intent], color="#999999", lw=1, label="hand wants")
    axes[0][column].plot(t, [1e3 * x for x in command], color="#1f4e79", lw=1, label="slave is told")
    axes[1][column].plot(t, force, color="#b03a2e", lw=0.8)
    axes[1][column].set_xlabel("time, s")
axes[0][0].set_ylabel("position, mm")
axes[1][0].set_ylabel("contact force, N")
axes[0][0].legend(frameon=False, loc="lower center")
figure.tight_layout()
figure.savefig(sys.argv[3], metadata={"Date": None})
