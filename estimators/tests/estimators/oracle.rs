//! Every algorithm of this crate against an oracle of its own: Python, written from the equations (`tests/reference/`).
//!
//! A test reads a recorded input, runs the crate's public functions over it and compares every number of every step
//! with the oracle's output. Constants stand in both places: here, and in the oracle's file, whose doc comment has the
//! equations.
#![allow(non_snake_case)]

use crate::reference::{Table, assert_agrees};
use monorig_estimators::filters::adaptive_low_pass::AdaptiveSmoother;
use monorig_estimators::filters::forgetting::Forgetting;
use monorig_estimators::filters::gaussian::{Correction, Gaussian};
use monorig_estimators::filters::imm::Imm;
use monorig_estimators::filters::low_pass::MatchedFilter;
use monorig_estimators::filters::rls::Rls;
use monorig_estimators::filters::sage_husa::SageHusa;
use monorig_estimators::filters::strong_tracking::{Alarm, StrongTracking, fade};
use monorig_estimators::filters::{ekf, ukf};
use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector2, Vector3, matrix, vector};

const GRAVITY: f64 = 9.81;

/// The upper triangle of a symmetric matrix, row by row.
fn upper<const N: usize>(P: &SMatrix<f64, N, N>) -> Vec<f64> {
    let row = |i: usize| (i..N).map(move |j| P[(i, j)]);
    (0..N).flat_map(row).collect()
}

fn flag(on: bool) -> f64 {
    f64::from(u8::from(on))
}

#[test]
fn recursive_least_squares() {
    let policies = [
        Forgetting::None,
        Forgetting::Constant(0.97),
        Forgetting::Dynamic {
            floor: 0.9,
            sharpness: 0.5,
            first: 0.98,
        },
        Forgetting::Multiple([0.999, 0.95]),
        Forgetting::TimeLaw {
            loss: 0.05,
            decay: 0.98,
        },
    ];
    let input = Table::read("rls_input.csv").arrays::<6>();
    let mut rows = Vec::new();
    for (number, policy) in policies.iter().copied().enumerate() {
        let prior = Gaussian::independent(vector![10.0, 1.0], vector![8.0, 5.0]);
        let mut rls = Rls::new(prior, policy);
        for [y, h1, h2, r, remember, reset_to_prior] in &input {
            if *reset_to_prior != 0.0 {
                rls.reset_to_prior(&vector![1.0, 0.0]);
            }
            let done = rls
                .update(*y, &vector![*h1, *h2], *r, *remember != 0.0)
                .unwrap();
            let mut row = vec![number as f64];
            row.extend(rls.belief.x.iter());
            row.extend(upper(&rls.belief.P));
            row.extend([done.residual, done.normalised, done.lambda]);
            row.extend([flag(done.limited), rls.spread(), rls.correlation_factor()]);
            rows.push(row);
        }
    }
    assert_agrees("rls", &rows);
}

/// The recursion as it is written in books: K = P h/(r + hᵀ P h), P ← P − K hᵀ P, made symmetric.
fn plain_recursion(belief: &mut Gaussian<3>, y: f64, h: &Vector3<f64>, r: f64, lambda: f64) {
    belief.P /= lambda;
    let K = belief.P * h / (r + h.dot(&(belief.P * h)));
    belief.x += K * (y - h.dot(&belief.x));
    belief.P -= K * (belief.P * h).transpose();
    belief.P = 0.5 * (belief.P + belief.P.transpose());
}

/// Regressors that differ by a thousandth to a hundred-thousandth, against 60 digits (`rls_near_equal.py`): worst error
/// of any number of P relative to the standard deviations beside it, and of χ in standard deviations.
#[test]
fn near_equal_regressors_need_the_square_root_form() {
    let input = Table::read("rls_near_equal_input.csv").arrays::<5>();
    let exact = Table::read("rls_near_equal_output.csv").arrays::<12>();
    let prior = Gaussian::independent(SVector::zeros(), vector![1.0, 1.0, 1.0]);
    let error = |belief: &Gaussian<3>, row: &[f64; 12]| {
        let [_, _, _, x1, x2, x3, P11, P12, P13, P22, P23, P33] = *row;
        let P = matrix![P11, P12, P13; P12, P22, P23; P13, P23, P33];
        let sd = P.diagonal().map(f64::sqrt);
        let of_P = (belief.P - P).component_div(&(sd * sd.transpose()));
        let of_x = (belief.x - vector![x1, x2, x3]).component_div(&sd);
        of_P.abs().max().max(of_x.abs().max())
    };
    for (case, apart) in [1e-3, 1e-4, 1e-5].into_iter().enumerate() {
        let [mut factored, mut plain] = [0.0_f64; 2];
        for lambda in [1.0, 0.999] {
            let mut rls = Rls::new(prior, Forgetting::Constant(lambda));
            let mut book = prior;
            let mine = input.iter().filter(|row| row[0] == case as f64);
            for (k, [_, y, h1, h2, h3]) in mine.enumerate() {
                let h = vector![*h1, *h2, *h3];
                rls.update(*y, &h, 1e-12, false);
                plain_recursion(&mut book, *y, &h, 1e-12, lambda);
                let at = [case as f64, lambda, (k + 1) as f64];
                if let Some(row) = exact.iter().find(|row| row[..3] == at) {
                    factored = factored.max(error(&rls.belief, row));
                    plain = plain.max(error(&book, row));
                }
            }
        }
        println!("apart by {apart:.0e}: square root {factored:.1e}, plain {plain:.1e}");
        assert!(factored < 1e-8 && plain > 1e3 * factored);
    }
}

/// The crane of the state filters: x = (v, θ, 10 t / M), u = tractive force / 10 t; `common.py` has its equations.
mod crane {
    use super::*;

    const DT: f64 = 0.02;
    const MU: f64 = 0.03;
    pub const Q: Matrix3<f64> = matrix![2e-5, 1e-6, 0.0; 1e-6, 4e-5, 0.0; 0.0, 0.0, 1e-7];
    pub const R: Matrix2<f64> = matrix![4e-4, 1e-4; 1e-4, 2.5e-3];

    pub fn prior() -> Gaussian<3> {
        Gaussian::independent(vector![0.1, 0.02, 1.0], vector![0.2, 0.1, 0.3])
    }

    pub fn f(x: &Vector3<f64>, u: f64) -> Vector3<f64> {
        let acceleration = u * x.z - GRAVITY * x.y.sin() - MU * GRAVITY * x.y.cos();
        vector![x.x + DT * acceleration, x.y, x.z]
    }

    pub fn h(x: &Vector3<f64>, u: f64) -> Vector2<f64> {
        vector![x.x, u * x.z - MU * GRAVITY * x.y.cos()]
    }

    pub fn F(x: &Vector3<f64>, u: f64) -> Matrix3<f64> {
        let of_theta = -GRAVITY * x.y.cos() + MU * GRAVITY * x.y.sin();
        matrix![1.0, DT * of_theta, DT * u; 0.0, 1.0, 0.0; 0.0, 0.0, 1.0]
    }

    pub fn H(x: &Vector3<f64>, u: f64) -> SMatrix<f64, 2, 3> {
        matrix![1.0, 0.0, 0.0; 0.0, MU * GRAVITY * x.y.sin(), u]
    }

    pub fn row(belief: &Gaussian<3>, done: &Correction<2, 3>) -> Vec<f64> {
        let mut row: Vec<f64> = belief.x.iter().copied().collect();
        row.extend(upper(&belief.P));
        row.extend(done.y.iter());
        row.extend(upper(&done.S));
        row.extend(done.K.transpose().iter()); // row by row
        row.extend([done.nis, done.log_likelihood]);
        row
    }
}

#[test]
fn extended_kalman_filter() {
    let mut belief = crane::prior();
    let mut rows = Vec::new();
    for [u, z1, z2] in Table::read("ekf_input.csv").arrays() {
        let (x_next, F) = (crane::f(&belief.x, u), crane::F(&belief.x, u));
        ekf::predict(&mut belief, x_next, &F, &crane::Q);
        let (h, H) = (crane::h(&belief.x, u), crane::H(&belief.x, u));
        let done = ekf::update(&mut belief, vector![z1, z2], h, &H, &crane::R).unwrap();
        rows.push(crane::row(&belief, &done));
    }
    assert_agrees("ekf", &rows);
}

#[test]
fn unscented_kalman_filter() {
    let spread = ukf::Spread {
        alpha: 0.97,
        beta: 2.0,
        kappa: 0.0,
    };
    let mut belief = crane::prior();
    let mut rows = Vec::new();
    for [u, z1, z2] in Table::read("ukf_input.csv").arrays() {
        ukf::predict(&mut belief, &spread, |x| crane::f(x, u), &crane::Q).unwrap();
        let h = |x: &Vector3<f64>| crane::h(x, u);
        let done = ukf::update(&mut belief, &spread, vector![z1, z2], h, &crane::R).unwrap();
        rows.push(crane::row(&belief, &done));
    }
    assert_agrees("ukf", &rows);
}

#[test]
fn sage_husa_estimators() {
    let F = matrix![1.0, 0.1; 0.0, 1.0];
    let H = Matrix2::identity();
    let mut rows = Vec::new();
    for adapts_q in [false, true] {
        let mut belief = Gaussian::<2>::independent(vector![0.0, 0.0], vector![1.0, 2.0]);
        let limits = [0.4, 10.0];
        let mut Q = SageHusa::new(matrix![1e-4, 0.0; 0.0, 4e-3], 0.95, limits);
        let mut R = SageHusa::new(matrix![0.04, 0.01; 0.01, 0.09], 0.95, limits);
        for [z1, z2] in Table::read("sage_husa_input.csv").arrays() {
            let (z, x_next) = (vector![z1, z2], F * belief.x);
            ekf::predict(&mut belief, x_next, &F, Q.covariance());
            let z_predicted = belief.x;
            let done = ekf::update(&mut belief, z, z_predicted, &H, R.covariance()).unwrap();
            let adapted = if adapts_q {
                Q.observe_correction(&done);
                &Q
            } else {
                R.observe_residual(&(z - belief.x), &H, &belief);
                &R
            };
            let mut row = vec![flag(adapts_q)];
            row.extend(belief.x.iter());
            row.extend(upper(&belief.P));
            row.extend(upper(adapted.covariance()));
            row.push(flag(adapted.limited()));
            rows.push(row);
        }
    }
    assert_agrees("sage_husa", &rows);
}

#[test]
fn strong_tracking_and_its_alarm() {
    let F = matrix![1.0, 0.05; 0.0, 1.0];
    let H = matrix![1.0, 0.0; 0.2, 1.0];
    let (Q, R) = (matrix![1e-6, 0.0; 0.0, 1e-5], matrix![4e-4, 0.0; 0.0, 0.04]);
    let mut rows = Vec::new();
    for mode in [0, 1] {
        let mut belief = Gaussian::<2>::independent(vector![0.0, 0.0], vector![0.1, 0.2]);
        let mut tracking = StrongTracking::new(0.95, 1.5, 20.0);
        let mut alarm = Alarm::new(2.0);
        for [z1, z2] in Table::read("strong_tracking_input.csv").arrays() {
            let (z, x_next) = (vector![z1, z2], F * belief.x);
            let y = z - H * x_next;
            let carried = H * F * belief.P * F.transpose() * H.transpose();
            let process = H * Q * H.transpose();
            let lambda = tracking.fading(&y, &carried, &process, &R);
            let rings = alarm.active(&y, &(carried + process + R));
            if mode == 0 || rings {
                fade(&mut belief, &vector![1.0, lambda]);
            }
            ekf::predict(&mut belief, x_next, &F, &Q);
            ekf::update(&mut belief, z, H * x_next, &H, &R).unwrap();
            let mut row = vec![f64::from(mode), lambda, flag(rings)];
            row.extend(belief.x.iter());
            row.extend(upper(&belief.P));
            rows.push(row);
        }
    }
    assert_agrees("strong_tracking", &rows);
}

#[test]
fn interacting_models_fixed_and_time_varying() {
    let dt = 0.05;
    let rolling = matrix![1.0, -GRAVITY * dt; 0.0, 1.0];
    let models = [
        (rolling, matrix![1e-6, 0.0; 0.0, 1e-8]),
        (rolling, matrix![1e-4, 0.0; 0.0, 4e-4]),
        (matrix![0.9, 0.0; 0.0, 0.95], matrix![1e-2, 0.0; 0.0, 1e-5]),
    ];
    let H = matrix![1.0, 0.0; 0.0, GRAVITY];
    let R = matrix![1e-3, 2e-4; 2e-4, 4e-2];
    let mut rows = Vec::new();
    for time_varying in [false, true] {
        let prior = Gaussian::<2>::independent(vector![0.0, 0.0], vector![0.2, 0.05]);
        let mut imm = Imm::<2, 3>::new(prior, 0.96, time_varying);
        for [z1, z2] in Table::read("imm_input.csv").arrays() {
            imm.mix();
            let mut logs = SVector::<f64, 3>::zeros();
            for ((belief, (F, Q)), log) in imm.beliefs.iter_mut().zip(&models).zip(logs.iter_mut())
            {
                let x_next = F * belief.x;
                ekf::predict(belief, x_next, F, Q);
                let done = ekf::update(belief, vector![z1, z2], H * x_next, &H, &R).unwrap();
                *log = done.log_likelihood;
            }
            imm.weigh(&logs);
            let combined = imm.combined();
            let mut row = vec![flag(time_varying)];
            row.extend(imm.probability().iter());
            row.extend(combined.x.iter());
            row.extend(upper(&combined.P));
            row.extend(imm.transition().transpose().iter()); // row by row
            rows.push(row);
        }
    }
    assert_agrees("imm", &rows);
}

#[test]
fn adaptive_smoothing() {
    let mut smoother = AdaptiveSmoother::new([0.5, 2.0, 8.0], 0.1, [2.0, 5.0]);
    let input = Table::read("smoothing_input.csv").arrays();
    let rows: Vec<Vec<f64>> = input
        .into_iter()
        .map(|[dt, a, b]| {
            let [a, b] = smoother.step([a, b], dt);
            vec![a, b, smoother.gain()]
        })
        .collect();
    assert_agrees("smoothing", &rows);
}

#[test]
fn matched_filter() {
    let mut filter = MatchedFilter::new(1.0);
    let input = Table::read("conditioning_input.csv").arrays();
    let rows: Vec<Vec<f64>> = input
        .into_iter()
        .map(|[dt, u]| {
            filter.step(u, dt);
            vec![filter.value().unwrap(), filter.rate()]
        })
        .collect();
    assert_agrees("conditioning", &rows);
}
