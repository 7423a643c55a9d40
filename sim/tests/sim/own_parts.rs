//! Estimators and controllers by name and by box, one estimator under several names, and what is refused.

use monorig_estimators::{
    Command, Error, Estimate, Estimator, Measurements, Sample, Time, Value, Vehicle,
};
use monorig_sim::closed_loop::registry::Refusal;
use monorig_sim::closed_loop::run::Steps;
use monorig_sim::config::scenario::{ControllerSettings, FeedForward, PlantKind, PlantSettings};
use monorig_sim::plant::PlantSetup;
use monorig_sim::plant::point_mass::PointMass;
use monorig_sim::sensors::fault::FaultWindow;
use monorig_sim::sensors::{Fitting, SensorChannel, StepInterval};
use monorig_sim::{
    Controller, ControllerSetup, DriveCycle, Instrument, Perception, Plant, Rail, Reference,
    Registry, Scenario, Settings, Sheet, Simulation, SimulationBuilder, StepFrame, Train, Truth,
};
use std::path::{Path, PathBuf};

monorig_estimators::params! {
    /// Parameters of the constant estimator.
    ConstantParams {
        mass_kg ["kg"] = 15e3, 1.0 => 1e6, "The mass that it always reports.";
    }
}

/// Reports a constant mass; owns a heap, and is no `Copy`.
struct Constant(Vec<f64>);

impl Estimator for Constant {
    fn step(&mut self, z: &Measurements, _: &Command, _: f64) -> Result<Estimate, Error> {
        let total_mass_kg = Value {
            value: self.0[0],
            sd: 1.0,
            valid: true,
        };
        Ok(Estimate {
            total_mass_kg,
            ..Estimate::at(z.t)
        })
    }
    fn reset(&mut self) {}
}

/// Refuses every step in its own words, and breaks down at a time of its own.
struct Refuses {
    breaks_at_s: f64,
}

impl Estimator for Refuses {
    fn step(&mut self, z: &Measurements, _: &Command, _: f64) -> Result<Estimate, Error> {
        match z.t.s() < self.breaks_at_s {
            true => Err(Error::own("no fix")),
            false => Err(Error::broken(format_args!("{} drives are lost", 2))),
        }
    }
    fn reset(&mut self) {}
}

/// Brakes, whatever is asked.
struct Brakes;

impl Controller for Brakes {
    fn control(&mut self, r: &Reference, _: &Perception, _: f64) -> Command {
        Command {
            brake: 1.0,
            ..r.command()
        }
    }
}

fn assets() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets")
}

/// Ten seconds of a point mass on the first section of Liu et al. 2023.
fn in_code() -> SimulationBuilder {
    let rail = Rail::load(&assets().join("tracks/liu2023_section1.yaml")).unwrap();
    let train = Train::load(&assets().join("trains/dx80_176y.yaml")).unwrap();
    // a run is drawn by the name of its scenario, too
    Simulation::builder(rail, train)
        .name("sample")
        .sensors(Sheet::load(&assets().join("sensors/liu2023.yaml")).unwrap())
        .drive_cycle(DriveCycle::by_time(&[(0.0, 0.0), (4.0, 1.0)]).unwrap())
        .plant_kind(PlantKind::PointMass)
        .load_mass_kg(10e3)
        .stop_after_s(10.0)
}

/// The same as a file, with more of it.
fn from_file(more: &str) -> Result<Simulation, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sample.yaml");
    let assets = assets();
    let assets = assets.display();
    let text = format!(
        "version: 1\nwhy: A test.\ntrack: {assets}/tracks/liu2023_section1.yaml\ntrain: {assets}/trains/dx80_176y.yaml\n\
         sensors: {assets}/sensors/liu2023.yaml\nload: {{mass_kg: 10000}}\nphysics: {{plant: point-mass}}\nstop: {{after_s: 10}}\n{more}\n"
    );
    std::fs::write(&path, text).unwrap();
    std::fs::write(
        folder.path().join("tuned.yaml"),
        "version: 1\nwhy: A test.\nestimator: dffrls_aekf_robust\nparameters: {delta: 0.9}\n",
    )
    .unwrap();
    let scenario = Scenario::load(&path, &[]).map_err(|e| e.to_string())?;
    Simulation::build(scenario, &parts(), 1).map_err(|e| e.to_string())
}

monorig_estimators::params! {
    /// Parameters of a radar.
    RadarParams {
        scale ["-"] = 1.0, 0.5 => 2.0, "What it shows of a speed of 1 m/s.";
        rate_hz ["Hz"] = 100.0, 1.0 => 1000.0, "Samples per second.";
    }
}

/// Measures the speed of the train, into `auxiliary_1`.
struct Radar(RadarParams);

impl Instrument for Radar {
    fn name(&self) -> &str {
        "radar"
    }
    fn rate_hz(&self) -> f64 {
        self.0.rate_hz
    }
    fn measure(
        &mut self,
        step: StepInterval,
        truth: &Truth,
        z: &mut Measurements,
    ) -> Result<(), monorig_sim::Error> {
        z.auxiliary[0] = Some(Sample {
            t: Time::from_ns(step.to_ns),
            value: truth.speed_mps * self.0.scale,
        });
        Ok(())
    }
    fn add_fault(&mut self, _: Option<usize>, _: FaultWindow) {}
    fn channels(&self) -> Vec<SensorChannel> {
        let value = |z: &Measurements| z.auxiliary[0].map(|s| s.value);
        vec![SensorChannel::new("auxiliary_1", "m/s", value)]
    }
}

monorig_estimators::params! {
    /// Parameters of a point mass that a program adds.
    PointParams { load_mass_kg ["kg"] = 10e3, 0.0 => 20e3, "The load that is really there."; }
}

/// The registry of a program that adds a part of each kind.
fn parts() -> Registry {
    let mut registry = Registry::default();
    registry
        .estimator("constant", |_: &Vehicle, p: &ConstantParams| {
            Constant(vec![p.mass_kg])
        })
        .unwrap();
    registry
        .instrument("radar", |_: &Fitting<'_>, p: &RadarParams| Radar(*p))
        .unwrap();
    registry
        .instrument("sonar", |_: &Fitting<'_>, p: &RadarParams| Radar(*p))
        .unwrap();
    registry
        .plant("point", |s: &PlantSetup<'_>, p: &PointParams| {
            let train = s.train.clone().with_load_mass(p.load_mass_kg);
            let train = train.map_err(|_| "this load is too heavy for the train")?;
            Ok::<_, &str>(PointMass::new(train, s.rail.clone(), s.options))
        })
        .unwrap();
    registry
}

const DRIVE: &str = "drive: {speed: [{at_s: 0, mps: 0}, {at_s: 4, mps: 1}]}";

/// Speed and all masses, step by step, as bits.
fn bits(sim: &mut Simulation) -> Vec<u64> {
    let mut all = Vec::new();
    let mut watch = |f: &StepFrame<'_>| {
        all.push(f.truth.speed_mps.to_bits());
        let masses = f.estimators.iter().map(|e| e.estimate.total_mass_kg.value);
        all.extend(masses.map(f64::to_bits));
    };
    sim.run(&mut [&mut watch]).unwrap();
    all
}

fn refusal(built: Result<Simulation, impl ToString>) -> String {
    match built {
        Ok(_) => panic!("it was built"),
        Err(e) => e.to_string(),
    }
}

#[test]
fn code_and_file_give_the_same_run_to_the_bit() {
    let estimator = "dffrls_aekf_robust";
    let code = in_code().registered_estimator(estimator, Settings::default());
    let more = format!("{DRIVE}\nestimators: {{{estimator}: {{}}}}");
    let of_file = bits(&mut from_file(&more).unwrap());
    assert!(of_file.len() > 4000);
    assert_eq!(bits(&mut code.build(1).unwrap()), of_file);
}

#[test]
fn one_estimator_runs_under_several_names_with_parameters_of_its_own() {
    let mut sim = from_file(&format!(
        "{DRIVE}\nestimators:\n  dffrls_aekf_robust: {{}}\n  same: {{is: dffrls_aekf_robust}}\n  \
         tuned: {{is: dffrls_aekf_robust, delta: 0.9, lambda0: 0.9}}\n  by-file: {{is: dffrls_aekf_robust, from: tuned.yaml}}\n  \
         mine: {{is: constant, mass_kg: 12345}}\nin_loop: tuned"
    ))
    .unwrap();
    let names: Vec<&str> = sim.estimators.iter().map(|e| e.name.as_str()).collect();
    assert_eq!(
        names,
        ["by-file", "dffrls_aekf_robust", "mine", "same", "tuned"]
    );
    assert_eq!(sim.in_loop, Some(4));
    let (mut steps, mut differ) = (0, 0);
    let mut watch = |f: &StepFrame<'_>| {
        let of = |name: &str| {
            let found = f.estimators.iter().find(|e| e.name == name);
            found.unwrap().estimate
        };
        assert_eq!(of("dffrls_aekf_robust"), of("same"));
        differ += usize::from(of("tuned") != of("same"));
        steps += usize::from(f.sampled);
        assert!(!f.sampled || of("mine").total_mass_kg.value == 12345.0);
    };
    sim.run(&mut [&mut watch]).unwrap();
    assert!(steps > 1000 && differ > steps / 2, "{differ} of {steps}");
}

#[test]
fn what_is_not_in_the_registry_is_refused_with_the_nearest_name() {
    for (estimators, parts) in [
        (
            "dffrls_aekf_robst: {}",
            &["did you mean `dffrls_aekf_robust`", "`is`"][..],
        ),
        (
            "tuned: {is: constnt}",
            &["tuned.is", "did you mean `constant`"],
        ),
        (
            "mine: {is: constant, mas_kg: 1}",
            &["mine.mas_kg", "did you mean `mass_kg`"],
        ),
        (
            "constant: {mass_kg: 0}",
            &["constant.mass_kg", "1…1000000 kg"],
        ),
        ("constant: {mass_kg: heavy}", &["heavy is not a number"]),
        ("constant: {mass_kg: true}", &["true is not a number"]),
        (
            "x: {is: constant, from: tuned.yaml}",
            &["parameters of `dffrls_aekf_robust`", "of `constant`"],
        ),
        ("x: {from: tuned.yaml}", &["write `is: dffrls_aekf_robust`"]),
        (
            "'a/b': {is: constant}",
            &["cannot be the name of an estimator", "`a_b`"],
        ),
        (
            "'': {is: constant}",
            &["cannot be the name of an estimator"],
        ),
    ] {
        let told = refusal(from_file(&format!("{DRIVE}\nestimators: {{{estimators}}}")));
        let all = parts.iter().all(|part| told.contains(part));
        assert!(all && told.contains("sample.yaml:"), "{told}");
    }
    for (controller, part) in [
        ("{kind: pid}", "did you mean `pi`"),
        ("{kpp: 1}", "did you mean `kp`"),
        ("{kp: -1}", "0…1000 1/s"),
        ("{hold: 1}", "1 is not true or false"),
        ("{feedforward: estimat}", "estimate"),
    ] {
        let drive = DRIVE.replace("]}", &format!("], controller: {controller}}}"));
        let told = refusal(from_file(&drive));
        assert!(
            told.contains(part) && told.contains("drive.controller"),
            "{told}"
        );
    }
}

#[test]
fn boxes_of_ones_own_run_beside_the_registry() {
    let mut sim = in_code()
        .estimator("mine", Box::new(Constant(vec![20e3])))
        .registered_estimator("rail_fusion", Settings::default())
        .controller(Box::new(Brakes))
        .build(1)
        .unwrap();
    let outcome = sim.run(&mut []).unwrap();
    assert!(outcome.finished && sim.plant.truth().speed_mps.abs() < 1e-3);
    assert_eq!(sim.estimators[0].estimate.total_mass_kg.value, 20e3);

    let brakes = |_: &Vehicle, _: &ControllerSetup, _: &ConstantParams| Brakes;
    let mut registry = Registry::default();
    registry.controller("brakes", brakes).unwrap();
    let named = in_code()
        .registry(&registry)
        .registered_controller(ControllerSettings::of_kind("brakes").set("mass_kg", 2.0));
    let mut sim = named.build(1).unwrap();
    sim.run(&mut []).unwrap();
    assert!(sim.plant.truth().speed_mps.abs() < 1e-3);
}

/// A scenario names an instrument and a plant of the program's own, with parameters, faults and changes.
#[test]
fn an_instrument_and_a_plant_by_name() {
    let more = format!("{DRIVE}\nestimators: {{constant: {{}}}}");
    let ours = bits(&mut from_file(&more).unwrap());
    let own = more.replace("drive", "instruments: {radar: {scale: 2}}\nevents: [{name: blind, from_s: 1, to_s: 2, sensor: radar, fault: 'off'}]\ndrive");
    let mut sim = from_file(&own).unwrap();
    assert!(sim.sensors.names().contains(&"radar".to_owned()));
    let mut seen = Vec::new();
    let mut watch = |f: &StepFrame<'_>| {
        let radar = f.measurements.auxiliary[0];
        seen.extend(radar.map(|s| (s.value, 2.0 * f.truth.speed_mps)));
    };
    sim.run(&mut [&mut watch]).unwrap();
    assert!(seen.len() > 1000 && seen.iter().all(|(a, b)| a == b));

    let with = |plant: &str| {
        in_code()
            .registry(&parts())
            .plant_kind(PlantKind::named(plant))
    };
    let estimated = |b: SimulationBuilder| b.registered_estimator("constant", Settings::default());
    assert_eq!(bits(&mut estimated(with("point")).build(1).unwrap()), ours);
    assert_eq!(
        bits(&mut estimated(with("point-mass")).build(1).unwrap()),
        ours
    );
    let lighter = PlantKind::Own(PlantSettings::of_kind("point").set("load_mass_kg", 5e3));
    let lighter = estimated(with("rapier")).plant_kind(lighter).build(1);
    assert_ne!(bits(&mut lighter.unwrap()), ours);

    for (wrong, told) in [
        ("instruments: {raddar: {}}", "did you mean `radar`"),
        ("instruments: {radar: {scal: 1}}", "did you mean `scale`"),
        ("instruments: {radar: {scale: 3}}", "3 is not"),
        (
            "instruments: {radar: {rate_hz: 900}}",
            "more than one sample per physics step",
        ),
        (
            "instruments: {sonar: {}}",
            "the name of this instrument is `radar`",
        ),
    ] {
        let found = from_file(&format!("{more}\n{wrong}")).err().unwrap();
        assert!(
            found.contains(told) && found.contains("instruments"),
            "{found}"
        );
        assert!(found.contains("sample.yaml"), "{found}");
    }
    for (plant, told) in [
        ("pointmass", "did you mean `point-mass`"),
        ("pont", "did you mean `point`"),
    ] {
        let found = refusal(with(plant).build(1));
        assert!(
            found.contains(told) && found.contains("physics.plant"),
            "{found}"
        );
    }
    let taken = |s: &PlantSetup<'_>, _: &PointParams| {
        Ok::<_, String>(PointMass::new(s.train.clone(), s.rail.clone(), s.options))
    };
    assert!(parts().plant("rapier", taken).is_err());
}

#[test]
fn what_cannot_be_built_in_code_says_why() {
    let mine = || Box::new(Constant(vec![20e3]));
    let no_sensors = || {
        let rail = Rail::load(&assets().join("tracks/level_200m.yaml")).unwrap();
        let train = Train::load(&assets().join("trains/dx80_176y.yaml")).unwrap();
        Simulation::builder(rail, train)
    };
    for (builder, part) in [
        (in_code().load_mass_kg(f64::NAN), "load.mass_kg"),
        (in_code().load_mass_kg(1e6), "the train cannot carry"),
        (in_code().stop_after_s(0.0), "stop.after_s"),
        (in_code().in_loop("nobody"), "`nobody` is not among"),
        (
            in_code().feedforward(FeedForward::Estimate),
            "no estimator in the loop",
        ),
        (in_code().estimator("a/b", mine()), "cannot be the name"),
        (
            in_code().estimator("a", mine()).estimator("a", mine()),
            "two estimators",
        ),
        (
            no_sensors().stop_after_s(1.0),
            "the speed reference has no point",
        ),
        (
            no_sensors()
                .stop_after_s(1.0)
                .drive_cycle(DriveCycle::by_time(&[(0.0, 0.0)]).unwrap()),
            "no instruments",
        ),
        (
            no_sensors().drive_cycle(DriveCycle::by_time(&[(0.0, 0.0)]).unwrap()),
            "this run has no end",
        ),
    ] {
        let told = refusal(builder.build(1));
        assert!(told.contains(part), "{part}: {told}");
    }
    assert!(DriveCycle::by_time(&[(-1.0, 0.0)]).is_err());
    assert!(DriveCycle::by_chainage(&[(1.0, f64::NAN)], 0.3).is_err());
}

/// Marks a mass valid that is no number, or infinite, from its second sample on.
struct NoNumber(f64, u32);

impl Estimator for NoNumber {
    fn step(&mut self, z: &Measurements, _: &Command, _: f64) -> Result<Estimate, Error> {
        self.1 += 1;
        let value = if self.1 > 1 { self.0 } else { 12e3 };
        let total_mass_kg = Value {
            value,
            sd: 1.0,
            valid: true,
        };
        Ok(Estimate {
            total_mass_kg,
            ..Estimate::at(z.t)
        })
    }
    fn reset(&mut self) {}
}

/// A number that is not finite is not taken as valid, neither by the controller in the loop nor by those who judge, and
/// the run says so.
#[test]
fn a_value_that_is_no_number_is_not_taken_as_valid() {
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut sim = in_code()
            .estimator("mine", Box::new(NoNumber(value, 0)))
            .in_loop("mine")
            .build(1)
            .unwrap();
        let mut last = (0, false);
        let mut watch = |f: &StepFrame<'_>| {
            if f.sampled {
                last.0 += 1;
                last.1 = f.estimators[0].estimate.total_mass_kg.valid;
                assert_eq!(last.1, last.0 == 1);
            }
            assert!(f.truth.speed_mps.is_finite() && f.command.motor_torque_nm[0].is_finite());
        };
        let outcome = sim.run(&mut [&mut watch]).unwrap();
        let [(name, times, reason)] = &outcome.refusals[..] else {
            panic!("{:?}", outcome.refusals)
        };
        assert_eq!((name.as_str(), *times), ("mine", last.0 - 1));
        assert!(reason.contains("not finite"), "{reason}");
    }
}

/// A train whose resistance turns its speed round within a step: the run ends with the time, a body and the value that
/// does it, and without a panic.
#[test]
fn a_plant_that_diverges_ends_the_run() {
    for key in ["bearing_nspm", "air_nspm2"] {
        let rail = Rail::load(&assets().join("tracks/liu2023_section1.yaml")).unwrap();
        let mut train = Train::load(&assets().join("trains/dx80_176y.yaml")).unwrap();
        match key {
            "bearing_nspm" => train.resistance.bearing_nspm = 1e9,
            _ => train.resistance.air_nspm2 = 1e12,
        }
        let built = Simulation::builder(rail, train)
            .sensors(Sheet::load(&assets().join("sensors/liu2023.yaml")).unwrap())
            .drive_cycle(DriveCycle::by_time(&[(0.0, 1.0)]).unwrap())
            .start_speed_mps(1.0)
            .plant_kind(PlantKind::Rapier)
            .stop_after_s(5.0)
            .build(1);
        let ended = built.and_then(|mut sim| sim.run(&mut []));
        let told = ended.unwrap_err().to_string();
        assert!(
            told.contains("broke down at t = ") && told.contains("diverges"),
            "{told}"
        );
        assert!(told.contains(&format!("train.resistance.{key}")), "{told}");
        // while the train settles there is no motion to name a body by
        assert!(
            told.contains("motion of `") || told.contains("t = 0.000"),
            "{told}"
        );
    }
}

/// The words of an estimator of one's own reach its user: of a refused step, of one after which it cannot go on, of a
/// vehicle that it cannot be built for.
#[test]
fn the_reason_of_an_estimator_of_ones_own_is_told() {
    let with = |breaks_at_s| {
        in_code().estimator_with("mine", move |vehicle| {
            assert!(vehicle.drives > 0);
            Ok(Box::new(Refuses { breaks_at_s }))
        })
    };
    let outcome = with(f64::INFINITY).build(1).unwrap().run(&mut []).unwrap();
    let (name, times, reason) = &outcome.refusals[0];
    assert_eq!((name.as_str(), reason.as_str()), ("mine", "no fix"));
    assert!(*times > 100);
    let broken = with(3.0).build(1).unwrap().run(&mut []).unwrap_err();
    let monorig_sim::Error::Estimator {
        name,
        seed: Some(1),
        t_s,
        what,
    } = &broken
    else {
        panic!("{broken}");
    };
    assert_eq!(
        (name.as_str(), what.as_str()),
        ("mine", "2 drives are lost")
    );
    assert!((3.0..3.1).contains(t_s), "{t_s}");
    let refuses = |_: &Vehicle| Err(Refusal::new("no gyro", "a sensor sheet with one"));
    let refused = in_code()
        .estimator_with("mine", refuses)
        .build(1)
        .err()
        .unwrap();
    let told = refused.to_string();
    assert!(
        told.contains("estimators.mine: no gyro") && told.contains("sheet with one"),
        "{told}"
    );
}

/// Panics at a time of its own, as estimator and as controller.
struct Panics {
    at_s: f64,
}

impl Estimator for Panics {
    fn step(&mut self, z: &Measurements, _: &Command, _: f64) -> Result<Estimate, Error> {
        assert!(z.t.s() < self.at_s, "no wheel {}", 7);
        Ok(Estimate::at(z.t))
    }
    fn reset(&mut self) {}
}

impl Controller for Panics {
    fn control(&mut self, r: &Reference, _: &Perception, dt_s: f64) -> Command {
        self.at_s -= dt_s;
        assert!(self.at_s > 0.0, "no wheel {}", 7);
        r.command()
    }
}

/// A plant that stands, and panics at a time of its own.
struct PanickingPlant {
    truth: Truth,
    at_s: f64,
}

impl Plant for PanickingPlant {
    fn step(&mut self, _: &Command, dt_s: f64) -> Result<(), monorig_sim::Error> {
        self.truth.t_s += dt_s;
        assert!(self.truth.t_s < self.at_s, "no wheel {}", 7);
        Ok(())
    }
    fn truth(&self) -> &Truth {
        &self.truth
    }
    fn set_load_mass(&mut self, _: f64, _: Option<f64>) {}
    fn set_clamp_limit(&mut self, _: f64) {}
}

/// A panic of an estimator, a controller or a plant of one's own ends its run with an error: the part, the time, its
/// message and its place in the source. A panic while one is built is an error of its key.
#[test]
fn a_panic_of_ones_own_part_is_an_error_of_the_run() {
    let mut truth = in_code().build(1).unwrap().plant.truth().clone();
    truth.speed_mps = 0.0;
    let at_s = 3.0;
    for (builder, part) in [
        (
            in_code().estimator("mine", Box::new(Panics { at_s })),
            "the estimator mine broke down at t = 3.0",
        ),
        (
            in_code().controller(Box::new(Panics { at_s })),
            "the controller panicked",
        ),
        (
            in_code().plant(Box::new(PanickingPlant { truth, at_s })),
            "the plant panicked",
        ),
    ] {
        let ended = builder.build(1).unwrap().run(&mut []);
        let told = ended.unwrap_err().to_string();
        let words = [part, "panicked: no wheel 7 (", "own_parts.rs:"];
        assert!(words.iter().all(|w| told.contains(w)), "{told}");
    }
    let panics = |_: &Vehicle| -> Result<_, Refusal> { panic!("no gyro") };
    let refused = in_code().estimator_with("mine", panics).build(1).err();
    let told = refused.unwrap().to_string();
    assert!(
        told.contains("estimators.mine: it panicked: no gyro ("),
        "{told}"
    );
}

/// The loop in single steps is the loop: with the controller's own commands they are the same run.
#[test]
fn single_steps_are_the_run() {
    let truth = |s: &Simulation| (s.plant.truth().chainage_m, s.plant.truth().speed_mps);
    let mut whole = in_code().build(1).unwrap();
    let outcome = whole.run(&mut []).unwrap();
    let mut single = in_code().build(1).unwrap();
    let mut steps = Steps::default();
    let ended = loop {
        if let Some(ended) = steps.ended(&single, &mut |_| true).unwrap() {
            break ended;
        }
        let seen = steps.look(&mut single);
        let command = single.control(&seen);
        steps.make(&mut single, command, &seen, &mut []).unwrap();
    };
    assert_eq!(ended, outcome);
    assert_eq!(truth(&single), truth(&whole));
    assert!(single.plant.truth().speed_mps > 0.5);
}
