"""What is wrong with the times of a recording."""

from __future__ import annotations

from typing import Any

# Steps that differ from the usual one by more than this share of it are uneven; by more than MISSING times it, samples are missing.
UNEVEN = 0.05
MISSING = 1.5


def remarks(t: Any, name: str) -> list[str]:
    """A sentence for each thing: times that repeat, run back, jump, or are uneven. `t`: s."""
    import numpy

    out: list[str] = []
    steps = numpy.diff(numpy.asarray(t, dtype=float))
    if len(steps) == 0:
        return [f"{name}: has fewer than two samples"]
    if not numpy.isfinite(steps).all():
        return [f"{name}: {int((~numpy.isfinite(t)).sum())} times are not numbers"]

    def first(where: Any) -> str:
        row = int(numpy.argmax(where))
        return f"first after sample {row}, at {float(t[row]):.6g} s"

    same, back = steps == 0.0, steps < 0.0
    if same.any():
        out.append(f"{name}: the time repeats {int(same.sum())} times, {first(same)}: remove the duplicate rows")
    if back.any():
        out.append(f"{name}: the clock runs back {int(back.sum())} times, by up to {-steps.min():.6g} s, {first(back)}: cut the recording there")
    ahead = steps[steps > 0.0]
    if len(ahead) == 0:
        return out
    usual = float(numpy.median(ahead))
    jumps = steps > MISSING * usual
    if jumps.any():
        lost = int(numpy.round(steps[jumps] / usual - 1.0).sum())
        out.append(f"{name}: the clock jumps {int(jumps.sum())} times, by up to {steps.max():.6g} s where {usual:.6g} s are usual, {first(jumps)}: about {lost} samples are missing")
    uneven = (numpy.abs(steps - usual) > UNEVEN * usual) & ~jumps & ~same & ~back
    if uneven.mean() > 0.01:
        spread = float(numpy.std(steps[~jumps & ~same & ~back]))
        out.append(f"{name}: the steps are uneven: {usual:.6g} s as a rule, with a standard deviation of {spread:.3g} s")
    return out


def warn(t: Any, name: str) -> None:
    """Warns of what is wrong with the times."""
    import warnings

    for remark in remarks(t, name):
        warnings.warn(remark, ClockWarning, stacklevel=4)


class ClockWarning(UserWarning):
    """The times of a recording are not what a clock gives."""
