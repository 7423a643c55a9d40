//! Replays beyond the channels of a log: commands, stamps beside arrivals, faults, estimators of one's own, estimates
//! made elsewhere.

use monorig_estimators::{Command, Error, Estimate, Estimator, Measurements};
use monorig_logs::drive::{Drive, Plan, Step};
use monorig_logs::map::{Map, NoiseSource};
use monorig_logs::replay::EstimatesFile;
use monorig_logs::replay::{ReplayOptions, simulation};
use monorig_sim::{Registry, StepFrame};
use std::path::PathBuf;

struct Log(tempfile::TempDir);

impl Log {
    fn new(files: &[(&str, &str)]) -> Self {
        let log = Self(tempfile::tempdir().unwrap());
        for (name, text) in files {
            std::fs::write(log.path(name), text).unwrap();
        }
        log
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn map(&self, text: &str) -> Result<Map, monorig_sim::Error> {
        std::fs::write(self.path("x.map.yaml"), text).unwrap();
        Map::load(&self.path("x.map.yaml"))
    }

    fn steps(&self, map: &str) -> Vec<Step> {
        let map = self.map(map).unwrap();
        let plan = Plan::new(&map).unwrap();
        let mut drive = Drive::open(&map, &plan).unwrap();
        std::iter::from_fn(|| drive.next(&map).unwrap()).collect()
    }
}

const WHEEL: &str = "\
version: 1
files: {log: log.csv}
step: {rate_hz: 10}
nominal: {tare_kg: 4000, wheel_radius_m: 0.17}
channels:
  wheel_speed: [{columns: [v], unit: m/s}]
";

/// Ten seconds at 10 Hz, the speed as large as the time.
fn ramp() -> String {
    let rows = (0..100).map(|k| format!("{},{}\n", f64::from(k) * 0.1, f64::from(k) * 0.1));
    format!("t,v\n{}", rows.collect::<String>())
}

fn speeds(steps: &[Step]) -> Vec<Option<f64>> {
    steps
        .iter()
        .map(|s| s.z.wheel_speed_mps[0].map(|v| v.value))
        .collect()
}

#[test]
fn stamps_stand_beside_arrivals() {
    let log = Log::new(&[(
        "log.csv",
        "t,taken,v\n0.10,0.04,1\n0.20,0.15,2\n0.30,0.12,3\n",
    )]);
    let of = |order: &str| -> Vec<(i64, i64, f64)> {
        let time = format!("time: {{stamp: taken, order: {order}, origin: zero}}\nchannels:");
        let steps = log.steps(&WHEEL.replace("channels:", &time));
        let ms = |ns: i64| ns / 1_000_000;
        let speed = |s: &Step| s.z.wheel_speed_mps[0].map(|v| (ms(s.t_ns), ms(v.t.ns()), v.value));
        steps.iter().filter_map(speed).collect()
    };
    assert_eq!(
        of("arrival"),
        [(100, 40, 1.0), (200, 150, 2.0), (300, 120, 3.0)]
    );
    // by stamp the last two are in one step
    assert_eq!(of("stamp"), [(100, 40, 1.0), (200, 135, 2.5)]);
    let map = WHEEL.replace("channels:", "time: {stamp: nowhere}\nchannels:");
    let map = log.map(&map).unwrap();
    let told = Drive::open(&map, &Plan::new(&map).unwrap())
        .map(|_| ())
        .unwrap_err();
    assert!(told.to_string().contains("nowhere"), "{told}");
}

/// The command of a step is the last one until its end, given to the estimators in that step.
#[test]
fn commands_are_those_of_the_log() {
    let log = Log::new(&[
        ("log.csv", &ramp()),
        (
            "control.csv",
            "t,torque,clamp,brake\n0.25,40,11,0\n0.85,-8,12,0.5\n",
        ),
    ]);
    let map = WHEEL
        .replace("log.csv}", "log.csv, control: control.csv}")
        .replace("columns: [v]", "file: log, columns: [v]")
        + "  command: {file: control, torque: [torque], unit: Nm, clamp_pressure_mpa: clamp, brake: brake}\nestimators: {ekf_v_theta_biases: {}}\n";
    let map = log.map(&map).unwrap();
    let registry = Registry::default();
    let mut simulation = simulation(&map, &ReplayOptions::default(), &registry).unwrap();
    let mut seen = Vec::new();
    let mut watch = |f: &StepFrame<'_>| {
        let c = f.command;
        seen.push((
            f.time_ns / 1_000_000,
            c.motor_torque_nm[0],
            c.clamp_pressure_mpa,
            c.brake,
        ));
    };
    simulation.run(&mut [&mut watch]).unwrap();
    assert_eq!(seen[2], (200, 0.0, 0.0, 0.0));
    assert_eq!(seen[3], (300, 40.0, 11.0, 0.0));
    assert_eq!(seen[8], (800, 40.0, 11.0, 0.0));
    assert_eq!(seen[9], (900, -8.0, 12.0, 0.5));
}

/// Each fault changes the samples of its window as described, and nothing outside of it.
#[test]
fn faults_of_a_log() {
    let log = Log::new(&[("log.csv", &ramp())]);
    let plain = speeds(&log.steps(WHEEL));
    let of = |fault: &str| {
        let fault = format!("faults: [{{from_s: 3, to_s: 6, channel: wheel_speed, {fault}}}]\n");
        log.steps(&(WHEEL.to_owned() + &fault))
    };
    let inside = 30..60;
    for (fault, expected) in [
        (
            "fault: \"off\"",
            Box::new(|_| None) as Box<dyn Fn(f64) -> Option<f64>>,
        ),
        ("fault: stuck", Box::new(|_| Some(2.9))),
        ("fault: scale, size: 2", Box::new(|v| Some(2.0 * v))),
        ("fault: km_per_h", Box::new(|v| Some(3.6 * v))),
        ("fault: wrong_sign, index: 0", Box::new(|v| Some(-v))),
    ] {
        for (k, (got, v)) in speeds(&of(fault)).iter().zip(&plain).enumerate() {
            let wanted = if inside.contains(&k) {
                expected(v.unwrap())
            } else {
                *v
            };
            let same = match (got, wanted) {
                (Some(a), Some(b)) => (a - b).abs() < 1e-9,
                (a, b) => a.is_none() && b.is_none(),
            };
            assert!(same, "{fault}: step {k}: {got:?}, {wanted:?}");
        }
    }
    let lost = speeds(&of("fault: loss, size: 0.5"))
        .iter()
        .filter(|v| v.is_none())
        .count();
    assert!((5..26).contains(&lost), "{lost} of 30 are lost");
    let jitter = of("fault: jitter, size: 20");
    let off: Vec<i64> = jitter
        .iter()
        .map(|s| s.z.wheel_speed_mps[0].unwrap().t.ns() - s.t_ns)
        .collect();
    assert!(off[30..60].iter().all(|ns| ns.abs() <= 20_000_000));
    assert!(off[30..60].iter().any(|ns| ns.abs() > 5_000_000));
    assert!(off[..30].iter().chain(&off[60..]).all(|ns| *ns == 0));

    let refused = |fault: &str| {
        let map = log.map(&(WHEEL.to_owned() + &format!("faults: [{fault}]\n")));
        let map = map.unwrap();
        Plan::new(&map).map(|_| ()).unwrap_err().to_string()
    };
    let told = refused("{from_s: 0, channel: inclination, fault: stuck}");
    assert!(told.contains("does not have the channel"), "{told}");
    assert!(refused("{from_s: 0, channel: wheel_speed, fault: scale}").contains("size"));
    assert!(refused("{from_s: 0, channel: wheel_speed, fault: loss, size: 2}").contains("size"));
}

/// An estimator that a program adds: the number of its steps as mass, and how often it was reset as speed.
#[derive(Default)]
struct Mine {
    steps: f64,
    resets: f64,
}

monorig_estimators::params! {
    /// Parameters of mine.
    MyParams { first ["1"] = 0.0, 0.0 => 1e6, "Where it counts from."; }
}

impl Estimator for Mine {
    fn step(&mut self, z: &Measurements, _: &Command, _: f64) -> Result<Estimate, Error> {
        self.steps += 1.0;
        let mut estimate = Estimate::at(z.t);
        estimate.total_mass_kg.value = self.steps;
        estimate.speed_mps.value = self.resets;
        Ok(estimate)
    }

    fn reset(&mut self) {
        self.resets += 1.0;
    }
}

#[test]
fn an_estimator_of_ones_own_is_replayed_with_its_parameters_and_reset_at_segments() {
    let rows = "t,v\n0,1\n0.1,1\n0.2,1\n100,1\n100.1,1\n";
    let log = Log::new(&[("log.csv", rows)]);
    let map = log
        .map(&(WHEEL.to_owned() + "estimators: {mine: {first: 10}}\n"))
        .unwrap();
    let mut registry = Registry::default();
    let build = |_: &monorig_estimators::Vehicle, p: &MyParams| Mine {
        steps: p.first,
        resets: 0.0,
    };
    registry.estimator("mine", build).unwrap();
    let mut simulation = simulation(&map, &ReplayOptions::default(), &registry).unwrap();
    let mut last = (0.0, 0.0);
    let mut watch = |f: &StepFrame<'_>| {
        let e = &f.estimators[0].estimate;
        last = (e.total_mass_kg.value, e.speed_mps.value);
    };
    simulation.run(&mut [&mut watch]).unwrap();
    assert_eq!(last, (15.0, 1.0));
}

/// Times of estimates are those of the log's clock, and an empty cell is no estimate.
#[test]
fn estimates_made_elsewhere_are_played_at_their_times() {
    let rows = "t,v\n1000,1\n1000.1,1\n1000.2,1\n1000.3,1\n1000.4,1\n";
    let log = Log::new(&[
        ("log.csv", rows),
        (
            "mine.csv",
            "t,mass_kg,mass_sd_kg\n1000.05,5000,10\n1000.25,6000,10\n1000.35,,10\n",
        ),
    ]);
    let map = log.map(WHEEL).unwrap();
    let file = EstimatesFile::load(&log.path("mine.csv")).unwrap();
    let options = ReplayOptions {
        judged: vec![("mine".into(), file)],
        ..ReplayOptions::default()
    };
    let mut simulation = simulation(&map, &options, &Registry::default()).unwrap();
    let mut seen = Vec::new();
    let mut watch = |f: &StepFrame<'_>| {
        let mass = f.estimators[0].estimate.total_mass_kg;
        seen.push((mass.value.is_finite().then_some(mass.value), mass.valid));
    };
    simulation.run(&mut [&mut watch]).unwrap();
    let expected = [
        (None, false),
        (Some(5000.0), true),
        (Some(5000.0), true),
        (Some(6000.0), true),
        (None, false),
    ];
    assert_eq!(seen, expected);
}

/// White noise on a speed that changes slowly is found, given to the estimators that the map does not set it for, and
/// reported.
#[test]
fn noise_of_a_log_is_given_by_name() {
    let mut noise = monorig_sim::sensors::stream::Stream::new(3, "test");
    let rows = (0..3000).map(|k| {
        let t = f64::from(k) * 0.1;
        format!("{t},{}\n", (0.05 * t).sin() + 0.04 * noise.normal())
    });
    let log = Log::new(&[("log.csv", &format!("t,v\n{}", rows.collect::<String>()))]);
    let map = WHEEL.to_owned()
        + "estimators: {ekf_v_theta_biases: {}, set: {is: ekf_v_theta_biases, wheel_speed_sd_mps: 0.3}}\n";
    let map = log.map(&map).unwrap();
    let options = ReplayOptions {
        noise: Some(NoiseSource::FromLog),
        ..ReplayOptions::default()
    };
    let built = monorig_logs::replay::build(&map, &options, &Registry::default()).unwrap();
    let (simulation, found) = (built.simulation, built.found);
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(
        found[0]
            .what
            .contains("estimators.ekf_v_theta_biases.wheel_speed_sd_mps")
    );
    assert!((found[0].value / 0.04 - 1.0).abs() < 0.1, "{found:?}");
    let settings = serde_json::to_value(&simulation.scenario).unwrap();
    let given = settings["estimators"]["ekf_v_theta_biases"]["wheel_speed_sd_mps"].as_f64();
    assert_eq!(given, Some(found[0].value));
    assert_eq!(settings["estimators"]["set"]["wheel_speed_sd_mps"], 0.3);
}

/// A table without a time or an estimate, or whose time goes back, is refused.
#[test]
fn bad_tables_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("mine.csv");
    let told = |text: &str| {
        std::fs::write(&path, text).unwrap();
        EstimatesFile::load(&path).unwrap_err().to_string()
    };
    assert!(told("t,m\n0,1\n").contains("no estimate"));
    assert!(told("t,mass_kg\n1,1\n0,1\n").contains("goes back in row"));
    let no_time = told("mass_kg,grade_deg\n1,0\n");
    assert!(no_time.contains("has the name of a time"), "{no_time}");
}
