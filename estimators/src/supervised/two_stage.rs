//! Common part of the two-stage pipelines: signals → mass regression → slope filter with that mass → estimate.

use crate::api::aid::AidStatus;
use crate::api::estimator::Internal;
use crate::api::real::{GRAVITY, cos, sin, sqrt};
use crate::api::signals::{Estimate, Flags, Value, Vehicle};
use crate::api::snapshot::{Archive, State, state};
use crate::detect::control::{self, Control};
use crate::detect::observability::GradeObservability;
use crate::detect::plausibility::Instruments;
use crate::detect::slip::SlipDetector;
use crate::detect::validity::{Source, Validity};
use crate::models::force_balance::ForceBalance;
use crate::models::force_balance::{Drive, MAX_GRADE_RAD};
use crate::preprocess::conditioning::ConditioningParams;
use crate::preprocess::front_end::{Reading, motion};
use crate::preprocess::resampler::Resampler;
use crate::rail::distributed_train::{AlignedSample, DistributedTrain, steeper};
use crate::runner::{Pipeline, copy_into};
use crate::supervised::force_balance_ekf::ForceBalanceEkf;
use crate::supervised::supervision::{Supervisors, mapped};
use crate::{Real, Time};

/// The traction that keeps the speed on a grade: sin θ + s μ cos θ = F/(M g).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SteadyTraction {
    /// Traction F at the rims, N.
    pub traction_n: Real,
    /// Grade angle θ, rad: sine and cosine.
    pub sin_cos: [Real; 2],
    /// Direction of travel s, ±1.
    pub direction: Real,
    /// Running-resistance coefficient μ.
    pub mu: Real,
}

impl SteadyTraction {
    /// ∂(sin θ + s μ cos θ)/∂θ: an error of F/(M g) divided by it is one of θ. Not below 0.1, which no grade of a rail
    /// comes near.
    pub fn by_theta(&self) -> Real {
        let [sine, cosine] = self.sin_cos;
        (cosine - self.direction * self.mu * sine).max(0.1)
    }
}

/// A first stage: something that learns the mass while the train runs.
///
/// Its samples come aligned with the rail under the train; the train with the rail memory stands beside the stages and
/// is lent to them.
pub trait MassEstimator: Copy {
    /// Names of [`MassEstimator::internals`].
    const INTERNALS: &'static [Internal; 6];

    /// One step of what the stage filters itself, before the samples of that step. `grade_rad` is the grade angle that
    /// the second stage had after the step before.
    fn step(
        &mut self,
        _reading: &Reading,
        _balance: &ForceBalance,
        _signals: &Resampler,
        _grade_rad: Real,
        _dt: Real,
    ) {
    }

    /// One sample of the regression: gate and fuse. What became of it.
    fn sample(
        &mut self,
        sample: &AlignedSample,
        balance: &ForceBalance,
        train: &DistributedTrain,
    ) -> AidStatus;

    /// The train stands, brakes, or has not run long enough for samples to count.
    fn pause(&mut self) {}

    /// Total mass, kg.
    fn mass_kg(&self) -> Value;

    /// Running-resistance coefficient to go with that mass.
    fn running_resistance(&self, train: &DistributedTrain) -> Real;

    /// Standard deviation, rad, that the uncertainty of mass and resistance gives to a slope computed from the force
    /// balance with the traction of `steady`.
    fn slope_sd_rad(&self, steady: &SteadyTraction, train: &DistributedTrain) -> Real;

    /// Standard deviation of the errors of its force balance beyond the noise of the parameters, m/s²: an error of the
    /// slope by this over g.
    fn unmodelled_mps2(&self) -> Real {
        0.0
    }

    /// Traction that a bend takes, N: 0 for a stage without a model of bends.
    fn bend_n(&self) -> Real {
        0.0
    }

    /// Returns true if its last sample was excited.
    fn excited(&self) -> bool {
        true
    }

    /// Returns true if a limit acts.
    fn saturated(&self) -> bool;

    /// Its own quantities, for plots.
    fn internals(&self, train: &DistributedTrain) -> [Real; 6];
}

/// Places of the sources in the list of statuses.
const WHEEL_SPEED: usize = 0;
const FORCE_BALANCE: usize = 1;

/// Mass first, then slope, with the rail memory of a distributed train beside the two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoStage<M> {
    /// Constants of the force balance.
    balance: ForceBalance,
    /// Signals of the regression.
    signals: Resampler,
    /// The train on the rail memory, with the samples that wait for rail not yet read.
    train: DistributedTrain,
    /// First stage.
    mass: M,
    /// Second stage.
    slope: ForceBalanceEkf,
    slip: SlipDetector,
    observability: GradeObservability,
    validity: Validity,
    conditioning: ConditioningParams,
    /// Speed below which the train counts as standing, m/s.
    standstill_mps: Real,
    /// Status of the last wheel speed, and of the last sample of the force balance.
    aids: [AidStatus; 2],
    /// Time since the last sample of the force balance, s.
    since_sample_s: Real,
}

impl<M: MassEstimator> TwoStage<M> {
    /// Builds the estimator from the signals of the regression, the two stages, and which supervisors are on.
    pub fn new(
        vehicle: &Vehicle,
        signals: Resampler,
        mass: M,
        slope: ForceBalanceEkf,
        supervision: &Supervisors,
        standstill_mps: Option<Real>,
    ) -> Self {
        let mapped = mapped(vehicle, supervision.grade_map);
        Self {
            balance: ForceBalance::new(vehicle),
            signals,
            train: DistributedTrain::new(&mapped, standstill_mps),
            validity: Validity::new(
                vehicle,
                supervision.integrity,
                Instruments {
                    accelerometer: true,
                    gyro: false,
                },
            ),
            conditioning: supervision.conditioning,
            mass,
            slip: SlipDetector::new(supervision.slip_detector),
            slope,
            observability: GradeObservability::default(),
            standstill_mps: vehicle.standstill_mps(standstill_mps),
            aids: [AidStatus::default(); 2],
            since_sample_s: 0.0,
        }
    }

    /// First stage: resample, align with the rail memory, regress.
    fn learn_mass(&mut self, reading: &Reading, running: bool, dt: Real) {
        if let Control::Out(outcome) = control::force_balance(reading, running, true) {
            self.note(FORCE_BALANCE, control::without(outcome));
        }
        let balance = &self.balance;
        let sample = self.signals.step(reading, balance, running, dt);
        let grade_rad = self.slope.belief().x.y;
        self.mass
            .step(reading, balance, &self.signals, grade_rad, dt);
        let next = self.train.step(&self.signals, sample, reading, running, dt);
        self.since_sample_s += dt;
        if let Some(next) = next {
            let status = self.mass.sample(&next, &self.balance, &self.train);
            if let Some(nis) = status.nis() {
                self.validity
                    .innovation(Source::ForceBalance, nis, self.since_sample_s);
                self.since_sample_s = 0.0;
            }
            self.note(FORCE_BALANCE, status);
        }
        if !self.signals.settled() {
            self.mass.pause();
        }
    }

    /// Inputs of the train by the force balance; `None` while it does not hold.
    fn drive(&self, reading: &Reading, mass: &Value, running: bool) -> Option<Drive> {
        let (torque, speed) = reading
            .motor_torque_nm
            .zip(reading.speed_mps)
            .filter(|_| running)?;
        Some(Drive {
            traction_n: self.balance.net_traction(torque, speed) - self.mass.bend_n(),
            mass_kg: mass.value,
            resistance: self.mass.running_resistance(&self.train) * direction(reading),
        })
    }

    /// Second stage: predict by the force balance, correct by wheel speed.
    fn filter_slope(
        &mut self,
        reading: &Reading,
        drive: Option<Drive>,
        (moving, running): (bool, bool),
        dt: Real,
    ) {
        self.slope.learn_noise(&reading.noise);
        self.slope.predict(drive, dt);
        if moving && drive.is_none() {
            self.slope.drift(dt);
            self.observability.lose();
        }
        match control::wheel_speed(reading) {
            Control::New(speed) => {
                let (judgement, correction) = self.slope.update(speed, running);
                if correction.is_some() {
                    self.observability.update(self.slope.belief().P.m22);
                }
                if running {
                    self.validity
                        .innovation(Source::WheelSpeed, judgement.nis, judgement.period_s);
                }
                let fused = correction.map(|c| (c.y.x, c.S.x));
                self.note(WHEEL_SPEED, judgement.status(fused));
            }
            Control::Held => {}
            Control::Out(outcome) => self.note(WHEEL_SPEED, control::without(outcome)),
        }
    }

    /// Notes what became of a measurement.
    fn note(&mut self, source: usize, status: AidStatus) {
        if let Some(place) = self.aids.get_mut(source) {
            *place = status;
        }
    }

    /// Effective grade: that of the second stage, with the uncertainty of what the first one gave it.
    fn effective_grade(
        &self,
        reading: &Reading,
        mass: Value,
        drive: Option<Drive>,
        running: bool,
    ) -> Value {
        let belief = self.slope.belief();
        let parameters_sd = drive.map_or(0.0, |drive| {
            let direction = direction(reading);
            let steady = SteadyTraction {
                traction_n: self.slope.steady_traction_n(&drive),
                sin_cos: [sin(belief.x.y), cos(belief.x.y)],
                direction,
                mu: drive.resistance * direction,
            };
            self.mass.slope_sd_rad(&steady, &self.train)
        });
        let unmodelled = self.mass.unmodelled_mps2() / GRAVITY;
        let sd = sqrt(belief.P.m22 + parameters_sd * parameters_sd + unmodelled * unmodelled);
        // Couplings, bristles and the load take up the torque before a train that drives off moves as one.
        let basis = running
            && self.signals.settled()
            && self.slope.started()
            && !self.slope.clamped()
            && self.validity.mass(mass).valid
            && self.slip.wheel_speed_consistent(self.slope.adapted_ratio())
            && self.observability.grade_observable();
        self.validity.grade(Value {
            value: belief.x.y,
            sd,
            valid: basis,
        })
    }

    /// Grade at the IMU, by the rail memory.
    fn grade_at_imu(&self, mass_kg: Real, effective: &Value) -> Value {
        let (offset, offset_sd) = self.train.imu_offset(mass_kg, effective.value);
        let sd = sqrt(effective.sd * effective.sd + offset_sd * offset_sd);
        Value {
            value: steeper(effective.value, offset).clamp(-MAX_GRADE_RAD, MAX_GRADE_RAD),
            sd,
            valid: effective.valid,
        }
    }
}

/// Sign of the speed, ±1.
fn direction(reading: &Reading) -> Real {
    if reading.speed_mps.is_some_and(|v| v < 0.0) {
        -1.0
    } else {
        1.0
    }
}

impl<M: MassEstimator + State> Pipeline for TwoStage<M> {
    const INTERNALS: &'static [Internal] = {
        let [a, b, c, d, e, f] = *M::INTERNALS;
        &[
            a,
            b,
            c,
            d,
            e,
            f,
            Internal::new("wheel_speed_sd_mps", "m/s"),
            Internal::new("slope_filter_sd_rad", "rad"),
            Internal::new("fading", "-"),
        ]
    };

    fn advance(&mut self, reading: &Reading, t: Time, dt: Real) -> Estimate {
        let (moving, running) = motion(reading, self.standstill_mps);
        self.validity.observe(reading, dt);
        self.learn_mass(reading, running, dt);
        let total_mass_kg = self.mass.mass_kg();
        let drive = self.drive(reading, &total_mass_kg, running);
        self.filter_slope(reading, drive, (moving, running), dt);
        let effective = self.effective_grade(reading, total_mass_kg, drive, running);
        if effective.valid {
            self.train
                .learn_bias(total_mass_kg.value, effective.value, dt);
        }
        let speed = self.slope.belief();
        let (innovation, nis) = self.slope.innovation();
        let estimate = Estimate {
            t,
            total_mass_kg,
            grade_rad: self.grade_at_imu(total_mass_kg.value, &effective),
            effective_grade_rad: effective,
            speed_mps: Value {
                value: speed.x.x,
                sd: sqrt(speed.P.m11),
                valid: reading.speed_mps.is_some(),
            },
            innovation,
            nis,
            flags: Flags {
                moving,
                excited: self.signals.settled() && self.mass.excited(),
                saturated: self.mass.saturated() || self.slope.saturated(),
            },
        };
        self.validity.publish(estimate, true)
    }

    fn conditioning(&self) -> Option<ConditioningParams> {
        Some(self.conditioning)
    }

    const AID_SOURCES: &'static [&'static str] = &["wheel_speed", "force_balance"];

    fn aid_status(&self, status: &mut [AidStatus]) {
        copy_into(status, &self.aids);
    }

    fn internal_values(&self, values: &mut [Real]) {
        let [a, b, c, d, e, f] = self.mass.internals(&self.train);
        let slope = &self.slope;
        let now = [
            a,
            b,
            c,
            d,
            e,
            f,
            slope.measurement_sd(),
            sqrt(slope.belief().P.m22),
            slope.fading(),
        ];
        copy_into(values, &now);
    }

    fn visit(&mut self, archive: &mut Archive) {
        State::visit(self, archive);
    }
}

state!(@[M: State] TwoStage<M> { signals, train, mass, slope, observability, validity, aids, since_sample_s; balance, slip, conditioning, standstill_mps });

#[cfg(test)]
#[path = "two_stage_tests.rs"]
mod tests;
