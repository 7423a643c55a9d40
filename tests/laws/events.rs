//! Effects of events on a run: every kind of event, obstacles, and the closed loop.

use monorig_estimators::api::estimator::Estimator;
use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::run::{Observer, StepFrame, run};
use monorig_sim::config::scenario::Scenario;
use monorig_sim::error::Error;
use monorig_sim::plant::Truth;
use monorig_sim::record::{Chunk, Layout, Recorder, Sink};
use monorig_tests::{G, scenario, train};

/// Steps of a run, 1/s: those of the default of 4 ms.
const STEPS_HZ: f64 = 250.0;

/// Keeps what a test asks for.
struct Keep<F: FnMut(&StepFrame<'_>)>(F);

impl<F: FnMut(&StepFrame<'_>)> Observer for Keep<F> {
    fn wants_truth(&self, _: i64) -> bool {
        true
    }
    fn on_step(&mut self, f: &StepFrame<'_>) -> Result<(), Error> {
        (self.0)(f);
        Ok(())
    }
}

fn watch(s: Scenario, look: impl FnMut(&StepFrame<'_>)) -> monorig_sim::closed_loop::run::Outcome {
    let mut rig = Simulation::build(s, &Registry::default(), 1).expect("rig");
    let mut keep = Keep(look);
    run(&mut rig, &mut [&mut keep], &mut |_| true).expect("run")
}

/// The minimal scenario on a level track, 20 t on the hook, 20 s, unless `set` says otherwise.
fn level(set: &[(&str, &str)]) -> Scenario {
    let mut all = vec![
        ("track", "../assets/tracks/level_200m.yaml"),
        ("load.mass_kg", "20000"),
        ("stop.after_s", "20"),
    ];
    all.extend(set);
    scenario("minimal", &all)
}

fn truths(set: &[(&str, &str)]) -> Vec<Truth> {
    let mut all = Vec::new();
    watch(level(set), |f| all.push(f.truth.clone()));
    all
}

#[test]
fn a_load_set_down_leaves_the_train_lighter_and_the_springs_unloaded() {
    let all = truths(&[
        ("load.mass_kg", "8000"),
        ("events", "[{at_s: 10, load_mass_kg: 1000}]"),
        ("stop.after_s", "14"),
    ]);
    let at = |t: f64| &all[(t * STEPS_HZ) as usize - 1];
    assert!((at(9.9).total_mass_kg - at(13.9).total_mass_kg - 7000.0).abs() < 1e-9);
    // Relieved of seven tonnes the rolling resistance falls by their share (mean of a second: the load bounces).
    let mean = |t: f64| {
        (0..STEPS_HZ as usize)
            .map(|k| at(t + k as f64 / STEPS_HZ).resistance_n)
            .sum::<f64>()
            / STEPS_HZ
    };
    let share = 7000.0 * G * train("dx80_176y").resistance.running_wheel;
    let fell = mean(8.9) - mean(12.9);
    assert!(
        (fell / share - 1.0).abs() < 0.05,
        "{fell} N against {share} N"
    );
}

#[test]
fn on_a_slippery_stretch_the_wheels_that_are_on_it_slip_and_the_others_do_not() {
    let all = truths(&[
        ("events", "[{from_m: 28.0, to_m: 31.0, adhesion: 0.01}]"),
        ("start.chainage_m", "25"),
        ("load.mass_kg", "10000"),
        (
            "drive.speed",
            "[{at_s: 0, mps: 0}, {at_s: 1, mps: 0}, {at_s: 15, mps: 2.0}]",
        ),
    ]);
    let (mut on, mut off): (f64, f64) = (0.0, 0.0);
    for t in &all {
        for d in &t.drives {
            let slip = d.slip_mps.abs();
            if d.adhesion < 0.1 {
                on = on.max(slip)
            } else {
                off = off.max(slip)
            }
        }
    }
    assert!(on > 0.02, "slip on the stretch {on}");
    // Creep is 0.2 % at 5 kN; the wheels that leave the stretch spin down for a moment.
    assert!(
        all.last()
            .unwrap()
            .drives
            .iter()
            .all(|d| d.slip_mps.abs() < 0.02)
    );
}

#[test]
fn an_emergency_brake_stops_the_train_within_the_distance_its_force_allows() {
    let all = truths(&[
        ("events", "[{at_s: 10, brake: 0.2}]"),
        ("load.mass_kg", "10000"),
    ]);
    let at = |t: f64| &all[(t * STEPS_HZ) as usize - 1];
    let v = at(10.0).speed_mps;
    let start = at(10.0).chainage_m;
    let end = all.last().unwrap();
    assert!(
        v > 0.9 && end.speed_mps.abs() < 1e-3,
        "from {v} to {}",
        end.speed_mps
    );
    // 20 % of 140 kN and 4 kN of running resistance on 19 t and what turns with it; the brake needs some lags of 0.3 s
    // to come on.
    let slowest = v * v / 2.0 * 20_300.0 / 28_000.0 + v * 3.0 * 0.3;
    let way = end.chainage_m - start;
    assert!(way > 0.1 && way < slowest, "{way} m, at most {slowest} m");
}

/// Mean over the last second.
fn last_second(all: &[Truth], of: fn(&Truth) -> f64) -> f64 {
    all.iter()
        .rev()
        .take(STEPS_HZ as usize)
        .map(of)
        .sum::<f64>()
        / STEPS_HZ
}

/// 3 % of 8 × 17.5 kN: the controller drives against it, and the train is as fast as without.
#[test]
fn a_brake_that_drags_is_driven_against() {
    let run = |events| truths(&[("events", events), ("stop.after_s", "40")]);
    let (free, drags) = (run("[]"), run("[{at_s: 10, dragging_brake: 0.03}]"));
    let more = |of: fn(&Truth) -> f64| last_second(&drags, of) - last_second(&free, of);
    let brake_n = 0.03 * 8.0 * 17_500.0;
    assert!((more(|t| t.brake_n) / -brake_n - 1.0).abs() < 0.02);
    let traction_n = more(|t| t.traction_n);
    assert!((traction_n / brake_n - 1.0).abs() < 0.1, "{traction_n} N");
    assert!(more(|t| t.speed_mps).abs() < 0.02);
}

#[test]
fn a_drive_that_is_not_there_is_refused_by_its_key() {
    let s = level(&[("events", "[{at_s: 1, isolated_drive: 8}]")]);
    let refused = Simulation::build(s, &Registry::default(), 1).err().unwrap();
    let told = refused.to_string();
    assert!(
        told.contains("events[0].isolated_drive") && told.contains("no drive 8"),
        "{told}"
    );
}

/// The others have a seventh each of the torque that all eight have without the event.
#[test]
fn an_isolated_drive_gives_nothing_and_the_others_its_part() {
    let run = |events| truths(&[("events", events), ("stop.after_s", "40")]);
    let (whole, isolated) = (run("[]"), run("[{at_s: 10, isolated_drive: 3}]"));
    let torque = |all: &[Truth], i: usize| {
        let now = all.last().unwrap();
        now.drives[i].motor_torque_nm
    };
    let sum = |all: &[Truth]| (0..8).map(|i| torque(all, i)).sum::<f64>();
    assert!(torque(&isolated, 3).abs() < 1e-6 && torque(&whole, 3) > 1.0);
    let share = torque(&isolated, 0) / sum(&isolated);
    assert!((share - 1.0 / 7.0).abs() < 1e-3, "{share}");
    let ratio = sum(&isolated) / sum(&whole);
    assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
}

#[test]
fn lost_clamp_pressure_takes_the_traction_away() {
    let all = truths(&[
        ("events", "[{at_s: 8, clamp_mpa: 0.0}]"),
        ("load.mass_kg", "10000"),
    ]);
    let at = |t: f64| &all[(t * STEPS_HZ) as usize - 1];
    assert!(at(7.9).traction_n > 1000.0);
    assert!(at(12.0).traction_n.abs() < 50.0, "{}", at(12.0).traction_n);
    assert!(
        at(19.0).speed_mps < at(8.0).speed_mps - 0.5,
        "the train coasts down"
    );
}

#[test]
fn a_stuck_sensor_repeats_itself_and_an_absent_one_says_nothing() {
    let mut stuck = Vec::new();
    let mut absent = 0;
    let set = [(
        "events",
        "[{from_s: 8, to_s: 12, sensor: accelerometer, fault: stuck}, {from_s: 14, sensor: accelerometer, fault: \"off\"}]",
    )];
    watch(level(&set), |f| {
        let t = f.truth.t_s;
        if let Some(s) = f.measurements.specific_force_mps2 {
            if (8.1..11.9).contains(&t) {
                stuck.push(s.value[0]);
            }
            if t > 14.1 {
                absent += 1;
            }
        }
    });
    assert!(stuck.len() > 500 && stuck.iter().all(|x| *x == stuck[0]));
    assert_eq!(absent, 0);
}

#[test]
fn a_load_that_meets_an_obstacle_is_held_by_it() {
    let block = "[{at_m: 32, left_m: 0, up_m: -2.2, size_m: [0.5, 3, 2.5]}]";
    let set = [
        ("obstacles", block),
        ("stop.after_s", "25"),
        ("start.chainage_m", "25"),
    ];
    let mut least = f64::INFINITY;
    let mut clear = Vec::new();
    let mut sway: f64 = 0.0;
    watch(level(&set), |f| {
        least = least.min(f.truth.clearance_m);
        sway = sway.max(f.truth.sway_rad[0].abs());
        clear.push((f.truth.t_s, f.truth.clearance_m));
    });
    let free = truths(&[("stop.after_s", "25"), ("start.chainage_m", "25")]);
    let free_sway = free.iter().map(|t| t.sway_rad[0].abs()).fold(0.0, f64::max);
    assert!(clear[0].1 > 1.0, "far at the start: {:?}", clear[0]);
    assert!(least < 0.02, "it comes near: {least}");
    assert!(
        sway > 3.0 * free_sway,
        "it is pushed back: {sway} rad against {free_sway} rad"
    );
}

#[test]
fn a_roadway_gives_a_clearance_that_is_the_distance_to_its_walls() {
    // 1.2 m wide payload in a 3 m roadway: 0.9 m to either wall, apart from sway.
    let all = truths(&[
        ("roadway", "{width_m: 3.0, above_m: 0.5, below_m: 4.0}"),
        ("stop.after_s", "3"),
    ]);
    for t in &all {
        assert!((t.clearance_m - 0.9).abs() < 0.02, "{}", t.clearance_m);
    }
}

#[test]
fn the_estimate_in_the_loop_changes_the_motion() {
    // Same seed, same noise: with the estimate fed forward the train follows its speed better over the climb.
    let follow = |ff: &str| {
        let (mut sum, mut n, mut last) = (0.0, 0.0, 0.0);
        watch(
            scenario("liu2023_section1", &[("drive.controller.feedforward", ff)]),
            |f| {
                if f.truth.t_s > 25.0 {
                    sum += (f.truth.speed_mps - f.reference.speed_mps).powi(2);
                    n += 1.0;
                }
                last = f.truth.chainage_m;
            },
        );
        ((sum / n).sqrt(), last)
    };
    let (without, end_without) = follow("none");
    let (with, end_with) = follow("estimate");
    assert_ne!(
        end_with, end_without,
        "the output of the estimator reaches the motion"
    );
    assert!(
        with < without,
        "speed error {with} m/s with, {without} m/s without"
    );
}

#[test]
fn a_cycle_and_its_loads_start_over() {
    let mut rows = Vec::new();
    watch(
        level(&[
            ("load.mass_kg", "0"),
            ("stop.after_s", "36"),
            ("physics.plant", "point-mass"),
            (
                "drive",
                "{speed: [{at_s: 0, mps: 0}, {at_s: 2, mps: 1}, {at_s: 8, mps: 1}, {at_s: 10, mps: 0}], every_s: 12}",
            ),
            (
                "events",
                "[{at_s: 3, load_mass_kg: 5000, every_s: 12}, {at_s: 9, load_mass_kg: 1000, every_s: 12}]",
            ),
        ]),
        |f| rows.push((f.truth.t_s, f.reference.speed_mps, f.truth.load_mass_kg)),
    );
    let at = |t: f64| rows[(t * STEPS_HZ) as usize - 1];
    for round in 0..3 {
        let start = 12.0 * f64::from(round);
        for (t, speed, load) in [
            (1.0, 0.5, if round == 0 { 0.0 } else { 1000.0 }),
            (5.0, 1.0, 5000.0),
            (9.5, 0.25, 1000.0),
            (11.0, 0.0, 1000.0),
        ] {
            let (_, v, kg) = at(start + t);
            assert!((v - speed).abs() < 2e-3, "{v} m/s {t} s into round {round}");
            assert_eq!(kg, load, "{t} s into round {round}");
        }
    }
}

/// The methods as printed stand beside the others in a scenario, whole or with some slips mended; what they say stays
/// finite, however wrong.
#[test]
fn methods_as_printed_can_be_named_beside_the_others() {
    let bank = "{dffrls_aekf_robust: {}, dffrls_aekf_printed: {}, resistance_dffrls_printed: {eq14: corrected}, \
                dffrls_aukf_printed: {}, imm_stf_printed: {eq11: corrected}, mmrls_sh_stf_printed: {}}";
    let (mut members, mut whole) = (0, true);
    watch(level(&[("estimators", bank)]), |f| {
        members = f.estimators.len();
        whole &= f
            .estimators
            .iter()
            .all(|member| member.estimate.is_finite());
    });
    assert_eq!((members, whole), (6, true));
}

/// A fault of an instrument that nobody reads changes nothing, to the bit; that of one that is read does.
#[test]
fn no_estimate_depends_on_the_clamp_pressure() {
    let estimates = |events: &str| {
        let mut all = Vec::new();
        let set = [("stop.after_s", "12"), ("events", events), ("expect", "[]")];
        watch(scenario("fault_clamp_pressure", &set), |f| {
            let e = f.estimators[0].estimate;
            all.push(
                [e.total_mass_kg, e.grade_rad, e.effective_grade_rad]
                    .map(|x| [x.value.to_bits(), x.sd.to_bits()]),
            );
        });
        all
    };
    let sound = estimates("[]");
    for sensor in ["clamp_pressure", "gyro"] {
        let faults = [
            "off}",
            "stuck}",
            "drift, size: 1}",
            "scale, size: 2}",
            "spikes, size: 5}",
        ];
        for (fault, changes) in faults.map(|f| (f, sensor == "gyro")) {
            let faulty = estimates(&format!("[{{from_s: 3, sensor: {sensor}, fault: {fault}]"));
            assert_eq!(faulty != sound, changes, "{sensor}: {fault}");
        }
    }
}

/// Keeps the events of a recording.
struct EventSink(Vec<(i64, String)>);

impl Sink for EventSink {
    fn begin(&mut self, _: &Layout<'_>) -> Result<(), Error> {
        Ok(())
    }
    fn chunk(&mut self, chunk: &Chunk) -> Result<(), Error> {
        self.0.extend(chunk.events.iter().cloned());
        Ok(())
    }
    fn finish(&mut self) -> Result<(), Error> {
        Ok(())
    }
}

/// A named point of the drive, the end of a fault, and the train's front and rear on a named stretch of the track are
/// recorded in the row in which they come.
#[test]
fn named_moments_are_recorded_when_they_come() {
    let off = "[{from_s: 10, to_s: 12, sensor: gyro, fault: 'off'}]";
    let set = [("physics.plant", "point-mass"), ("events", off)];
    let file = scenario("liu2023_section1", &set);
    let mut rig = Simulation::build(file, &Registry::default(), 1).expect("rig");
    let mut places = rig.rail.places.iter();
    let climb = places.find(|p| p.name == "climb").expect("climb").clone();
    let (imu_m, length_m) = (rig.imu_offset_m, rig.train.limits.length_m);
    let (mut front_s, mut rear_s) = (f64::INFINITY, f64::INFINITY);
    let mut look = Keep(|f: &StepFrame<'_>| {
        let front_m = f.truth.chainage_m - imu_m;
        if front_m >= climb.from_m {
            front_s = front_s.min(f.truth.t_s);
        }
        if front_m - length_m >= climb.from_m {
            rear_s = rear_s.min(f.truth.t_s);
        }
    });
    let mut kept = EventSink(Vec::new());
    let mut recorder = Recorder::new(vec![Box::new(&mut kept)]);
    run(&mut rig, &mut [&mut recorder, &mut look], &mut |_| true).expect("run");
    drop(recorder);
    for (text, at_s) in [
        ("at_speed", 4.0),
        ("fault on gyro: off is over", 12.0),
        ("front enters climb", front_s),
        ("rear enters climb", rear_s),
    ] {
        let told = kept.0.iter().filter(|e| e.1 == text);
        let times: Vec<f64> = told.map(|e| e.0 as f64 * 1e-9 - at_s).collect();
        // a row every 20 ms
        assert!(
            times.len() == 1 && (-1e-6..0.021).contains(&times[0]),
            "{text}: {times:?}"
        );
    }
    assert!(kept.0.is_sorted_by_key(|e| e.0));
}

/// While the computer of the estimators restarts nothing is marked valid once the last estimate is stale; from then on
/// the estimates are those of a new estimator that begins with the next sample, to the last bit.
#[test]
fn after_a_restart_every_estimator_begins_anew() {
    let s = level(&[
        ("events", "[{at_s: 8, restart_s: 3}]"),
        ("drive.controller.feedforward", "none"),
    ]);
    let mut rig = Simulation::build(s, &Registry::default(), 1).expect("rig");
    let name = "dffrls_aekf_robust";
    let mut fresh =
        monorig_estimators::registry::build(name, &rig.vehicle, std::iter::empty()).expect(name);
    let (mut last_s, mut compared, mut valid) = (11.0 - 1.0 / STEPS_HZ, 0, 0);
    let mut keep = Keep(|f: &StepFrame<'_>| {
        let found = f.estimators[0].estimate;
        let t = f.truth.t_s;
        if t > 8.6 && t < 10.999 {
            assert!(!found.grade_rad.valid && !found.total_mass_kg.valid, "{t}");
        }
        if t < 10.999 || !f.sampled {
            return;
        }
        let own = fresh.step(f.measurements, f.command, t - last_s);
        last_s = t;
        let own = own.expect("step");
        assert_eq!(own.grade_rad, found.grade_rad, "{t}");
        assert_eq!(own.total_mass_kg, found.total_mass_kg, "{t}");
        compared += 1;
        valid += usize::from(found.grade_rad.valid);
    });
    run(&mut rig, &mut [&mut keep], &mut |_| true).expect("run");
    assert!(
        compared > 1000 && valid > compared / 2,
        "{compared} {valid}"
    );
}
