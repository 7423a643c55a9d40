//! Filters on data of their own model: errors and innovations are as large as the filters predict (Bar-Shalom, Li &
//! Kirubarajan 2001, ch. 5.4), filters that must agree agree, and covariances stay covariances.
//!
//! NEES eᵀ P⁻¹ e is averaged over runs at each of twenty instants. A correct filter leaves the 95 % band at one instant
//! in twenty; more than three of twenty happens to it with probability 0.016. NIS is averaged over all runs and
//! instants.
//!
//! Not in the band by construction, and measured here against the theory instead:
//!
//! - least squares with constant forgetting λ: P is what a random walk of the parameters would need; for constant
//!   parameters the error covariance is P/(1 + λ) once the start is forgotten (sums of geometric series), so NEES is
//!   1/(1 + λ)
//! - Sage-Husa: R is an estimate from some hundred samples and errs by a tenth, more often upwards; NEES lies a few
//!   percent below 1
//! - strong tracking: each false alarm makes P too large for a while; they are rare, and NEES stays near 1
#![allow(non_snake_case)]

use crate::common::{Random, chi_square_band};
use monorig_estimators::Real;
use monorig_estimators::filters::forgetting::Forgetting;
use monorig_estimators::filters::gaussian::Gaussian;
use monorig_estimators::filters::imm::Imm;
use monorig_estimators::filters::rls::Rls;
use monorig_estimators::filters::sage_husa::SageHusa;
use monorig_estimators::filters::strong_tracking::{Alarm, StrongTracking, fade};
use monorig_estimators::filters::ukf::Spread;
use monorig_estimators::filters::{ekf, ukf};
use nalgebra::{Matrix1, Matrix2, Matrix3, SMatrix, SVector, Vector2, matrix, vector};

const RUNS: usize = 100;
const INSTANTS: usize = 20;
const STEPS_BETWEEN: usize = 25;
const SPREAD: Spread = Spread {
    alpha: 1.0,
    beta: 2.0,
    kappa: 1.0,
};

fn nees<const N: usize>(belief: &Gaussian<N>, truth: &SVector<Real, N>) -> Real {
    let error = belief.x - truth;
    error.dot(&belief.P.cholesky().unwrap().solve(&error))
}

/// One run: a step of truth and filter; the NIS of the step and the NEES after it.
trait Run {
    const STATES: usize;
    fn start(random: Random) -> Self;
    fn step(&mut self) -> (Real, Real);
}

/// Mean NEES over its degrees of freedom at each instant, and mean NIS.
fn averages<R: Run>(seed: u64) -> ([Real; INSTANTS], Real) {
    let mut errors = [0.0; INSTANTS];
    let mut innovations = 0.0;
    for run in 0..RUNS {
        let mut filter = R::start(Random::new(seed * 10_000 + run as u64));
        for at_instant in &mut errors {
            let mut last = 0.0;
            for _ in 0..STEPS_BETWEEN {
                let (nis, nees) = filter.step();
                innovations += nis;
                last = nees;
            }
            *at_instant += last;
        }
    }
    let nees = errors.map(|sum| sum / (RUNS * R::STATES) as Real);
    (
        nees,
        innovations / (RUNS * INSTANTS * STEPS_BETWEEN) as Real,
    )
}

/// Means of NEES over all instants but the first five, when the start is forgotten, and of NIS.
fn settled<R: Run>(seed: u64) -> (Real, Real) {
    let (nees, nis) = averages::<R>(seed);
    let late = &nees[5..];
    let nees = late.iter().sum::<Real>() / late.len() as Real;
    println!("mean NEES {nees:.4}, NIS {nis:.4}");
    (nees, nis)
}

/// Number of the instants in the NEES band, and true if the mean NIS is in its band.
fn consistency<R: Run>(seed: u64) -> (usize, bool) {
    let (nees, nis) = averages::<R>(seed);
    let (low, high) = chi_square_band(RUNS * R::STATES);
    let inside = nees.iter().filter(|n| (low..high).contains(*n)).count();
    let (low, high) = chi_square_band(RUNS * INSTANTS * STEPS_BETWEEN);
    println!("NEES inside at {inside} of {INSTANTS} instants, NIS {nis:.4} in {low:.4}…{high:.4}");
    (inside, (low..high).contains(&nis))
}

fn assert_consistent<R: Run>(seed: u64) {
    let (inside, nis) = consistency::<R>(seed);
    assert!(
        inside >= 17,
        "NEES in its band at {inside} of {INSTANTS} instants only"
    );
    assert!(nis, "NIS outside its band");
}

/// Variance of the measured position.
const POSITION_NOISE: Real = 0.04;

/// Noises that a filter adapts.
const NOTHING: u8 = 0;
const NOISE: u8 = 1;
const FADING: u8 = 2;

/// Constant velocity, position measured; the filter assumes `BELIEVED`/100 of the true process noise, and may adapt.
struct Kalman<const BELIEVED: usize, const ADAPTS: u8 = NOTHING> {
    random: Random,
    noise: SageHusa<1>,
    tracking: (StrongTracking<1>, Alarm<1>),
    truth: Vector2<Real>,
    belief: Gaussian<2>,
}

impl<const BELIEVED: usize, const ADAPTS: u8> Run for Kalman<BELIEVED, ADAPTS> {
    const STATES: usize = 2;

    fn start(mut random: Random) -> Self {
        let belief = Gaussian::independent(vector![0.0, 1.0], vector![0.5, 0.3]);
        let truth = belief.x + vector![0.5 * random.normal(), 0.3 * random.normal()];
        Self {
            random,
            noise: SageHusa::new(Matrix1::new(POSITION_NOISE), 0.99, [0.01, 100.0]),
            tracking: (StrongTracking::new(0.95, 2.0, 50.0), Alarm::new(3.0)),
            truth,
            belief,
        }
    }

    fn step(&mut self) -> (Real, Real) {
        let (dt, q, r): (Real, Real, Real) = (0.1, 0.05, POSITION_NOISE);
        let F = matrix![1.0, dt; 0.0, 1.0];
        let random = &mut self.random;
        // White acceleration over the step: its effects on position and speed share one root.
        let (a, b) = (random.normal(), random.normal());
        let root = (q * dt).sqrt();
        self.truth = F * self.truth + vector![root * dt * (0.5 * a + b / 12f64.sqrt()), root * a];
        let z = self.truth.x + r.sqrt() * random.normal();

        let Q = matrix![dt * dt * dt / 3.0, dt * dt / 2.0; dt * dt / 2.0, dt]
            * (q * BELIEVED as Real / 100.0);
        let H = matrix![1.0, 0.0];
        let noise = if ADAPTS == NOISE {
            *self.noise.covariance()
        } else {
            Matrix1::new(r)
        };
        if ADAPTS == FADING {
            let y = vector![z] - H * (F * self.belief.x);
            let carried = H * (F * self.belief.P * F.transpose()) * H.transpose();
            let process = H * Q * H.transpose();
            let lambda = self.tracking.0.fading(&y, &carried, &process, &noise);
            if self.tracking.1.active(&y, &(carried + process + noise)) {
                fade(&mut self.belief, &vector![1.0, lambda]);
            }
        }
        let x_next = F * self.belief.x;
        ekf::predict(&mut self.belief, x_next, &F, &Q);
        let z_predicted = H * self.belief.x;
        let done = ekf::update(&mut self.belief, vector![z], z_predicted, &H, &noise).unwrap();
        if ADAPTS == NOISE {
            let residual = vector![z] - H * self.belief.x;
            self.noise.observe_residual(&residual, &H, &self.belief);
        }
        (done.nis, nees(&self.belief, &self.truth))
    }
}

#[test]
fn kalman_filter() {
    assert_consistent::<Kalman<100>>(1);
}

#[test]
fn a_filter_that_believes_too_little_or_too_much_noise_is_found_out() {
    for (inside, nis) in [consistency::<Kalman<25>>(2), consistency::<Kalman<400>>(2)] {
        assert!(inside < 10 && !nis);
    }
}

#[test]
fn sage_husa_is_about_consistent() {
    let (nees, nis) = settled::<Kalman<100, NOISE>>(7);
    assert!((0.9..1.1).contains(&nees) && (0.9..1.1).contains(&nis));
}

#[test]
fn strong_tracking_leaves_a_consistent_filter_alone() {
    let (nees, nis) = settled::<Kalman<100, FADING>>(8);
    assert!((0.95..1.02).contains(&nees) && (0.95..1.02).contains(&nis));
}

const DT: Real = 0.02;
/// Process noise of a pendulum's rate, and noise of the sine of its angle.
const Q_RATE: Real = 1e-3;
const R_SINE: Real = 1e-3;

fn pendulum(x: &Vector2<Real>) -> Vector2<Real> {
    vector![x.x + DT * x.y, x.y - DT * 4.0 * x.x.sin()]
}

fn pendulum_noise() -> Matrix2<Real> {
    matrix![0.0, 0.0; 0.0, Q_RATE * DT]
}

/// A pendulum whose sine is measured, tracked by an extended (`false`) or unscented (`true`) filter.
struct Pendulum<const UNSCENTED: bool> {
    random: Random,
    truth: Vector2<Real>,
    belief: Gaussian<2>,
}

fn extended_step(belief: &mut Gaussian<2>, z: Real) -> Real {
    let F = matrix![1.0, DT; -DT * 4.0 * belief.x.x.cos(), 1.0];
    let x_next = pendulum(&belief.x);
    ekf::predict(belief, x_next, &F, &pendulum_noise());
    let H = matrix![belief.x.x.cos(), 0.0];
    let z_predicted = vector![belief.x.x.sin()];
    ekf::update(belief, vector![z], z_predicted, &H, &Matrix1::new(R_SINE))
        .unwrap()
        .nis
}

fn unscented_step(belief: &mut Gaussian<2>, z: Real) -> Real {
    ukf::predict(belief, &SPREAD, pendulum, &pendulum_noise()).unwrap();
    let sine = |x: &Vector2<Real>| vector![x.x.sin()];
    ukf::update(belief, &SPREAD, vector![z], sine, &Matrix1::new(R_SINE))
        .unwrap()
        .nis
}

impl<const UNSCENTED: bool> Run for Pendulum<UNSCENTED> {
    const STATES: usize = 2;

    fn start(mut random: Random) -> Self {
        let belief = Gaussian::independent(vector![0.3, 0.0], vector![0.05, 0.05]);
        let truth = belief.x + vector![0.05 * random.normal(), 0.05 * random.normal()];
        Self {
            random,
            truth,
            belief,
        }
    }

    fn step(&mut self) -> (Real, Real) {
        let random = &mut self.random;
        self.truth = pendulum(&self.truth) + vector![0.0, (Q_RATE * DT).sqrt() * random.normal()];
        let z = self.truth.x.sin() + R_SINE.sqrt() * random.normal();
        let nis = if UNSCENTED {
            unscented_step(&mut self.belief, z)
        } else {
            extended_step(&mut self.belief, z)
        };
        (nis, nees(&self.belief, &self.truth))
    }
}

#[test]
fn extended_kalman_filter() {
    assert_consistent::<Pendulum<false>>(3);
}

#[test]
fn unscented_kalman_filter() {
    assert_consistent::<Pendulum<true>>(4);
}

/// A random walk whose noise switches like a Markov chain. NEES and NIS are those of the combined belief.
struct Switching {
    random: Random,
    truth: Real,
    busy: bool,
    imm: Imm<1, 2>,
}

impl Run for Switching {
    const STATES: usize = 1;

    fn start(mut random: Random) -> Self {
        let belief = Gaussian::independent(vector![0.0], vector![1.0]);
        Self {
            truth: random.normal(),
            busy: random.chance(0.5),
            random,
            imm: Imm::new(belief, 0.95, false),
        }
    }

    fn step(&mut self) -> (Real, Real) {
        let (q, r): ([Real; 2], Real) = ([0.02, 0.1], 0.2);
        let random = &mut self.random;
        self.busy ^= random.chance(0.05);
        self.truth += q[usize::from(self.busy)].sqrt() * random.normal();
        let z = self.truth + r.sqrt() * random.normal();
        self.imm.mix();
        for (belief, q) in self.imm.beliefs.iter_mut().zip(q) {
            belief.P.x += q;
        }
        let predicted = self.imm.combined();
        let nis = (z - predicted.x.x).powi(2) / (predicted.P.x + r);
        let mut logs = Vector2::zeros();
        for (belief, log) in self.imm.beliefs.iter_mut().zip(logs.iter_mut()) {
            let y = z - belief.x.x;
            *log = belief
                .correct_scalar(y, &vector![1.0], r)
                .unwrap()
                .log_likelihood;
        }
        self.imm.weigh(&logs);
        (nis, nees(&self.imm.combined(), &vector![self.truth]))
    }
}

#[test]
fn interacting_multiple_models() {
    assert_consistent::<Switching>(5);
}

/// Least squares that keeps `KEPT`/100 of the weight, parameters drawn from the prior.
struct LeastSquares<const KEPT: usize> {
    random: Random,
    truth: SVector<Real, 3>,
    rls: Rls<3>,
}

impl<const KEPT: usize> Run for LeastSquares<KEPT> {
    const STATES: usize = 3;

    fn start(mut random: Random) -> Self {
        let prior = Gaussian::independent(vector![1.0, -2.0, 0.5], vector![2.0, 0.5, 1.0]);
        let draw = SVector::from_fn(|_, _| random.normal());
        let sd: SVector<Real, 3> = prior.P.diagonal().map(Real::sqrt);
        Self {
            truth: prior.x + sd.component_mul(&draw),
            rls: Rls::new(prior, Forgetting::Constant(KEPT as Real / 100.0)),
            random,
        }
    }

    fn step(&mut self) -> (Real, Real) {
        let r: Real = 0.5;
        let random = &mut self.random;
        let h = vector![1.0, random.normal(), 3.0 * random.normal()];
        let y = h.dot(&self.truth) + r.sqrt() * random.normal();
        let outcome = self.rls.update(y, &h, r, false).unwrap();
        (
            outcome.normalised * outcome.normalised,
            nees(&self.rls.belief, &self.truth),
        )
    }
}

#[test]
fn least_squares_without_forgetting() {
    assert_consistent::<LeastSquares<100>>(6);
}

#[test]
fn least_squares_with_forgetting_is_as_wrong_about_constants_as_theory_says() {
    let (nees, _) = settled::<LeastSquares<95>>(9);
    assert!((0.95..1.05).contains(&(nees * 1.95)), "{nees}");
}

#[test]
fn extended_and_unscented_filters_agree_on_a_nearly_linear_model() {
    // A pendulum near its rest is linear but for θ³/6: at 0.01 rad the filters may differ by millionths of that.
    let mut random = Random::new(7);
    let mut extended = Gaussian::independent(vector![0.01, 0.0], vector![0.002, 0.002]);
    let mut unscented = extended;
    let mut truth: Vector2<Real> = extended.x;
    let (mut most, mut moved) = (0.0, 0.0);
    for _ in 0..2000 {
        truth = pendulum(&truth);
        let z = truth.x.sin() + 1e-3 * random.normal();
        extended_step(&mut extended, z);
        unscented_step(&mut unscented, z);
        let sd = extended.P.diagonal().map(Real::sqrt);
        most = (extended.x - unscented.x)
            .component_div(&sd)
            .amax()
            .max(most);
        most = ((extended.P - unscented.P).amax() / extended.P.amax()).max(most);
        moved = extended.x.amax().max(moved);
    }
    assert!(most < 0.01, "{most} standard deviations apart");
    assert!(
        most > 0.0 && moved > 0.005,
        "the comparison compares nothing"
    );
}

#[test]
fn extended_and_unscented_filters_differ_where_the_model_is_not_linear() {
    let belief = Gaussian::independent(vector![1.3, 0.0], vector![0.5, 0.1]);
    let (mut extended, mut unscented) = (belief, belief);
    extended_step(&mut extended, 0.9);
    unscented_step(&mut unscented, 0.9);
    assert!((extended.x - unscented.x).norm() > 0.01);
}

#[test]
fn closed_form_of_the_varying_transitions_equals_the_product_form() {
    let mut random = Random::new(8);
    let belief = Gaussian::<1>::independent(vector![0.0], vector![1.0]);
    let stay = 0.9;
    let mut imm = Imm::<1, 3>::new(belief, stay, true);
    let away = (1.0 - stay) / 2.0;
    let mut product = matrix![stay, away, away; away, stay, away; away, away, stay];
    let mut before = *imm.probability();
    let mut most: Real = 0.0;
    for _ in 0..5000 {
        imm.weigh(&SVector::from_fn(|_, _| 3.0 * random.normal()));
        let now = *imm.probability();
        for i in 0..3 {
            let leaned = product
                .row(i)
                .zip_map(&(now - before).transpose(), |p, change| p * change.exp());
            product.set_row(i, &(leaned / leaned.sum()));
        }
        before = now;
        assert!((imm.transition() - product).amax() < 1e-9);
        for row in imm.transition().row_iter() {
            assert!((row.sum() - 1.0).abs() < 1e-12);
        }
        most = (imm.transition()[(0, 0)] - stay).abs().max(most);
    }
    assert!(most > 0.01, "the transitions never moved");
}

fn assert_covariance<const N: usize>(P: &SMatrix<Real, N, N>, of: &str, step: usize) {
    assert_eq!(*P, P.transpose(), "{of} at step {step} is not symmetric");
    assert!(
        P.cholesky().is_some(),
        "{of} at step {step} is not positive definite: {P}"
    );
}

/// A transition near identity, a measurement row, a noise variance over ten decades.
fn random_model(random: &mut Random) -> (Matrix3<Real>, SVector<Real, 3>, Real) {
    (
        Matrix3::identity() + Matrix3::from_fn(|_, _| 0.05 * random.normal()),
        SVector::from_fn(|i, _| 10f64.powi(i as i32 - 1) * random.normal()),
        10f64.powf(-6.0 + 10.0 * random.uniform()),
    )
}

const STEPS: usize = 20_000;

#[test]
fn covariances_of_the_filters_stay_symmetric_and_positive_definite() {
    let mut random = Random::new(9);
    let prior = Gaussian::independent(SVector::<Real, 3>::zeros(), vector![100.0, 1.0, 0.01]);
    let most = vector![1e6, 1e4, 1e2];
    let Q = Matrix3::from_diagonal(&vector![1e-6, 1e-7, 1e-8]);
    let (mut extended, mut unscented) = (prior, prior);
    let mut imm = Imm::<3, 2>::new(prior, 0.9, true);
    let mut noise = SageHusa::new(matrix![1.0, 0.2; 0.2, 2.0], 0.98, [0.01, 100.0]);
    for step in 0..STEPS {
        let (F, h, r) = random_model(&mut random);
        let (z, R) = (10.0 * random.normal(), Matrix1::new(r));
        let H = h.transpose();

        let x_next = F * extended.x;
        ekf::predict(&mut extended, x_next, &F, &Q);
        if step % 10 == 0 {
            fade(&mut extended, &vector![1.0, 3.0, 10.0]);
        }
        extended.limit_variance(&most);
        assert_covariance(&extended.P, "extended, predicted", step);
        let z_predicted = H * extended.x;
        ekf::update(&mut extended, vector![z], z_predicted, &H, &R).unwrap();
        assert_covariance(&extended.P, "extended, corrected", step);

        let bend = |x: &SVector<Real, 3>| F * x + vector![0.0, 0.1 * x.x.sin(), 0.0];
        ukf::predict(&mut unscented, &SPREAD, bend, &Q).unwrap();
        unscented.limit_variance(&most);
        assert_covariance(&unscented.P, "unscented, predicted", step);
        ukf::update(&mut unscented, &SPREAD, vector![z], |x| H * x, &R).unwrap();
        assert_covariance(&unscented.P, "unscented, corrected", step);

        imm.mix();
        let mut logs = Vector2::zeros();
        for ((belief, log), scale) in imm
            .beliefs
            .iter_mut()
            .zip(logs.iter_mut())
            .zip([1.0, 100.0])
        {
            let x_next = F * belief.x;
            ekf::predict(belief, x_next, &F, &(Q * scale));
            belief.limit_variance(&most);
            let z_predicted = H * belief.x;
            *log = ekf::update(belief, vector![z], z_predicted, &H, &R)
                .unwrap()
                .log_likelihood;
        }
        imm.weigh(&logs);
        assert_covariance(&imm.combined().P, "interacting models", step);

        let residual = vector![z, 0.1 * z + random.normal()];
        let pick = matrix![1.0, 0.0, 0.0; 0.0, 1.0, 0.0];
        noise.observe_residual(&residual, &pick, &extended);
        assert_covariance(noise.covariance(), "Sage-Husa noise", step);
    }
}

#[test]
fn covariances_of_least_squares_stay_symmetric_and_positive_definite() {
    for policy in [
        Forgetting::None,
        Forgetting::Constant(0.9),
        Forgetting::Dynamic {
            floor: 0.8,
            sharpness: 2.0,
            first: 0.98,
        },
        Forgetting::Multiple([0.99, 0.9, 0.8]),
        Forgetting::TimeLaw {
            loss: 0.05,
            decay: 0.98,
        },
    ] {
        let mut random = Random::new(10);
        let prior = Gaussian::independent(SVector::zeros(), vector![100.0, 10.0, 1.0]);
        let mut rls = Rls::<3>::new(prior, policy);
        for step in 0..STEPS {
            let (_, h, r) = random_model(&mut random);
            // Long stretches with one and the same regressor: where a forgetting recursion winds up.
            let h = if step % 1000 < 500 {
                h
            } else {
                vector![1.0, 0.0, 0.0]
            };
            rls.update(10.0 * random.normal(), &h, r, false).unwrap();
            assert_covariance(&rls.belief.P, "least squares", step);
            for (variance, most) in rls
                .belief
                .P
                .diagonal()
                .iter()
                .zip(prior.P.diagonal().iter())
            {
                assert!(*variance <= most * (1.0 + 1e-12), "{policy:?} winds up");
            }
            if step % 777 == 0 {
                rls.reset_to_prior(&vector![1.0, 0.0, 0.0]);
                assert_covariance(&rls.belief.P, "reopened least squares", step);
            }
        }
    }
}
