//! Patent CN 111507019 B (Beijing Institute of Technology, 2022), "iterative joint estimation of vehicle mass and road
//! slope based on MMRLS and SH-STF": `mmrls_sh_stf`. Mass by two least squares, straight and turning, weighed by
//! likelihood; slope by an extended Kalman filter that adapts its noise (Sage & Husa) or tracks strongly, one at a
//! time.
//!
//! The formulas of the published text are pictures; their numbers are those of the reconstruction. With its errata
//! corrected and nothing else:
//!
//! - eq. 20: the accelerometer in place of g i + a; i of the filter that inverts the same balance with this mass brings
//!   no new information
//! - eq. 22: running resistance and slope in the turning model too, and no turning model below one degree of steering
//!   or 1 m/s
//! - eq. 26, 27: the size of the residual in its own standard deviations, tanh(|e|/2σ); in print the sigmoid of e in N,
//!   sign and all
//! - eq. 28, 29: the innovation variance; the printed one falls to 0
//! - eq. 46–48: R alone, from the residual after the update, which keeps it positive; Q as it starts
//! - step 4: the criterion, cut off in print, is the classical one: strong tracking while ν² > γ S
//!
//! P₀, σ, γ, Q and R are not given. A rail is straight.

use nalgebra::{Matrix1, Matrix2, SMatrix, Vector1, Vector2, matrix, vector};

use crate::Real;
use crate::api::estimator::Internal;
use crate::api::estimator::copy_into;
use crate::api::params::params;
use crate::api::real::{GRAVITY, PI, asin, cos, exp, sin, sqrt, tanh, within};
use crate::api::snapshot::state;
use crate::api::vehicle::{RoadVehicle, Vehicle};
use crate::filters::ekf::Ekf;
use crate::filters::forgetting::Forgetting;
use crate::filters::gaussian::{Correction, Gaussian};
use crate::filters::low_pass::MatchedFilter;
use crate::filters::model::{Model, Process};
use crate::filters::rls::{Outcome, Rls};
use crate::filters::sage_husa::{Adaptive, Noise};
use crate::filters::strong_tracking::StrongTracking;
use crate::methods::method::{Answer, Found, Method, Signals};
use crate::models::force_balance::Drive;
use crate::models::sample::ResampledSample;

params! {
    /// The regressions of eq. 20–34.
    Regressions {
        mass0_kg ["kg"] = none, 1.0 => 1e6, "Total mass at the start; not set: the middle of the vehicle's mass range.";
        mass_sd ["-"] = 0.5, 0.001 => 10.0, "Standard deviation of this mass, as a share of the mass: P₀.";
        residual_sd_mps2 ["m/s²"] = 0.03, 1e-4 => 1.0, "Standard deviation σ of the residual divided by the mass.";
        cutoff_hz ["Hz"] = 1.0, 0.05 => 20.0, "Corner of the low-pass of force, speed and accelerometer.";
        rate_hz ["Hz"] = 10.0, 0.1 => 1000.0, "Rate of the samples t of the law μ(t) = 1 − 0.05 · 0.98ᵗ.";
    }
}

params! {
    /// The filter of eq. 35–55.
    Slope {
        q_v ["m²/s³"] = 1e-4, 1e-12 => 10.0, "Process noise of speed.";
        q_i ["1/s"] = 3e-4, 1e-12 => 10.0, "Process noise of the grade i.";
        wheel_speed_sd_mps ["m/s"] = 0.005, 1e-6 => 10.0, "Standard deviation of wheel speed at the start.";
        grade0_deg ["deg"] = 0.0, -60.0 => 60.0, "Grade angle at the start.";
        grade0_sd_deg ["deg"] = 5.0, 0.001 => 90.0, "Standard deviation of the grade angle at the start.";
        b ["-"] = 0.97, 0.5 => 0.99999, "Fading factor b of the adapted noise; the patent has 0.95 to 0.99.";
        memory ["-"] = 0.95, 0.0 => 1.0, "Forgetting factor ρ of the innovation covariance.";
        weakening ["-"] = 1.5, 1.0 => 100.0, "Weakening factor β.";
        gamma ["-"] = 6.6, 1.0 => 1e6, "γ: ratio of the square of an innovation to S above which strong tracking acts.";
    }
}

methods! {
    /// The method.
    mmrls_sh_stf: MmrlsShStfPublished = Patent,
        { mass: Regressions, slope: Slope },
        |vehicle, p| build(vehicle, &p.mass, &p.slope);
}

/// State [v, i], measurement v.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ClimbModel {
    /// Rotating masses J reflected to the rim, kg: δ = 1 + J/m.
    pub rotating_mass_kg: Real,
    /// Process noise of v (m²/s³) and i (1/s).
    pub q: [Real; 2],
}

impl Process<2> for ClimbModel {
    type Input = Drive;

    fn f(&self, x: &Vector2<Real>, u: &Drive, dt: Real) -> Vector2<Real> {
        let delta = 1.0 + self.rotating_mass_kg / u.mass_kg;
        let v_dot = (u.traction_n / u.mass_kg - GRAVITY * u.resistance - GRAVITY * x.y) / delta; // eq. 35–37
        vector![x.x + dt * v_dot, x.y] // eq. 38, 39
    }

    fn F(&self, _: &Vector2<Real>, u: &Drive, dt: Real) -> Matrix2<Real> {
        let delta = 1.0 + self.rotating_mass_kg / u.mass_kg;
        matrix![1.0, -dt * GRAVITY / delta; 0.0, 1.0] // eq. 43
    }

    fn Q(&self, _: &Drive, dt: Real) -> Matrix2<Real> {
        let [q_v, q_i] = self.q;
        Matrix2::from_diagonal(&vector![q_v * dt, q_i * dt])
    }
}

impl Model<2, 1> for ClimbModel {
    fn h(&self, x: &Vector2<Real>) -> Vector1<Real> {
        vector![x.x] // eq. 41
    }

    fn H(&self, _: &Vector2<Real>) -> SMatrix<Real, 1, 2> {
        matrix![1.0, 0.0] // eq. 41
    }
}

/// Steering angle, rad, and speed, m/s, from which on the turning model is used; no front wheel is steered further than
/// the third, rad.
const TURNING: [Real; 3] = [PI / 180.0, 1.0, 0.7];
/// Limits that keep the covariance finite while measurements are senseless: of the fading factor, which has none in
/// print, and in m/s and i.
const MAX_FADING: Real = 1e4;
const USABLE_SD: [Real; 2] = [100.0, 10.0];
/// Steepest road, as i.
const MAX_I: Real = 0.87;

/// One regression with the likelihood of its last residual.
#[derive(Clone, Copy, Debug, PartialEq)]
struct WeighedRegression {
    /// m/m₀.
    rls: Rls<1>,
    likelihood: Real,
}

impl WeighedRegression {
    fn learn(&mut self, y: Real, h: Real, r: Real) -> Option<Outcome> {
        let S = 1.0 + h * h * self.rls.belief.P.x / r; // eq. 28, 29
        let outcome = self.rls.update(y, &vector![h], r, false)?; // eq. 21
        let e = y - h * self.rls.belief.x.x; // eq. 24, 25
        let size = tanh(e.abs() / (2.0 * sqrt(r))); // eq. 26, 27
        self.likelihood = exp(-0.5 * size * size / S) / sqrt(2.0 * PI * S); // eq. 30, 31
        Some(outcome)
    }
}

/// Regressions and slope filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patent {
    mass0_kg: Real,
    range_kg: [Real; 2],
    rotating_mass_kg: Real,
    resistance: Real,
    road: Option<RoadVehicle>,
    r: Real,
    gamma: Real,
    straight: WeighedRegression,
    turning: WeighedRegression,
    /// Weight of the straight model.
    weight: Real,
    /// Traction lost by turning, N, behind the low-pass of the force.
    lost_n: MatchedFilter,
    steer_rad: Real,
    slope: Adaptive<Ekf<ClimbModel, 2>, 1>,
    tracking: StrongTracking<1>,
    fading: Real,
    since_s: Real,
    learnt: bool,
    started: bool,
    outcome: Outcome,
    last: Option<Correction<1, 2>>,
}

impl Patent {
    /// F_t − F_tt of the turning model, N, and the steering angle, rad: 0 on a rail, slow, or without an instrument.
    fn lost_in_turn(&self, z: &Signals) -> Option<(Real, Real)> {
        let (road, traction) = (self.road?, z.traction_n? + z.drag_n);
        let (steer, yaw_rate) = (z.steering_angle_rad?, z.yaw_rate_radps?);
        let [_, slow, most] = TURNING;
        let v = z.speed_mps.filter(|v| *v > slow)?;
        let steer = steer.clamp(-most, most);
        let beta = road.rear_axle_m / (road.front_axle_m + road.rear_axle_m) * steer; // eq. 23
        let slip = steer - beta - road.front_axle_m * yaw_rate / v; // eq. 11
        let side_n = road.front_cornering_npr * slip; // eq. 7
        Some((traction * (1.0 - cos(steer)) + side_n * sin(steer), steer)) // eq. 12, 18
    }

    fn learn(&mut self, now: &ResampledSample, direction: Real) -> Option<()> {
        let delta = 1.0 + self.rotating_mass_kg / self.mass0_kg;
        let inertia = (delta - 1.0) * now.acceleration_mps2;
        let a_e = direction * GRAVITY * self.resistance + now.specific_force_mps2? + inertia; // eq. 20
        self.outcome = self
            .straight
            .learn(now.force_n / self.mass0_kg, a_e, self.r)?;
        self.learnt = true;
        self.weight = 1.0;
        let [turning, ..] = TURNING;
        if self.steer_rad.abs() >= turning {
            let force_n = now.force_n - self.lost_n.value()?;
            self.turning.learn(force_n / self.mass0_kg, a_e, self.r)?; // eq. 22
            let (s, t) = (self.straight.likelihood, self.turning.likelihood);
            self.weight = s / (s + t); // eq. 32, 33
        }
        Some(())
    }

    /// m, with the standard deviation of the mixture.
    fn mass_kg(&self) -> Found {
        let (s, t, w) = (self.straight.rls, self.turning.rls, self.weight);
        let m = w * s.belief.x.x + (1.0 - w) * t.belief.x.x; // eq. 34
        let about = |rls: &Rls<1>| rls.widened().x + (rls.belief.x.x - m) * (rls.belief.x.x - m);
        let variance = w * about(&s) + (1.0 - w) * about(&t);
        Found {
            value: m * self.mass0_kg,
            sd: sqrt(variance) * self.mass0_kg,
            started: self.learnt,
        }
    }

    fn filter(&mut self, z: &Signals) -> Option<()> {
        self.since_s += z.dt;
        let Some(traction_n) = z.traction_n else {
            self.started = false; // eq. 35 does not hold; v starts again where it does
            return None;
        };
        let speed = vector![z.new_speed_mps?];
        let dt = self.since_s.min(1.0);
        self.since_s = 0.0;
        let [low, high] = self.range_kg;
        let drive = Drive {
            traction_n, // F_t − F_w
            mass_kg: within(self.mass_kg().value, low, high),
            resistance: z.direction * self.resistance,
        };
        let (filter, R) = (&mut self.slope.filter, *self.slope.noise.R());
        if !self.started {
            (filter.belief.x.x, self.started) = (speed.x, true);
            return None;
        }
        let ahead = filter.preview(speed, &drive, dt);
        let lambda = self
            .tracking
            .fading(&ahead.y, &ahead.carried, &ahead.process, &R); // eq. 52–55
        let S = ahead.carried + ahead.process + R;
        let jumped = ahead.y.x * ahead.y.x > self.gamma * S.x; // step 4
        self.fading = if jumped { lambda } else { 1.0 };
        filter.belief.P *= self.fading; // eq. 51, 52
        filter.predict(&drive, dt); // eq. 44
        let [v, i] = USABLE_SD;
        filter.belief.limit_variance(&vector![v * v, i * i]);
        self.last = Some(self.slope.update(speed)?); // eq. 45
        if !jumped {
            self.slope.adapt(speed); // eq. 46–48
        }
        Some(())
    }
}

impl Method for Patent {
    const INTERNALS: &'static [Internal] = &[
        Internal::new("straight_mass_kg", "kg"),
        Internal::new("turning_mass_kg", "kg"),
        Internal::new("straight_weight", "-"),
        Internal::new("lambda", "-"),
        Internal::new("fading", "-"),
        Internal::new("wheel_speed_sd_mps", "m/s"),
        Internal::new("slope_filter_sd", "-"),
    ];

    fn step(&mut self, z: &Signals) {
        let (lost_n, steer_rad) = self.lost_in_turn(z).unwrap_or_default();
        self.lost_n.step(lost_n, z.dt);
        self.steer_rad = steer_rad;
        let _ = z.sample.and_then(|now| self.learn(&now, z.direction));
        let _ = self.filter(z);
    }

    fn answer(&self) -> Answer {
        let Gaussian { x, P } = self.slope.filter.belief;
        let i = within(x.y, -MAX_I, MAX_I);
        let found = |value, sd| Found {
            value,
            sd,
            started: self.last.is_some(),
        };
        Answer {
            mass_kg: Some(self.mass_kg()),
            grade_rad: found(asin(i), sqrt(P.m22) / sqrt(1.0 - i * i)),
            speed_mps: Some(found(x.x, sqrt(P.m11))),
            innovation: self.last.map_or((0.0, 0.0), |c| (c.y.x, c.nis)),
        }
    }

    fn internal_values(&self, values: &mut [Real]) {
        let [s, t] = [&self.straight, &self.turning].map(|m| m.rls.belief.x.x * self.mass0_kg);
        let (R, P) = (self.slope.noise.R().x, self.slope.filter.belief.P.m22);
        let now = [
            s,
            t,
            self.weight,
            self.outcome.lambda,
            self.fading,
            sqrt(R),
            sqrt(P),
        ];
        copy_into(values, &now);
    }
}

state!(WeighedRegression { rls, likelihood; });
state!(Patent { straight, turning, weight, lost_n, steer_rad, slope, tracking, fading, since_s, learnt, started, outcome, last;
    mass0_kg, range_kg, rotating_mass_kg, resistance, road, r, gamma });

fn build(vehicle: &Vehicle, mass: &Regressions, p: &Slope) -> ([Real; 2], Patent) {
    let v = p.wheel_speed_sd_mps;
    let rad = PI / 180.0;
    let law = Forgetting::TimeLaw {
        loss: 0.05,
        decay: 0.98,
    };
    let first = WeighedRegression {
        rls: Rls::new(
            Gaussian::independent(vector![1.0], vector![mass.mass_sd]),
            law,
        ),
        likelihood: 1.0,
    };
    let model = ClimbModel {
        rotating_mass_kg: vehicle.rotating_mass_kg,
        q: [p.q_v, p.q_i],
    };
    let x = vector![0.0, sin(p.grade0_deg * rad)];
    let belief = Gaussian::independent(x, vector![v, p.grade0_sd_deg * rad]);
    let method = Patent {
        mass0_kg: vehicle.first_mass_kg(mass.mass0_kg),
        range_kg: vehicle.mass_range_kg,
        rotating_mass_kg: vehicle.rotating_mass_kg,
        resistance: vehicle.running_resistance,
        road: vehicle.road,
        r: mass.residual_sd_mps2 * mass.residual_sd_mps2,
        gamma: p.gamma,
        straight: first,
        turning: first,
        weight: 1.0,
        lost_n: MatchedFilter::new(mass.cutoff_hz),
        steer_rad: 0.0,
        slope: Adaptive {
            filter: Ekf::new(model, belief),
            noise: Noise::published(Matrix1::new(v * v), Some(p.b)),
        },
        tracking: StrongTracking::new(p.memory, p.weakening, MAX_FADING),
        fading: 1.0,
        since_s: 0.0,
        learnt: false,
        started: false,
        outcome: Outcome::default(),
        last: None,
    };
    ([mass.cutoff_hz, mass.rate_hz], method)
}
