//! Slope from the force balance: extended Kalman filter with state [v, θ] and wheel speed as its only measurement
//! (Liu et al. 2023, eq. 23–29, with sin θ and cos θ in place of θ and 1).
//!
//! v⁻ = v + dt v̇(F, M, θ, μ),  θ⁻ = θ,  z = v + noise
//!
//! Limits of this structure, whatever its tuning: it observes the slope only through traction, so an error of mass,
//! running resistance, torque or brake force is an error of slope (1 % of μ = 0.02 is 0.01°; 1 % of mass on a 10° grade
//! is 0.1°); it lags a change of slope by about a second, as a slope must first change the speed; standing or braking
//! there is no new information. The accelerometer, which reads the slope directly, is not used.

use nalgebra::{Matrix1, Matrix2, SMatrix, Vector1, Vector2, matrix, vector};

use crate::Real;
use crate::api::params::params;
use crate::api::reading::LearntNoise;
use crate::api::real::{GRAVITY, PI, sin_cos, sqrt};
use crate::api::snapshot::state;
use crate::detect::validity::Integrity;
use crate::filters::ekf::Ekf;
use crate::filters::gaussian::{Correction, Gaussian};
use crate::filters::model::{Model, Process};
use crate::filters::sage_husa::{Aekf, Noise, SageHusa};
use crate::instruments::gate::{Gate, Judgement, Passage};
use crate::models::force_balance::{Drive, ForceBalance, MAX_GRADE_RAD};

params! {
    /// Parameters of the slope filter.
    GradeParams {
        q_v ["m²/s³"] = 1e-4, 0.0 => 10.0, "Process noise of speed: unmodelled force per unit mass.";
        q_theta ["rad²/s"] = 1.5e-4, 0.0 => 10.0, "Process noise of the grade angle while moving.";
        grade0_deg ["deg"] = 0.0, -60.0 => 60.0, "Grade angle at the start.";
        grade0_sd_deg ["deg"] = 5.0, 0.001 => 90.0, "Standard deviation of the grade angle at the start.";
    }
}

/// Growth of the slope's variance by dead reckoning, rad²/s: 3° after a second, 14° after twenty.
const DEAD_RECKONING_RAD2_PER_S: Real = 3e-3;

/// The force balance as a model: state [v, θ], measurement wheel speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceBalanceModel {
    /// Constants of the balance.
    pub balance: ForceBalance,
    /// Process noise of v (m²/s³) and θ (rad²/s).
    pub q: [Real; 2],
}

impl Process<2> for ForceBalanceModel {
    type Input = Drive;

    fn f(&self, x: &Vector2<Real>, u: &Drive, dt: Real) -> Vector2<Real> {
        self.f_and_F(x, u, dt).0
    }

    fn F(&self, x: &Vector2<Real>, u: &Drive, dt: Real) -> Matrix2<Real> {
        self.f_and_F(x, u, dt).1
    }

    fn f_and_F(&self, x: &Vector2<Real>, u: &Drive, dt: Real) -> (Vector2<Real>, Matrix2<Real>) {
        let [v_dot, by_theta] =
            self.balance
                .acceleration(u.traction_n, u.mass_kg, x.y, u.resistance);
        (
            vector![x.x + dt * v_dot, x.y],
            matrix![1.0, dt * by_theta; 0.0, 1.0],
        )
    }

    fn Q(&self, _: &Drive, dt: Real) -> Matrix2<Real> {
        let [q_v, q_theta] = self.q;
        Matrix2::from_diagonal(&vector![q_v * dt, q_theta * dt])
    }
}

impl Model<2, 1> for ForceBalanceModel {
    fn h(&self, x: &Vector2<Real>) -> Vector1<Real> {
        vector![x.x]
    }

    fn H(&self, _: &Vector2<Real>) -> SMatrix<Real, 1, 2> {
        matrix![1.0, 0.0]
    }
}

/// Adaptation to a noise or a slope that differs from the parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Adaptation {
    /// Not at all.
    None,
    /// The noise of wheel speed follows the data (Sage & Husa), with this fading factor b or κ per sample.
    SageHusa {
        /// Fading factor.
        fading: Real,
    },
}

impl Adaptation {
    /// Sage-Husa alone.
    pub fn sage_husa(fading: Real) -> Self {
        Adaptation::SageHusa { fading }
    }
}

/// The filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceBalanceEkf {
    aekf: Aekf<ForceBalanceModel, 2, 1>,
    started: bool,
    saturated: bool,
    /// Innovation and NIS of the last measurement.
    last: Option<(Real, Real)>,
    gate: Gate,
    /// Standard deviation of wheel speed from the parameters, and the one in use before any adaptation, m/s.
    told_sd: Real,
    unadapted_sd: Real,
}

impl ForceBalanceEkf {
    /// Builds the filter from the balance, the parameters, the way to adapt and the innovation gate. The adapted
    /// variance of wheel speed stays between a hundredth and a hundred times the nominal one.
    pub fn new(
        balance: ForceBalance,
        params: GradeParams,
        adaptation: Adaptation,
        integrity: &Integrity,
        wheel_speed_sd_mps: Real,
    ) -> Self {
        let sd = wheel_speed_sd_mps;
        let rad = PI / 180.0;
        let x = vector![0.0, params.grade0_deg * rad];
        let R = Matrix1::new(sd * sd);
        let noise = match adaptation {
            Adaptation::None => Noise::Known(R),
            Adaptation::SageHusa { fading } => {
                Noise::SageHusa(SageHusa::new(R, fading, [0.01, 100.0]))
            }
        };
        let model = ForceBalanceModel {
            balance,
            q: [params.q_v, params.q_theta],
        };
        let belief = Gaussian::independent(x, vector![sd, params.grade0_sd_deg * rad]);
        Self {
            aekf: Aekf {
                filter: Ekf::new(model, belief),
                noise,
            },
            started: false,
            saturated: false,
            last: None,
            gate: integrity.gate(true),
            told_sd: sd,
            unadapted_sd: sd,
        }
    }

    /// Sets the noise of wheel speed that the samples show, for the gate and for un-adapted noise.
    pub fn learn_noise(&mut self, learnt: &LearntNoise) {
        self.unadapted_sd = learnt.wheel_speed(self.told_sd);
        if let Noise::Known(R) = &mut self.aekf.noise {
            R.x = self.unadapted_sd * self.unadapted_sd;
        }
    }

    /// Carries the belief over `dt`. Without a `drive` (standing, braking, torque unknown) there is no force balance:
    /// the slope is kept and its tie to the speed is cut.
    pub fn predict(&mut self, drive: Option<Drive>, dt: Real) {
        self.gate.tick(dt);
        let belief = &mut self.aekf.filter.belief;
        let Some(drive) = drive else {
            belief.P.m12 = 0.0;
            belief.P.m21 = 0.0;
            belief.P.m11 += dt; // any acceleration up to 1 m/s² or so
            return;
        };
        self.aekf.filter.predict(&drive, dt);
    }

    /// Dead reckoning: moving under the brake, or with torque unknown, the slope may become another; its variance
    /// grows, its value stays.
    pub fn drift(&mut self, dt: Real) {
        let P = &mut self.aekf.filter.belief.P;
        P.m22 = (P.m22 + DEAD_RECKONING_RAD2_PER_S * dt).min(MAX_GRADE_RAD * MAX_GRADE_RAD);
    }

    /// Corrects by a wheel speed that passes the innovation gate. `adapt` lets the measurement noise learn from it.
    ///
    /// Returns the judgement of the gate and the correction: `None`, if the measurement was rejected or the numbers
    /// allowed no correction.
    pub fn update(
        &mut self,
        wheel_speed_mps: Real,
        adapt: bool,
    ) -> (Judgement, Option<Correction<1, 2>>) {
        let belief = &mut self.aekf.filter.belief;
        if !self.started {
            belief.x.x = wheel_speed_mps;
            self.started = true;
        }
        let y = wheel_speed_mps - belief.x.x;
        let variance = belief.P.m11 + self.unadapted_sd * self.unadapted_sd;
        let judgement = self.gate.judge(y, variance);
        match judgement.passage {
            Passage::Reject => {
                self.last = Some((y, judgement.nis));
                return (judgement, None);
            }
            Passage::Reopen => belief.P.m11 += y * y,
            Passage::Fuse => {}
        }
        (judgement, self.fuse(wheel_speed_mps, adapt))
    }

    fn fuse(&mut self, wheel_speed_mps: Real, adapt: bool) -> Option<Correction<1, 2>> {
        let z = vector![wheel_speed_mps];
        let correction = self.aekf.update(z)?;
        self.last = Some((correction.y.x, correction.nis));
        let x = &mut self.aekf.filter.belief.x;
        let inside = x.y.clamp(-MAX_GRADE_RAD, MAX_GRADE_RAD);
        self.saturated = inside != x.y;
        x.y = inside;
        if adapt {
            self.aekf.adapt(z);
        }
        Some(correction)
    }

    /// Belief about [v in m/s, θ in rad].
    pub fn belief(&self) -> &Gaussian<2> {
        &self.aekf.filter.belief
    }

    /// Innovation (m/s) and NIS of the last measurement.
    pub fn innovation(&self) -> (Real, Real) {
        self.last.unwrap_or((0.0, 0.0))
    }

    /// Returns true if the filter has had a wheel speed.
    pub fn started(&self) -> bool {
        self.started
    }

    /// Standard deviation of wheel speed in use, m/s.
    pub fn measurement_sd(&self) -> Real {
        sqrt(self.aekf.noise.R().x)
    }

    /// Adapted over un-adapted standard deviation of wheel speed.
    pub fn adapted_ratio(&self) -> Real {
        self.measurement_sd() / self.unadapted_sd
    }

    /// Returns true if the grade is held at its limit.
    pub fn clamped(&self) -> bool {
        self.saturated
    }

    /// Returns true if a limit acts: steepest grade, or a limit of the adapted noise.
    pub fn saturated(&self) -> bool {
        self.saturated || self.aekf.noise.limited()
    }

    /// Traction that keeps the speed at the estimated slope, N, and sine and cosine of that: what the slope's
    /// uncertainty is reckoned at.
    pub fn steady_traction_n(&self, drive: &Drive) -> (Real, [Real; 2]) {
        let [sine, cosine] = sin_cos(self.belief().x.y);
        let traction_n = drive.mass_kg * GRAVITY * (sine + drive.resistance * cosine);
        (traction_n, [sine, cosine])
    }
}

state!(ForceBalanceEkf { aekf, started, saturated, last, gate, unadapted_sd; told_sd });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::vehicles::vehicle;
    use crate::testing::{Random, chi_square_band};

    /// Standard deviation of wheel speed, m/s.
    const WHEEL_SD: Real = 0.005;

    fn filter(adaptation: Adaptation) -> ForceBalanceEkf {
        ForceBalanceEkf::new(
            ForceBalance::new(&vehicle()),
            GradeParams::default(),
            adaptation,
            &Integrity::default(),
            WHEEL_SD,
        )
    }

    #[test]
    fn error_is_chi_square_when_the_world_is_the_model() {
        // The plant: (M + J) v̇ = F − M g (sin θ + μ cos θ) plus white force noise; θ a random walk of the filter's own
        // strength.
        let (mass, mu, dt): (Real, Real, Real) = (12_000.0, 0.02, 0.01);
        let params = GradeParams::default();
        let runs = 100;
        let mut nees = 0.0;
        for run in 0..runs {
            let mut random = Random::new(500 + run as u64);
            let mut filter = filter(Adaptation::None);
            let (mut v, mut theta) = (0.5, params.grade0_sd_deg.to_radians() * random.normal());
            filter.update(v + WHEEL_SD * random.normal(), false);
            for _ in 0..500 {
                let force = mass * 9.81 * (theta.sin() + mu * theta.cos()) + 5e3 * (0.8 - v);
                filter.predict(
                    Some(Drive {
                        traction_n: force,
                        mass_kg: mass,
                        resistance: mu,
                    }),
                    dt,
                );
                v += dt * (force - mass * 9.81 * (theta.sin() + mu * theta.cos()))
                    / (mass + vehicle().rotating_mass_kg)
                    + (params.q_v * dt).sqrt() * random.normal();
                theta += (params.q_theta * dt).sqrt() * random.normal();
                filter.update(v + WHEEL_SD * random.normal(), false);
            }
            let error = filter.belief().x - vector![v, theta];
            nees += error.dot(&filter.belief().P.cholesky().unwrap().solve(&error))
                / 2.0
                / runs as Real;
        }
        let (low, high) = chi_square_band(2 * runs);
        assert!((low..high).contains(&nees), "{nees} not in {low}…{high}");
    }

    #[test]
    fn standing_keeps_the_slope() {
        let mut filter = filter(Adaptation::sage_husa(0.998));
        let drive = Drive {
            traction_n: 5e3,
            mass_kg: 1e4,
            resistance: 0.02,
        };
        for _ in 0..100 {
            filter.predict(Some(drive), 0.01);
            filter.update(0.5, true);
        }
        let theta = filter.belief().x.y;
        assert!(theta != 0.0);
        for k in 0..1000 {
            filter.predict(None, 0.01);
            filter.update(0.01 * (k % 3) as Real, false);
        }
        assert_eq!(filter.belief().x.y, theta);
    }
}

#[cfg(test)]
#[path = "force_balance_ekf_tests.rs"]
mod laws;
