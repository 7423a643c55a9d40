//! Ours through the header are ours, to the last bit: loaded as a library beside the native ones, and linked into a
//! program in C.

use crate::steps::{bits, names, project, steps};
use monorig_estimators::api::aid::AidStatus;
use monorig_estimators::api::signals::{Command, Estimate, Measurements};
use monorig_estimators::{Estimator, Vehicle, registry};
use monorig_plugin::loads_libraries;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::config::scenario::Settings;
use std::path::PathBuf;

/// A file that cargo has built with this test.
fn built(name: &str) -> PathBuf {
    let deps = std::env::current_exe().unwrap();
    let deps = deps.parent().unwrap();
    let places = [deps.join(name), deps.parent().unwrap().join(name)];
    places.into_iter().find(|p| p.exists()).unwrap()
}

/// Ours as a shared library.
fn library() -> PathBuf {
    use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
    built(&format!("{DLL_PREFIX}monorig_c{DLL_SUFFIX}"))
}

/// Estimators of libraries in this process, and in processes of their own.
fn hosts() -> Vec<(&'static str, Registry)> {
    let here = ("in this process", loads_libraries(Registry::default()));
    #[cfg(unix)]
    {
        let program = std::env::current_exe().unwrap().into_os_string();
        let words = ["header::serves", "--exact", "--ignored", "--nocapture"].map(Into::into);
        let program = std::iter::once(program).chain(words).collect();
        let guarded = monorig_plugin::guards_libraries(Registry::default(), program);
        vec![here, ("in a process of its own", guarded)]
    }
    #[cfg(not(unix))]
    vec![here]
}

#[test]
#[cfg(unix)]
#[ignore = "no test: the process that others start"]
fn serves() {
    monorig_plugin::serve();
}

#[test]
fn every_estimator_through_the_header_is_the_native_one() {
    same_through_the_header(8.0);
}

#[test]
#[ignore = "a soak, which .ci/run makes"]
fn soak_every_estimator_through_the_header_is_the_native_one() {
    same_through_the_header(30.0);
}

/// Estimates, reasons, internal quantities, aid status and snapshots, of every estimator on so much of two scenarios.
fn same_through_the_header(length_s: f64) {
    let file = library();
    for scenario in ["liu2023_section1.yaml", "minimal.yaml"] {
        let (vehicle, steps) = steps(scenario, length_s);
        assert!(steps.len() > 1000);
        let mut aids = 0;
        let hosts = hosts();
        let all = hosts
            .iter()
            .flat_map(|host| names().map(move |name| (host, name)));
        for ((host, types), name) in all {
            let at = format!("{name} {host}, {scenario}");
            let mut native = registry::build(name, &vehicle, []).unwrap();
            let settings = Settings::of_type(name).in_library("monorig_c", file.clone());
            let of_type = types.estimator_of(name, &settings).unwrap();
            let mut foreign = of_type.build(&vehicle, &[]).unwrap();
            assert_eq!(native.internals(), foreign.internals(), "{at}");
            assert_eq!(native.aid_sources(), foreign.aid_sources(), "{at}");
            let places = native.internals().len();
            let (mut a, mut b) = (vec![0.0; places], vec![0.0; places]);
            let places = native.aid_sources().len();
            aids += places;
            let (mut p, mut q) = (
                vec![AidStatus::default(); places],
                vec![AidStatus::default(); places],
            );
            for (i, (z, u, dt)) in steps.iter().enumerate() {
                match (native.step(z, u, *dt), foreign.step(z, u, *dt)) {
                    (Ok(x), Ok(y)) => assert_eq!(bits(&x), bits(&y), "{at}, step {i}"),
                    (x, y) => assert_eq!(
                        x.unwrap_err().to_string().get(..90),
                        y.unwrap_err().to_string().get(..90),
                        "{at}, step {i}"
                    ),
                }
                native.internal_values(&mut a);
                foreign.internal_values(&mut b);
                let bits = |v: &[f64]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(&a), bits(&b), "{at}, step {i}");
                native.aid_status(&mut p);
                foreign.aid_status(&mut q);
                assert_eq!(format!("{p:?}"), format!("{q:?}"), "{at}, step {i}");
            }
            let (mut a, mut b) = (vec![0; 18_432], vec![0; 18_432]);
            let (x, y) = (native.snapshot(&mut a), foreign.snapshot(&mut b));
            assert!(x == y, "{at}: {x:?}, {y:?}");
            native.reset();
            if let Ok(used) = x {
                assert!(a == b, "{at}: a snapshot");
                foreign.reset();
                foreign.restore(&b[..used]).unwrap();
                assert!(foreign.restore(&b[1..used]).is_err(), "{at}");
                let used = foreign.snapshot(&mut b).unwrap();
                assert_eq!(a[..used], b[..used], "{at}");
            }
        }
        assert!(aids > 10, "aid status is compared");
    }
}

/// Parameters through the header are those that ours have, and no text is cut.
#[test]
fn parameters_through_the_header_are_ours() {
    let file = library();
    let types = loads_libraries(Registry::default());
    for name in names() {
        let settings = Settings::of_type(name).in_library("monorig_c", file.clone());
        let of_type = types.estimator_of(name, &settings).unwrap();
        let theirs: Vec<String> = of_type.keys().map(|k| format!("{k:?}")).collect();
        let ours: Vec<String> = registry::keys(name)
            .unwrap()
            .map(|k| format!("{k:?}"))
            .collect();
        assert_eq!(ours.len(), theirs.len(), "{name}");
        for (a, b) in ours.iter().zip(&theirs) {
            // the words of a choice begin with the default there
            assert!(a == b || a.contains("Choice"), "{a}\n{b}");
        }
    }
}

/// A program in C with the static library, its instance in static memory: the same numbers as natively.
#[test]
#[cfg(unix)]
fn a_program_in_c_with_the_static_library_gets_the_native_numbers() {
    use monorig_estimators::{Sample, Time, VehicleData};
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("program");
    let Some(mut cc) = monorig_testing::c_compiler() else {
        return;
    };
    cc.args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-O2", "-I"]);
    cc.arg(project().join("interfaces/c/include"))
        .arg("-o")
        .arg(&program);
    cc.arg(project().join("interfaces/c/tests/program.c"))
        .arg(built("libmonorig_c.a"));
    assert!(
        cc.args(["-lm", "-lpthread", "-ldl"])
            .status()
            .unwrap()
            .success()
    );
    let printed = std::process::Command::new(&program).output().unwrap();
    assert!(
        printed.status.success(),
        "{}",
        String::from_utf8_lossy(&printed.stderr)
    );

    let vehicle = Vehicle::new(VehicleData {
        tare_kg: 4000.0,
        drives: 1,
        wheel_radius_m: 0.17,
        gear_ratio: 20.0,
        efficiency: 0.9,
        running_resistance: 0.02,
        mass_range_kg: [4000.0, 30000.0],
        ..VehicleData::default()
    });
    let settings = [("delta", 0.95.into())];
    let mut native = registry::build("dffrls_aekf_robust", &vehicle.unwrap(), settings).unwrap();
    let mut last = Estimate::default();
    for step in 1..=2000_i64 {
        let t = Time::from_ns(5_000_000 * step);
        let mut z = Measurements::at(t);
        let sample = |value| Some(Sample { t, value });
        z.wheel_speed_mps[0] = sample(0.5 + 0.00001 * step as f64);
        z.motor_torque_nm[0] = sample(20.0);
        z.specific_force_mps2 = Some(Sample {
            t,
            value: [0.002, 0.0, 9.81],
        });
        z.angular_rate_radps = Some(Sample { t, value: [0.0; 3] });
        last = native.step(&z, &Command::default(), 0.005).unwrap();
    }
    let native: Vec<String> = [last.total_mass_kg, last.grade_rad, last.speed_mps]
        .iter()
        .map(|v| {
            format!(
                "{:016x} {:016x} {}",
                v.value.to_bits(),
                v.sd.to_bits(),
                u8::from(v.valid)
            )
        })
        .collect();
    let printed = String::from_utf8(printed.stdout).unwrap();
    assert_eq!(printed.lines().collect::<Vec<_>>(), native);
}

/// Prints the cost of the header: `cargo test --release --test c header:: -- --ignored --nocapture`.
#[test]
#[ignore = "a measurement: prints times and asserts nothing"]
fn cost_of_the_header() {
    let hosts = hosts();
    let pass = |estimator: &mut dyn Estimator, steps: &[(Measurements, Command, f64)]| {
        estimator.reset();
        let began = std::time::Instant::now();
        for (z, u, dt) in steps {
            std::hint::black_box(estimator.step(z, u, *dt)).ok();
        }
        began.elapsed().as_secs_f64() * 1e9 / steps.len() as f64
    };
    for scenario in ["liu2023_section1.yaml", "minimal.yaml"] {
        let (vehicle, steps) = steps(scenario, 30.0);
        for name in ["dffrls_aekf", "complementary_filter", "rail_fusion"] {
            let settings = Settings::of_type(name).in_library("monorig_c", library());
            let native = registry::build(name, &vehicle, []).unwrap();
            let mut all: Vec<(&str, Box<dyn Estimator>, f64)> =
                vec![("native", Box::new(native), f64::INFINITY)];
            for (host, types) in &hosts {
                let of_type = types.estimator_of(name, &settings).unwrap();
                all.push((host, of_type.build(&vehicle, &[]).unwrap(), f64::INFINITY));
            }
            // in turn, so that whatever else the machine does meets all of them
            for _ in 0..30 {
                for (_, estimator, best) in &mut all {
                    *best = best.min(pass(estimator.as_mut(), &steps));
                }
            }
            println!("{scenario}, {} drives, {name}, ns a step:", vehicle.drives);
            let native = all[0].2;
            for (host, _, ns) in all {
                println!("    {host}: {ns:.0}, {:.2} times", ns / native);
            }
        }
    }
}
