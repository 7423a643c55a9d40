//! `dffrls_aukf_printed`: "dynamic inclination recognition of monorail crane based on DFFRLS-AUKF" (Huainan main
//! roadway tests), as printed.
//!
//! - `eq6`: the cosine missing in the curvature model, a′ − v̇′ = g v ρ
//! - `eq9`: smoothing with the gain (1 − Γₐ/Γ) m₀ once Γ passes the amplitude Γₐ of the noise at rest ([`Smoother`]);
//!   `other`: eq. 10, whose last branch adds to a gain that is never taken back
//! - `eq14`: state [v̇, θ′] with the accelerometer as input where its derivative belongs; `other`: with the derivative.
//!   Either way the curvature never enters, and θ is the open sum of θ′
//! - `eq19`: weight of the centre in covariances W_m0 + 1 − α² − β
//! - `eq26`: mean of the predicted measurement with the weights of covariances
//! - `eq34`: Sage-Husa for Q and R at once (eq. 32–36); q and r of the print go into no other equation
//!
//! A covariance without a Cholesky root is a breakdown.

use nalgebra::{Matrix2, Vector2, vector};

use crate::api::estimator::Internal;
use crate::api::params::{param_groups, params};
use crate::api::reading::Reading;
use crate::api::real::{GRAVITY, PI, pow, sin, sqrt};
use crate::api::signals::{Estimate, Vehicle};
use crate::filters::gaussian::cholesky;
use crate::filters::low_pass::MatchedFilter;
use crate::preprocess::front_end::motion;
use crate::printed::curvature_rls::{Curvature, CurvatureParams, DynamicForgetting};
use crate::printed::{Erratum, PrintReading, PrintedAnswer, usable};
use crate::runner::{Pipeline, copy_into};
use crate::{Real, Time};

params! {
    /// Switches and constants of `dffrls_aukf_printed`.
    Own {
        eq6 [choice Erratum] = Erratum::Printed, "Printed: no cosine in the curvature model.";
        eq9 [choice PrintReading] = PrintReading::Printed, "Printed: smoothing by eq. 9; other: by eq. 10; corrected: neither of the two.";
        eq14 [choice PrintReading] = PrintReading::Printed, "Printed: state [v̇, θ′], input a; other: input a′; corrected: state [v, θ], input a and ρ v.";
        eq19 [choice Erratum] = Erratum::Printed, "Printed: − β in the weight of the centre.";
        eq26 [choice Erratum] = Erratum::Printed, "Printed: mean of the measurement by the weights of covariances.";
        eq34 [choice Erratum] = Erratum::Printed, "Printed: printed Sage-Husa for Q and R; corrected: noise fixed.";
        m0 ["-"] = 0.15, 0.01 => 1.0, "Smoothing gain m₀ at rest.";
        m_step ["-"] = 0.1, 0.0 => 1.0, "Addition of eq. 10 to m₀, Δ₁ = Δ₂.";
        rest_amplitude_mps2 ["m/s²"] = 0.02, 1e-4 => 10.0, "Amplitude Γₐ = Γ₀ at rest.";
        alpha ["-"] = 0.97, 1e-3 => 1.0, "Spread of the sigma points.";
        beta ["-"] = 2.0, 0.0 => 10.0, "Tail constant of the sigma points (the paper's η).";
        kappa_ukf ["-"] = 1.0, -1.0 => 10.0, "Second spread of the sigma points, 3 − n.";
        b ["-"] = 0.97, 0.5 => 0.99999, "Forgetting factor b of the noise.";
        q_v ["m²/s³"] = 1e-5, 1e-12 => 10.0, "Process noise of the first state at the start.";
        q_theta ["rad²/s"] = 2e-5, 1e-12 => 10.0, "Process noise of the second state at the start.";
        wheel_speed_sd_mps ["m/s"] = 0.005, 1e-6 => 10.0, "Standard deviation of the measurement at the start (of v̇, m/s², in print).";
        grade0_sd_deg ["deg"] = 5.0, 0.001 => 90.0, "Standard deviation of the grade angle at the start.";
    }
}

param_groups! {
    /// Parameters of `dffrls_aukf_printed`.
    Params { own: Own, curvature: CurvatureParams, forgetting: DynamicForgetting }
}

/// Speed below which the train stands, m/s.
const STANDSTILL_MPS: Real = 0.05;
/// Γ/Γ₀ from which eq. 10 takes its second and its third branch.
const BRANCHES: [Real; 2] = [3.0, 6.0];

/// First-order smoothing with the gain of eq. 9 or of eq. 10.
///
/// Γ is the difference of the last two outputs, with its sign: eq. 9 has that of this output, which needs the gain that
/// is sought.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoother {
    by_branches: bool,
    m0: Real,
    step: Real,
    rest: Real,
    m: Real,
    outputs: Option<[Real; 2]>,
}

impl Smoother {
    /// Eq. 9, or eq. 10 if `by_branches`; gain `m0` at rest, `step` Δ₁ = Δ₂, `rest` Γₐ = Γ₀.
    pub fn new(by_branches: bool, m0: Real, step: Real, rest: Real) -> Self {
        Self {
            by_branches,
            m0,
            step,
            rest,
            m: m0,
            outputs: None,
        }
    }

    /// The gain for a difference Γ of outputs.
    pub fn gain(&self, difference: Real) -> Real {
        let [low, high] = BRANCHES;
        if !self.by_branches {
            return if difference > self.rest {
                (1.0 - self.rest / difference) * self.m0
            } else {
                self.m0
            };
        }
        let ratio = difference / self.rest;
        if ratio > high {
            self.m + self.step
        } else if ratio > low {
            self.m0 + self.step
        } else {
            self.m0
        }
    }

    /// One sample.
    pub fn step(&mut self, input: Real) -> Real {
        let [last, before] = self.outputs.unwrap_or([input; 2]);
        self.m = self.gain(last - before);
        let output = self.m * input + (1.0 - self.m) * last;
        self.outputs = Some([output, last]);
        output
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct AukfState {
    x: Vector2<Real>,
    P: Matrix2<Real>,
    Q: Option<Matrix2<Real>>,
    R: Real,
    k: u32,
    innovation: Real,
    nis: Real,
}

/// The pipeline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DffrlsAukfPrinted {
    own: Own,
    mass_kg: Real,
    smoother: Smoother,
    curvature: Curvature,
    force: MatchedFilter,
    speed: MatchedFilter,
    now: AukfState,
    start: AukfState,
    started: bool,
    /// Open sum of θ′, rad.
    angle: Real,
    since_s: Real,
    breakdowns: Real,
}

/// Builds the estimator from the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> DffrlsAukfPrinted {
    let own = params.own;
    let [low, high] = vehicle.mass_range_kg;
    let (r, sd) = (own.wheel_speed_sd_mps, own.grade0_sd_deg * PI / 180.0);
    let start = AukfState {
        x: Vector2::zeros(),
        P: Matrix2::from_diagonal(&vector![r * r, sd * sd]),
        Q: None,
        R: r * r,
        k: 0,
        innovation: 0.0,
        nis: 0.0,
    };
    let filter = MatchedFilter::new(params.curvature.cutoff_hz);
    DffrlsAukfPrinted {
        own,
        mass_kg: 0.5 * (low + high),
        smoother: Smoother::new(
            own.eq9 == PrintReading::Other,
            own.m0,
            own.m_step,
            own.rest_amplitude_mps2,
        ),
        curvature: Curvature::new(vehicle, params.curvature, params.forgetting.policy()),
        force: filter,
        speed: filter,
        now: start,
        start,
        started: false,
        angle: 0.0,
        since_s: 0.0,
        breakdowns: 0.0,
    }
}

impl DffrlsAukfPrinted {
    /// Eq. 18–36 with the transition `f` of the state and the measurement `z` of its first number.
    fn next(
        &self,
        f: impl Fn(&Vector2<Real>) -> Vector2<Real>,
        z: Real,
        dt: Real,
    ) -> Option<AukfState> {
        let own = &self.own;
        let scale = own.alpha * own.alpha * (2.0 + own.kappa_ukf);
        let centre = (scale - 2.0) / scale;
        let tail = if own.eq19.is_printed() {
            -own.beta
        } else {
            own.beta
        };
        let weights = [centre, centre + 1.0 - own.alpha * own.alpha + tail];
        let other = 0.5 / scale;
        let points = |x: &Vector2<Real>, P: &Matrix2<Real>| {
            let reach = cholesky(P)? * sqrt(scale);
            let (a, b) = (reach.column(0), reach.column(1));
            Some([*x, x + a, x + b, x - a, x - b])
        };
        let AukfState { x, P, Q, R, k, .. } = self.now;
        let Q = Q.unwrap_or(Matrix2::from_diagonal(&vector![
            own.q_v * dt,
            own.q_theta * dt
        ]));
        let carried = points(&x, &P)?.map(|point| f(&point));
        let x_prior = sum(&carried, weights[0], other, |point| *point);
        let carried_P = sum(&carried, weights[1], other, |point| {
            (point - x_prior) * (point - x_prior).transpose()
        });
        let P_prior = carried_P + Q;

        let redrawn = points(&x_prior, &P_prior)?;
        let mean_weight = if own.eq26.is_printed() {
            weights[1]
        } else {
            weights[0]
        };
        let z_mean = sum(&redrawn, mean_weight, other, |point| {
            Vector2::repeat(point.x)
        })
        .x;
        let cross = sum(&redrawn, weights[1], other, |point| {
            (point - x_prior) * (point.x - z_mean)
        });
        let spread = sum(&redrawn, weights[1], other, |point| {
            Vector2::repeat((point.x - z_mean) * (point.x - z_mean))
        })
        .x;
        let S = spread + R;
        let K = cross / S;
        let innovation = z - z_mean;
        let x = x_prior + K * innovation;
        let P = P_prior - K * K.transpose() * S;

        let mut next = AukfState {
            x,
            P,
            Q: Some(Q),
            R,
            k: k.saturating_add(1),
            innovation,
            nis: innovation * innovation / S,
        };
        if own.eq34.is_printed() {
            let d = (1.0 - own.b) / (1.0 - pow(own.b, k as Real + 1.0));
            let moved = K * innovation;
            next.Q = Some(Q * (1.0 - d) + (moved * moved.transpose() + P - carried_P) * d);
            next.R = R * (1.0 - d) + (innovation * innovation - spread) * d;
        }
        let numbers = next.x.iter().chain(&next.P).chain([&next.R]);
        (usable(numbers) && next.nis.is_finite()).then_some(next)
    }

    fn sample(&mut self, reading: &Reading, speed: Real, dt: Real) {
        let Some((force, v)) = self.force.value().zip(self.speed.value()) else {
            return;
        };
        let (rho, rate) = (self.curvature.per_m().0, self.speed.rate());
        let next = if self.own.eq14.is_printed() {
            let input = if self.own.eq14 == PrintReading::Other {
                self.force.rate()
            } else {
                force
            };
            self.next(
                |x| vector![x.x - GRAVITY * dt * x.y + dt * input, x.y],
                rate,
                dt,
            )
        } else {
            if !self.started {
                self.now.x.x = speed;
                self.started = true;
            }
            let f = reading.specific_force_mps2.unwrap_or(force);
            self.next(
                |x| vector![x.x + dt * (f - GRAVITY * sin(x.y)), x.y + dt * rho * x.x],
                speed,
                dt,
            )
        };
        match next {
            Some(next) => self.now = next,
            None => {
                self.now = self.start;
                self.now.x.x = if self.own.eq14.is_printed() { rate } else { v };
                self.breakdowns += 1.0;
            }
        }
        if self.own.eq14.is_printed() {
            self.angle = (self.angle + dt * self.now.x.y).clamp(-1e3, 1e3);
        }
    }

    fn grade(&self) -> Real {
        if self.own.eq14.is_printed() {
            self.angle
        } else {
            self.now.x.y
        }
    }
}

/// The weighed sum over the sigma points of a function of them.
fn sum<const C: usize>(
    points: &[Vector2<Real>; 5],
    centre: Real,
    other: Real,
    of: impl Fn(&Vector2<Real>) -> nalgebra::SMatrix<Real, 2, C>,
) -> nalgebra::SMatrix<Real, 2, C> {
    let [first, rest @ ..] = points;
    rest.iter()
        .fold(of(first) * centre, |sum, point| sum + of(point) * other)
}

impl Pipeline for DffrlsAukfPrinted {
    const INTERNALS: &'static [Internal] = &[
        Internal::new("curvature_per_m", "1/m"),
        Internal::new("smoothing_gain", "-"),
        Internal::new("q_theta", "rad²/s"),
        Internal::new("r", "-"),
        Internal::new("breakdowns", "-"),
    ];

    fn advance(&mut self, reading: &Reading, t: Time, dt: Real) -> Estimate {
        let (moving, _) = motion(reading, STANDSTILL_MPS);
        let known = reading.specific_force_mps2.is_some() && reading.speed_mps.is_some();
        let mut smoothed = *reading;
        if self.own.eq9.is_printed() {
            smoothed.specific_force_mps2 = reading
                .specific_force_mps2
                .map(|f| self.smoother.step(f))
                .filter(|f| usable([f]));
            if reading.specific_force_mps2.is_some() && smoothed.specific_force_mps2.is_none() {
                self.smoother.outputs = None;
                self.breakdowns += 1.0;
            }
        }
        let theta = if self.own.eq6.is_printed() {
            0.0
        } else {
            self.grade()
        };
        self.curvature.step(&smoothed, theta, dt);
        if let Some((f, v)) = smoothed.specific_force_mps2.zip(reading.speed_mps) {
            self.force.step(f, dt);
            self.speed.step(v, dt);
        }
        self.since_s += dt;
        if let Some(speed) = reading.new_speed_mps {
            let period = self.since_s.min(1.0);
            self.since_s = 0.0;
            self.sample(&smoothed, speed, period);
        }
        PrintedAnswer {
            mass: (self.mass_kg, self.mass_kg * self.mass_kg),
            grade: (self.grade(), self.now.P.m22),
            speed_mps: reading.speed_mps.unwrap_or(0.0),
            innovation: self.now.innovation,
            nis: self.now.nis,
        }
        .estimate(t, moving, known)
    }

    fn internal_values(&self, values: &mut [Real]) {
        let Q = self.now.Q.unwrap_or(Matrix2::zeros());
        copy_into(
            values,
            &[
                self.curvature.per_m().0,
                self.smoother.m,
                Q.m22,
                self.now.R,
                self.breakdowns,
            ],
        );
    }
}
