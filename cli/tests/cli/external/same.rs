//! An estimator in a process gives the estimates of the same one in the loop.

use super::{bits, ecu, estimate_of, refused, registry, scenario, watch};
use monorig_estimators::api::signals::{Command, Estimate, Measurements, Sample, Slot};
use monorig_estimators::{Error, Estimator, Real, Time, Vehicle};
use monorig_sim::closed_loop::registry::{BoxedEstimator, EstimatorType, NamedSettings};

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
                for name in some {
                    let names = [name.clone(), format!("{name}-ecu")];
                    let [a, b] = names.map(|name| estimate_of(frame, &name));
                    assert!(bits(&a) == bits(&b), "{name}, step {steps}:\n{a:?}\n{b:?}");
                }
            },
        );
        let outcome = outcome.unwrap();
        for name in some {
            let [here, there] =
                [name.clone(), format!("{name}-ecu")].map(|n| refused(&outcome, &n));
            assert_eq!(here, there, "{name}");
        }
        assert!(steps > 2000, "{steps}");
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
            let (a, b) = (
                estimate_of(frame, &format!("{name}-rounded")),
                estimate_of(frame, "ecu"),
            );
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
