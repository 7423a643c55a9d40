//! Guo, Wang, Zhao & Dai, "Joint estimation of vehicle mass and road slope considering lateral motion", Journal of
//! Jilin University (Engineering) 2024: `imm_stf` and what is compared with it: fixed transitions, no lateral
//! correction, plain Kalman filters, each model alone. Mass by least squares on differences, slope by a kinematic and a
//! dynamic model that interact, each a strong tracking filter.
//!
//! The published method with its errata corrected and nothing else:
//!
//! - eq. 1: η = |a_x|/√(a_x² + a_y²) only while |a_y| > 0.5 and |a_x| > 0.3 m/s²; else 1 (in print it is 0/0 at steady
//!   speed and 0 in steady cornering). That the side force scales the traction is the method, and stays
//! - eq. 3: the rotating masses J taken off; differences only while the slope stays, |Δ(f − v̇)| small (dθ/dv̇ = 0 is
//!   otherwise false)
//! - eq. 4: differences of a quarter of a second of low-passed signals; of one sample they are noise
//! - eq. 10–12, 15: no derivative of the accelerometer as input beside it as measurement, Δ = 0
//! - eq. 16: the force balance in the row of a; in that of i the slope has no memory
//! - eq. 23, 24: index i under the sum; eq. 32: |S|^½, in logarithms ([`imm`](crate::filters::imm))
//! - eq. 28: fading by the mixed covariance of the step before and by traces in units of S
//!   ([`strong_tracking`](crate::filters::strong_tracking))
//!
//! ω, P₀, λ, α, π(0), Q, R and the gates are not given.

use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector2, Vector3, matrix, vector};

use crate::Real;
use crate::api::estimator::Internal;
use crate::api::params::params;
use crate::api::real::{GRAVITY, PI, asin, sin, sqrt, within};
use crate::api::snapshot::state;
use crate::api::vehicle::Vehicle;
use crate::filters::ekf::Ekf;
use crate::filters::forgetting::Forgetting;
use crate::filters::gaussian::{Correction, Gaussian};
use crate::filters::imm::Imm;
use crate::filters::model::{Model, Process};
use crate::filters::rls::{Outcome, Rls};
use crate::filters::strong_tracking::StrongTracking;
use crate::methods::method::{Answer, Found, Method, Signals};
use crate::models::force_balance::Drive;
use crate::models::sample::ResampledSample;

params! {
    /// The regression of eq. 2–7.
    Regression {
        omega ["-"] = 0.999, 0.5 => 1.0, "Forgetting factor ω, per difference.";
        mass0_kg ["kg"] = none, 1.0 => 1e6, "Total mass at the start; not set: the middle of the vehicle's mass range.";
        mass_sd ["-"] = 0.5, 0.001 => 10.0, "Standard deviation of this mass, as a share of the mass: P₀.";
        difference_sd_mps2 ["m/s²"] = 0.03, 1e-4 => 10.0, "Expected residual divided by the mass, the unit of P₀.";
        force_gate_mps2 ["m/s²"] = 0.1, 0.0 => 10.0, "Change of force divided by mass above which a difference is used.";
        slope_gate_mps2 ["m/s²"] = 0.2, 0.0 => 10.0, "Change of f − v̇ up to which the slope counts as constant.";
        cutoff_hz ["Hz"] = 2.0, 0.05 => 20.0, "Corner of the low-pass of force, speed and accelerometer.";
        rate_hz ["Hz"] = 4.0, 0.1 => 1000.0, "Rate of the samples whose differences are used.";
    }
}

params! {
    /// The models of eq. 8–17.
    Models {
        q_v ["m²/s³"] = 1e-6, 1e-12 => 10.0, "Process noise of speed.";
        q_a ["m²/s⁵"] = 0.3, 1e-9 => 100.0, "Process noise of acceleration, kinematic model.";
        q_i ["1/s"] = 5e-4, 1e-12 => 1.0, "Process noise of i.";
        force_sd_mps2 ["m/s²"] = 0.03, 1e-4 => 10.0, "Unmodelled force divided by the mass, dynamic model.";
        accel_sd_mps2 ["m/s²"] = 0.02, 1e-4 => 10.0, "Standard deviation of the specific force.";
        wheel_speed_sd_mps ["m/s"] = 0.005, 1e-6 => 10.0, "Standard deviation of wheel speed.";
        grade0_deg ["deg"] = 0.0, -60.0 => 60.0, "Grade angle at the start.";
        grade0_sd_deg ["deg"] = 5.0, 0.001 => 90.0, "Standard deviation of the grade angle at the start.";
    }
}

params! {
    /// Transitions between the models, eq. 20.
    Transitions {
        stay ["-"] = 0.95, 0.5 => 0.999999, "π₁₁ = π₂₂ at the start.";
    }
}

params! {
    /// Strong tracking, eq. 27 and 28.
    Tracking {
        memory ["-"] = 0.95, 0.0 => 1.0, "Forgetting factor λ of the innovation covariance.";
        weakening ["-"] = 5.0, 1.0 => 100.0, "Weakening factor α.";
    }
}

methods! {
    /// The method: strong tracking in both models, transitions that follow the likelier, lateral correction.
    imm_stf: ImmStfPublished = Guo2024<2>,
        { transitions: Transitions, models: Models, tracking: Tracking, mass: Regression },
        |vehicle, p| build(vehicle, &p.mass, &p.models, Choice { stay: p.transitions.stay, ..METHOD }, Some(p.tracking));
    /// The method with fixed transitions.
    imm_stf_fixed: ImmStfFixedPublished = Guo2024<2>,
        { transitions: Transitions, models: Models, tracking: Tracking, mass: Regression },
        |vehicle, p| build(vehicle, &p.mass, &p.models, Choice { stay: p.transitions.stay, time_varying: false, ..METHOD }, Some(p.tracking));
    /// The method without lateral correction.
    imm_stf_no_lateral: ImmStfNoLateralPublished = Guo2024<2>,
        { transitions: Transitions, models: Models, tracking: Tracking, mass: Regression },
        |vehicle, p| build(vehicle, &p.mass, &p.models, Choice { stay: p.transitions.stay, lateral: false, ..METHOD }, Some(p.tracking));
    /// The method with plain Kalman filters.
    imm_ekf: ImmEkfPublished = Guo2024<2>,
        { transitions: Transitions, models: Models, mass: Regression },
        |vehicle, p| build(vehicle, &p.mass, &p.models, Choice { stay: p.transitions.stay, ..METHOD }, None);
    /// The method with plain Kalman filters and fixed transitions.
    imm_ekf_fixed: ImmEkfFixedPublished = Guo2024<2>,
        { transitions: Transitions, models: Models, mass: Regression },
        |vehicle, p| build(vehicle, &p.mass, &p.models, Choice { stay: p.transitions.stay, time_varying: false, ..METHOD }, None);
}

methods! {
    /// The kinematic model alone.
    kinematic_stf: KinematicStfPublished = Guo2024<1>,
        { models: Models, tracking: Tracking, mass: Regression },
        |vehicle, p| build(vehicle, &p.mass, &p.models, alone(RampAcceleration::Kinematic), Some(p.tracking));
    /// The dynamic model alone.
    dynamic_stf: DynamicStfPublished = Guo2024<1>,
        { models: Models, tracking: Tracking, mass: Regression },
        |vehicle, p| build(vehicle, &p.mass, &p.models, alone(RampAcceleration::Dynamic), Some(p.tracking));
}

/// Settings by which the methods differ from each other.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Choice<const K: usize> {
    models: [RampAcceleration; K],
    stay: Real,
    time_varying: bool,
    lateral: bool,
}

const METHOD: Choice<2> = Choice {
    models: [RampAcceleration::Kinematic, RampAcceleration::Dynamic],
    stay: 0.95,
    time_varying: true,
    lateral: true,
};

fn alone(model: RampAcceleration) -> Choice<1> {
    Choice {
        models: [model],
        stay: 1.0,
        time_varying: false,
        lateral: true,
    }
}

/// Model of the acceleration: a random walk, or the force balance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RampAcceleration {
    /// Eq. 8–13.
    Kinematic,
    /// Eq. 14–17.
    Dynamic,
}

/// State [v, a, i], i = sin θ; measurement [a_sen, v].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RampModel {
    /// Choice of the kinematic or the dynamic model.
    pub acceleration: RampAcceleration,
    /// Rotating masses J reflected to the rim, kg.
    pub rotating_mass_kg: Real,
    /// Process noise of v (m²/s³), a (m²/s⁵) and i (1/s).
    pub q: [Real; 3],
    /// Standard deviation of the force balance divided by the mass, m/s².
    pub force_sd_mps2: Real,
}

impl RampModel {
    /// The drive of the dynamic model and its 1 + J/m.
    fn balance<'a>(&self, u: &'a Option<Drive>) -> Option<(&'a Drive, Real)> {
        let u = u
            .as_ref()
            .filter(|_| self.acceleration == RampAcceleration::Dynamic)?;
        Some((u, 1.0 + self.rotating_mass_kg / u.mass_kg))
    }
}

impl Process<3> for RampModel {
    /// `None` where there is no force balance: both models are then the kinematic one.
    type Input = Option<Drive>;

    fn f(&self, x: &Vector3<Real>, u: &Option<Drive>, dt: Real) -> Vector3<Real> {
        let a = self.balance(u).map_or(x.y, |(u, delta)| {
            (u.traction_n / u.mass_kg - GRAVITY * u.resistance - GRAVITY * x.z) / delta // eq. 14, 16
        });
        vector![x.x + dt * x.y, a, x.z] // eq. 12, 16
    }

    fn F(&self, _: &Vector3<Real>, u: &Option<Drive>, dt: Real) -> Matrix3<Real> {
        let kinematic = (1.0, 0.0);
        let (by_a, by_i) = self
            .balance(u)
            .map_or(kinematic, |(_, delta)| (0.0, -GRAVITY / delta));
        matrix![1.0, dt, 0.0; 0.0, by_a, by_i; 0.0, 0.0, 1.0] // eq. 12, 16: A
    }

    fn Q(&self, u: &Option<Drive>, dt: Real) -> Matrix3<Real> {
        let [q_v, q_a, q_i] = self.q;
        let force = self.balance(u).map(|(_, delta)| self.force_sd_mps2 / delta);
        let a = force.map_or(q_a * dt, |sd| sd * sd);
        Matrix3::from_diagonal(&vector![q_v * dt, a, q_i * dt])
    }
}

impl Model<3, 2> for RampModel {
    fn h(&self, x: &Vector3<Real>) -> Vector2<Real> {
        vector![x.y + GRAVITY * x.z, x.x] // eq. 8, 13, 17
    }

    fn H(&self, _: &Vector3<Real>) -> SMatrix<Real, 2, 3> {
        matrix![0.0, 1.0, GRAVITY; 1.0, 0.0, 0.0] // eq. 13, 17
    }
}

/// Lateral and longitudinal acceleration, m/s², from which on eq. 1 is used.
const CORNERING_MPS2: [Real; 2] = [0.5, 0.3];
/// Limits that keep the covariance finite while measurements are senseless: of the fading factor, which has none in
/// print, and in m/s, m/s² and i.
const MAX_FADING: Real = 1e4;
const USABLE_SD: [Real; 3] = [100.0, 100.0, 10.0];
/// Steepest road, as i.
const MAX_I: Real = 0.87;

/// Regression and interacting filters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guo2024<const K: usize> {
    mass0_kg: Real,
    range_kg: [Real; 2],
    rotating_mass_kg: Real,
    resistance: Real,
    r: Real,
    gates_mps2: [Real; 2],
    R: Matrix2<Real>,
    lateral: bool,
    /// m/m₀.
    rls: Rls<1>,
    before: Option<ResampledSample>,
    models: [RampModel; K],
    imm: Imm<3, K>,
    start: Gaussian<3>,
    tracking: [StrongTracking<2>; K],
    tracks: bool,
    fading: SVector<Real, K>,
    since_s: Real,
    started: bool,
    learnt: bool,
    outcome: Outcome,
    last: Option<Correction<2, 3>>,
}

impl<const K: usize> Guo2024<K> {
    fn eta(&self, z: &Signals) -> Real {
        let (a_x, a_y) = (z.acceleration_mps2, z.lateral_force_mps2.unwrap_or(0.0));
        let [across, along] = CORNERING_MPS2;
        if self.lateral && a_y.abs() > across && a_x.abs() > along {
            a_x.abs() / sqrt(a_x * a_x + a_y * a_y) // eq. 1
        } else {
            1.0
        }
    }

    fn learn(&mut self, now: &ResampledSample, eta: Real) -> Option<()> {
        let before = self.before.replace(*now)?;
        let phi = now.acceleration_mps2 - before.acceleration_mps2; // eq. 4
        let change = (now.force_n - before.force_n) * eta;
        let [considerable, stays] = self.gates_mps2;
        let slope = now.specific_force_mps2? - before.specific_force_mps2? - phi;
        if change.abs() < considerable * self.mass0_kg || slope.abs() > stays {
            return None;
        }
        let y = (change - self.rotating_mass_kg * phi) / self.mass0_kg; // eq. 3, 4
        self.outcome = self.rls.update(y, &vector![phi], self.r, false)?; // eq. 5–7
        self.learnt = true;
        Some(())
    }

    fn mass_kg(&self) -> Found {
        Found {
            value: self.rls.belief.x.x * self.mass0_kg,
            sd: sqrt(self.rls.widened().x) * self.mass0_kg,
            started: self.learnt,
        }
    }

    fn cycle(&mut self, u: &Option<Drive>, z: Vector2<Real>, dt: Real) {
        self.imm.mix(); // eq. 20–24
        let mut logs = SVector::<Real, K>::repeat(Real::NEG_INFINITY);
        let filters = self
            .imm
            .beliefs
            .iter_mut()
            .zip(self.models)
            .zip(&mut self.tracking);
        let outputs = logs.iter_mut().zip(self.fading.iter_mut());
        for (((belief, model), tracking), (log, fading)) in filters.zip(outputs) {
            let mut filter = Ekf::new(model, *belief);
            if self.tracks {
                *fading = tracking.predict(&mut filter, u, dt, z, &self.R); // eq. 25–29
            } else {
                filter.predict(u, dt);
            }
            filter
                .belief
                .limit_variance(&SVector::from(USABLE_SD.map(|sd| sd * sd)));
            if let Some(correction) = filter.update(z, &self.R) {
                *log = correction.log_likelihood; // eq. 30–32
                self.last = Some(correction);
            } else {
                filter.belief = self.start; // fading has left no covariance: start again
                filter.belief.x.x = z.y;
            }
            filter.belief.x.z = within(filter.belief.x.z, -MAX_I, MAX_I);
            *belief = filter.belief;
        }
        self.imm.weigh(&logs); // eq. 33, and 36–38 at the next eq. 20
    }
}

impl<const K: usize> Method for Guo2024<K> {
    const INTERNALS: &'static [Internal] = if K == 1 {
        &[
            Internal::new("mass_residual_n", "N"),
            Internal::new("fading", "-"),
        ]
    } else {
        &[
            Internal::new("mass_residual_n", "N"),
            Internal::new("kinematic_fading", "-"),
            Internal::new("dynamic_fading", "-"),
            Internal::new("dynamic_model_probability", "-"),
        ]
    };

    fn step(&mut self, z: &Signals) {
        let eta = self.eta(z);
        if z.traction_n.is_none() {
            self.before = None;
        }
        let _ = z.sample.and_then(|now| self.learn(&now, eta));
        self.since_s += z.dt;
        let (Some(v), Some(a_sen)) = (z.new_speed_mps, z.specific_force_mps2) else {
            return;
        };
        let dt = self.since_s.min(1.0);
        self.since_s = 0.0;
        if !self.started {
            self.imm
                .beliefs
                .iter_mut()
                .for_each(|belief| belief.x.x = v);
            self.started = true;
        }
        let [low, high] = self.range_kg;
        let drive = z.traction_n.map(|net_n| Drive {
            traction_n: (net_n + z.drag_n) * eta - z.drag_n, // eq. 1, 14: F_t η − F_w
            mass_kg: within(self.mass_kg().value, low, high),
            resistance: z.direction * self.resistance,
        });
        self.cycle(&drive, vector![a_sen, v], dt);
    }

    fn answer(&self) -> Answer {
        let Gaussian { x, P } = self.imm.combined(); // eq. 34, 35
        let found = |value, sd| Found {
            value,
            sd,
            started: self.last.is_some(),
        };
        Answer {
            mass_kg: Some(self.mass_kg()),
            grade_rad: found(asin(x.z), sqrt(P.m33) / sqrt(1.0 - x.z * x.z).max(0.1)),
            speed_mps: Some(found(x.x, sqrt(P.m11))),
            innovation: self.last.map_or((0.0, 0.0), |c| (c.y.y, c.nis / 2.0)),
        }
    }

    fn internal_values(&self, values: &mut [Real]) {
        let residual = core::iter::once(self.outcome.residual * self.mass0_kg);
        let last_model = self.imm.probability().iter().skip(1);
        let now = residual.chain(self.fading.iter().chain(last_model).copied());
        for (place, value) in values.iter_mut().zip(now) {
            *place = value;
        }
    }
}

state!(@[const K: usize] Guo2024<K> { rls, before, imm, tracking, fading, since_s, started, learnt, outcome, last;
    mass0_kg, range_kg, rotating_mass_kg, resistance, r, gates_mps2, R, lateral, models, start, tracks });

fn build<const K: usize>(
    vehicle: &Vehicle,
    mass: &Regression,
    p: &Models,
    choice: Choice<K>,
    tracking: Option<Tracking>,
) -> ([Real; 2], Guo2024<K>) {
    let rad = PI / 180.0;
    let x = vector![0.0, 0.0, sin(p.grade0_deg * rad)];
    let sd = vector![p.wheel_speed_sd_mps, 0.5, p.grade0_sd_deg * rad];
    let start = Gaussian::independent(x, sd);
    let Tracking { memory, weakening } = tracking.unwrap_or_default();
    let model = |acceleration| RampModel {
        acceleration,
        rotating_mass_kg: vehicle.rotating_mass_kg,
        q: [p.q_v, p.q_a, p.q_i],
        force_sd_mps2: p.force_sd_mps2,
    };
    let method = Guo2024 {
        mass0_kg: vehicle.first_mass_kg(mass.mass0_kg),
        range_kg: vehicle.mass_range_kg,
        rotating_mass_kg: vehicle.rotating_mass_kg,
        resistance: vehicle.running_resistance,
        r: mass.difference_sd_mps2 * mass.difference_sd_mps2,
        gates_mps2: [mass.force_gate_mps2, mass.slope_gate_mps2],
        R: Matrix2::from_diagonal(&vector![
            p.accel_sd_mps2 * p.accel_sd_mps2,
            p.wheel_speed_sd_mps * p.wheel_speed_sd_mps
        ]),
        lateral: choice.lateral,
        rls: Rls::new(
            Gaussian::independent(vector![1.0], vector![mass.mass_sd]),
            Forgetting::Constant(mass.omega),
        ),
        before: None,
        models: choice.models.map(model),
        imm: Imm::new(start, choice.stay, choice.time_varying),
        start,
        tracking: [StrongTracking::new(memory, weakening, MAX_FADING); K],
        tracks: tracking.is_some(),
        fading: SVector::repeat(1.0),
        since_s: 0.0,
        started: false,
        learnt: false,
        outcome: Outcome::default(),
        last: None,
    };
    ([mass.cutoff_hz, mass.rate_hz], method)
}
