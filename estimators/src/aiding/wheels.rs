//! Wheel speeds, which measure the speed: gate of each wheel (slip), and the mean of the rest.
//!
//! h = (v + v̇ τ − l_z θ̇)(1 + e_w), R = σ_w²/n for n wheels in use. θ̇ is that of the step, linear in the state; τ is
//! the time by which the wheels are ahead of the accelerometer by their stamps, and v̇ τ is known.

use nalgebra::SVector;

use crate::Real;
use crate::aiding::Aid;
use crate::api::real::sqrt;
use crate::api::signals::MAX_DRIVES;
use crate::api::snapshot::state;
use crate::detect::control::Control;
use crate::filters::gaussian::Gaussian;
use crate::models::attitude::{LinearPitchRate, N, SCALE, V};
use crate::tuning::{MOTION, STATISTICS, TIMES, WHEELS};

/// Mean of the wheels in use, as a measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wheels {
    /// Mean speed, m/s.
    pub speed_mps: Real,
    /// Variance of the mean speed, m²/s².
    pub variance: Real,
    /// Distance l_z of the IMU below the unit's middle, m.
    pub below_m: Real,
    /// Rate of the pitch.
    pub pitch_rate: LinearPitchRate,
    /// Speed gained since the time of the state, v̇ τ, m/s.
    pub gained_mps: Real,
}

impl Wheels {
    /// v + v̇ τ − l_z θ̇, m/s.
    fn at_rail(&self, x: &SVector<Real, N>) -> Real {
        x[V] + self.gained_mps - self.below_m * self.pitch_rate.at(x)
    }
}

impl Aid<N> for Wheels {
    fn innovation(&self, x: &SVector<Real, N>) -> Real {
        self.speed_mps - self.h(x)
    }

    fn h(&self, x: &SVector<Real, N>) -> Real {
        self.at_rail(x) * (1.0 + x[SCALE])
    }

    #[allow(
        clippy::indexing_slicing,
        reason = "indices of states are constants below N"
    )]
    fn H(&self, x: &SVector<Real, N>) -> SVector<Real, N> {
        let mut h = SVector::<Real, N>::zeros();
        let scale = 1.0 + x[SCALE];
        h[V] = scale;
        for (place, by) in self.pitch_rate.by_state() {
            h[place] -= self.below_m * by * scale;
        }
        h[SCALE] = self.at_rail(x);
        h
    }

    fn R(&self) -> Real {
        self.variance
    }
}

/// Vote of the wheels of one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ballot {
    /// Wheels in use.
    pub used: usize,
    /// Wheels beyond the gate.
    pub rejected: usize,
    /// Wheels beyond the gate that are faster than the train while driven, or slower while braked: they slip. The
    /// others are broken.
    pub slipping: usize,
    /// Mean speed of the wheels in use, m/s; without any the speed nearest to the prediction.
    pub speed_mps: Real,
    /// Deviation from the prediction beyond which a wheel is rejected, m/s.
    pub limit_mps: Real,
    /// True if all wheels, at least three, agree with each other beyond the gate and do not slip.
    pub contradicts: bool,
}

/// Gate of each wheel, and the scales of the wheels against each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelGate {
    drives: usize,
    sd_mps: Real,
    gate_sd: Real,
    gated: bool,
    scale: [Real; MAX_DRIVES],
}

impl WheelGate {
    /// Builds the gate for `drives` wheels whose speeds have the standard deviation `sd_mps`; the gate is `gate_sd`
    /// standard deviations if `gated`.
    pub fn new(drives: usize, sd_mps: Real, gate_sd: Real, gated: bool) -> Self {
        Self {
            drives: drives.min(MAX_DRIVES),
            sd_mps,
            gate_sd,
            gated,
            scale: [0.0; MAX_DRIVES],
        }
    }

    /// Returns true if wheels beyond the gate are rejected.
    pub fn is_gated(&self) -> bool {
        self.gated
    }

    /// Compares the new samples with a belief: the measurement, and the vote that made it. The wheels are ahead of the
    /// state by a time in which the vehicle gains a speed, m/s, known with a variance, m²/s².
    #[allow(
        clippy::indexing_slicing,
        reason = "indices of states are constants below N"
    )]
    pub fn control(
        &mut self,
        belief: &Gaussian<N>,
        (new_mps, torque_nm): (&[Option<Real>; MAX_DRIVES], &[Option<Real>; MAX_DRIVES]),
        (below_m, pitch_rate): (Real, LinearPitchRate),
        (gained_mps, gained_variance): (Real, Real),
        dt: Real,
    ) -> (Control<Wheels>, Ballot) {
        let mut wheels = Wheels {
            speed_mps: 0.0,
            variance: self.sd_mps * self.sd_mps,
            below_m,
            pitch_rate,
            gained_mps,
        };
        let predicted = wheels.h(&belief.x);
        let spread = WHEELS.spread * predicted;
        let variance = belief.P[(V, V)] + wheels.variance + gained_variance + spread * spread;
        let limit = self.gate_sd * sqrt(variance);
        let ballot = self.vote(new_mps, torque_nm, predicted, limit);
        wheels.speed_mps = ballot.speed_mps;
        wheels.variance = wheels.variance / ballot.used.max(1) as Real + gained_variance;
        if ballot.rejected == 0
            && ballot.used == self.drives
            && ballot.speed_mps.abs() > MOTION.moves_mps
        {
            self.learn_scales(new_mps, ballot.speed_mps, dt);
        }
        match ballot.used + ballot.rejected {
            0 => (Control::Held, ballot),
            _ => (Control::New(wheels), ballot),
        }
    }

    fn vote(
        &self,
        new_mps: &[Option<Real>; MAX_DRIVES],
        torque_nm: &[Option<Real>; MAX_DRIVES],
        predicted: Real,
        limit: Real,
    ) -> Ballot {
        let (mut used, mut rejected, mut slipping, mut sum) = (0, 0, 0, 0.0);
        let (mut least, mut most, mut nearest) = (Real::MAX, Real::MIN, Real::MAX);
        let units = new_mps.iter().zip(&self.scale).zip(torque_nm);
        for ((sample, scale), torque) in units.take(self.drives) {
            let Some(v) = sample.map(|v| v / (1.0 + scale)) else {
                continue;
            };
            (least, most) = (least.min(v), most.max(v));
            if (v - predicted).abs() < (nearest - predicted).abs() {
                nearest = v;
            }
            if self.gated && (v - predicted).abs() > limit {
                rejected += 1;
                let driven = torque.unwrap_or(v - predicted) * (v - predicted) > 0.0;
                slipping += usize::from(driven);
                continue;
            }
            (used, sum) = (used + 1, sum + v);
        }
        Ballot {
            used,
            rejected,
            slipping,
            speed_mps: match (used, rejected) {
                (0, 0) => 0.0,
                (0, _) => nearest,
                _ => sum / used as Real,
            },
            limit_mps: limit,
            contradicts: used == 0
                && rejected >= WHEELS.min_agreed
                && slipping == 0
                && most - least < STATISTICS.fault_sd * self.sd_mps + WHEELS.spread * most.abs(),
        }
    }

    fn learn_scales(&mut self, new_mps: &[Option<Real>; MAX_DRIVES], mean: Real, dt: Real) {
        for (scale, sample) in self.scale.iter_mut().zip(new_mps) {
            if let Some(v) = sample {
                let learnt = *scale + dt / TIMES.young_s * (v / mean - 1.0 - *scale);
                *scale = learnt.clamp(-WHEELS.max_scale, WHEELS.max_scale);
            }
        }
    }
}

state!(WheelGate { scale; drives, sd_mps, gate_sd, gated });

#[cfg(test)]
mod tests {
    use super::*;

    const SD_MPS: Real = 0.01;
    const GATE_SD: Real = 5.0;
    const SPEED_MPS: Real = 2.0;
    const SPEED_SD_MPS: Real = 0.02;

    /// A belief of 2 m/s.
    fn belief() -> Gaussian<N> {
        let mut belief = Gaussian::independent(SVector::zeros(), SVector::zeros());
        belief.set_independent(V, SPEED_MPS, SPEED_SD_MPS * SPEED_SD_MPS);
        belief
    }

    fn samples(values: &[Real]) -> [Option<Real>; MAX_DRIVES] {
        let mut samples = [None; MAX_DRIVES];
        for (place, value) in samples.iter_mut().zip(values) {
            *place = Some(*value);
        }
        samples
    }

    /// Vote and measurement of wheels that are off the belief by these speeds, with these torques.
    fn vote(gated: bool, off_mps: &[Real], torques: &[Real]) -> (Control<Wheels>, Ballot) {
        let mut gate = WheelGate::new(4, SD_MPS, GATE_SD, gated);
        let mut new = samples(off_mps);
        new.iter_mut().flatten().for_each(|v| *v += SPEED_MPS);
        let lever = (0.0, LinearPitchRate::default());
        gate.control(
            &belief(),
            (&new, &samples(torques)),
            lever,
            (0.0, 0.0),
            0.01,
        )
    }

    /// Deviation from 2 m/s beyond which a wheel is rejected: five standard deviations of the speed, the wheel and its
    /// creep.
    fn limit() -> Real {
        let creep = WHEELS.spread * SPEED_MPS;
        GATE_SD * (SPEED_SD_MPS * SPEED_SD_MPS + SD_MPS * SD_MPS + creep * creep).sqrt()
    }

    /// The mean of the wheels within the limit is the measurement, with the variance of a mean; none beyond it has a
    /// part in it. Without the gate all have.
    #[test]
    fn the_mean_of_the_wheels_within_the_gate_is_measured() {
        let beyond = 1.01 * limit();
        for (off, gated, used, mean) in [
            (&[0.03, -0.01][..], true, 2, 0.01),
            (&[0.03, -0.01, beyond, -beyond], true, 2, 0.01),
            (&[0.03, -0.01, beyond, -beyond], false, 4, 0.005),
            (&[0.99 * limit()], true, 1, 0.99 * limit()),
        ] {
            let (control, ballot) = vote(gated, off, &[1.0; 4]);
            let Control::New(wheels) = control else {
                panic!("{control:?}");
            };
            assert_eq!((ballot.used, ballot.rejected), (used, off.len() - used));
            assert!((wheels.speed_mps - SPEED_MPS - mean).abs() < 1e-12);
            assert!((wheels.R() * used as Real / (SD_MPS * SD_MPS) - 1.0).abs() < 1e-9);
            assert!((ballot.limit_mps / limit() - 1.0).abs() < 1e-9);
        }
    }

    /// If all are beyond the limit, the one nearest to what is expected is told; without any there is nothing new.
    #[test]
    fn without_a_wheel_in_use_the_nearest_is_told() {
        let far = 2.0 * limit();
        for off in [[far, 3.0 * far, -2.0 * far], [3.0 * far, -2.0 * far, far]] {
            let (control, ballot) = vote(true, &off, &[]);
            assert!(matches!(control, Control::New(_)));
            assert_eq!((ballot.used, ballot.rejected), (0, 3));
            assert!(
                (ballot.speed_mps - SPEED_MPS - far).abs() < 1e-12,
                "{off:?}"
            );
        }
        let (control, ballot) = vote(true, &[], &[]);
        assert_eq!((control, ballot.speed_mps), (Control::Held, 0.0));
    }

    /// A wheel that is ahead while it drives, or behind while it brakes, slips; else, or if it stands against its
    /// torque, it is broken. Without a torque it may slip.
    #[test]
    fn a_wheel_slips_where_its_torque_takes_it() {
        let far = 2.0 * limit();
        for (off, torques, slipping) in [
            (far, &[50.0][..], 1),
            (-far, &[-50.0], 1),
            (far, &[-50.0], 0),
            (-far, &[50.0], 0),
            (far, &[], 1),
            (-far, &[], 1),
        ] {
            let (_, ballot) = vote(true, &[off], torques);
            assert_eq!(
                (ballot.rejected, ballot.slipping),
                (1, slipping),
                "{off} {torques:?}"
            );
        }
    }

    /// Wheels are expected to show the speed gained by their time and the pitch about the rail; how well the gain is
    /// known widens gate and measurement.
    #[test]
    fn wheels_are_compared_at_their_time_and_place() {
        let mut gate = WheelGate::new(1, SD_MPS, GATE_SD, true);
        let mut rate = LinearPitchRate::default();
        rate.theta_dot = 0.3;
        let expected = SPEED_MPS + 0.2 - 0.5 * 0.3;
        let new = samples(&[expected]);
        let (control, ballot) = gate.control(
            &belief(),
            (&new, &[None; MAX_DRIVES]),
            (0.5, rate),
            (0.2, 0.01),
            0.01,
        );
        let Control::New(wheels) = control else {
            panic!("{control:?}");
        };
        assert!(wheels.innovation(&belief().x).abs() < 1e-12);
        assert!((wheels.R() - SD_MPS * SD_MPS - 0.01).abs() < 1e-12);
        let creep = WHEELS.spread * expected;
        let known = SPEED_SD_MPS * SPEED_SD_MPS + SD_MPS * SD_MPS + creep * creep;
        let limit = GATE_SD * (known + 0.01).sqrt();
        assert!((ballot.limit_mps / limit - 1.0).abs() < 1e-9);
    }

    /// Wheels of another size are told from the mean of all of them over 20 s, while all roll; then they agree. At a
    /// crawl, and with a wheel missing, nothing is learnt.
    #[test]
    fn the_sizes_of_the_wheels_are_learnt_while_all_roll() {
        for (speed, wheels, learnt) in [
            (2.0, 4, true),
            (-2.0, 4, true),
            (0.05, 4, false),
            (2.0, 3, false),
        ] {
            let mut gate = WheelGate::new(4, SD_MPS, GATE_SD, true);
            let mut belief = belief();
            belief.x[V] = speed;
            let sizes = [1.02, 0.99, 1.0, 0.99];
            let new = samples(&sizes.map(|size| size * speed)[..wheels]);
            let mut range_after = |seconds: Real| {
                for _ in 0..(seconds / 0.01) as usize {
                    let lever = (0.0, LinearPitchRate::default());
                    gate.control(
                        &belief,
                        (&new, &[None; MAX_DRIVES]),
                        lever,
                        (0.0, 0.0),
                        0.01,
                    );
                }
                let left = sizes
                    .iter()
                    .zip(&gate.scale)
                    .map(|(size, scale)| size / (1.0 + scale));
                let [low, high] = left.fold([Real::MAX, 0.0], |[low, high], size| {
                    [low.min(size), high.max(size)]
                });
                (high - low) / 0.03
            };
            let (soon, late) = (range_after(20.0), range_after(200.0));
            let expected = if learnt {
                [(-1.0 as Real).exp(), 0.0]
            } else {
                [1.0, 1.0]
            };
            assert!(
                (soon - expected[0]).abs() < 0.02,
                "{speed} {wheels}: {soon}"
            );
            assert!(
                (late - expected[1]).abs() < 0.02,
                "{speed} {wheels}: {late}"
            );
        }
    }

    /// Without the slip gate a wheel that reads 0, or turns the other way, for an hour has the largest scale that a
    /// wheel may have.
    #[test]
    fn a_wheel_that_stays_behind_has_a_scale_that_is_possible() {
        for stuck in [0.0, -2.0] {
            let mut gate = WheelGate::new(4, SD_MPS, GATE_SD, false);
            let mut belief = belief();
            belief.x[V] = 2.0;
            let (new, lever) = (samples(&[2.0, 2.0, 2.0, stuck]), LinearPitchRate::default());
            for _ in 0..360_000 {
                let torques = (&new, &[None; MAX_DRIVES]);
                gate.control(&belief, torques, (0.0, lever), (0.0, 0.0), 0.01);
            }
            let most = WHEELS.max_scale;
            assert!(gate.scale.iter().all(|scale| scale.abs() <= most));
            assert_eq!(gate.scale[3], -most);
        }
    }

    /// Three wheels or more, all there are, that agree with each other to six standard deviations and their creep, to
    /// either side, contradict what is expected unless they slip. Fewer, or one that is within the gate, do not.
    #[test]
    fn wheels_that_agree_contradict() {
        for speed in [10.0, -10.0, 0.5 as Real] {
            let range = STATISTICS.fault_sd * SD_MPS + WHEELS.spread * speed.abs();
            let contradicts = |off: &[Real], torque: Real| {
                let gate = WheelGate::new(4, SD_MPS, GATE_SD, true);
                let values: std::vec::Vec<Real> = off.iter().map(|off| speed + off).collect();
                let predicted = speed - 2.0;
                let new = samples(&values);
                gate.vote(&new, &samples(&[torque; 4]), predicted, 1.0)
                    .contradicts
            };
            // the range of the largest, which is the one that creeps most
            let most = |by: Real| {
                if speed > 0.0 {
                    [0.0, -by, 0.0, -0.5 * by]
                } else {
                    [0.0, by, 0.0, 0.5 * by]
                }
            };
            let largest = most(0.98 * range);
            assert!(contradicts(&largest, -1.0), "{speed}");
            assert!(contradicts(&largest[..3], -1.0));
            assert!(!contradicts(&largest[..2], -1.0));
            assert!(!contradicts(&most(1.02 * range), -1.0), "{speed}");
            assert!(!contradicts(&largest, 1.0));
            assert!(!contradicts(&[0.0, 0.0, 0.0, -2.0], -1.0));
        }
    }
}
