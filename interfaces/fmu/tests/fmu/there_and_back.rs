//! Every estimator exported as an FMU and imported again is the native one, to the last bit.

use crate::common::{bits, exported, imported, names, project, scenario, steps};
use monorig_estimators::{Command, Estimator, Measurements, registry};
use monorig_fmu::Fmi;
use monorig_plugin::loads_libraries;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::config::scenario::Settings;

/// Estimates, reasons and refusals of these, through one standard.
fn same_as_native(fmi: Fmi, names: &[&str]) {
    const SCENARIO: &str = "minimal.yaml";
    let (vehicle, steps) = steps(SCENARIO, 8.0);
    assert!(steps.len() > 1000);
    let folder = tempfile::tempdir().unwrap();
    let mut valid = 0;
    for name in names.iter().copied() {
        let file = exported(
            &Settings::of_type(name),
            &scenario(SCENARIO),
            fmi,
            folder.path(),
        );
        let mut foreign = imported(&file).build(&vehicle, &[]).unwrap();
        std::fs::remove_file(file).unwrap();
        let mut native = registry::build(name, &vehicle, []).unwrap();
        for (i, (z, u, dt)) in steps.iter().enumerate() {
            match (native.step(z, u, *dt), foreign.step(z, u, *dt)) {
                (Ok(x), Ok(y)) => {
                    assert_eq!(bits(&x), bits(&y), "{name}, step {i}");
                    valid += u32::from(x.grade_rad.valid);
                }
                (x, y) => assert_eq!(
                    x.unwrap_err().to_string().get(..90),
                    y.unwrap_err().to_string().get(..90),
                    "{name}, step {i}"
                ),
            }
        }
    }
    let least = 200 * names.len();
    assert!(valid > least as u32, "{valid} valid estimates are compared");
}

/// Some of both kinds, with supervision and without, for what FMI 2 has of its own; the rest is tested through FMI 3.
#[test]
fn estimators_through_fmi_2_are_the_native_ones() {
    let some = ["rail_fusion", "attitude", "dffrls_aekf_robust", "rls_ekf"];
    same_as_native(Fmi::Two, &some);
}

#[test]
#[ignore = "a soak, which .ci/run makes"]
fn soak_every_estimator_through_fmi_2_is_the_native_one() {
    same_as_native(Fmi::Two, &names().collect::<Vec<_>>());
}

#[test]
fn every_estimator_through_fmi_3_is_the_native_one() {
    same_as_native(Fmi::Three, &names().collect::<Vec<_>>());
}

/// A step that is refused is refused through the FMU with the same reason, and the next is as if it had not been.
#[test]
fn a_refused_step_leaves_the_state() {
    let (vehicle, steps) = steps("minimal.yaml", 4.0);
    let folder = tempfile::tempdir().unwrap();
    for fmi in [Fmi::Two, Fmi::Three] {
        let settings = Settings::of_type("dffrls_aekf_robust");
        let file = exported(&settings, &scenario("minimal.yaml"), fmi, folder.path());
        let mut foreign = imported(&file).build(&vehicle, &[]).unwrap();
        let mut native = registry::build("dffrls_aekf_robust", &vehicle, []).unwrap();
        let mut refusals = 0;
        for (i, (z, u, dt)) in steps.iter().enumerate() {
            let dt = if i % 100 == 99 { 1e4 } else { *dt };
            match (native.step(z, u, dt), foreign.step(z, u, dt)) {
                (Ok(x), Ok(y)) => assert_eq!(bits(&x), bits(&y), "step {i}"),
                (x, y) => {
                    let (x, y) = (x.unwrap_err().to_string(), y.unwrap_err().to_string());
                    assert_eq!(x.get(..90), y.get(..90), "step {i}");
                    refusals += 1;
                }
            }
        }
        assert!(refusals > 3, "{refusals}");
    }
}

/// A snapshot through the FMU goes on as the run did, also in another instance; a torn one is refused.
#[test]
fn a_state_is_saved_and_put_back() {
    let (vehicle, steps) = steps("minimal.yaml", 4.0);
    let (first, second) = steps.split_at(steps.len() / 2);
    let folder = tempfile::tempdir().unwrap();
    for fmi in [Fmi::Two, Fmi::Three] {
        let settings = Settings::of_type("rail_fusion");
        let file = exported(&settings, &scenario("minimal.yaml"), fmi, folder.path());
        let of_type = imported(&file);
        let mut one = of_type.build(&vehicle, &[]).unwrap();
        for (z, u, dt) in first {
            one.step(z, u, *dt).unwrap();
        }
        let mut state = vec![0; 1 << 16];
        let used = one.snapshot(&mut state).unwrap();
        let mut other = of_type.build(&vehicle, &[]).unwrap();
        assert!(other.restore(&state[..used - 3]).is_err());
        other.restore(&state[..used]).unwrap();
        for (i, (z, u, dt)) in second.iter().enumerate() {
            let (a, b) = (one.step(z, u, *dt).unwrap(), other.step(z, u, *dt).unwrap());
            assert_eq!(bits(&a), bits(&b), "step {i}");
        }
        other.reset();
        let mut native = registry::build("rail_fusion", &vehicle, []).unwrap();
        for (z, u, dt) in first {
            let (a, b) = (
                native.step(z, u, *dt).unwrap(),
                other.step(z, u, *dt).unwrap(),
            );
            assert_eq!(bits(&a), bits(&b), "after a reset");
        }
    }
}

/// Parameters are those of ours; a value set at the export, and one set at the import, have the effect of a native one.
#[test]
fn parameters_go_through_the_fmu() {
    let (vehicle, steps) = steps("minimal.yaml", 8.0);
    let folder = tempfile::tempdir().unwrap();
    const NAME: &str = "dffrls_aekf_robust";
    for fmi in [Fmi::Two, Fmi::Three] {
        let settings = Settings::of_type(NAME).set("delta", 0.95);
        let file = exported(&settings, &scenario("minimal.yaml"), fmi, folder.path());
        let of_type = imported(&file);
        let theirs: Vec<_> = of_type
            .keys()
            .map(|k| (k.name, k.number().map(|n| n.1)))
            .collect();
        let ours: Vec<_> = registry::keys(NAME)
            .unwrap()
            .map(|k| (k.name, k.number().map(|n| n.1)))
            .collect();
        for (theirs, ours) in theirs.iter().zip(&ours) {
            let none = |unit: Option<&str>| unit.filter(|u| *u != "-").map(str::to_owned);
            assert_eq!((theirs.0, none(theirs.1)), (ours.0, none(ours.1)));
        }
        assert_eq!(theirs.len(), ours.len());
        assert!(of_type.check("delta", 7.0.into()).is_err());
        let last = |estimator: &mut dyn Estimator| {
            let all = steps
                .iter()
                .filter_map(|(z, u, dt)| estimator.step(z, u, *dt).ok());
            bits(&all.last().unwrap())
        };
        let mut native = registry::build(NAME, &vehicle, [("delta", 0.95.into())]).unwrap();
        let mut foreign = of_type.build(&vehicle, &[]).unwrap();
        assert_eq!(last(&mut native), last(&mut *foreign));
        let mut native = registry::build(NAME, &vehicle, [("delta", 0.9.into())]).unwrap();
        let mut foreign = of_type.build(&vehicle, &[("delta", 0.9.into())]).unwrap();
        assert_eq!(last(&mut native), last(&mut *foreign));
    }
}

/// A library with the header of C as an FMU is what it is as a library.
#[test]
#[cfg(unix)] // compiles with `cc`
fn a_library_of_c_becomes_an_fmu() {
    let folder = tempfile::tempdir().unwrap();
    let library = folder.path().join("two_state.so");
    let Some(mut cc) = monorig_testing::c_compiler() else {
        return;
    };
    cc.args(["-shared", "-fPIC", "-O2", "-std=c99", "-I"]);
    cc.arg(project().join("interfaces/c/include"))
        .arg("-o")
        .arg(&library);
    cc.arg(project().join("examples/own_estimator_c/two_state.c"));
    assert!(cc.arg("-lm").status().unwrap().success());
    let at = library.display().to_string();
    let settings = Settings::of_type("two_state").in_library(&at, library);
    let registry = loads_libraries(Registry::default());
    let of_library = registry.estimator_of("mine", &settings).unwrap();
    let (vehicle, steps) = steps("minimal.yaml", 4.0);
    for fmi in [Fmi::Two, Fmi::Three] {
        let file = exported(&settings, &scenario("minimal.yaml"), fmi, folder.path());
        let mut direct = of_library.build(&vehicle, &[]).unwrap();
        let mut fmu = imported(&file).build(&vehicle, &[]).unwrap();
        for (i, (z, u, dt)) in steps.iter().enumerate() {
            let (a, b) = (direct.step(z, u, *dt), fmu.step(z, u, *dt));
            assert_eq!(bits(&a.unwrap()), bits(&b.unwrap()), "step {i}");
        }
    }
}

/// Prints the cost of a step: `cargo test --release --test fmu -- --ignored --nocapture`.
#[test]
#[ignore = "a measurement: prints times and asserts nothing"]
fn cost_of_a_step() {
    let best = |estimator: &mut dyn Estimator, steps: &[(Measurements, Command, f64)]| {
        let once = |_| {
            estimator.reset();
            let began = std::time::Instant::now();
            for (z, u, dt) in steps {
                std::hint::black_box(estimator.step(z, u, *dt)).ok();
            }
            began.elapsed().as_secs_f64() * 1e9 / steps.len() as f64
        };
        (0..15).map(once).fold(f64::INFINITY, f64::min)
    };
    let folder = tempfile::tempdir().unwrap();
    for of in ["minimal.yaml", "liu2023_section1.yaml"] {
        let (vehicle, steps) = steps(of, 20.0);
        for name in ["dffrls_aekf", "complementary_filter", "rail_fusion"] {
            let mut native = registry::build(name, &vehicle, []).unwrap();
            let native = best(&mut native, &steps);
            let through = [Fmi::Two, Fmi::Three].map(|fmi| {
                let file = exported(&Settings::of_type(name), &scenario(of), fmi, folder.path());
                best(&mut *imported(&file).build(&vehicle, &[]).unwrap(), &steps)
            });
            println!(
                "{of}, {} drives, {name}: {native:.0} ns, FMI 2 and 3 {through:.0?} ns",
                vehicle.drives
            );
        }
    }
}
