"""The package as a person uses it: the command line's results bit for bit, from every sort of frame; errors, threads, Ctrl-C, models, figures.

    python check.py PROGRAM FOLDER        PROGRAM: the command line of the same build; FOLDER: where the package is, and the notebook
"""

import json
import os
import pathlib
import resource
import signal
import subprocess
import sys
import tempfile
import textwrap
import threading
import time
import unittest

PROGRAM, PLACE = sys.argv[1:3]
ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, PLACE)

import numpy  # noqa: E402
import pandas  # noqa: E402
import polars  # noqa: E402

import backdrive  # noqa: E402

NOMINAL = """name = 'small-master'
[bodies]
motor = 0.02   # kg
handle = 0.1
[[elements]]
name = 'cable'
kind = 'spring'
between = ['motor', 'handle']
stiffness = 3000.0
[[elements]]
name = 'cable_damping'
kind = 'damper'
between = ['motor', 'handle']
damping = 3.0
[[elements]]
name = 'grip'
kind = 'spring'
between = ['handle', 'ground']
stiffness = 400.0
[[elements]]
name = 'grip_damping'
kind = 'damper'
between = ['handle', 'ground']
damping = 8.0
[[inputs]]
name = 'force'
kind = 'force'
on = 'motor'
hold = 'zero'
[[outputs]]
name = 'position'
kind = 'position'
of = 'motor'
"""
FRICTION = "[[elements]]\nname = 'friction'\nkind = 'coulomb'\nbetween = ['motor', 'ground']\nforce = 0.4\n"
DRIVES = {
    "sweep": "sweep:amplitude=2,from=0.5,to=40,duration=2",
    "triangle": "triangle:amplitude=1.5,period=0.5,cycles=4",
    "multisine": "multisine:rms=1.2,from=0.5,to=40,period=2",
}


def recorded(truth):
    """What a device did, with a little noise, in one dictionary of arrays for each drive."""
    noise = numpy.random.default_rng(7)
    out = {}
    for name, drive in DRIVES.items():
        frame = dict(backdrive.simulate(truth, drive, rate=1000.0, kind="numpy", progress=False).frame)
        frame["position"] = frame["position"] + 2e-6 * noise.standard_normal(len(frame["t"]))
        out[name] = frame
    return out


class Package(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.home = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.home.name)
        cls.model = backdrive.Model(NOMINAL)
        cls.frames = recorded(backdrive.Model(NOMINAL + FRICTION))
        (cls.folder / "model.toml").write_text(NOMINAL)
        for name, frame in cls.frames.items():
            pandas.DataFrame(frame).to_csv(cls.folder / f"{name}.csv", index=False)
        (cls.folder / "set.toml").write_text("fit = ['sweep.csv', 'triangle.csv']\nheld_out = ['multisine.csv']\n")

    @classmethod
    def tearDownClass(cls):
        cls.home.cleanup()

    def program(self, *arguments, codes=(0, 1)):
        done = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, cwd=self.folder)
        self.assertIn(done.returncode, codes, done.stderr)
        return done.stdout

    def seen_and_unseen(self, as_frame):
        frames = {name: as_frame(frame) for name, frame in self.frames.items()}
        return {name: frames[name] for name in ("sweep", "triangle")}, {"multisine": frames["multisine"]}

    def test_a_diagnosis_is_that_of_the_command_line_to_the_last_byte(self):
        said = self.program("diagnose", "set.toml", "--model", "model.toml", "--out", "out")
        seen, unseen = self.seen_and_unseen(pandas.DataFrame)
        verdict = backdrive.diagnose(seen, self.model, held_out=unseen, progress=False)
        self.assertEqual(verdict.json, (self.folder / "out/verdict.json").read_text())
        self.assertEqual(verdict.model.text, (self.folder / "out/model.diagnosed.toml").read_text())
        self.assertEqual(str(verdict), said.partition("\nwrote ")[0].rstrip())
        self.assertEqual(verdict.verdict, "missing")
        self.assertEqual(verdict.findings[0].physics, "coulomb")
        self.assertAlmostEqual(verdict.findings[0].parameters.force.value, 0.4, delta=0.02)
        self.assertEqual(json.loads(verdict.json)["held_out"], verdict.held_out)
        self.assertIn("findings", dir(verdict))

        page = (self.folder / "out/report.html").read_text()
        self.assertEqual(verdict.html.count("<figure>"), page.count("<figure>"))
        self.assertIn("srcdoc=", verdict._repr_html_())
        figures = verdict.figures
        self.assertGreater(len(figures), 3)
        self.assertTrue(all(len(s["x"]) == len(s["y"]) for f in figures for p in f.data["panels"] for s in p["series"]))
        import matplotlib

        matplotlib.use("agg")
        for number in range(len(figures)):
            drawn = verdict.plot(number)
            self.assertTrue(drawn.axes)
            matplotlib.pyplot.close(drawn)

    def test_a_folder_is_written_only_where_one_is_asked_for(self):
        seen, unseen = self.seen_and_unseen(dict)
        before = set(os.listdir("."))
        verdict = backdrive.diagnose(seen, self.model, held_out=unseen, progress=False)
        self.assertEqual(set(os.listdir(".")), before)
        out = self.folder / "asked"
        asked = backdrive.diagnose(seen, self.model, held_out=unseen, out=out, progress=False)
        self.assertEqual((out / "verdict.json").read_text(), verdict.json)
        self.assertEqual((out / "model.diagnosed.toml").read_text(), verdict.model.text)
        self.assertIn("<html", (out / "report.html").read_text())
        self.assertEqual(str(asked), str(verdict))
        self.assertNotIn(os.path.join(tempfile.gettempdir(), "backdrive-"), verdict.html)
        bare = backdrive.diagnose(seen, self.model, held_out=unseen, report=False, progress=False)
        self.assertIsNone(bare.html)

    def test_every_sort_of_frame_gives_the_same(self):
        told = json.loads(self.program("fit", "model.toml", "set.toml", "--json"))
        # Of frames no command can be offered.
        self.assertTrue(told.pop("next"))

        def structured(frame):
            out = numpy.zeros(len(frame["t"]), dtype=[(name, "f8") for name in frame])
            for name, column in frame.items():
                out[name] = column
            return out

        for kind in (dict, pandas.DataFrame, polars.DataFrame, structured):
            seen, unseen = self.seen_and_unseen(kind)
            fitted = backdrive.fit(seen, self.model, held_out=unseen, progress=False)
            self.assertEqual(dict(fitted.data), told, kind)
        by_path = backdrive.fit(self.folder / "set.toml", self.folder / "model.toml", progress=False)
        self.assertEqual(by_path.numbers, told["numbers"])
        self.assertIn("bodies.motor", repr(fitted))

    def test_columns_may_be_called_otherwise_and_have_units(self):
        seen, unseen = self.seen_and_unseen(lambda f: pandas.DataFrame({"time": f["t"], "f": f["force"], "x": f["position"] * 1000.0}))
        columns = {"t": "time", "force": "f", "position": {"column": "x", "unit": "mm"}}
        fitted = backdrive.fit(seen, self.model, held_out=unseen, columns=columns, progress=False)
        told = json.loads(self.program("fit", "model.toml", "set.toml", "--json"))
        for one, other in zip(fitted.numbers, told["numbers"]):
            self.assertAlmostEqual(one.value / other["value"], 1.0, places=6)

    def test_a_simulation_is_that_of_the_command_line(self):
        self.program("simulate", "model.toml", "sweep.csv", "--out", "predicted.csv", "--overwrite")
        told = pandas.read_csv(self.folder / "predicted.csv")
        made = backdrive.simulate(self.model, pandas.DataFrame(self.frames["sweep"]), progress=False)
        pandas.testing.assert_frame_equal(made.frame, told, check_exact=True)
        self.assertGreater(made.nrmse.position, 0.0)
        self.assertIsInstance(backdrive.simulate(self.model, DRIVES["sweep"], kind="polars", progress=False).frame, polars.DataFrame)

    def test_a_bag_gives_back_what_was_written_and_gaps_stay_gaps(self):
        frame = pandas.DataFrame(self.frames["sweep"])
        backdrive.save_bag(frame, self.folder / "sweep.mcap", overwrite=True)
        pandas.testing.assert_frame_equal(backdrive.load_bag(self.folder / "sweep.mcap"), frame, check_exact=True)

    def test_a_loop_is_judged_as_by_the_command_line(self):
        bag = self.folder / "hold.mcap"
        self.program("run", ROOT / "launch/push-and-hold.toml", "--bag", bag)
        told = json.loads(self.program("stability", bag, "--gain", 1, "--sweep", "0.5:20:2", "--json"))
        judged = backdrive.stability(bag, gain=1, sweep=(0.5, 20, 2), progress=False)
        data = dict(judged.data)
        # Commands name files from where they are pasted.
        self.assertEqual(len(data.pop("next")), len(told.pop("next")))
        self.assertEqual(data, told)
        self.assertGreater(len(judged.figures), 1)
        answer = backdrive.why(bag, progress=False)
        self.assertEqual(dict(answer.data), json.loads(self.program("why", bag, "--json")))
        self.assertIn("<html", answer.html)
        frame = backdrive.load_bag(bag, topics="/master/measured_js", kind="numpy")
        self.program("bag", "export", bag, "--csv", "hold.csv", "--topic", "/master/measured_js")
        table = pandas.read_csv(self.folder / "hold.csv")
        self.assertEqual(list(frame), list(table))
        for name in table:
            numpy.testing.assert_array_equal(frame[name], table[name].to_numpy())

    def test_a_comparison_is_that_of_the_command_line(self):
        session = ROOT / "launch/coupling.toml"
        told = json.loads(self.program("compare", session, "--laws", "wave", "--delays", "0,50", "--jitter", "none", "--loss", "none", "--grips", "1", "--json"))
        compared = backdrive.compare(session, laws="wave", delays=[0, 50], jitter=[], loss=[], grips=[], progress=False)
        self.assertEqual(dict(compared.data), told)
        self.assertIn("<html", compared.html)
        for wrong in ({"laws": "magic"}, {"delays": [-1.0]}, {"jitter": [(10, 20)]}, {"loss": [1.0]}, {"script": "x.toml"}):
            with self.assertRaises(backdrive.UsageError):
                backdrive.compare(session, progress=False, **wrong)

    def test_an_inspection_is_that_of_the_command_line(self):
        t = numpy.arange(1500) * 0.02
        frame = pandas.DataFrame({"t": t, "elbow.command": numpy.sin(1.3 * t), "elbow.position": -numpy.sin(1.3 * (t - 0.1))})
        frame.to_csv(self.folder / "elbow.csv", index=False)
        told = json.loads(self.program("inspect", "elbow.csv", "--json"))
        report = backdrive.inspect({"elbow": frame}, progress=False)
        self.assertEqual([f.kind for f in report.findings], ["wrong_sign"])
        self.assertEqual([f["message"] for f in told["findings"]], [f.message for f in report.findings])
        self.assertIn("scale = -1", report.findings[0].todo)
        self.assertIn("<html", report.html)

    def test_errors_name_file_line_and_key(self):
        broken = NOMINAL.replace("motor = 0.02", "motor = -0.02")
        (self.folder / "broken.toml").write_text(broken)
        with self.assertRaises(backdrive.InputError) as caught:
            backdrive.diagnose(self.folder, self.folder / "broken.toml", progress=False)
        error = caught.exception
        self.assertEqual((error.file, error.line, error.code), (str(self.folder / "broken.toml"), 3, 3))
        self.assertIn("motor", error.key)
        self.assertIsInstance(error, ValueError)
        with self.assertRaises(backdrive.InputError) as caught:
            backdrive.diagnose({"t": numpy.arange(100) / 100, "speed": numpy.arange(100)}, self.model, progress=False)
        self.assertIn("force", str(caught.exception))
        self.assertNotIn("/tmp", str(caught.exception))
        frame = {name: column.copy() for name, column in self.frames["sweep"].items()}
        frame["position"][10] = numpy.nan
        with self.assertRaises(backdrive.InputError) as caught:
            backdrive.fit(frame, self.model, progress=False)
        self.assertEqual((caught.exception.file, caught.exception.line), ("recording.csv", 12))
        with self.assertRaises(backdrive.UsageError):
            backdrive.diagnose(frame, self.model, without="magic", progress=False)
        for wrong in ({"patience": -1.0}, {"effort": 0.0}, {"effects": 9}, {"effects": -1}):
            with self.assertRaises(backdrive.UsageError) as caught:
                backdrive.diagnose(frame, self.model, progress=False, **wrong)
            self.assertIn(next(iter(wrong)), str(caught.exception))
        for wrong in ({"gain": -1.0}, {"coupling": "magic"}, {"hand": "magic"}, {"magic": 1}, {"sweep": (2.0, 1.0, 3)}):
            with self.assertRaises(backdrive.UsageError):
                backdrive.stability(self.folder / "sweep.csv", progress=False, **wrong)
        with self.assertRaises(backdrive.InputError):
            backdrive.fit({"t": [0.0, 1.0], "force": [1.0]}, self.model, progress=False)
        with self.assertRaises(backdrive.InputError):
            backdrive.Model("there-is-none.toml")

    def test_a_model_is_changed_in_place_of_its_comments(self):
        model = self.model.copy()
        model["bodies.motor"] = 0.03
        self.assertEqual(model["bodies.motor"], 0.03)
        self.assertIn("motor = 0.03   # kg", model.text)
        self.assertEqual(model.numbers()["elements.cable.stiffness"], 3000.0)
        with self.assertRaises(backdrive.InputError):
            model["bodies.motor"] = -1.0
        self.assertEqual(model["bodies.motor"], 0.03)
        with self.assertRaises(backdrive.InputError):
            model["elements.rope.stiffness"] = 1.0
        self.assertIn("[motor] 0.03 kg", model.diagram)
        self.assertIn("<pre", model._repr_html_())
        pushed = model.driven([{"name": "hand", "kind": "force", "on": "handle"}], [{"name": "speed", "kind": "velocity", "of": "handle"}])
        frame = backdrive.simulate(pushed, DRIVES["sweep"], kind="numpy", progress=False).frame
        self.assertEqual(set(frame), {"t", "hand", "speed"})
        arm = backdrive.Model(ROOT / "plant/robots/two-joint-arm.toml")
        arm.write(self.folder / "arm.toml")
        self.assertEqual(backdrive.Model(self.folder / "arm.toml").diagram, arm.diagram)

    def test_a_feed_forward_takes_arrays(self):
        model = backdrive.Model(NOMINAL + FRICTION)
        scope = {}
        exec(model.export("feedforward", language="python").text, scope)
        (name, function), *_ = model.feedforward().items()
        speeds = numpy.linspace(-0.02, 0.02, 101)
        one_by_one = [scope[name](0.0, v) for v in speeds]
        numpy.testing.assert_allclose(function(0.0, speeds), one_by_one, rtol=1e-14)
        self.assertGreater(numpy.ptp(one_by_one), 0.7)

    def test_models_come_from_mujoco_and_go_there(self):
        import mujoco

        xml = """<mujoco model="lever"><option gravity="0 0 -9.81"/><worldbody><body name="arm"><joint name="elbow" axis="0 1 0" damping="0.1" frictionloss="0.2"/>
            <inertial pos="0.1 0 0" mass="1.5" diaginertia="0.01 0.02 0.02"/></body></worldbody></mujoco>"""
        theirs = mujoco.MjModel.from_xml_string(xml)
        for source in (xml, theirs, mujoco.MjSpec.from_string(xml)):
            model = backdrive.Model.from_mujoco(source)
            self.assertIn("elbow", model.diagram)
        back = model.to_mujoco()
        for mine, other in ((back.body_mass[-1], theirs.body_mass[-1]), (back.dof_damping[0], 0.1), (back.dof_frictionloss[0], 0.2)):
            self.assertAlmostEqual(mine, other, places=9)
        other = mujoco.MjModel.from_xml_string(xml.replace("elbow", "wrist"))
        self.assertIsNotNone(other)
        with self.assertRaises(backdrive.UsageError):
            backdrive.Model.from_mujoco(theirs)

    def test_the_package_brings_the_whole_command_line(self):
        def called(*arguments):
            environment = {**os.environ, "PYTHONPATH": PLACE}
            return subprocess.run([sys.executable, "-m", "backdrive", *map(str, arguments)], capture_output=True, text=True, cwd=self.folder, env=environment)

        said = called("fit", "model.toml", "set.toml", "--json")
        self.assertEqual(said.stdout, self.program("fit", "model.toml", "set.toml", "--json"))
        self.assertEqual(said.returncode, 1, "the records disagree: a spring without its friction fits none of them")
        self.assertEqual((called("fit", "absent.toml", "set.toml").returncode, called("fit", "--what").returncode), (3, 2))
        # Each node of a run is a process of the same command.
        said = called("run", ROOT / "launch/push-and-hold.toml", "--duration", 0.2, "--bag", "processes.mcap")
        self.assertTrue((self.folder / "processes.mcap").is_file(), said.stderr)
        self.assertEqual(called("bag", "info", "processes.mcap", "--check").returncode, 0)

    def test_other_threads_go_on(self):
        counted, over = [0], threading.Event()

        def count():
            while not over.is_set():
                counted[0] += 1
                time.sleep(0.001)

        thread = threading.Thread(target=count)
        thread.start()
        began = time.monotonic()
        seen, unseen = self.seen_and_unseen(dict)
        told = []
        backdrive.fit(seen, self.model, held_out=unseen, progress=lambda *now: told.append(now))
        took = time.monotonic() - began
        over.set()
        thread.join()
        self.assertGreater(counted[0], 50.0 * took)

    def test_ctrl_c_ends_it(self):
        script = f"""
            import sys, time
            sys.path.insert(0, {PLACE!r})
            import backdrive
            print("begins", flush=True)
            try:
                backdrive.diagnose({str(self.folder / "set.toml")!r}, {str(self.folder / "model.toml")!r}, effort=50.0, effects=6)
            except KeyboardInterrupt as stop:
                print("interrupted", flush=True)
                print(type(stop).__name__, None if stop.verdict is None else stop.verdict.verdict, flush=True)
        """
        child = subprocess.Popen([sys.executable, "-c", textwrap.dedent(script)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.assertEqual(child.stdout.readline(), "begins\n")
        time.sleep(0.8)
        child.send_signal(signal.SIGINT)
        began = time.monotonic()
        said, _ = child.communicate(timeout=30)
        first, second = said.splitlines()
        self.assertEqual(first, "interrupted")
        # What was found until then, and never that nothing is missing.
        kind, word = second.split()
        self.assertEqual(kind, "Interrupted")
        self.assertNotIn(word, ["None", "nothing_missing"])
        self.assertLess(time.monotonic() - began, 15.0)

    def test_the_import_takes_less_than_a_third_of_a_second(self):
        script = f"import sys, time; sys.path.insert(0, {PLACE!r}); t = time.perf_counter(); import backdrive; print(time.perf_counter() - t)"
        taken = min(float(subprocess.check_output([sys.executable, "-c", script], text=True)) for _ in range(5))
        print(f"import: {taken:.3f} s")
        self.assertLess(taken, 0.3)

    def test_the_call_costs_as_much_as_the_command(self):
        def children():
            used = resource.getrusage(resource.RUSAGE_CHILDREN)
            return used.ru_utime + used.ru_stime

        ours, theirs = [], []
        seen, unseen = self.seen_and_unseen(dict)
        for number in range(3):
            before = children()
            self.program("diagnose", "set.toml", "--model", "model.toml", "--out", f"cost-{number}")
            theirs.append(children() - before)
            before = time.process_time()
            backdrive.diagnose(seen, self.model, held_out=unseen, progress=False)
            ours.append(time.process_time() - before)
        print(f"processor time: call {min(ours):.2f} s, command {min(theirs):.2f} s")
        self.assertLess(min(ours), 1.05 * min(theirs))

    def test_the_notebook_runs(self):
        import nbformat
        from nbclient import NotebookClient

        book = nbformat.read(ROOT / "docs/notebook.ipynb", as_version=4)
        environment = {"PYTHONPATH": PLACE, "PATH": os.environ["PATH"], "HOME": os.environ.get("HOME", "/")}
        os.environ.update(environment)
        NotebookClient(book, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(ROOT / "docs")}}).execute()
        results = [o for c in book.cells if c.cell_type == "code" for o in c.outputs if o.output_type in ("execute_result", "display_data")]
        self.assertTrue(any("<iframe srcdoc=" in o.data.get("text/html", "") for o in results))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
