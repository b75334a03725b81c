//! Excitations: what they look like, and how the wrong ones are refused.

use backdrive_plant::excitation::{Excitation, load_experiments};
use backdrive_plant::model::Model;
use rustfft::{FftPlanner, num_complex::Complex};

fn ex(text: &str) -> Excitation {
    text.parse().unwrap_or_else(|e| panic!("{e}"))
}

fn rms(x: &[f64]) -> f64 {
    (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt()
}

fn peak(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |a, x| a.max(x.abs()))
}

fn spectrum(x: &[f64]) -> Vec<f64> {
    let mut s: Vec<Complex<f64>> = x.iter().map(|x| Complex::new(*x, 0.0)).collect();
    FftPlanner::new().plan_fft_forward(x.len()).process(&mut s);
    s[..x.len() / 2].iter().map(|c| 2.0 * c.norm() / x.len() as f64).collect()
}

#[test]
fn a_sweep_runs_from_one_frequency_to_the_other() {
    for (text, middle) in [("", 20.0), (",spacing=linear", 42.5)] {
        let e = ex(&format!("sweep:amplitude=2,from=5,to=80,duration=10{text}"));
        let x = e.samples(10_000.0).unwrap();
        assert_eq!((x.len(), x[0]), (100_000, 0.0));
        assert!((peak(&x) - 2.0).abs() < 1e-3 && (rms(&x) - 2.0_f64.sqrt()).abs() < 0.02);
        // Frequency from the zero crossings of a second about the middle.
        let part = &x[45_000..55_000];
        let up: Vec<usize> = (1..part.len()).filter(|i| part[i - 1] < 0.0 && part[*i] >= 0.0).collect();
        let f = (up.len() - 1) as f64 / ((up[up.len() - 1] - up[0]) as f64 / 10_000.0);
        assert!((f / middle - 1.0).abs() < 0.05, "{f} {middle}");
    }
    let falling = ex("sweep:amplitude=1,from=10,to=100,duration=4,tilt=-1").samples(4000.0).unwrap();
    assert!((peak(&falling[15_000..]) - 0.1).abs() < 0.02);
}

#[test]
fn a_multisine_has_its_lines_and_no_others() {
    let e = ex("multisine:rms=0.5,from=1,to=20,period=2,periods=3,grid=odd,seed=7");
    let x = e.samples(1000.0).unwrap();
    assert_eq!(x.len(), 6000);
    assert!((rms(&x) - 0.5).abs() < 1e-12);
    assert!((0..2000).all(|i| (x[i] - x[i + 2000]).abs() < 1e-12), "periodic");
    for (k, a) in spectrum(&x[..2000]).iter().enumerate() {
        let there = k % 2 == 1 && (2..=40).contains(&k);
        assert!(if there { *a > 0.1 } else { *a < 1e-9 }, "line {k}: {a}");
    }
    // The sum and the transform agree.
    let signal = e.signal();
    assert!((0..6000).step_by(371).all(|i| (signal.at(i as f64 / 1000.0) - x[i]).abs() < 1e-9));
    assert_ne!(x, ex("multisine:rms=0.5,from=1,to=20,period=2,periods=3,grid=odd,seed=8").samples(1000.0).unwrap());
}

#[test]
fn a_multisine_is_repeated_at_each_level() {
    let one = ex("multisine:peak=0.3,from=1,to=50,period=0.5,periods=2,seed=7").samples(1000.0).unwrap();
    let e = ex("multisine:peak=0.3,from=1,to=50,period=0.5,periods=2,levels=0.1/-0.3/1,seed=7");
    let x = e.samples(1000.0).unwrap();
    assert_eq!((x.len(), e.duration()), (3000, 3.0));
    let signal = e.signal();
    for (level, factor) in [0.1, -0.3, 1.0].into_iter().enumerate() {
        for i in 0..1000 {
            let (value, k) = (factor * one[i], 1000 * level + i);
            assert!((x[k] - value).abs() < 1e-12, "sample {k}");
            assert!((signal.at(k as f64 / 1000.0) - value).abs() < 1e-9, "sample {k}");
        }
    }
    assert!("multisine:peak=1,from=1,to=50,period=1,levels=x".parse::<Excitation>().is_err());
}

#[test]
fn crest_rounds_lower_the_peak_at_the_same_power() {
    let crest = |rounds: u32| {
        let x = ex(&format!("multisine:peak=2,from=1,to=50,period=2,seed=3,crest={rounds}")).samples(2000.0).unwrap();
        assert!((peak(&x) - 2.0).abs() < 0.02);
        peak(&x) / rms(&x)
    };
    assert!(crest(0) > 3.0 && crest(100) < 2.1, "{} {}", crest(0), crest(100));
}

#[test]
fn a_triangle_moves_at_constant_speed_and_returns_inside_itself() {
    let e = ex("triangle:amplitude=3,period=4/2,cycles=1,nested=2,inner=0.5");
    let x = e.samples(1000.0).unwrap();
    assert!((peak(&x) - 3.0).abs() < 0.01 && x.last().unwrap().abs() < 0.01);
    // Speeds 3 and 6 per second, at corners less.
    let speed: Vec<f64> = x.windows(2).map(|w| (w[1] - w[0]).abs() * 1000.0).collect();
    assert!(speed.iter().filter(|v| (**v - 3.0).abs() < 1e-6 || (**v - 6.0).abs() < 1e-6).count() > speed.len() - 30);
    let reversals = x.windows(3).filter(|w| (w[1] - w[0]) * (w[2] - w[1]) < 0.0).count();
    // Two ends of a cycle, and two in each of the two inner loops, at each of two speeds.
    assert_eq!(reversals, 2 * (2 + 4));
}

#[test]
fn steps_impacts_and_sines_are_laid_out() {
    let x = ex("steps:amplitude=1/2,hold=0.5,quiet=0.5").samples(10.0).unwrap();
    let level: Vec<f64> = x.chunks(5).map(|c| c[2]).collect();
    assert_eq!(level, [0.0, 1.0, 0.0, -1.0, 0.0, 2.0, 0.0, -2.0, 0.0]);
    let x = ex("steps:amplitude=1,hold=1,rise=0.5").samples(100.0).unwrap();
    assert!((x[25] - 0.5).abs() < 1e-9 && (x[75] - 1.0).abs() < 1e-9);

    let x = ex("impacts:amplitude=-4,width=0.01,interval=1,count=2,bounces=1").samples(10_000.0).unwrap();
    assert_eq!(x.len(), 20_000);
    assert!((x[50] + 4.0).abs() < 1e-6 && (x[750] + 2.0).abs() < 1e-6 && x[5000] == 0.0, "{} {}", x[50], x[750]);
    assert!((x.iter().sum::<f64>() / 10_000.0 + 2.0 * 6.0 * 0.01 * 2.0 / std::f64::consts::PI).abs() < 1e-4);

    let x = ex("sines:amplitude=1/3,frequency=5/10,cycles=10").samples(1000.0).unwrap();
    assert_eq!(x.len(), 6000);
    assert!((rms(&x[..2000]) - 0.5_f64.sqrt()).abs() < 1e-9 && (rms(&x[2000..4000]) - 4.5_f64.sqrt()).abs() < 1e-9);
}

#[test]
fn fades_limit_and_offset_frame_it() {
    let e = ex("sines:amplitude=2,frequency=10,cycles=20,fade_in=0.5,fade_out=0.5,limit=1.5,offset=0.25,quiet=1");
    let x = e.samples(1000.0).unwrap();
    assert_eq!((x.len(), e.duration()), (3000, 3.0));
    assert!(peak(&x[..1000]) == 0.0 && peak(&x[1000..1050]) < 0.1 && peak(&x[2950..]) < 0.1);
    assert_eq!(x.iter().copied().fold(f64::MIN, f64::max), 1.5);
    assert_eq!((e.signal().at(-1.0), e.signal().at(3.0)), (0.0, 0.0));
}

#[test]
fn what_is_shown_reads_back_the_same() {
    for text in [
        "sweep:amplitude=2,from=1,to=200,duration=10,spacing=linear,tilt=-1,limit=8.9",
        "multisine:peak=2,from=0,to=50,period=2,periods=2,grid=odd,seed=3,crest=4,fade_in=0.1",
        "multisine:rms=2,from=1,to=50,period=2,periods=2,levels=0.1/0.3/1",
        "triangle:amplitude=3,period=4/0.25,cycles=3,nested=2,inner=0.5",
        "steps:amplitude=1/-2,hold=0.5,rise=0.001,count=2,quiet=1",
        "impacts:amplitude=-4/0.3,width=0.01,interval=1,count=2,bounces=1",
        "sines:amplitude=1e-7/3,frequency=5,cycles=10,offset=-1",
    ] {
        let e = ex(text);
        assert_eq!(ex(&e.to_string()), e, "{text}");
        let json = serde_json::to_string(&e).unwrap();
        assert_eq!(serde_json::from_str::<Excitation>(&json).unwrap(), e);
    }
}

#[test]
fn wrong_excitations_say_what_is_wrong() {
    let wrong = |text: &str| text.parse::<Excitation>().unwrap_err().to_string();
    assert_eq!(wrong("swep:amplitude=2"), "excitation \"swep:amplitude=2\": kind: unknown value \"swep\"; did you mean \"sweep\"?");
    assert_eq!(wrong("sweep"), "excitation \"sweep\": missing key \"amplitude\"");
    assert_eq!(wrong("sweep:amplitude"), "excitation \"sweep:amplitude\": expected key=value, found \"amplitude\"");
    assert_eq!(wrong("sweep:a b=1"), "excitation \"sweep:a b=1\": \"a b\" is not a key");
    assert_eq!(
        wrong("sweep:amplitude=1,amplitude=2"),
        "excitation \"sweep:amplitude=1,amplitude=2\": is not valid TOML at column 1: duplicate key"
    );
    let sweep = |rest: &str| {
        let text = format!("sweep:amplitude=1,from=1,to=2,{rest}");
        wrong(&text).replace(&format!("excitation \"{text}\": "), "")
    };
    assert_eq!(sweep("duration=x"), "duration: expected a number, found the string \"x\"");
    assert_eq!(sweep("duration=-1"), "duration: must be above 0, is -1");
    assert_eq!(sweep("duration=nan"), "duration: expected a number, found the string \"nan\"");
    assert_eq!(sweep("duraton=1"), "unknown key \"duraton\"; did you mean \"duration\"?");
    assert_eq!(
        sweep("duration=1,colour=2"),
        "unknown key \"colour\"; known here: kind, amplitude, from, to, duration, spacing, tilt, quiet, fade_in, fade_out, offset, limit"
    );
    assert_eq!(sweep("duration=1,fade_in=0.8,fade_out=0.8"), "fade_in: the fades are longer than the 1 s between them");
    assert!(wrong("multisine:from=1,to=2,period=1").ends_with("needs either rms or peak"));
    assert!(wrong("multisine:rms=1,from=1.2,to=1.4,period=1").ends_with("period: no line of a period of 1 s lies from 1.2 to 1.4 Hz"));
    assert_eq!(
        ex("sweep:amplitude=1,from=1,to=200,duration=1").samples(300.0).unwrap_err().to_string(),
        "a sampling rate of 300 Hz cannot carry 200 Hz; it needs more than 400 Hz"
    );
    assert!(ex("steps:amplitude=1,hold=1").samples(f64::NAN).is_err());
}

#[test]
fn a_file_holds_experiments_that_may_drive_several_inputs() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("e.toml");
    let table =
        |name: &str, rest: &str| format!("[[excitations]]\nname = \"{name}\"\nkind = \"steps\"\namplitude = [1, 2]\nhold = 0.5\n{rest}\n");
    let load = |text: &str| {
        std::fs::write(&path, text).unwrap();
        load_experiments(&path).map_err(|e| e.to_string().replace(&path.display().to_string(), "e.toml"))
    };
    let found = load(&(table("a", "") + &table("b", "input = \"x\"") + &table("b", "input = \"y\""))).unwrap();
    assert_eq!(found.iter().map(|e| (e.name.as_str(), e.drives.len())).collect::<Vec<_>>(), [("a", 1), ("b", 2)]);
    assert_eq!(found[1].drives[1].0.as_deref(), Some("y"));
    let model = |inputs: &[&str]| {
        let one = |n: &&str| format!("[[inputs]]\nname = \"{n}\"\nkind = \"force\"\non = \"m\"\n");
        Model::from_toml(&format!("[bodies]\nm = 1\n{}", inputs.iter().map(one).collect::<String>()), "m").unwrap()
    };
    let columns = found[1].columns_for(&model(&["z", "y", "x"]), 100.0).unwrap();
    assert_eq!(columns.iter().map(Vec::len).collect::<Vec<_>>(), [400, 400, 400]);
    assert_eq!((columns[0][10], columns[1][10]), (0.0, 1.0));
    assert_eq!(found[0].columns_for(&model(&["z"]), 100.0).unwrap().len(), 1);
    let wrong = |e: usize, inputs: &[&str]| found[e].columns_for(&model(inputs), 100.0).unwrap_err().to_string();
    assert_eq!(wrong(0, &["x", "y"]), "experiment \"a\": which input does it drive? the model has x, y");
    assert_eq!(wrong(1, &["force"]), "experiment \"b\": unknown input \"x\"; there is force");
    assert_eq!(
        load(&(table("a", "") + &table("a", ""))).unwrap_err(),
        "e.toml:8: excitations[1] \"a\" name: another excitation of this name drives the same input; give each its input"
    );
    assert_eq!(load(&table("a", "hld = 1")).unwrap_err(), "e.toml:6: excitations[0] \"a\": unknown key \"hld\"; did you mean \"hold\"?");
    assert_eq!(load("").unwrap_err(), "e.toml:1: has no excitations; expected [[excitations]] tables");
}
