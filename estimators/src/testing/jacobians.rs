//! The Jacobians of every model against central finite differences.
//!
//! A new model goes into [`MODELS`]. One that is forgotten there is found in the sources ([`every_model_of_the_sources_is_checked`]).

use nalgebra::{SVector, vector};
use std::path::{Path, PathBuf};
use std::string::String;
use std::vec::Vec;
use std::{fs, println};

use crate::Real;
use crate::filters::model::Model;
use crate::methods::ekf_v_theta_biases::{BiasModel, Inertial};
use crate::methods::guo_2024::{self, RampModel};
use crate::methods::huainan::InclinationModel;
use crate::methods::joint_ekf::{self, JointModel};
use crate::methods::liu_2023::GradeModel;
use crate::methods::patent::ClimbModel;
use crate::models::force_balance::Drive;
use crate::models::force_balance::ForceBalance;
use crate::supervised::force_balance_ekf::ForceBalanceModel;
use crate::supervised::imm::{self, Acceleration, SlopeModel};
use crate::supervised::inertial::{InertialModel, Motion, Turn};
use crate::testing::Random;
use crate::testing::vehicles::vehicle;

/// A model's name and what draws an input and a state for it and checks its Jacobians there.
type Case = (&'static str, fn(&mut Random));

/// Every model by the name of its type, sorted, with what draws inputs and states for it.
const MODELS: &[Case] = &[
    ("BiasModel", biases),
    ("ClimbModel", climb),
    ("ForceBalanceModel", force_balance),
    ("GradeModel", liu_grade),
    ("InclinationModel", inclination),
    ("InertialModel", inertial),
    ("JointModel", joint),
    ("RampModel", ramp),
    ("SlopeModel", slope),
];

/// Drawn inputs for each model.
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

fn inertial(random: &mut Random) {
    let model = InertialModel {
        q_v: 1e-6,
        q_theta: [5e-6, 1e-8],
    };
    let turns = [
        Turn::Curvature(0.1 * random.normal()),
        Turn::Gyro(0.1 * random.normal()),
    ];
    let force = random.normal();
    for turn in turns {
        for specific_force_mps2 in [None, Some(force)] {
            let motion = Motion {
                specific_force_mps2,
                turn,
                force_noise_mps2: 0.0,
            };
            check(&model, &motion, speed_and_grade(random));
        }
    }
}

fn joint(random: &mut Random) {
    let model = JointModel {
        balance: ForceBalance::new(&vehicle()),
        q: [1e-4, 1e-4],
    };
    let push = joint_ekf::Push {
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
    use guo_2024::Acceleration::{Dynamic, Kinematic};
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

fn slope(random: &mut Random) {
    for acceleration in [Acceleration::Kinematic, Acceleration::Dynamic] {
        let model = SlopeModel {
            acceleration,
            q: [1e-6, 0.3, 5e-4],
        };
        let push = imm::Push {
            level_mps2: random.normal(),
            inertia: 1.0 + random.uniform(),
            sd_mps2: 0.03,
        };
        for push in [None, Some(push)] {
            let x = vector![random.normal(), random.normal(), 0.3 * random.normal()];
            check(&model, &push, x);
        }
    }
}

/// Speed and grade angle of a crane, or worse.
fn speed_and_grade(random: &mut Random) -> SVector<Real, 2> {
    vector![2.0 * random.normal(), 0.4 * random.normal()]
}

/// `F` and `H` at `x` against (f(x + s) − f(x − s))/2s, and Q symmetric with no negative variance.
fn check<T: Model<N, M>, const N: usize, const M: usize>(
    model: &T,
    u: &T::Input,
    x: SVector<Real, N>,
) {
    const STEP: Real = 1e-5;
    let dt = 0.1;
    let (F, H) = (model.F(&x, u, dt), model.H(&x));
    for i in 0..N {
        let mut step = SVector::<Real, N>::zeros();
        step[i] = STEP;
        let (plus, minus) = (x + step, x - step);
        let by_f = (model.f(&plus, u, dt) - model.f(&minus, u, dt)) / (2.0 * STEP);
        let by_h = (model.h(&plus) - model.h(&minus)) / (2.0 * STEP);
        let name = std::any::type_name::<T>();
        let off = (F.column(i) - by_f).amax();
        assert!(off < 1e-8 * (1.0 + F.amax()), "{name}: F by x{i}: {off}");
        let off = (H.column(i) - by_h).amax();
        assert!(off < 1e-8 * (1.0 + H.amax()), "{name}: H by x{i}: {off}");
    }
    let Q = model.Q(u, dt);
    assert!(Q == Q.transpose() && Q.diagonal().iter().all(|q| *q >= 0.0));
}

#[test]
fn every_jacobian_equals_central_differences() {
    for (name, draw) in MODELS {
        println!("{name}");
        let mut random = Random::new(71);
        for _ in 0..DRAWS {
            draw(&mut random);
        }
    }
}

/// The types that the text of a source file makes a [`Model`].
fn models_of(text: &str) -> Vec<String> {
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
        if path.starts_with("Model<") {
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
fn every_model_of_the_sources_is_checked() {
    let mut files = Vec::new();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    sources(&folder, &mut files);
    let mut models: Vec<String> = files
        .iter()
        .flat_map(|file| models_of(&fs::read_to_string(file).unwrap()))
        .collect();
    models.sort();
    let listed: Vec<&str> = MODELS.iter().map(|(name, _)| *name).collect();
    assert_eq!(models, listed, "the list of this file is not that of src/");
}

#[test]
fn the_search_for_models_sees_past_generics_and_line_breaks() {
    let text = "\nimpl Model<2, 1> for A {\nimpl<T: Model<N, M>, const N: usize> Filter<N, M> for B<T> {\nimpl<const K: usize> Model<3, K>\n    for C<K>\nwhere\n{\nimpl D {";
    assert_eq!(models_of(text), ["A", "C"]);
}
