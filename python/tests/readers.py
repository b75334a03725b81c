"""The readers held against the writers of others: pyarrow, scipy and rosbags; a LeRobot dataset in the layout that its version 3 publishes.

    python readers.py FOLDER        FOLDER: where the package is
"""

import json
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import unittest
import warnings

PLACE = sys.argv[1]
sys.path.insert(0, PLACE)

import numpy  # noqa: E402
import pyarrow  # noqa: E402
import pyarrow.parquet  # noqa: E402

import backdrive  # noqa: E402

JOINTS = ["shoulder_pan", "elbow_flex"]


def lerobot_v3(root, episodes, fps, *, features=("observation.state", "action"), names=None, files=2):
    """Writes episodes, each a dictionary of arrays (rows, joints) by feature, over several files."""
    names = names or [f"{joint}.pos" for joint in JOINTS]
    told = {f: {"dtype": "float32", "shape": [len(names)], "names": names} for f in features}
    for name, dtype in (("timestamp", "float32"), ("frame_index", "int64"), ("episode_index", "int64"), ("index", "int64"), ("task_index", "int64")):
        told[name] = {"dtype": dtype, "shape": [1], "names": None}
    frames = sum(len(e[features[0]]) for e in episodes)
    info = {"codebase_version": "v3.0", "fps": fps, "features": told, "total_episodes": len(episodes), "total_frames": frames, "total_tasks": 1}
    info |= {"data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet", "robot_type": "so101_follower"}
    (root / "meta").mkdir(parents=True)
    (root / "meta/info.json").write_text(json.dumps(info))
    (root / "data/chunk-000").mkdir(parents=True)
    tables, index = [], 0
    for number, episode in enumerate(episodes):
        rows = len(episode[features[0]])
        columns = {f: pyarrow.FixedSizeListArray.from_arrays(pyarrow.array(numpy.asarray(episode[f], dtype="f4").ravel()), len(names)) for f in features}
        columns["timestamp"] = pyarrow.array((numpy.arange(rows) / fps).astype("f4"))
        columns |= {"frame_index": pyarrow.array(numpy.arange(rows)), "episode_index": pyarrow.array(numpy.full(rows, number))}
        columns |= {"index": pyarrow.array(numpy.arange(index, index + rows)), "task_index": pyarrow.array(numpy.zeros(rows, dtype="i8"))}
        tables.append(pyarrow.table(columns))
        index += rows
    share = -(-len(tables) // files)
    for number in range(files):
        part = tables[number * share : (number + 1) * share]
        if part:
            pyarrow.parquet.write_table(pyarrow.concat_tables(part), root / f"data/chunk-000/file-{number:03d}.parquet", compression="snappy")


def processor_time():
    """Of the processes that this one has waited for, s: what other work on the machine does not lengthen."""
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


class Readers(unittest.TestCase):
    def setUp(self):
        self.home = tempfile.TemporaryDirectory()
        self.folder = pathlib.Path(self.home.name)
        warnings.simplefilter("error", backdrive.ClockWarning)

    def tearDown(self):
        self.home.cleanup()

    def random(self, *shape):
        return numpy.random.default_rng(3).standard_normal(shape).astype("f4")

    def test_a_lerobot_dataset_gives_what_its_contract_says(self):
        states = [self.random(rows, 2) for rows in (40, 700, 5)]
        lerobot_v3(self.folder / "set", [{"observation.state": s, "action": s + 1.0} for s in states], 30)
        frames = backdrive.load_lerobot(self.folder / "set", contract=backdrive.Contract(angle="rad"), kind="numpy")
        self.assertEqual(list(frames), ["episode_000000", "episode_000001", "episode_000002"])
        for frame, state in zip(frames.values(), states):
            # What is missing stays missing: no velocity, no effort.
            self.assertEqual(set(frame), {"t", *(f"{j}.{r}" for j in JOINTS for r in ("position", "command"))})
            numpy.testing.assert_array_equal(frame["elbow_flex.position"], state[:, 1].astype(float))
            numpy.testing.assert_array_equal(frame["t"], numpy.arange(len(state)) / 30)
        degrees = backdrive.load_lerobot(self.folder / "set", [1], kind="pandas")
        numpy.testing.assert_allclose(degrees["episode_000001"]["shoulder_pan.position"], numpy.radians(states[1][:, 0].astype(float)), rtol=1e-15)
        with self.assertRaisesRegex(backdrive.InputError, "contract: angle: has nothing for elbow_flex; it has shoulder_pan"):
            backdrive.load_lerobot(self.folder / "set", contract=backdrive.Contract(angle={"shoulder_pan": "deg"}))
        with self.assertRaisesRegex(backdrive.InputError, "contract: joints: the dataset has no joint elbow; it has elbow_flex, shoulder_pan"):
            backdrive.load_lerobot(self.folder / "set", contract=backdrive.Contract(joints={"elbow": "elbow_flex"}))
        late = backdrive.Contract(angle={j: 0.5 for j in JOINTS}, commanded_at="next", joints={"elbow_flex": "elbow"})
        moved = backdrive.load_lerobot(self.folder / "set", [0], contract=late, kind="numpy")["episode_000000"]
        numpy.testing.assert_array_equal(moved["elbow.command"], 0.5 * (states[0] + 1.0)[:-1, 1].astype(float))
        numpy.testing.assert_array_equal(moved["elbow.position"], 0.5 * states[0][1:, 1].astype(float))
        self.assertEqual(moved["t"][0], 1 / 30)

    def test_an_arm_is_diagnosed_from_a_lerobot_folder(self):
        """The example: friction and play that were left out are named at their joints, in less than a minute."""
        examples = pathlib.Path(__file__).resolve().parents[1] / "examples"
        environment = os.environ | {"PYTHONPATH": PLACE}
        for script in ("so101_dataset.py", "so101_verdict.py"):
            began = processor_time()
            done = subprocess.run([sys.executable, examples / script, self.folder], capture_output=True, text=True, env=environment)
            self.assertEqual(done.returncode, 0, done.stderr)
        taken = processor_time() - began
        print(f"from a LeRobot folder to a verdict: {taken:.1f} s of processor time")
        self.assertIn("dry friction at the elbow_flex", done.stdout)
        self.assertIn("play of the gear between shoulder_pan", done.stdout)
        self.assertTrue((self.folder / "report.html").exists())
        self.assertLess(taken, 60.0)

    def test_what_is_wrong_with_a_dataset_is_told(self):
        with self.assertRaisesRegex(backdrive.InputError, "info.json: cannot be read"):
            backdrive.load_lerobot(self.folder)
        lerobot_v3(self.folder / "set", [{"observation.state": self.random(9, 2), "action": self.random(9, 2)}], 30)
        with self.assertRaisesRegex(backdrive.InputError, "no episode 7"):
            backdrive.load_lerobot(self.folder / "set", [7])
        with self.assertRaisesRegex(backdrive.InputError, "features: has no 'state'"):
            backdrive.load_lerobot(self.folder / "set", contract=backdrive.Contract(measured="state"))
        path = self.folder / "set/meta/info.json"
        path.write_text(path.read_text().replace("v3.0", "v2.1"))
        with self.assertRaisesRegex(backdrive.InputError, "codebase_version"):
            backdrive.load_lerobot(self.folder / "set")
        path.write_text(path.read_text().replace("v2.1", "v3.0"))
        (self.folder / "set/data/chunk-000/file-000.parquet").write_bytes(b"PAR1 and no more")
        with self.assertRaisesRegex(backdrive.InputError, "file-000.parquet: cannot be read"):
            backdrive.load_lerobot(self.folder / "set")

    def test_parquet_is_exact_and_words_are_left_out(self):
        t, x = numpy.arange(50) / 100.0, self.random(50).astype(float)
        path = self.folder / "log.parquet"
        pyarrow.parquet.write_table(pyarrow.table({"time": t, "x": x, "n": numpy.arange(50, dtype="i4"), "word": ["a"] * 50}), path)
        frame = backdrive.load_parquet(path, time="time", kind="numpy")
        self.assertEqual(list(frame), ["t", "x", "n"])
        numpy.testing.assert_array_equal(frame["x"], x)
        with self.assertRaisesRegex(backdrive.InputError, "t: there is no such column"):
            backdrive.load_parquet(path)

    def test_what_is_saved_comes_back_to_the_last_bit(self):
        frame = {"t": numpy.arange(40) / 1000.0, "q": self.random(40).astype(float), "tiny": 1e-300 * self.random(40)}
        loads = {
            "csv": lambda path: __import__("pandas").read_csv(path),
            "parquet": backdrive.load_parquet,
            "mat": backdrive.load_mat,
            "mcap": backdrive.load_bag,
        }
        for suffix, load in loads.items():
            path = self.folder / f"log.{suffix}"
            backdrive.save(frame, path)
            back = load(path)
            for name, column in frame.items():
                numpy.testing.assert_array_equal(back[name], column, f"{suffix}: {name}")
            with self.assertRaisesRegex(backdrive.InputError, "is there already"):
                backdrive.save(frame, path)
        with self.assertRaisesRegex(backdrive.InputError, "a b: is no name that MATLAB takes"):
            backdrive.save({"t": frame["t"], "a b": frame["q"]}, self.folder / "other.mat")
        with self.assertRaisesRegex(backdrive.InputError, "ends in none of"):
            backdrive.save(frame, self.folder / "log.xlsx")

    def test_parquet_and_mat_files_are_recordings_by_their_paths(self):
        model = backdrive.Model("name = 'm'\n[bodies]\nb = 2.0\n[[inputs]]\nname = 'f'\nkind = 'force'\non = 'b'\n[[outputs]]\nname = 'v'\nkind = 'velocity'\nof = 'b'\n")
        log = backdrive.simulate(model, "sweep:amplitude=1,from=1,to=20,duration=1", rate=1000.0, kind="numpy", progress=False).frame
        log["v"] = log["v"] + 1e-6 * self.random(len(log["v"]))
        told = backdrive.fit(log, model, progress=False).numbers
        for suffix in ("parquet", "mat"):
            backdrive.save(log, self.folder / f"log.{suffix}")
            self.assertEqual(backdrive.fit(self.folder / f"log.{suffix}", model, progress=False).numbers, told)

    def test_instants_and_durations_are_times(self):
        import pandas
        import polars

        ns = numpy.arange(100) * 1_000_000
        told = {"t": ns / 1e9, "f": self.random(100).astype(float)}
        begin = numpy.datetime64("2026-01-31T12:00:00.123456789", "ns")
        instants, spans = begin + ns.astype("timedelta64[ns]"), ns.astype("timedelta64[ns]")
        frames = {
            "instants": pandas.DataFrame({"t": instants, "f": told["f"]}),
            "with a zone": pandas.DataFrame({"t": pandas.DatetimeIndex(instants).tz_localize("Europe/Berlin"), "f": told["f"]}),
            "index": pandas.DataFrame({"f": told["f"]}, index=pandas.DatetimeIndex(instants)),
            "index of numbers": pandas.DataFrame({"f": told["f"]}, index=pandas.Index(told["t"], name="t")),
            "spans": pandas.DataFrame({"t": spans, "f": told["f"]}),
            "polars": polars.DataFrame({"t": instants, "f": told["f"]}),
            "arrays": {"t": instants.astype("datetime64[us]"), "f": told["f"]},
        }
        for name, frame in frames.items():
            path = self.folder / f"{name}.parquet"
            backdrive.save(frame, path)
            back = backdrive.load_parquet(path, kind="numpy")
            # Of microseconds each instant may be one off.
            numpy.testing.assert_allclose(back["t"], told["t"], rtol=0, atol=1.1e-6 if name == "arrays" else 0, err_msg=name)
            numpy.testing.assert_array_equal(back["f"], told["f"], err_msg=name)
        path = self.folder / "stamps.parquet"
        pyarrow.parquet.write_table(pyarrow.table({"when": instants, "since": spans, "f": told["f"]}), path)
        for time in ("when", "since"):
            numpy.testing.assert_array_equal(backdrive.load_parquet(path, time=time, kind="numpy")["t"], told["t"])

    def test_mat_files_give_vectors_matrices_and_structures(self):
        import scipy.io

        t, q = numpy.arange(60) * 0.001, self.random(60, 2).astype(float)
        path = self.folder / "log.mat"
        scipy.io.savemat(path, {"t": t, "vir": q[:, 0], "q": q, "name": "emps", "gain": 35.15, "log": {"time": t, "q": q.T}})
        frame = backdrive.load_mat(path, kind="numpy")
        self.assertEqual(list(frame), ["t", "vir", "q[0]", "q[1]"])
        numpy.testing.assert_array_equal(frame["q[1]"], q[:, 1])
        inside = backdrive.load_mat(path, time="time", variable="log", kind="numpy")
        numpy.testing.assert_array_equal(inside["q[0]"], q[:, 0])
        with self.assertRaisesRegex(backdrive.InputError, "is no vector of times"):
            backdrive.load_mat(path, time="when")

    def test_ros_bags_of_both_generations_give_a_frame_for_each_topic(self):
        from rosbags.rosbag1 import Writer as Writer1
        from rosbags.rosbag2 import Writer as Writer2
        from rosbags.typesys import Stores, get_typestore

        q = self.random(20, 2).astype(float)
        begin = 1_700_000_000_123_456_789
        for store, ros1 in ((get_typestore(Stores.ROS1_NOETIC), True), (get_typestore(Stores.ROS2_HUMBLE), False)):
            kinds = store.types
            path = self.folder / ("one.bag" if ros1 else "two")
            with Writer1(path) if ros1 else Writer2(path, version=9) as writer:
                topic = writer.add_connection("/joint_states", "sensor_msgs/msg/JointState", typestore=store)
                for row in range(20):
                    ns = begin + row * 10_000_000
                    time = kinds["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9)
                    header = kinds["std_msgs/msg/Header"](**({"seq": row} if ros1 else {}), stamp=time, frame_id="")
                    message = kinds["sensor_msgs/msg/JointState"](header=header, name=JOINTS, position=q[row], velocity=q[row] * 2.0, effort=numpy.array([]))
                    raw = store.serialize_ros1(message, "sensor_msgs/msg/JointState") if ros1 else store.serialize_cdr(message, "sensor_msgs/msg/JointState")
                    writer.write(topic, ns + 777, raw)
            frame = backdrive.load_rosbag(path, kind="numpy")["/joint_states"]
            self.assertEqual(list(frame), ["t", *(f"{f}.{j}" for f in ("position", "velocity") for j in JOINTS)])
            numpy.testing.assert_array_equal(frame["position.elbow_flex"], q[:, 1])
            numpy.testing.assert_array_equal(frame["t"], numpy.arange(20) * 10_000_000 / 1e9)
            with self.assertRaisesRegex(backdrive.InputError, "has no topic /tf"):
                backdrive.load_rosbag(path, topics="/tf")

    def test_clocks_that_stand_run_back_jump_or_are_uneven_are_told(self):
        from backdrive._clock import remarks

        even = numpy.arange(1000) / 100.0
        self.assertEqual(remarks(even, "a"), [])
        for change, said in (
            (lambda t: numpy.insert(t, 400, t[400]), "repeats 1 times, first after sample 400, at 4 s"),
            (lambda t: numpy.concatenate([t[:500], t[:500]]), "runs back 1 times, by up to 4.99 s"),
            (lambda t: numpy.delete(t, slice(300, 320)), "jumps 1 times, by up to 0.21 s where 0.01 s are usual, first after sample 299, at 2.99 s: about 20"),
            (lambda t: t + 0.0007 * numpy.random.default_rng(1).standard_normal(len(t)), "uneven"),
        ):
            self.assertEqual(len(found := remarks(change(even), "a")), 1, found)
            self.assertIn(said, found[0])
        path = self.folder / "jumps.parquet"
        pyarrow.parquet.write_table(pyarrow.table({"t": numpy.delete(even, slice(300, 320))}), path)
        with self.assertWarnsRegex(backdrive.ClockWarning, "jumps.parquet: the clock jumps 1 times"):
            warnings.simplefilter("always", backdrive.ClockWarning)
            backdrive.load_parquet(path)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
