//! Images for a Cortex-M4F under QEMU, where the variable MONORIG_FIRMWARE names a folder with them.

#[path = "../../../../examples/firmware/src/single.rs"]
mod single;

use super::{bits, estimate_of, refused, registry, scenario, watch};
use monorig_estimators::Vehicle;
use monorig_sim::closed_loop::registry::{BoxedEstimator, EstimatorType, NamedSettings, Registry};
use monorig_wire::answer::{Answers, Came};
use monorig_wire::candump;
use monorig_wire::frame::Frame;
use monorig_wire::signal::Numbers;
use monorig_wire::step::Step;
use std::io::{BufRead, Write};
use std::path::PathBuf;
use std::time::{Duration, Instant};

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

/// The words that make an estimator of an image.
fn external(image: &str) -> Option<String> {
    let words: Vec<String> = qemu(image)?.iter().map(|w| format!("\"{w}\"")).collect();
    let words = words.join(", ");
    Some(format!(
        "{{external: {{process: [{words}], signals: float}}}}"
    ))
}

/// Ours, and those in single precision: `NAME_f32`.
fn with_single_precision() -> Registry {
    let mut registry = registry();
    let build = |vehicle: &Vehicle, _: NamedSettings<'_>| {
        let vehicle = single::vehicle(vehicle).unwrap();
        let built = monorig_estimators_f32::registry::build("rail_fusion", &vehicle, []);
        Ok(Box::new(single::Single(built.unwrap())) as BoxedEstimator)
    };
    registry
        .add(EstimatorType::new("rail_fusion_f32", &[], build))
        .unwrap();
    registry
}

/// An image under QEMU gives the estimates of the host in every step, in either precision: two whole scenarios, and the
/// first steps of one by the UART.
#[test]
fn firmware_gives_the_estimates_of_the_host() {
    let registry = with_single_precision();
    for (image, host, scene, after_s) in [
        (
            "liu2023_section1_f32",
            "rail_fusion_f32",
            "liu2023_section1",
            60,
        ),
        ("minimal_f32", "rail_fusion_f32", "minimal", 60),
        ("liu2023_section1", "rail_fusion", "liu2023_section1", 60),
        ("minimal", "rail_fusion", "minimal", 60),
        ("uart", "rail_fusion", "liu2023_section1", 1),
    ] {
        let Some(firmware) = external(image) else {
            return;
        };
        let both = format!("{{{host}: {{}}, firmware: {firmware}}}");
        let scenario = scenario(&format!("{scene}.yaml"), &both, &after_s.to_string());
        let begun = Instant::now();
        let mut steps = 0;
        let outcome = watch(scenario, &registry, &mut |frame| {
            steps += 1;
            let [a, b] = [host, "firmware"].map(|name| estimate_of(frame, name));
            assert!(bits(&a) == bits(&b), "{image}, step {steps}:\n{a:?}\n{b:?}");
        });
        let outcome = outcome.unwrap();
        assert_eq!(refused(&outcome, host), refused(&outcome, "firmware"));
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
