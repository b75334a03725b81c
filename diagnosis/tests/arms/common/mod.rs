//! Logs of a two-joint arm, made by inverse dynamics with friction added: what is in them is known.
#![allow(dead_code)]

use backdrive_plant::robot::{RobotFile, Tree};
use rand::{RngExt, SeedableRng};
use std::fmt::Write as _;
use std::path::Path;

pub const URDF: &str = r#"<robot name="arm">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0.01 0 -0.2"/><mass value="2.0"/><inertia ixx="0.03" ixy="0" ixz="0" iyy="0.031" iyz="0" izz="0.002"/></inertial></link>
  <link name="fore"><inertial><origin xyz="0 0.005 -0.15"/><mass value="1.0"/><inertia ixx="0.009" ixy="0" ixz="0" iyy="0.0095" iyz="0" izz="0.0006"/></inertial></link>
  <link name="tip"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/><limit lower="-2.5" upper="2.5" effort="60" velocity="6"/><dynamics damping="0.1" friction="0.2"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0 0 -0.35"/><axis xyz="0 1 0"/><limit lower="-2.5" upper="2.5" effort="25" velocity="8"/><dynamics damping="0.04"/></joint>
  <joint name="flange" type="fixed"><parent link="fore"/><child link="tip"/><origin xyz="0 0 -0.3"/></joint>
</robot>
"#;

/// Where the tip is in the frame of the last link, m.
pub const TIP: [f64; 3] = [0.0, 0.0, -0.3];

/// What the torque has besides the links, by joint.
#[derive(Clone, Copy, Default)]
pub struct Beside {
    pub damping: [f64; 2],
    pub dry: [f64; 2],
    pub by_load: [f64; 2],
    pub gain: [f64; 2],
    /// Compliance of the gears, rad/(N m), behind which the links hang; positions are those of the motors.
    pub soft: [f64; 2],
}

/// What the file states.
pub const AS_STATED: Beside = Beside { damping: [0.1, 0.04], dry: [0.2, 0.0], by_load: [0.0; 2], gain: [1.0; 2], soft: [0.0; 2] };

/// Positions, velocities and accelerations of both joints at a time, s.
pub type Path2 = dyn Fn(f64) -> [[f64; 2]; 3];

/// A Fourier series of both joints about a pose, rad, drawn from a seed.
pub fn series(seed: u64, pose: [f64; 2], size: f64) -> Box<Path2> {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let series: Vec<Vec<[f64; 2]>> = (0..2)
        .map(|_| {
            (1..6)
                .map(|h| [size / f64::from(h) * random.random_range(-1.0..1.0), size / f64::from(h) * random.random_range(-1.0..1.0)])
                .collect()
        })
        .collect();
    Box::new(move |t| {
        let (mut q, mut v, mut a) = (pose, [0.0; 2], [0.0; 2]);
        for j in 0..2 {
            for (h, [c, s]) in series[j].iter().enumerate() {
                let w = std::f64::consts::TAU * 0.11 * (h + 1) as f64;
                let (sin, cos) = (w * t).sin_cos();
                q[j] += c * cos + s * sin;
                v[j] += w * (s * cos - c * sin);
                a[j] -= w * w * (c * cos + s * sin);
            }
        }
        [q, v, a]
    })
}

/// A log's columns: t, two positions, two velocities, two torques.
pub fn log(seed: u64, beside: &Beside) -> [Vec<f64>; 7] {
    along(&*series(seed, [0.0; 2], 0.6), seed, beside, 2400, 0.0)
}

/// The same along a path, with a mass at the tip, kg, at 200 Hz.
pub fn along(path: &Path2, seed: u64, beside: &Beside, count: i32, at_tip: f64) -> [Vec<f64>; 7] {
    let robot = RobotFile::from_xml(URDF, "arm.urdf").expect("the arm is read").robot;
    let fore = robot.link("fore").expect("a link");
    let robot = robot.with_mass_at(fore, at_tip, TIP.into());
    let tree = Tree::new(&robot).expect("the arm is computed");
    let mut work = tree.workspace();
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1000 + seed);
    let period = 1.0 / 200.0;
    let mut out: [Vec<f64>; 7] = Default::default();
    let mut links = |i: i32| {
        let [q, v, a] = path(f64::from(i) * period);
        let mut f = [0.0; 2];
        tree.inverse_dynamics(&q, &v, &a, &mut work, &mut f);
        (q, v, f)
    };
    let near: Vec<_> = (-1..=count).map(&mut links).collect();
    for (i, three) in near.windows(3).enumerate() {
        let (mut q, mut v, f) = three[1];
        out[0].push(i as f64 * period);
        for j in 0..2 {
            // A motor is ahead of its link by what its gear gives.
            q[j] += beside.soft[j] * f[j];
            v[j] += beside.soft[j] * (three[2].2[j] - three[0].2[j]) / (2.0 * period);
            let rubbing = (beside.dry[j] + beside.by_load[j] * f[j].abs()) * v[j].signum();
            let noise = 0.01 * random.random_range(-1.0..1.0);
            out[1 + j].push(q[j]);
            out[3 + j].push(v[j]);
            out[5 + j].push(beside.gain[j] * (f[j] + beside.damping[j] * v[j] + rubbing) + noise);
        }
    }
    out
}

/// Writes a log's columns.
pub fn write(file: &Path, columns: &[Vec<f64>; 7]) {
    let mut text = "t,q1,q2,dq1,dq2,tau1,tau2\n".to_string();
    for i in 0..columns[0].len() {
        let row: Vec<String> = columns.iter().map(|c| format!("{:.7}", c[i])).collect();
        let _ = writeln!(text, "{}", row.join(","));
    }
    std::fs::write(file, text).expect("a file is written");
}

/// A set of three logs, the last held out, in a folder; `change` is made to every log, `joints` stands in the set.
pub fn set(folder: &Path, beside: &Beside, joints: &str, change: impl Fn(&mut [Vec<f64>; 7])) {
    let text = |name: &str, text: &str| std::fs::write(folder.join(name), text).expect("a file is written");
    text("arm.urdf", URDF);
    text("arm.toml", "name = \"arm\"\n[robot]\nfile = \"arm.urdf\"\n");
    text("set.toml", &format!("model = \"arm.toml\"\nfit = [\"a.csv\", \"b.csv\"]\nheld_out = [\"c.csv\"]\n{joints}"));
    for (seed, name) in ["a.csv", "b.csv", "c.csv"].iter().enumerate() {
        let mut columns = log(seed as u64 + 1, beside);
        change(&mut columns);
        write(&folder.join(name), &columns);
    }
}
