//! Nanoseconds a step of every algorithm and every named estimator, the best of several rounds.
//!
//! `cargo bench -p monorig-estimators`; with `-- --check` it ends with status 1 if a bar is missed (use it on a quiet
//! machine). Words behind `--` choose parts and estimators whose names hold one of them, so that two builds can be run
//! in turns.
#![allow(non_snake_case, clippy::unwrap_used)]

#[path = "../tests/estimators/common/mod.rs"]
#[allow(dead_code)] // the tests use the rest
mod common;

use std::{hint::black_box, time::Instant};

use common::{Crane, Random, vehicle};
use monorig_estimators::api::estimator::Estimator;
use monorig_estimators::api::real::{cos, sin};
use monorig_estimators::api::signals::{Command, Measurements};
use monorig_estimators::filters::adaptive_low_pass::AdaptiveSmoother;
use monorig_estimators::filters::forgetting::Forgetting;
use monorig_estimators::filters::gaussian::Gaussian;
use monorig_estimators::filters::imm::Imm;
use monorig_estimators::filters::low_pass::MatchedFilter;
use monorig_estimators::filters::rls::Rls;
use monorig_estimators::filters::sage_husa::SageHusa;
use monorig_estimators::filters::strong_tracking::{Alarm, StrongTracking};
use monorig_estimators::filters::ukf::Spread;
use monorig_estimators::filters::{ekf, ukf};
use monorig_estimators::{Real, registry};
use nalgebra::{Matrix1, Matrix2, Matrix3, SMatrix, SVector, Vector2, Vector3, matrix, vector};

const ROUNDS: usize = 30;
const SAMPLES: usize = 4096;
/// Samples that are timed together.
const STRETCH: usize = 100;
const SPREAD: Spread = Spread {
    alpha: 1.0,
    beta: 2.0,
    kappa: 1.0,
};

/// Best time of one step, ns. Each round starts from the same state and runs through all samples; of every stretch of
/// them the best round counts, so that other programs on the machine are seen only where they interrupt the same
/// stretch in all rounds. The samples are copied before the clock starts: in a loop too they have just been written.
fn time<S: Clone, Z: Clone>(state: &S, samples: &[Z], step: impl Fn(&mut S, &Z)) -> Real {
    let mut best = vec![u128::MAX; samples.len().div_ceil(STRETCH)];
    for _ in 0..ROUNDS {
        let mut state = black_box(state.clone());
        for (stretch, best) in samples.chunks(STRETCH).zip(&mut best) {
            let stretch = stretch.to_vec();
            let start = Instant::now();
            for sample in &stretch {
                step(&mut state, black_box(sample));
            }
            *best = start.elapsed().as_nanos().min(*best);
        }
        black_box(&state);
    }
    best.iter().sum::<u128>() as Real / samples.len() as Real
}

/// Prints the table and counts missed bars.
struct Table {
    /// Words that select rows by name; without words all rows run.
    words: Vec<String>,
    missed: usize,
}

impl Table {
    fn wants(&self, name: &str) -> bool {
        self.words.is_empty() || self.words.iter().any(|word| name.contains(word.as_str()))
    }

    fn row(&self, name: &str, ns: Real, note: &str) {
        println!("{name:<52} {ns:8.1} ns  {note}");
    }

    /// A row with an upper bar.
    fn bar(&mut self, name: &str, value: Real, unit: &str, most: Real) {
        let verdict = if value <= most { "held" } else { "MISSED" };
        self.missed += usize::from(value > most);
        println!("{name:<52} {value:8.2} {unit:<3} bar {most} {unit}: {verdict}");
    }
}

/// Name and rows of a part of the table.
type Part = (&'static str, fn(&mut Table));

fn main() {
    let (options, words): (Vec<String>, Vec<String>) = std::env::args()
        .skip(1)
        .partition(|argument| argument.starts_with("--"));
    let mut table = Table { words, missed: 0 };
    let parts: [Part; 5] = [
        ("least_squares", least_squares),
        ("extended", extended),
        ("unscented", unscented),
        ("interacting", interacting),
        ("parts", small_parts),
    ];
    for (name, part) in parts {
        if table.wants(name) {
            part(&mut table);
        }
    }
    pipelines(&table);
    let check = options.iter().any(|option| option == "--check");
    if check && table.missed > 0 {
        eprintln!("{} bars missed", table.missed);
        std::process::exit(1);
    }
}

fn regression<const N: usize>() -> Vec<(Real, SVector<Real, N>)> {
    let mut random = Random::new(1);
    (0..SAMPLES)
        .map(|_| {
            let h: SVector<Real, N> =
                SVector::from_fn(|i, _| if i == 0 { 1.0 } else { random.normal() });
            (h.sum() + 0.1 * random.normal(), h)
        })
        .collect()
}

fn rls_of<const N: usize>(policy: Forgetting<N>) -> Rls<N> {
    Rls::new(
        Gaussian::independent(SVector::zeros(), SVector::repeat(10.0)),
        policy,
    )
}

fn least_squares(table: &mut Table) {
    println!("-- recursive least squares, r = 0.01, dependent steps");
    let samples = regression::<2>();
    let run = |policy| {
        time(&rls_of::<2>(policy), &samples, |rls, (y, h)| {
            black_box(rls.update(*y, h, 0.01, false));
        })
    };
    let ours = run(Forgetting::Constant(0.99));
    table.row("Rls<2> constant forgetting", ours, "");
    table.row(
        "Rls<2> dynamic forgetting",
        run(Forgetting::Dynamic {
            floor: 0.98,
            sharpness: 1.0,
            first: 0.98,
        }),
        "",
    );
    table.row(
        "Rls<2> multiple forgetting",
        run(Forgetting::Multiple([0.99, 0.95])),
        "",
    );
    table.row(
        "Rls<2> forgetting by time law",
        run(Forgetting::TimeLaw {
            loss: 0.05,
            decay: 0.98,
        }),
        "",
    );
    let samples = regression::<4>();
    let four = time(
        &rls_of::<4>(Forgetting::Constant(0.99)),
        &samples,
        |rls, (y, h)| {
            black_box(rls.update(*y, h, 0.01, false));
        },
    );
    table.row("Rls<4> constant forgetting", four, "");
}

/// Slope from speed: v⁺ = v + dt (u − g (sin θ + μ cos θ)), u traction over mass.
#[derive(Clone, Copy)]
struct SlopeModel {
    dt: Real,
    q_v: Real,
    q_theta: Real,
    r: Real,
}

impl Default for SlopeModel {
    fn default() -> Self {
        Self {
            dt: 0.01,
            q_v: 1e-6,
            q_theta: 3e-6,
            r: 2.5e-5,
        }
    }
}

const GRAVITY: Real = 9.81;
const MU: Real = 0.02;

impl SlopeModel {
    fn transition(&self, x: &Vector2<Real>, u: Real) -> (Vector2<Real>, Matrix2<Real>) {
        let (sine, cosine) = (sin(x.y), cos(x.y));
        let by_theta = -self.dt * GRAVITY * (cosine - MU * sine);
        (
            vector![x.x + self.dt * (u - GRAVITY * (sine + MU * cosine)), x.y],
            matrix![1.0, by_theta; 0.0, 1.0],
        )
    }

    fn Q(&self) -> Matrix2<Real> {
        Matrix2::from_diagonal(&vector![self.q_v, self.q_theta])
    }
}

/// Tractions per unit mass and wheel speeds of a train that starts.
fn speeds() -> Vec<(Real, Real)> {
    let mut random = Random::new(2);
    let (mut v, model) = (0.0, SlopeModel::default());
    (0..SAMPLES)
        .map(|_| {
            let u = 1.2 + 0.3 * random.normal();
            v += model.dt * (u - 9.81 * (0.1f64.sin() + 0.02 * 0.1f64.cos()));
            (u, v + 0.005 * random.normal())
        })
        .collect()
}

/// One step as one call, as an application makes it: the loop around it does not tear it apart.
#[inline(never)]
fn slope_step(belief: &mut Gaussian<2>, model: &SlopeModel, u: Real, z: Real, R: &Matrix1<Real>) {
    let (x_next, F) = model.transition(&belief.x, u);
    ekf::predict(belief, x_next, &F, &model.Q());
    let H = matrix![1.0, 0.0];
    let z_predicted = H * belief.x;
    black_box(ekf::update(belief, vector![z], z_predicted, &H, R));
}

fn extended(table: &mut Table) {
    println!(
        "-- extended Kalman filter, state [v, theta], sine and cosine of the slope, z = v: predict and update"
    );
    let (samples, model) = (speeds(), SlopeModel::default());
    let start = Gaussian::independent(vector![0.0, 0.0], vector![0.1, 0.1]);
    let R = Matrix1::new(model.r);
    let ours = time(&start, &samples, |belief, (u, z)| {
        slope_step(belief, &model, *u, *z, &R);
    });
    table.row("ekf two states", ours, "");

    let noise = SageHusa::new(R, 0.998, [0.01, 100.0]);
    let adaptive = time(&(start, noise), &samples, |(belief, noise), (u, z)| {
        let R = *noise.covariance();
        slope_step(belief, &model, *u, *z, &R);
        let H = matrix![1.0, 0.0];
        noise.observe_residual(&(vector![*z] - H * belief.x), &H, belief);
    });
    table.row("ekf two states with Sage-Husa", adaptive, "");
    table.bar("what Sage-Husa adds", adaptive - ours, "ns", 15.0);
}

#[inline(never)]
fn unscented_step(
    belief: &mut Gaussian<2>,
    model: &SlopeModel,
    u: Real,
    z: Real,
    R: &Matrix1<Real>,
    sine: impl Fn(Real) -> Real,
) {
    let f = |x: &Vector2<Real>| vector![x.x + model.dt * (u - 9.81 * sine(x.y)), x.y];
    black_box(ukf::predict(belief, &SPREAD, f, &model.Q()));
    black_box(ukf::update(
        belief,
        &SPREAD,
        vector![z],
        |x| vector![x.x],
        R,
    ));
}

fn unscented(table: &mut Table) {
    println!("-- unscented Kalman filter, two states: predict and update");
    let (samples, model) = (speeds(), SlopeModel::default());
    let start = Gaussian::independent(vector![0.0, 0.0], vector![0.1, 0.1]);
    let R = Matrix1::new(model.r);
    let cubic = |x: Real| x - x * x * x / 6.0;
    let cheap = time(&start, &samples, |belief, (u, z)| {
        unscented_step(belief, &model, *u, *z, &R, cubic);
    });
    let exact = time(&start, &samples, |belief, (u, z)| {
        unscented_step(belief, &model, *u, *z, &R, sin);
    });
    table.row("ukf two states, cubic model", cheap, "");
    table.row(
        "ukf two states, sine of the slope",
        exact,
        "5 sines of libm",
    );
}

/// One cycle of two random-acceleration models of [s, v, a] under `M` measurements.
fn cycle<const M: usize>(
    imm: &mut Imm<3, 2>,
    models: &[(Matrix3<Real>, Matrix3<Real>); 2],
    z: &SVector<Real, M>,
    H: &SMatrix<Real, M, 3>,
    R: &SMatrix<Real, M, M>,
) -> Gaussian<3> {
    imm.mix();
    let mut logs = Vector2::zeros();
    for ((belief, (F, Q)), log) in imm.beliefs.iter_mut().zip(models).zip(logs.iter_mut()) {
        let x_next: Vector3<Real> = F * belief.x;
        ekf::predict(belief, x_next, F, Q);
        let z_predicted = H * belief.x;
        *log = ekf::update(belief, *z, z_predicted, H, R).map_or(-1e3, |done| done.log_likelihood);
    }
    imm.weigh(&logs);
    imm.combined()
}

fn interacting(table: &mut Table) {
    println!(
        "-- interacting multiple models, two filters of three states: mix, predict, update, weigh, combine"
    );
    let mut random = Random::new(3);
    let samples: Vec<Vector2<Real>> = (0..SAMPLES)
        .map(|_| vector![random.normal(), random.normal()])
        .collect();
    let dt = 0.01;
    let F = matrix![1.0, dt, 0.5 * dt * dt; 0.0, 1.0, dt; 0.0, 0.0, 1.0];
    let Q = |q: Real| Matrix3::from_diagonal(&vector![1e-9, 1e-7, q]);
    let models = [(F, Q(1e-5)), (F, Q(1e-2))];
    let start = |time_varying| {
        let belief = Gaussian::independent(Vector3::zeros(), Vector3::repeat(1.0));
        Imm::<3, 2>::new(belief, 0.95, time_varying)
    };
    let H1 = matrix![1.0, 0.0, 0.0];
    let H2 = matrix![1.0, 0.0, 0.0; 0.0, 0.0, 1.0];
    let one = |time_varying| {
        time(&start(time_varying), &samples, |imm, z| {
            black_box(cycle(imm, &models, &vector![z.x], &H1, &Matrix1::new(1.0)));
        })
    };
    let fixed = one(false);
    table.row("imm one measurement, fixed transitions", fixed, "");
    table.row(
        "imm one measurement, time-varying transitions",
        one(true),
        "two exponentials more",
    );
    let two = time(&start(true), &samples, |imm, z| {
        black_box(cycle(imm, &models, z, &H2, &Matrix2::identity()));
    });
    table.row("imm two measurements, time-varying transitions", two, "");
}

fn small_parts(table: &mut Table) {
    println!("-- parts");
    let mut random = Random::new(4);
    let numbers: Vec<Real> = (0..SAMPLES).map(|_| random.normal()).collect();
    let tracking = (
        StrongTracking::<1>::new(0.95, 2.0, 50.0),
        Alarm::<1>::new(3.0),
    );
    let one = Matrix1::new(1.0);
    table.row(
        "strong tracking, one measurement, with alarm",
        time(&tracking, &numbers, |(tracking, alarm), y| {
            black_box(tracking.fading(&vector![*y], &one, &one, &one));
            black_box(alarm.active(&vector![*y], &(one * 3.0)));
        }),
        "",
    );
    let tracking = (
        StrongTracking::<2>::new(0.95, 2.0, 50.0),
        Alarm::<2>::new(3.0),
    );
    let two = Matrix2::identity();
    table.row(
        "strong tracking, two measurements, with alarm",
        time(&tracking, &numbers, |(tracking, alarm), y| {
            let y = vector![*y, -*y];
            black_box(tracking.fading(&y, &two, &two, &two));
            black_box(alarm.active(&y, &(two * 3.0)));
        }),
        "",
    );
    table.row(
        "matched filter, one channel",
        time(&MatchedFilter::new(1.0), &numbers, |filter, y| {
            filter.step(*y, 0.005);
            black_box(filter.rate());
        }),
        "",
    );
    let smoother = AdaptiveSmoother::<2>::new([0.5, 2.0, 10.0], 1.0, [1.0, 3.0]);
    table.row(
        "adaptive smoother, two channels",
        time(&smoother, &numbers, |smoother, y| {
            black_box(smoother.step([*y, -*y], 0.005));
        }),
        "",
    );
}

/// A drive: starts and stops on a slope that changes; IMU at every step, torque and wheel speed at every second one.
fn drive() -> Vec<Measurements> {
    let mut crane = Crane::new(vehicle(8), 15_000.0, 5);
    (0..20_000)
        .map(|k| {
            crane.grade_rad = 0.1 * (crane.chainage_m / 10.0).sin();
            let wanted = if k % 4000 < 3000 { 1.0 } else { 0.0 };
            let mut z = crane.step(wanted, 0.005);
            if k % 2 == 1 {
                z.motor_torque_nm = [None; 16];
                z.wheel_speed_mps = [None; 16];
            }
            z
        })
        .collect()
}

fn pipelines(table: &Table) {
    println!("-- named estimators: a step at 200 Hz of 8 drive units, checks included");
    let samples = drive();
    for name in registry::NAMES.iter().filter(|name| table.wants(name)) {
        let estimator = registry::build(name, &vehicle(8), []).unwrap();
        let ns = time(&estimator, &samples, |estimator, z| {
            black_box(estimator.step(z, &Command::default(), 0.005)).unwrap();
        });
        table.row(name, ns, "");
    }
    println!(
        "(one estimator with its start and its front end takes {} bytes)",
        size_of::<registry::AnyEstimator>()
    );
}
