"""Find the physics that a robot's model leaves out, from logs of what it did; ask whether a telerobot's loop is stable.

    import backdrive
    verdict = backdrive.diagnose({"a": frame_a, "b": frame_b}, "model.toml", held_out=frame_c)
    print(verdict)                      # the text of the command line; in a notebook `verdict` alone shows the report
    verdict.model.write("better.toml")  # the model with what was found

A recording is a path (a set's folder, `set.toml`, CSV, MCAP, parquet, MAT), or columns: a pandas or polars frame, a dictionary of arrays, a structured NumPy array.
Its column `t` is the time in s; the others have the names of the model's inputs and outputs, in SI units, unless `columns` states otherwise. Results equal those
of the command line `backdrive` to the last bit. Other Python threads continue meanwhile, and Ctrl-C stops the work.
"""

from ._backdrive import __version__
from ._clock import ClockWarning
from ._errors import Error, InputError, MachineError, UsageError
from ._figures import Figure
from ._fleet import Survey, map
from ._model import Model
from ._readers import Contract, load_lerobot, load_mat, load_parquet, load_rosbag, save
from ._results import Exported, Fields, Fit, Interrupted, Prediction, Report, Verdict
from ._verbs import compare, diagnose, export, fit, inspect, load_bag, save_bag, simulate, stability, why

__all__ = [
    "ClockWarning", "Contract", "Error", "Exported", "Fields", "Figure", "Fit", "InputError", "Interrupted", "MachineError", "Model", "Prediction", "Report", "Survey", "UsageError",
    "Verdict", "__version__", "compare", "diagnose", "export", "fit", "inspect", "load_bag", "load_lerobot", "load_mat", "load_parquet", "load_rosbag", "map", "save", "save_bag", "simulate",
    "stability", "why",
]
