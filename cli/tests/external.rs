//! Estimators outside of the program, by CAN frames: the same estimates, and what goes wrong on the way.

#![cfg(unix)] // programs as estimators
#![allow(clippy::unwrap_used)] // helpers of tests

mod common;

use common::{TestFolder, words};
use monorig_estimators::api::signals::{Command, Estimate, Measurements, Sample, Slot};
use monorig_estimators::{Error, Estimator, Real, Time, Vehicle};
use monorig_sim::closed_loop::registry::{BoxedEstimator, EstimatorType, NamedSettings, Registry};
use monorig_sim::closed_loop::run::{self, StepFrame};
use monorig_sim::closed_loop::{Outcome, Simulation, WallClock};
use monorig_sim::config::scenario::Scenario;
use monorig_wire::answer::{Answers, Came};
use monorig_wire::ecu::Ecu;
use monorig_wire::frame::Frame;
use monorig_wire::message::{Message, Value};
use monorig_wire::signal::Numbers;
use monorig_wire::step::Step;
use monorig_wire::{candump, cannelloni};
use std::io::{BufRead, Write};
use std::net::UdpSocket;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

const OURS: &str = env!("CARGO_BIN_EXE_monorig");

/// A scenario of the project with other estimators, `after_s` long.
fn scenario(name: &str, estimators: &str, after_s: &str) -> Scenario {
    let changes = [
        ("estimators", estimators),
        ("stop", &format!("{{after_s: {after_s}}}")),
        ("expect", "[]"),
        ("published", "[]"),
        ("known_failures", "[]"),
        ("in_loop", "null"),
        ("drive.controller", "{feedforward: none}"),
    ];
    let changes = changes.map(|(key, value)| (key.to_owned(), value.to_owned()));
    Scenario::load(&file(name), &changes).unwrap()
}

fn file(name: &str) -> PathBuf {
    common::project()
        .join("scenarios")
        .join(name)
        .canonicalize()
        .unwrap()
}

/// The estimator as an external one, started by ours.
fn ecu(name: &str, scenario: &str, signals: &str) -> String {
    let at = file(scenario);
    let at = at.display();
    let program = format!("[{OURS}, ecu, {name}, --scenario, {at}, --signals, {signals}]");
    format!("{{external: {{process: {program}, signals: {signals}}}}}")
}

fn registry() -> Registry {
    monorig_plugin::guards_libraries(Registry::default(), vec![OURS.into(), "serve-part".into()])
}

/// All numbers of an estimate.
fn numbers(e: &Estimate) -> Vec<f64> {
    let flag = |flag: bool| f64::from(u8::from(flag));
    let values = [
        e.total_mass_kg,
        e.grade_rad,
        e.effective_grade_rad,
        e.speed_mps,
    ];
    let mut all = vec![e.t.ns() as f64, e.innovation, e.nis];
    all.extend(values.iter().flat_map(|v| [v.value, v.sd, flag(v.valid)]));
    all.extend([e.flags.moving, e.flags.excited, e.flags.saturated].map(flag));
    all
}

/// Runs the scenario; hands over the name and the estimate of each estimator after each step with samples.
fn watch(
    scenario: Scenario,
    registry: &Registry,
    see: &mut dyn FnMut(&StepFrame<'_>),
) -> Result<Outcome, monorig_sim::Error> {
    let mut simulation = Simulation::build(scenario, registry, 3)?;
    let mut watched = |frame: &StepFrame<'_>| {
        if frame.sampled {
            see(frame);
        }
    };
    run::run(&mut simulation, &mut [&mut watched], &mut |_| true)
}

/// Each estimator in the loop and as a process of its own: with floating-point signals every number of every step is
/// the same, and so are the steps that are refused.
#[test]
fn every_estimator_is_the_same_in_a_process() {
    let registry = registry();
    let names: Vec<String> = registry
        .estimators()
        .iter()
        .map(|e| e.name().to_owned())
        .collect();
    assert!(names.len() > 10, "{names:?}");
    let scene = "liu2023_section1.yaml";
    for some in names.chunks(6) {
        let pair =
            |name: &String| format!("{name}: {{}}, {name}-ecu: {}", ecu(name, scene, "float"));
        let both: Vec<String> = some.iter().map(pair).collect();
        let mut steps = 0;
        let outcome = watch(
            scenario(scene, &format!("{{{}}}", both.join(", ")), "12"),
            &registry,
            &mut |frame| {
                steps += 1;
                let find = |name: &str| frame.estimators.iter().find(|e| e.name == name).unwrap();
                for name in some {
                    let [a, b] = [name.clone(), format!("{name}-ecu")].map(|n| find(&n).estimate);
                    let bits =
                        |e: &Estimate| numbers(e).iter().map(|x| x.to_bits()).collect::<Vec<_>>();
                    assert!(bits(&a) == bits(&b), "{name}, step {steps}:\n{a:?}\n{b:?}");
                }
            },
        );
        let refused = outcome.unwrap().refusals;
        for name in some {
            let times = |name: &str| refused.iter().find(|r| r.0 == name).map(|r| r.1);
            assert_eq!(times(name), times(&format!("{name}-ecu")), "{name}");
        }
        assert!(steps > 2000, "{steps}");
    }
}

/// The words that run an image for a Cortex-M4F of the folder `MONORIG_FIRMWARE`; none without the variable, which
/// `.ci/run` sets. Images have floating-point signals and are reached by semihosting, `uart.elf` by the UART.
fn qemu(image: &str) -> Option<Vec<String>> {
    let Some(folder) = std::env::var_os("MONORIG_FIRMWARE") else {
        eprintln!("skipped: MONORIG_FIRMWARE names no folder with images");
        return None;
    };
    let by = match image {
        "uart" => "-serial stdio",
        _ => "-serial none -semihosting-config enable=on,target=native",
    };
    let image = PathBuf::from(folder).join(format!("{image}.elf"));
    let all = format!("qemu-system-arm -M mps2-an386 -display none -monitor none {by} -kernel");
    let words = all.split(' ').map(str::to_owned);
    Some(words.chain([image.display().to_string()]).collect())
}

/// An image under QEMU gives the estimates of the host in every step: two whole scenarios, and the first steps of one
/// by the UART.
#[test]
fn firmware_gives_the_estimates_of_the_host() {
    for (image, scene, after_s) in [
        ("liu2023_section1", "liu2023_section1", 60),
        ("minimal", "minimal", 60),
        ("uart", "liu2023_section1", 1),
    ] {
        let Some(words) = qemu(image) else { return };
        let words: Vec<String> = words.iter().map(|w| format!("\"{w}\"")).collect();
        let firmware = format!(
            "{{external: {{process: [{}], signals: float}}}}",
            words.join(", ")
        );
        let both = format!("{{rail_fusion: {{}}, firmware: {firmware}}}");
        let scenario = scenario(&format!("{scene}.yaml"), &both, &after_s.to_string());
        let begun = Instant::now();
        let mut steps = 0;
        let outcome = watch(scenario, &registry(), &mut |frame| {
            steps += 1;
            let find = |name: &str| {
                frame
                    .estimators
                    .iter()
                    .find(|e| e.name == name)
                    .unwrap()
                    .estimate
            };
            let (a, b) = (find("rail_fusion"), find("firmware"));
            let bits = |e: &Estimate| numbers(e).iter().map(|x| x.to_bits()).collect::<Vec<_>>();
            assert!(bits(&a) == bits(&b), "{image}, step {steps}:\n{a:?}\n{b:?}");
        });
        let refused = outcome.unwrap().refusals;
        let times = |name: &str| refused.iter().find(|r| r.0 == name).map(|r| r.1);
        assert_eq!(times("rail_fusion"), times("firmware"));
        assert!(steps >= 190 * after_s, "{steps}");
        eprintln!(
            "{image}: {steps} steps in {:.1} s",
            begun.elapsed().as_secs_f64()
        );
    }
}

/// The image is reset twice: right after a snapshot it goes on as if nothing had been; between two snapshots it goes on
/// from the last one, and soon tells what the host tells. Without one its mass would be that of the start.
#[test]
fn firmware_goes_on_after_a_brown_out() {
    let Some(words) = qemu("minimal") else { return };
    let mut qemu = std::process::Command::new(&words[0])
        .args(&words[1..])
        .stdin(std::process::Stdio::piped())
        .stdout(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let mut to = qemu.stdin.take().unwrap();
    let mut from = std::io::BufReader::new(qemu.stdout.take().unwrap());
    let mut answers = Answers::new(Numbers::Float);
    let (mut sequence, mut last_ns, mut line) = (0, 0, Vec::new());
    let mut kg = [[0.0; 2]; 3];
    let ran = watch(
        scenario("minimal.yaml", "{rail_fusion: {}}", "30"),
        &registry(),
        &mut |frame| {
            let step = Step {
                z: *frame.measurements,
                u: *frame.command,
                dt_s: frame.time_ns as f64 * 1e-9 - last_ns as f64 * 1e-9,
                start: sequence == 0,
                sequence,
            };
            last_ns = frame.time_ns;
            let mut text = Vec::new();
            // snapshots are taken after every 20 steps
            if [2000, 4010].contains(&sequence) {
                candump::write(&Frame::new(0x7FF), 0, &mut text);
                to.write_all(&text).unwrap();
                text.clear();
                // what comes before it has started again is lost
                std::thread::sleep(Duration::from_secs(1));
            }
            step.frames(Numbers::Float, 8, &mut |f| candump::write(f, 0, &mut text));
            to.write_all(&text).unwrap();
            let answer = loop {
                line.clear();
                assert!(
                    from.read_until(b'\n', &mut line).unwrap() > 0,
                    "step {sequence}"
                );
                let came = candump::read(&line).unwrap().frame.unwrap();
                if let Came::Answer(answer) = answers.take(&came, step.z.t) {
                    break answer;
                }
            };
            assert_eq!(answer.sequence, sequence);
            let (host, board) = (frame.estimators[0].estimate, answer.estimate);
            if sequence < 4010 {
                let bits =
                    |e: &Estimate| numbers(e).iter().map(|x| x.to_bits()).collect::<Vec<_>>();
                assert!(
                    answer.refused || bits(&host) == bits(&board),
                    "step {sequence}: {host:?} {board:?}"
                );
            }
            for (k, at) in [4009, 4010, 5900].into_iter().enumerate() {
                if sequence == at {
                    kg[k] = [host, board].map(|e| e.total_mass_kg.value);
                }
            }
            sequence += 1;
        },
    );
    ran.unwrap();
    qemu.kill().unwrap();
    qemu.wait().unwrap();
    assert!(sequence > 5900, "{sequence}");
    assert_eq!(kg[0][0], kg[0][1]);
    for [host, board] in kg {
        assert!((host - board).abs() < 0.01 * host, "{kg:?}");
    }
}

/// An estimator that is given rounded samples.
struct Rounded(BoxedEstimator);

/// A number as a fixed-point signal of this step has it.
fn rounded(x: f64, step: f64) -> f64 {
    (x / step).round() * step
}

impl Estimator for Rounded {
    fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Estimate, Error> {
        let stamp = |t: Time| Time::from_ns((t.ns() as f64 / 1e3).round() as i64 * 1000);
        let mut seen = Measurements::at(stamp(z.t));
        for slot in Slot::all() {
            let step = match slot.name() {
                "angular_rate" | "inclination" | "steering_angle" => 1e-6,
                "motor_torque" | "auxiliary" => 1e-3,
                _ => 1e-5,
            };
            let sample = slot.get(z);
            slot.set(
                &mut seen,
                sample.map(|s| Sample {
                    t: stamp(s.t),
                    value: s.value.map(|x| rounded(x, step)),
                }),
            );
        }
        let u = Command {
            motor_torque_nm: u.motor_torque_nm.map(|x| rounded(x, 1e-3)),
            clamp_pressure_mpa: rounded(u.clamp_pressure_mpa, 1e-5),
            brake: rounded(u.brake, 1e-6),
        };
        self.0.step(&seen, &u, rounded(dt, 1e-6))
    }

    fn reset(&mut self) {
        self.0.reset();
    }
}

/// With fixed-point signals an estimator answers what it would have told of samples that are rounded to the steps of
/// the DBC, within half a step of its own signals.
#[test]
fn fixed_point_signals_round_to_the_steps_of_the_dbc() {
    let mut registry = registry();
    for name in ["rail_fusion", "dffrls_aekf"] {
        let ours = registry.find_estimator(name).unwrap().clone();
        let build = move |vehicle: &Vehicle, settings: NamedSettings<'_>| {
            Ok(Box::new(Rounded(ours.build(vehicle, settings)?)) as BoxedEstimator)
        };
        registry
            .add(EstimatorType::new(&format!("{name}-rounded"), &[], build))
            .unwrap();
        let scene = "minimal.yaml";
        let both = format!(
            "{{{name}-rounded: {{}}, ecu: {}}}",
            ecu(name, scene, "fixed")
        );
        let mut steps = 0;
        let ran = watch(scenario(scene, &both, "20"), &registry, &mut |frame| {
            steps += 1;
            let find = |n: &str| {
                frame
                    .estimators
                    .iter()
                    .find(|e| e.name == n)
                    .unwrap()
                    .estimate
            };
            let (a, b) = (find(&format!("{name}-rounded")), find("ecu"));
            for (a, b, half) in [
                (a.total_mass_kg, b.total_mass_kg, 0.05),
                (a.grade_rad, b.grade_rad, 0.5e-6),
                (a.effective_grade_rad, b.effective_grade_rad, 0.5e-6),
                (a.speed_mps, b.speed_mps, 0.5e-5),
            ] {
                let near = |x: f64, y: f64| (x - y).abs() <= half * (1.0 + 1e-6) + 1e-12;
                assert!(
                    near(a.value, b.value) && near(a.sd, b.sd),
                    "step {steps}: {a:?} {b:?}"
                );
                assert_eq!(a.valid, b.valid);
            }
        });
        ran.unwrap();
        assert!(steps > 3000, "{steps}");
    }
}

/// Changes the frames of an answer before a controller on UDP sends them.
type Tamper = dyn FnMut(u64, &mut Vec<Frame>) + Send;

/// A controller on UDP with one of our estimators, in a thread that ends with it. It starts again, with a socket and
/// an estimator of their own, before the step `restarts`.
struct Controller {
    address: String,
    over: Arc<AtomicBool>,
}

impl Drop for Controller {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
    }
}

impl Controller {
    fn start(restarts: u64, mut tamper: Box<Tamper>) -> Self {
        let make = move || {
            let scenario = scenario("minimal.yaml", "{dffrls_aekf: {}}", "1");
            let vehicle = Simulation::build(scenario, &Registry::default(), 1)
                .unwrap()
                .vehicle;
            let built = Registry::default()
                .find_estimator("dffrls_aekf")
                .unwrap()
                .build(&vehicle, &[]);
            built.unwrap()
        };
        let mut socket = Some(UdpSocket::bind("127.0.0.1:0").unwrap());
        let address = socket.as_ref().unwrap().local_addr().unwrap();
        let over = Arc::new(AtomicBool::new(false));
        let ends = over.clone();
        std::thread::spawn(move || {
            let (mut ecu, mut estimator) = (Ecu::new(Numbers::Fixed), make());
            let (mut steps, mut bytes) = (0, [0; 65_536]);
            while !ends.load(Ordering::Relaxed) {
                let at = socket.get_or_insert_with(|| UdpSocket::bind(address).unwrap());
                at.set_read_timeout(Some(Duration::from_millis(100)))
                    .unwrap();
                let Ok((count, asker)) = at.recv_from(&mut bytes) else {
                    continue;
                };
                if steps == restarts {
                    steps += 1;
                    socket = None;
                    (ecu, estimator) = (Ecu::new(Numbers::Fixed), make());
                    std::thread::sleep(Duration::from_millis(300));
                    continue;
                }
                let mut frames = Vec::new();
                assert!(cannelloni::read(&bytes[..count], &mut |frame| {
                    ecu.take(estimator.as_mut(), frame, &mut |f| frames.push(*f));
                }));
                if frames.is_empty() {
                    continue;
                }
                tamper(steps, &mut frames);
                steps += 1;
                let mut datagram = cannelloni::begin(0).to_vec();
                frames
                    .iter()
                    .for_each(|f| cannelloni::write(f, &mut datagram));
                cannelloni::count(&mut datagram, frames.len() as u16);
                at.send_to(&datagram, asker).unwrap();
            }
        });
        let address = address.to_string();
        Self { address, over }
    }

    /// A run of two seconds with it.
    fn run(&self, see: &mut dyn FnMut(&StepFrame<'_>)) -> Result<Outcome, monorig_sim::Error> {
        let ecu = format!("{{ecu: {{external: {{udp: \"{}\"}}}}}}", self.address);
        watch(scenario("minimal.yaml", &ecu, "2"), &registry(), see)
    }

    /// The words of a run that breaks.
    fn breaks(tamper: Box<Tamper>) -> String {
        let controller = Self::start(u64::MAX, tamper);
        controller.run(&mut |_| {}).unwrap_err().to_string()
    }
}

/// The number of the step in a frame of an answer, changed.
fn renumbered(frame: &Frame, by: u16) -> Frame {
    let message = Message::of(frame.id).unwrap();
    let mut values: [Value; 7] = message.decode(Numbers::Fixed, frame).unwrap();
    for value in &mut values {
        if let Value::Sequence(sequence) = value {
            *sequence = (*sequence + by) % monorig_wire::SEQUENCES;
        }
    }
    message.encode(Numbers::Fixed, &values).0
}

/// Over UDP, with the same numbers as in the loop; and again, with the same controller.
#[test]
fn a_controller_on_udp_makes_run_after_run() {
    let controller = Controller::start(u64::MAX, Box::new(|_, _| {}));
    let mut runs = Vec::new();
    for _ in 0..2 {
        let mut all = Vec::new();
        let outcome = controller.run(&mut |f| all.extend(numbers(&f.estimators[0].estimate)));
        assert!(outcome.unwrap().refusals.is_empty());
        assert!(all.len() > 5000);
        runs.push(all.iter().map(|x| x.to_bits()).collect::<Vec<_>>());
    }
    assert!(runs[0] == runs[1], "a run begins anew, whatever was before");
}

/// Each mistake of a controller ends the run with words of its own.
#[test]
fn mistakes_of_a_controller_have_messages() {
    let at = |step: u64, change: fn(&mut Vec<Frame>)| -> Box<Tamper> {
        Box::new(move |k, frames| {
            if k == step {
                change(frames);
            }
        })
    };
    let wrong = Controller::breaks(at(9, |all| {
        all.iter_mut().for_each(|f| *f = renumbered(f, 77));
    }));
    assert!(
        wrong.contains("answers step 86, and was given step 9"),
        "{wrong}"
    );
    let twice = Controller::breaks(at(9, |all| {
        let before: Vec<Frame> = all
            .iter()
            .map(|f| renumbered(f, monorig_wire::SEQUENCES - 1))
            .collect();
        all.splice(0..0, before);
    }));
    assert!(
        twice.contains("answers step 8 twice: are there two of them"),
        "{twice}"
    );
    let half = Controller::breaks(at(9, |all| {
        all.remove(1);
    }));
    assert!(
        half.contains("answers step 9 without mass and grade"),
        "{half}"
    );
    let silent = Controller::breaks(Box::new(|k, all| {
        if k >= 9 {
            all.clear();
        }
    }));
    assert!(silent.contains("gives no answer within 2 s to"), "{silent}");
    for words in [wrong, twice, half, silent] {
        assert!(
            words.contains("the estimator ecu broke down at t = 0.0")
                && words.contains("127.0.0.1:"),
            "{words}"
        );
    }
}

/// A value that is no number refuses its step, as one of a library does.
#[test]
fn what_is_no_number_is_refused() {
    let nan = |k: u64, all: &mut Vec<Frame>| {
        if k % 10 == 9 {
            let mut values: [Value; 4] = Message::Grade.decode(Numbers::Fixed, &all[1]).unwrap();
            values[0] = Value::Number(f64::NAN);
            all[1] = Message::Grade.encode(Numbers::Fixed, &values).0;
        }
    };
    let controller = Controller::start(u64::MAX, Box::new(nan));
    let mut steps = 0;
    let outcome = controller.run(&mut |_| steps += 1).unwrap();
    let [(_, times, reason)] = &outcome.refusals[..] else {
        panic!("{:?}", outcome.refusals)
    };
    assert_eq!(*times, steps / 10);
    assert!(reason.contains("grade_rad is NaN"), "{reason}");
}

/// A controller that starts again in the middle is sent its step again, and goes on; that is counted.
#[test]
fn a_controller_that_starts_again_goes_on() {
    let controller = Controller::start(200, Box::new(|_, _| {}));
    let mut again = 0.0;
    let outcome = controller.run(&mut |frame| {
        [again] = frame.estimators[0]
            .internals_named(["sent_again"])
            .map(Option::unwrap);
    });
    assert!(outcome.unwrap().refusals.is_empty());
    assert!(again >= 1.0, "{again}");
}

/// Nobody at the other end, two runs at one address, a program that hangs, ends, or sends something else.
#[test]
fn what_goes_wrong_at_the_other_end_is_told() {
    let free = UdpSocket::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let broken = |ecu: &str| {
        let estimators = format!("{{ecu: {{external: {ecu}}}}}");
        let begun = Instant::now();
        let ran = watch(
            scenario("minimal.yaml", &estimators, "2"),
            &registry(),
            &mut |_| {},
        );
        assert!(begun.elapsed() < Duration::from_secs(8), "{ecu}");
        ran.err()
            .unwrap_or_else(|| panic!("{ecu} works"))
            .to_string()
    };
    for (ecu, told) in [
        (
            &*format!("{{udp: \"{free}\"}}"),
            "gives no answer within 2 s to",
        ),
        (
            "{process: [sleep, \"60\"]}",
            "sleep gives no answer within 2 s to",
        ),
        (
            "{process: [sh, -c, exit 3]}",
            "sh ended its process: exit status: 3",
        ),
        ("{process: [sh, -c, kill -9 $$]}", "sh crashed: signal 9"),
        (
            "{process: [sh, -c, echo hello; sleep 9]}",
            "sh sends `hello`, no frame of candump",
        ),
        (
            "{process: [sh, -c, yes | tr -d '\\n']}",
            "sh sends a line of more than",
        ),
        // what it is sent is none of an answer
        ("{process: [cat]}", "cat gives no answer within 2 s to"),
    ] {
        let words = broken(ecu);
        assert!(words.contains(told), "{words}");
    }
    let both =
        format!("{{a: {{external: {{udp: \"{free}\"}}}}, b: {{external: {{udp: \"{free}\"}}}}}}");
    let two = watch(
        scenario("minimal.yaml", &both, "1"),
        &registry(),
        &mut |_| {},
    );
    let two = two.err().unwrap().to_string();
    assert!(two.contains("can make one run at a time"), "{two}");
}

/// In real time answers that are lost or held up on purpose are found: those lost exactly, and at least as many late,
/// since a busy machine may hold up others.
#[test]
fn answers_that_come_late_or_not_at_all_are_counted() {
    let clock = Arc::new(WallClock::new(0.1));
    let registry = registry().on_clock(Some(clock.clone()));
    let faults = "deadline_ms: 40, faults: {lose_every: 30, delay_every: 70, delay_ms: 150}";
    let ecu =
        ecu("attitude", "minimal.yaml", "fixed").replace("signals: fixed}", &format!("{faults}}}"));
    let mut internals = [0.0; 5];
    let mut steps = 0;
    let ran = watch(
        scenario("minimal.yaml", &format!("{{ecu: {ecu}}}"), "0.8"),
        &registry,
        &mut |frame| {
            let due = clock.due(frame.time_ns as f64 * 1e-9);
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
            steps += 1;
            let names = [
                "answers_asked",
                "answers_late",
                "answers_lost",
                "rig_late",
                "sent_again",
            ];
            internals = frame.estimators[0]
                .internals_named(names)
                .map(Option::unwrap);
        },
    );
    let outcome = ran.unwrap();
    let [asked, late, lost, ..] = internals;
    assert_eq!(
        asked,
        f64::from(steps - 1),
        "the first one is the beginning"
    );
    let planted = |every: i32| f64::from((steps - 1) / every);
    assert_eq!(lost, planted(30));
    assert!(late >= planted(70), "{late}");
    let [(_, refused, reason)] = &outcome.refusals[..] else {
        panic!("{:?}", outcome.refusals)
    };
    assert_eq!(*refused as f64, late + lost);
    assert_eq!(reason, "its answer did not come in time");
}

/// A run at a pace has the metrics of its answers; if this machine was too busy for the pace, it says so and is no
/// verdict.
#[test]
fn a_run_in_real_time_is_a_verdict_or_says_why_not() {
    let dir = TestFolder::new();
    let at = file("minimal.yaml");
    let ecu = format!(
        "estimators={{ecu: {}}}",
        ecu("attitude", "minimal.yaml", "fixed")
    );
    let task = [
        "run",
        at.to_str().unwrap(),
        "--no-rerun",
        "--pace",
        "8",
        "--set",
        &ecu,
        "--set",
        "stop.after_s=8",
        "--set",
        "integrity={max_misleading_share: 1}",
        "--name",
        "paced",
    ];
    let (code, out, err) = dir.monorig(&task);
    let metrics: serde_json::Value =
        serde_json::from_str(&dir.read("runs/minimal@paced/1/metrics.json")).unwrap();
    let metric = |name: &str| metrics["estimators"]["ecu"][name].as_f64().unwrap();
    let latency = metric("answer_latency_ms_p99");
    assert!(latency > 0.0 && latency < 2000.0, "{latency}");
    assert!(metric("answers_late_share") + metric("answers_lost_share") <= 1.0);
    let told = words(&err).contains("missed its own deadlines: the run is no verdict on ecu");
    match metric("rig_late_share") > 0.0 {
        true => assert!(code == Some(2) && told, "{out}{err}"),
        false => assert!(code == Some(0) && !told, "{out}{err}"),
    }
}

/// Steps a second in lockstep: `cargo test --release --test external -- --ignored --nocapture steps_a_second`.
#[test]
#[ignore = "a measurement"]
fn steps_a_second() {
    let registry = registry();
    let port = {
        let free = UdpSocket::bind("127.0.0.1:0").unwrap();
        free.local_addr().unwrap().port()
    };
    let at = file("minimal.yaml");
    let mut listening = std::process::Command::new(OURS)
        .args([
            "ecu",
            "rail_fusion",
            "--udp",
            &format!("127.0.0.1:{port}"),
            "--scenario",
        ])
        .arg(&at)
        .spawn()
        .unwrap();
    let mut steps = Vec::new();
    let mut last_ns = 0;
    let mut vehicle = None;
    let run = scenario("minimal.yaml", "{attitude: {}}", "60");
    vehicle.replace(
        Simulation::build(run.clone(), &registry, 3)
            .unwrap()
            .vehicle,
    );
    let ran = watch(run, &registry, &mut |frame| {
        steps.push((
            *frame.measurements,
            *frame.command,
            (frame.time_ns - last_ns) as f64 * 1e-9,
        ));
        last_ns = frame.time_ns;
    });
    ran.unwrap();
    for (what, settings) in [
        ("in the loop", "{is: rail_fusion}".to_owned()),
        ("by a pipe", ecu("rail_fusion", "minimal.yaml", "fixed")),
        (
            "by a pipe, float",
            ecu("rail_fusion", "minimal.yaml", "float"),
        ),
        (
            "by UDP",
            format!("{{external: {{udp: \"127.0.0.1:{port}\"}}}}"),
        ),
    ] {
        let settings = serde_yaml::from_str(&settings).unwrap();
        let of_type = registry.estimator_of("ecu", &settings).unwrap();
        let mut estimator = of_type.build(&vehicle.unwrap(), &[]).unwrap();
        let mut best = f64::INFINITY;
        for _ in 0..10 {
            estimator.reset();
            let begun = Instant::now();
            for (z, u, dt) in &steps {
                estimator.step(z, u, *dt).unwrap();
            }
            best = best.min(begun.elapsed().as_secs_f64());
        }
        println!("{what}: {:.0} steps/s", steps.len() as f64 / best);
    }
    listening.kill().unwrap();
    listening.wait().unwrap();
}

/// Mistakes in a scenario have its line; a run says that its estimator is an external one.
#[test]
fn an_external_estimator_in_a_scenario() {
    let dir = TestFolder::new();
    let written = |external: &str| {
        let project = common::project().canonicalize().unwrap();
        let assets = project.join("assets");
        let assets = assets.display();
        format!(
            "version: 1\nwhy: A controller.\ntrack: {assets}/tracks/liu2023_section1.yaml\ntrain: {assets}/trains/dx80_176y.yaml\n\
             load: {{mass_kg: 10000}}\nsensors: {assets}/sensors/liu2023.yaml\ndrive: {{speed: [{{at_s: 0, mps: 0}}, {{at_s: 2, mps: 0.5}}]}}\n\
             estimators:\n  ecu: {{external: {external}}}\nstop: {{after_s: 2}}\nintegrity: {{max_misleading_share: 1}}\n"
        )
    };
    for (external, told) in [
        ("{}", "one of `process` and `udp`"),
        ("{udp: localhost}", "`localhost` is no address with a port"),
        ("{process: []}", "begins with a program"),
        (
            "{process: [no-such-program]}",
            "there is no program `no-such-program`",
        ),
        ("{process: [./mine]}", "there is no program `./mine`"),
        ("{process: [sh], baud: 9600}", "baud"),
        (
            "{process: [sh], deadline_ms: 0}",
            "`deadline_ms` is above 0 and at most 1000",
        ),
        (
            "{process: [sh], faults: {delay_every: 3}}",
            "`delay_every` and `delay_ms` belong together",
        ),
        (
            "{process: [sh]}, is: rail_fusion",
            "`external` alone says where it is",
        ),
        ("{process: [sh]}, gain: 2", "no parameter `gain`"),
    ] {
        dir.write("bad.yaml", written(external).as_bytes());
        let refused = words(&dir.refused(&["check", "bad.yaml"]));
        assert!(
            refused.contains("bad.yaml:9:") && refused.contains(told),
            "{external}: {refused}"
        );
    }
    let program = format!("[{OURS}, ecu, attitude, --scenario, good.yaml]");
    dir.write(
        "good.yaml",
        written(&format!("{{process: {program}}}")).as_bytes(),
    );
    let (code, out, err) = dir.monorig(&["run", "good.yaml", "--no-rerun"]);
    assert_eq!(code, Some(0), "{out}{err}");
    assert!(words(&err).contains("ecu is external, process"), "{err}");
    let manifest: serde_json::Value =
        serde_json::from_str(&dir.read("runs/good/1/manifest.json")).unwrap();
    let told = manifest.pointer("/resolved/estimators/ecu/external/process/1");
    assert_eq!(
        told.and_then(|word| word.as_str()),
        Some("ecu"),
        "{manifest}"
    );
}
