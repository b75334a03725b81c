"""From a LeRobot folder to a verdict: python so101_verdict.py FOLDER, which so101_dataset.py has written."""

import sys

import backdrive

folder = sys.argv[1]
episodes = backdrive.load_lerobot(f"{folder}/dataset")
arm = backdrive.Model.from_mujoco(f"{folder}/arm.xml")
names = [c.removesuffix(".effort") for c in episodes["episode_000000"] if c.endswith(".effort")]
joints = {name: {"position": f"{name}.position", "torque": f"{name}.effort"} for name in names}
verdict = backdrive.diagnose(episodes, arm, joints=joints)
print(verdict)
verdict.write(f"{folder}/report.html")
