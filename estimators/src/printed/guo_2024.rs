//! `imm_stf_printed`: Guo, Wang, Zhao & Dai 2024, as printed.
//!
//! - `eq1`: traction times η = |a_x|/√(a_x² + a_y²), always
//! - `eq3`, `eq4`: the mass, see [`guo_2024_mass`](crate::printed::guo_2024_mass)
//! - `eq10`: the derivative of the accelerometer as input beside the accelerometer as measurement
//! - `eq11`: the full difference a_sen − a as input (also eq. 15), which contradicts a_sen = a + g i
//! - `eq16`: the force balance in the row of i, so that i has no memory; right: in that of a
//! - `eq23`: index j under the sum over i (also eq. 24): the models never mix
//! - `eq28`: fading by raw traces of unlike units, of P as it was after the last measurement, without end
//!
//! S^½ in eq. 32 has no meaning for a matrix: |S|^½ is taken. The state update that eq. 29–31 leave out is made.

use nalgebra::{Matrix2, Matrix3, SMatrix, Vector2, Vector3, matrix, vector};

use crate::api::estimator::Internal;
use crate::api::params::{param_groups, params};
use crate::api::reading::Reading;
use crate::api::real::{GRAVITY, PI, asin, exp, sqrt};
use crate::api::signals::{Estimate, Vehicle};
use crate::filters::gaussian::Gaussian;
use crate::filters::strong_tracking::{Alarm, StrongTracking, fade};
use crate::models::force_balance::ForceBalance;
use crate::preprocess::front_end::motion;
use crate::printed::guo_2024_mass::{DifferencesPrinted, MassFromDifferences};
use crate::printed::{Erratum, PrintedAnswer, usable};
use crate::runner::{Pipeline, copy_into};
use crate::{Real, Time};

params! {
    /// Switches and constants of `imm_stf_printed`.
    Own {
        eq1 [choice Erratum] = Erratum::Printed, "Printed: traction times η, always.";
        eq10 [choice Erratum] = Erratum::Printed, "Printed: derivative of the accelerometer as input.";
        eq11 [choice Erratum] = Erratum::Printed, "Printed: full difference a_sen − a as input.";
        eq16 [choice Erratum] = Erratum::Printed, "Printed: force balance in the row of i.";
        eq23 [choice Erratum] = Erratum::Printed, "Printed: models do not mix.";
        eq28 [choice Erratum] = Erratum::Printed, "Printed: fading by raw traces, without a limit; corrected: whitened, limited, on alarm.";
        stay ["-"] = 0.95, 0.5 => 0.999999, "Probability of staying in a model, at the start.";
        memory ["-"] = 0.95, 0.0 => 1.0, "Memory λ of the innovation covariance.";
        weakening ["-"] = 1.0, 1.0 => 100.0, "Weakening factor α.";
        q_v ["m²/s³"] = 1e-6, 1e-12 => 10.0, "Process noise of speed.";
        q_a ["m²/s⁵"] = 0.3, 1e-9 => 100.0, "Process noise of acceleration.";
        q_i ["1/s"] = 5e-4, 1e-12 => 1.0, "Process noise of i.";
        accel_sd_mps2 ["m/s²"] = 0.02, 1e-4 => 10.0, "Standard deviation of the specific force.";
        wheel_speed_sd_mps ["m/s"] = 0.005, 1e-6 => 10.0, "Standard deviation of wheel speed.";
        grade0_sd_deg ["deg"] = 5.0, 0.001 => 90.0, "Standard deviation of the grade angle at the start.";
    }
}

param_groups! {
    /// Parameters of `imm_stf_printed`.
    Params { own: Own, mass: DifferencesPrinted }
}

/// Speed below which the train stands, m/s.
const STANDSTILL_MPS: Real = 0.05;
/// Right fading: largest factor, level of the alarm.
const RIGHT_FADING: (Real, Real) = (50.0, 3.0);
/// Of the dynamic model: what the force balance leaves out, m/s².
const BALANCE_SD: Real = 0.03;

#[derive(Clone, Copy, Debug, PartialEq)]
struct ModelState {
    belief: Gaussian<3>,
    /// After the last measurement, before mixing.
    last_P: Matrix3<Real>,
    last_a: Real,
    V: Option<Matrix2<Real>>,
    right: (StrongTracking<2>, Alarm<2>),
    fading: Real,
}

/// The pipeline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImmStfPrinted {
    own: Own,
    balance: ForceBalance,
    mu: Real,
    mass: MassFromDifferences,
    last_felt: Option<Real>,
    /// Kinematic, dynamic.
    models: [ModelState; 2],
    start: ModelState,
    probability: Vector2<Real>,
    transition: Matrix2<Real>,
    started: bool,
    since_s: Real,
    innovation: (Real, Real),
    breakdowns: Real,
}

/// Builds the estimator from the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> ImmStfPrinted {
    let own = params.own;
    let sd = own.grade0_sd_deg * PI / 180.0;
    let belief = Gaussian::independent(Vector3::zeros(), vector![own.wheel_speed_sd_mps, 0.5, sd]);
    let (most, level) = RIGHT_FADING;
    let start = ModelState {
        belief,
        last_P: belief.P,
        last_a: 0.0,
        V: None,
        right: (
            StrongTracking::new(own.memory, own.weakening, most),
            Alarm::new(level),
        ),
        fading: 1.0,
    };
    let leave = 1.0 - own.stay;
    ImmStfPrinted {
        own,
        balance: ForceBalance::new(vehicle),
        mu: vehicle.running_resistance,
        mass: MassFromDifferences::new(vehicle, params.mass),
        last_felt: None,
        models: [start; 2],
        start,
        probability: Vector2::repeat(0.5),
        transition: matrix![own.stay, leave; leave, own.stay],
        started: false,
        since_s: 0.0,
        innovation: (0.0, 0.0),
        breakdowns: 0.0,
    }
}

/// z = [a_sen, v] = H x.
fn measurement() -> SMatrix<Real, 2, 3> {
    matrix![0.0, 1.0, GRAVITY; 1.0, 0.0, 0.0]
}

impl ImmStfPrinted {
    /// A, u and Q of the kinematic (0) or the dynamic (1) model, without Δ.
    fn model(
        &self,
        dynamic: bool,
        force: Real,
        direction: Real,
        dt: Real,
    ) -> (Matrix3<Real>, Vector3<Real>, Matrix3<Real>) {
        let own = &self.own;
        let [v, a, i] = [own.q_v * dt, own.q_a * dt, own.q_i * dt];
        let m = self.mass.kg().0;
        let resistance = direction * self.mu * GRAVITY;
        if !dynamic {
            let A = matrix![1.0, dt, 0.0; 0.0, 1.0, 0.0; 0.0, 0.0, 1.0];
            return (
                A,
                Vector3::zeros(),
                Matrix3::from_diagonal(&vector![v, a, i]),
            );
        }
        if own.eq16.is_printed() {
            let A = matrix![1.0, dt, 0.0; 0.0, 1.0, 0.0; 0.0, -1.0 / GRAVITY, 0.0];
            let u = vector![0.0, 0.0, (force / m - resistance) / GRAVITY];
            return (A, u, Matrix3::from_diagonal(&vector![v, a, i]));
        }
        let inertia = 1.0 + self.balance.rotating_mass_kg / m;
        let A = matrix![1.0, dt, 0.0; 0.0, 0.0, -GRAVITY / inertia; 0.0, 0.0, 1.0];
        let u = vector![0.0, (force / m - resistance) / inertia, 0.0];
        let sd = BALANCE_SD / inertia;
        (A, u, Matrix3::from_diagonal(&vector![v, sd * sd, i]))
    }

    /// Eq. 20–38.
    fn cycle(&mut self, force: Option<Real>, z: &Vector2<Real>, dt: Real) -> Option<()> {
        let own = self.own;
        let direction = if z.y < 0.0 { -1.0 } else { 1.0 };
        let H = measurement();
        let R = Matrix2::from_diagonal(&vector![
            own.accel_sd_mps2 * own.accel_sd_mps2,
            own.wheel_speed_sd_mps * own.wheel_speed_sd_mps
        ]);
        let predicted = self.transition.transpose() * self.probability;
        let mixed = self.mix(&predicted);
        let felt_rate = self.last_felt.map_or(0.0, |last| (z.x - last) / dt);
        let mut next = self.models;
        let mut logs = Vector2::zeros();
        let places = next.iter_mut().zip(logs.iter_mut()).zip(mixed);
        for (((model, log), from), dynamic) in places.zip([false, true]) {
            // Without a force balance both are the kinematic model.
            let (A, mut u, Q) = self.model(
                dynamic && force.is_some(),
                force.unwrap_or(0.0),
                direction,
                dt,
            );
            if own.eq10.is_printed() && !dynamic {
                u.z += (felt_rate * dt - (from.x.y - model.last_a)) / GRAVITY;
            }
            if own.eq11.is_printed() {
                // a_sen and a of the step before.
                let away = self.last_felt.unwrap_or(z.x) - from.x.y;
                u += vector![dt * away, away, 0.0];
            }
            model.last_a = from.x.y;
            let mut belief = from;
            belief.x = A * from.x + u;
            let y = z - H * belief.x;
            let carried = A * from.P * A.transpose();
            if own.eq28.is_printed() {
                let square = y * y.transpose();
                let V = model
                    .V
                    .map_or(square, |V| (V * own.memory + square) / (1.0 + own.memory));
                model.V = Some(V);
                let M = (V - H * Q * H.transpose() - R * own.weakening).trace();
                let N = (H * A * model.last_P * A.transpose() * H.transpose()).trace();
                model.fading = (M / N).max(1.0);
                belief.P = carried * model.fading + Q;
            } else {
                let (tracking, alarm) = &mut model.right;
                let (seen, process) = (H * carried * H.transpose(), H * Q * H.transpose());
                let lambda = tracking.fading(&y, &seen, &process, &R);
                let jumped = alarm.active(&y, &(seen + process + R));
                model.fading = if jumped { lambda } else { 1.0 };
                fade(&mut belief, &vector![1.0, 1.0, model.fading]);
                belief.P = A * belief.P * A.transpose() + Q;
            }
            belief.symmetrise();
            let correction = belief.correct(y, &H, &R)?;
            *log = correction.log_likelihood;
            self.innovation = (y.y, correction.nis / 2.0);
            (model.belief, model.last_P) = (belief, belief.P);
            usable(belief.x.iter().chain(&belief.P)).then_some(())?;
        }
        let largest = logs.max();
        let weighed = logs.map(|log| exp(log - largest)).component_mul(&predicted);
        let probability = (weighed / weighed.sum()).map(|p| p.max(1e-4));
        let probability = probability / probability.sum();
        let lean = (probability - self.probability).map(exp);
        let mut transition = self.transition * Matrix2::from_diagonal(&lean);
        for mut row in transition.row_iter_mut() {
            let sum = row.sum();
            row /= sum;
        }
        usable(probability.iter().chain(&transition)).then_some(())?;
        (self.models, self.probability, self.transition) = (next, probability, transition);
        Some(())
    }

    /// Eq. 22–24.
    fn mix(&self, predicted: &Vector2<Real>) -> [Gaussian<3>; 2] {
        let beliefs = self.models.map(|model| model.belief);
        if self.own.eq23.is_printed() {
            return beliefs;
        }
        let mut mixed = beliefs;
        let columns = self.transition.column_iter();
        for ((belief, from), c) in mixed.iter_mut().zip(columns).zip(predicted) {
            *belief = mixture(&beliefs, &(self.probability.component_mul(&from) / *c));
        }
        mixed
    }
}

/// Eq. 34–35.
fn mixture(beliefs: &[Gaussian<3>; 2], weights: &Vector2<Real>) -> Gaussian<3> {
    let [a, b] = beliefs;
    let x = a.x * weights.x + b.x * weights.y;
    let about = |g: &Gaussian<3>| g.P + (g.x - x) * (g.x - x).transpose();
    Gaussian {
        x,
        P: about(a) * weights.x + about(b) * weights.y,
    }
}

impl Pipeline for ImmStfPrinted {
    const INTERNALS: &'static [Internal] = &[
        Internal::new("dynamic_model_probability", "-"),
        Internal::new("kinematic_i", "-"),
        Internal::new("dynamic_i", "-"),
        Internal::new("kinematic_fading", "-"),
        Internal::new("dynamic_fading", "-"),
        Internal::new("breakdowns", "-"),
    ];

    fn advance(&mut self, reading: &Reading, t: Time, dt: Real) -> Estimate {
        let (moving, running) = motion(reading, STANDSTILL_MPS);
        self.since_s += dt;
        if let Some((speed, felt)) = reading.new_speed_mps.zip(reading.specific_force_mps2) {
            let period = self.since_s.min(1.0);
            self.since_s = 0.0;
            let across = reading.lateral_force_mps2.unwrap_or(0.0);
            let total = sqrt(felt * felt + across * across);
            let eta = if self.own.eq1.is_printed() && total > 0.0 {
                felt.abs() / total
            } else {
                1.0
            };
            let force = reading
                .motor_torque_nm
                .filter(|_| running)
                .map(|torque| self.balance.net_traction(torque, speed) * eta);
            if let Some(force) = force {
                self.mass.step(force, speed, felt, period);
            } else {
                self.mass.pause();
            }
            if !self.started {
                for model in &mut self.models {
                    model.belief.x.x = speed;
                }
                self.started = true;
            }
            if self.cycle(force, &vector![felt, speed], period).is_none() {
                self.models = [self.start; 2];
                for model in &mut self.models {
                    model.belief.x.x = speed;
                }
                self.probability = Vector2::repeat(0.5);
                self.breakdowns += 1.0;
            }
            self.last_felt = Some(felt);
        }
        let beliefs = self.models.map(|model| model.belief);
        let Gaussian { x, P } = mixture(&beliefs, &self.probability);
        let (innovation, nis) = self.innovation;
        PrintedAnswer {
            mass: self.mass.kg(),
            grade: (asin(x.z), P.m33),
            speed_mps: x.x,
            innovation,
            nis,
        }
        .estimate(t, moving, self.started)
    }

    fn internal_values(&self, values: &mut [Real]) {
        let [kinematic, dynamic] = &self.models;
        copy_into(
            values,
            &[
                self.probability.y,
                kinematic.belief.x.z,
                dynamic.belief.x.z,
                kinematic.fading.min(1e12),
                dynamic.fading.min(1e12),
                self.breakdowns + self.mass.breakdowns(),
            ],
        );
    }
}
