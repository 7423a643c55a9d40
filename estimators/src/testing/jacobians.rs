//! The Jacobians of every process, model and aid against central finite differences.
//!
//! A new one goes into [`MODELS`], [`PROCESSES`] or [`AIDS`]. One that is forgotten there is found in the sources
//! ([`everything_with_a_jacobian_is_checked`]).

use nalgebra::{SVector, vector};
use std::path::{Path, PathBuf};
use std::string::String;
use std::vec::Vec;
use std::{fs, println};

use crate::Real;
use crate::aiding::Aid;
use crate::aiding::force_balance::{BlockForce, BlockNoise};
use crate::aiding::lateral::Lateral;
use crate::aiding::standstill::Standstill;
use crate::aiding::vertical::Vertical;
use crate::aiding::wheels::Wheels;
use crate::api::mass_layout::MassLayout;
use crate::filters::model::{Model, Process};
use crate::methods::ekf_v_theta_biases::{BiasModel, Inertial};
use crate::methods::guo_2024::{self, RampModel};
use crate::methods::huainan::InclinationModel;
use crate::methods::joint_ekf::{self, JointModel};
use crate::methods::liu_2023::GradeModel;
use crate::methods::patent::ClimbModel;
use crate::models::attitude::{AttitudeInput, AttitudeModel, AttitudeNoise, Lever};
use crate::models::force_balance::{Drive, ForceBalance};
use crate::models::swing::SUBSTEPS;
use crate::models::swing_balance::{Nominal, SwingInput, SwingModel};
use crate::models::{attitude, swing_balance};
use crate::rail::train_means::TrainMeans;
use crate::supervised::force_balance_ekf::ForceBalanceModel;
use crate::testing::Random;
use crate::testing::vehicles::vehicle;

/// The name of a type, and a function that draws an input and a state for it and checks its Jacobians there.
type Case = (&'static str, fn(&mut Random));

/// Every model by the name of its type, sorted.
const MODELS: &[Case] = &[
    ("BiasModel", biases),
    ("ClimbModel", climb),
    ("ForceBalanceModel", force_balance),
    ("GradeModel", liu_grade),
    ("InclinationModel", inclination),
    ("JointModel", joint),
    ("RampModel", ramp),
];

/// Every process that is no model, because it has several measurements, each of which is an aid; sorted.
const PROCESSES: &[Case] = &[("AttitudeModel", attitude_motion), ("SwingModel", swing)];

/// Every aid, sorted.
const AIDS: &[Case] = &[
    ("BlockForce", block_force),
    ("Lateral", lateral),
    ("Standstill", standstill),
    ("Vertical", vertical),
    ("Wheels", wheels),
];

/// Drawn inputs for each.
const DRAWS: usize = 200;

fn biases(random: &mut Random) {
    let model = BiasModel {
        q: [1e-5, 1e-7, 1e-11, 1e-8],
    };
    let (force, rate) = (random.normal(), 0.1 * random.normal());
    for specific_force_mps2 in [None, Some(force)] {
        for pitch_rate_radps in [None, Some(rate)] {
            let inertial = Inertial {
                specific_force_mps2,
                pitch_rate_radps,
            };
            let grade = speed_and_grade(random);
            let biases = [0.01 * random.normal(), 0.1 * random.normal()];
            check(
                &model,
                &inertial,
                vector![grade.x, grade.y, biases[0], biases[1]],
            );
        }
    }
}

fn climb(random: &mut Random) {
    let model = ClimbModel {
        rotating_mass_kg: 65.0,
        q: [1e-4, 3e-4],
    };
    let drive = Drive {
        traction_n: 5e3 * random.normal(),
        mass_kg: 1.5e3 + 1.5e3 * random.uniform(),
        resistance: 0.03 * random.normal(),
    };
    check(&model, &drive, speed_and_grade(random));
}

fn force_balance(random: &mut Random) {
    let model = ForceBalanceModel {
        balance: ForceBalance::new(&vehicle()),
        q: [1e-4, 1e-4],
    };
    let drive = Drive {
        traction_n: 2e4 * random.normal(),
        mass_kg: 5e3 + 2e4 * random.uniform(),
        resistance: 0.03 * random.normal(),
    };
    check(&model, &drive, speed_and_grade(random));
}

fn liu_grade(random: &mut Random) {
    let model = GradeModel {
        rotating_mass_kg: 1_045.0,
        q: [1e-4, 3e-4],
    };
    let drive = Drive {
        traction_n: 2e4 * random.normal(),
        mass_kg: 5e3 + 2e4 * random.uniform(),
        resistance: 0.03 * random.normal(),
    };
    check(&model, &drive, speed_and_grade(random));
}

fn inclination(random: &mut Random) {
    let model = InclinationModel { q: [1e-4, 2e-5] };
    let u = vector![random.normal(), 0.1 * random.normal()];
    check(&model, &u, speed_and_grade(random));
}

fn joint(random: &mut Random) {
    let model = JointModel {
        balance: ForceBalance::new(&vehicle()),
        q: [1e-4, 1e-4],
    };
    let push = joint_ekf::NetForce {
        traction_n: 2e4 * random.normal(),
        resistance: 0.03 * random.normal(),
    };
    let x = speed_and_grade(random);
    check(
        &model,
        &push,
        vector![x.x, x.y, 0.4 + 2.0 * random.uniform()],
    );
}

fn ramp(random: &mut Random) {
    use guo_2024::RampAcceleration::{Dynamic, Kinematic};
    for acceleration in [Kinematic, Dynamic] {
        let model = RampModel {
            acceleration,
            rotating_mass_kg: 65.0,
            q: [1e-6, 0.3, 5e-4],
            force_sd_mps2: 0.03,
        };
        let drive = Drive {
            traction_n: 5e3 * random.normal(),
            mass_kg: 1.5e3 + 1.5e3 * random.uniform(),
            resistance: 0.03 * random.normal(),
        };
        for drive in [None, Some(drive)] {
            let x = vector![random.normal(), random.normal(), 0.3 * random.normal()];
            check(&model, &drive, x);
        }
    }
}

/// Speed and grade angle of a crane, or worse.
fn speed_and_grade(random: &mut Random) -> SVector<Real, 2> {
    vector![2.0 * random.normal(), 0.4 * random.normal()]
}

/// The model of the attitude with levers of the size of a crane's.
fn attitude_model() -> AttitudeModel {
    AttitudeModel {
        lever: Lever {
            ahead_m: 0.3,
            below_m: 0.5,
        },
        noise: AttitudeNoise {
            velocity_walk: 7e-4,
            speed_walk: 2e-3,
            angle_walk: 4e-5,
            roll_walk: 2e-4,
            accel_bias_walk: 1.5e-4,
            gyro_bias_walk: 1e-5,
            curvature_sd_per_m: 0.03,
            curvature_length_m: 5.0,
            scale_sd: 0.002,
        },
    }
}

/// Speed, angles, biases, scale and curvature, larger than they are.
fn attitude_state(random: &mut Random) -> SVector<Real, { attitude::N }> {
    let sizes = [2.0, 0.4, 0.3, 0.1, 0.1, 0.1, 0.05, 0.05, 0.05, 0.1, 0.05];
    SVector::from(sizes).map(|size: Real| size * random.normal())
}

fn vector_of(random: &mut Random, size: Real) -> [Real; 3] {
    [0; 3].map(|_| size * random.normal())
}

/// Both with and without accelerometer and gyro.
fn attitude_inputs(random: &mut Random) -> [AttitudeInput; 4] {
    let (force, rate) = (vector_of(random, 3.0), vector_of(random, 0.3));
    [(true, true), (true, false), (false, true), (false, false)].map(|(accelerometer, gyro)| {
        AttitudeInput {
            force_mps2: Some(force).filter(|_| accelerometer),
            rate_radps: Some(rate).filter(|_| gyro),
            seen_walk: [1e-3, 1e-4],
            speed_mps: 1.0,
        }
    })
}

fn attitude_motion(random: &mut Random) {
    let x = attitude_state(random);
    for u in attitude_inputs(random) {
        check_process(&attitude_model(), &u, x);
    }
}

fn wheels(random: &mut Random) {
    let (model, from) = (attitude_model(), attitude_state(random));
    for u in attitude_inputs(random) {
        let aid = Wheels {
            speed_mps: random.normal(),
            variance: 1e-5,
            below_m: model.lever.below_m,
            pitch_rate: model.rates(&from, &u).pitch_rate(),
            gained_mps: 0.1 * random.normal(),
        };
        // At the state that the pitch rate is linear about, it is exact.
        let speed = from[attitude::V] + aid.gained_mps;
        let exact = speed - aid.below_m * model.rates(&from, &u).theta_dot;
        let off = aid.h(&from) - exact * (1.0 + from[attitude::SCALE]);
        assert!(off.abs() < 1e-12, "{off}");
        // Its derivatives are those of the pitch rate there.
        for i in 0..attitude::N {
            let rate = |by: Real| {
                let mut x = from;
                x[i] += by;
                model.rates(&x, &u).theta_dot
            };
            let by_differences = (rate(1e-5) - rate(-1e-5)) / 2e-5;
            let terms = aid.pitch_rate.by_state();
            let by: Real = terms.iter().filter(|t| t.0 == i).map(|t| t.1).sum();
            assert!((by - by_differences).abs() < 1e-8, "{i}: {by}");
        }
        check_aid(&aid, attitude_state(random));
    }
}

fn lateral(random: &mut Random) {
    let aid = Lateral {
        residual_mps2: random.normal(),
        yaw_rate_radps: 0.3 * random.normal(),
        turned_mps2: random.normal(),
        variance: 1e-3,
    };
    check_aid(&aid, attitude_state(random));
}

fn vertical(random: &mut Random) {
    let aid = Vertical {
        residual_mps2: random.normal(),
        pitch_rate_radps: 0.3 * random.normal(),
        nodded_mps2: random.normal(),
        below_m: 0.5,
        variance: 1e-3,
    };
    check_aid(&aid, attitude_state(random));
}

fn standstill(random: &mut Random) {
    for aid in Standstill::by_axis(vector_of(random, 0.1), 0.01) {
        check_aid(&aid, attitude_state(random));
    }
}

/// A train with a load of up to 20 t on chains of 0.6 m that give lengthwise.
fn swing_model(swings: bool) -> SwingModel {
    let mut layout = MassLayout::even(9_000.0, [0.0, 18.0], [4.0, 14.0]);
    (layout.load.chain_m, layout.load.hook_depth_m) = (0.6, 0.4);
    layout.load.swinging_tare_kg = 800.0;
    layout.load.longitudinal_stiffness_npm = Some(3e6);
    let nominal = Nominal::new(&vehicle(), &layout, None, 0.01);
    SwingModel {
        nominal,
        swings,
        depth_m: nominal.hook_depth_m,
        swing_damping: 0.04,
        swing_walk: 0.003,
        length_walk: 0.001,
    }
}

fn swing_state(random: &mut Random) -> SVector<Real, { swing_balance::N }> {
    let sizes = [0.0, 1e3, 100.0, 1e4, 0.1, 0.3, 100.0, 0.02, 0.02, 0.1];
    let mut x = SVector::from(sizes).map(|size: Real| size * random.normal());
    x[swing_balance::MASS] = 2e4 * random.uniform();
    x
}

fn accelerations(random: &mut Random) -> [Real; SUBSTEPS] {
    [0; SUBSTEPS].map(|_| 0.4 * random.normal())
}

fn swing(random: &mut Random) {
    let u = SwingInput {
        part_noise_mps2: 0.02,
        accelerations_mps2: accelerations(random),
        force_sd_n: 100.0,
        noise_mass_kg: 1e4,
        amplitude_rad2: 0.01,
        length_m: 0.6,
        new_grade_rad2: 1e-4,
    };
    for swings in [true, false] {
        check_process(&swing_model(swings), &u, swing_state(random));
    }
}

fn block_force(random: &mut Random) {
    let means = TrainMeans {
        tare_deep_kg: 900.0 * random.normal(),
        tare_kg: 900.0,
        load_deep: 0.2 * random.normal(),
        load: 0.1,
        load_cos: 0.9 + 0.1 * random.uniform(),
        load_curvature_per_m: 0.05 * random.normal(),
        behind_tare_kgm: 1e4 * random.uniform(),
        behind_load_m: 3.0 * random.uniform(),
        ahead_kgm: 1e3,
        ahead_m: 0.1,
        ahead_rad_per_m: 0.03,
        bend_per_m: 0.1 * random.uniform(),
    };
    let noise = BlockNoise {
        part_noise_mps2: 0.02,
        model_sd_mps2: 0.0016,
        swing_model_sd: 0.015,
        mass_kg: 2e4,
        traction_variance: 1e4,
    };
    for swings in [true, false] {
        let (model, x) = (swing_model(swings), swing_state(random));
        let aid = BlockForce {
            model: &model,
            means: &means,
            traction_n: 2e4 * random.normal(),
            speed_mps: random.normal(),
            accelerations_mps2: accelerations(random),
            substep_s: 0.1,
            variance: 0.0,
        }
        .with_noise(&noise, &x);
        assert!(aid.R() > noise.traction_variance);
        check_aid(&aid, x);
        // The innovation falls as the prediction grows.
        let other = swing_state(random);
        let sum = |x| aid.innovation(x) + aid.h(x);
        assert!((sum(&x) - sum(&other)).abs() < 1e-6);
    }
}

/// Step of a central difference, relative to the number it changes if that is above 1.
const STEP: Real = 1e-5;

/// ∂f/∂x_i at `x` by (f(x + s) − f(x − s))/2s.
fn by_differences<const N: usize, const M: usize>(
    f: impl Fn(&SVector<Real, N>) -> SVector<Real, M>,
    x: &SVector<Real, N>,
    i: usize,
) -> SVector<Real, M> {
    let mut step = SVector::<Real, N>::zeros();
    step[i] = STEP * x[i].abs().max(1.0);
    (f(&(x + step)) - f(&(x - step))) / (2.0 * step[i])
}

/// Compares column `i` of a Jacobian whose largest entry is `most`.
fn compare<const M: usize>(
    name: &str,
    i: usize,
    found: SVector<Real, M>,
    expected: SVector<Real, M>,
    most: Real,
) {
    let off = (found - expected).amax();
    assert!(off < 1e-8 * (1.0 + most), "{name} by x{i}: {off}");
}

/// `F` at `x`, and Q symmetric with no negative variance.
fn check_process<T: Process<N>, const N: usize>(model: &T, u: &T::Input, x: SVector<Real, N>) {
    let (name, dt) = (std::any::type_name::<T>(), 0.1);
    let F = model.F(&x, u, dt);
    for i in 0..N {
        let expected = by_differences(|x| model.f(x, u, dt), &x, i);
        compare(name, i, F.column(i).into_owned(), expected, F.amax());
    }
    let Q = model.Q(u, dt);
    assert!(Q == Q.transpose() && Q.diagonal().iter().all(|q| *q >= 0.0));
}

/// `F`, `Q` and `H` at `x`.
fn check<T: Model<N, M>, const N: usize, const M: usize>(
    model: &T,
    u: &T::Input,
    x: SVector<Real, N>,
) {
    check_process(model, u, x);
    let H = model.H(&x);
    for i in 0..N {
        let expected = by_differences(|x| model.h(x), &x, i);
        let name = std::any::type_name::<T>();
        compare(name, i, H.column(i).into_owned(), expected, H.amax());
    }
}

/// `H` at `x`, and a positive R.
fn check_aid<T: Aid<N>, const N: usize>(aid: &T, x: SVector<Real, N>) {
    let H = aid.H(&x);
    for i in 0..N {
        let expected = by_differences(|x| vector![aid.h(x)], &x, i);
        let name = std::any::type_name::<T>();
        compare(name, i, vector![H[i]], expected, H.amax());
    }
    assert!(aid.R() > 0.0);
}

#[test]
fn every_jacobian_equals_central_differences() {
    for (name, draw) in MODELS.iter().chain(PROCESSES).chain(AIDS) {
        println!("{name}");
        let mut random = Random::new(71);
        for _ in 0..DRAWS {
            draw(&mut random);
        }
    }
}

/// The types for which the text of a source file implements a trait of this name.
fn types_of(text: &str, of_trait: &str) -> Vec<String> {
    let mut found = Vec::new();
    for block in text.split("\nimpl").skip(1) {
        let header: String = block.split('{').next().unwrap_or("").replace('\n', " ");
        // Past the generics of the impl, which may name the trait as a bound.
        let mut depth = 0;
        let rest = header.trim_start_matches(|c| {
            depth += i32::from(c == '<') - i32::from(c == '>');
            depth > 0 || c == '>' || c == ' '
        });
        let Some((path, of)) = rest.split_once(" for ") else {
            continue;
        };
        if path
            .strip_prefix(of_trait)
            .is_some_and(|rest| rest.starts_with('<'))
        {
            let end = |c: char| !c.is_alphanumeric() && c != '_';
            found.push(of.trim().split(end).next().unwrap().into());
        }
    }
    found
}

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|end| end == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn everything_with_a_jacobian_is_checked() {
    let mut files = Vec::new();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    sources(&folder, &mut files);
    let texts: Vec<String> = files
        .iter()
        .map(|file| fs::read_to_string(file).unwrap())
        .collect();
    let found = |of_trait| {
        let types = texts.iter().flat_map(|text| types_of(text, of_trait));
        let mut types: Vec<String> = types.collect();
        types.sort();
        types
    };
    let names = |cases: &[Case]| -> Vec<&str> { cases.iter().map(|(name, _)| *name).collect() };
    let mut processes = [names(MODELS), names(PROCESSES)].concat();
    processes.sort_unstable();
    assert_eq!(found("Model"), names(MODELS), "models of src/ and MODELS");
    assert_eq!(
        found("Process"),
        processes,
        "processes of src/ and the lists"
    );
    assert_eq!(found("Aid"), names(AIDS), "aids of src/ and AIDS");
}

#[test]
fn the_search_for_types_sees_past_generics_and_line_breaks() {
    let text = "\nimpl Model<2, 1> for A {\nimpl<T: Model<N, M>, const N: usize> Filter<N, M> for B<T> {\nimpl<const K: usize> Model<3, K>\n    for C<K>\nwhere\n{\nimpl D {\nimpl ModelOther<2> for E {\nimpl Aid<2> for F<'_> {";
    assert_eq!(types_of(text, "Model"), ["A", "C"]);
    assert_eq!(types_of(text, "Aid"), ["F"]);
}
