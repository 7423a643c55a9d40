//! Blocks of the force balance: means over half a second, with the acceleration in five parts.
//!
//! The acceleration of a block is the difference of the filter's speeds at its ends over its length, whose noise is 1.6
//! mm/s²: small enough for a regressor (no errors-in-variables treatment) but for hours at one speed on an even grade
//! (`docs/notes/rail_fusion.md`, "A regressor that is noise"). The accelerometer only shares it out within
//! the block.

use crate::Real;
use crate::api::aid::{AidOutcome, Rejection};
use crate::api::real::{sqrt, stored};
use crate::api::snapshot::{Blank, state};
use crate::models::swing::SUBSTEPS;
use crate::rail::rail_memory::{Place, RailMemory};
use crate::tuning::BLOCK;

/// Signals of one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BlockInput {
    /// Speed by the attitude filter, m/s.
    pub speed_mps: Real,
    /// Standard deviation of the speed without the part that is common to a block, m/s.
    pub speed_noise_mps: Real,
    /// Acceleration by the accelerometer, m/s².
    pub acceleration_mps2: Real,
    /// Traction at the rims, N, and its variance; `None` if too few torques are known.
    pub traction: Option<[Real; 2]>,
    /// Possible delay of the traction, s.
    pub traction_lag_s: Real,
    /// Velocity random walk of the accelerometer, learnt, m/s/√s.
    pub seen_walk: Real,
    /// Horizontal curvature without its sign, 1/m.
    pub bend_per_m: Real,
    /// Brake applied, 0…1.
    pub brake: Real,
    /// True if the IMU and at least one wheel are in use.
    pub sound: bool,
    /// True if a wheel slips.
    pub slip: bool,
    /// True if the torques are doubtful.
    pub doubt: bool,
}

/// Means over a block, in single precision: from the sixth digit on they are noise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Block {
    /// Middle of the distance covered.
    pub place: Place,
    /// Traction, N.
    pub traction_n: f32,
    /// Variance of the traction, N², including the inertia.
    pub variance: f32,
    /// Speed, m/s.
    pub speed_mps: f32,
    /// Standard deviation of the noise of the acceleration of a part, m/s², if it exceeds the model's noise; else 0.
    part_noise_mps2: f32,
    /// Acceleration in parts, m/s².
    acceleration_mps2: [f32; SUBSTEPS],
    /// Length of a part, s.
    substep_s: f32,
    /// Fused, or the reason why the block cannot be fused: braked, without an instrument, slip, torques in doubt.
    pub outcome: AidOutcome,
}

impl Block {
    /// Mean acceleration, m/s².
    pub fn mean_acceleration(&self) -> Real {
        self.accelerations().iter().sum::<Real>() / SUBSTEPS as Real
    }

    /// Acceleration in parts, m/s².
    pub fn accelerations(&self) -> [Real; SUBSTEPS] {
        self.acceleration_mps2.map(Real::from)
    }

    /// Standard deviation of the noise of the acceleration of a part, m/s², if it exceeds the model's noise; else 0.
    pub fn part_noise_mps2(&self) -> Real {
        Real::from(self.part_noise_mps2)
    }

    /// Length of a part, s.
    pub fn substep_s(&self) -> Real {
        Real::from(self.substep_s)
    }

    /// Length of the block, s.
    pub fn length_s(&self) -> Real {
        self.substep_s() * SUBSTEPS as Real
    }
}

/// Collects samples into blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BlockBuilder {
    started: Option<(Place, Real)>,
    with_traction: u32,
    traction: Real,
    variance: Real,
    speed: Real,
    noise: Real,
    brake: Real,
    unsound: bool,
    slip: bool,
    doubt: bool,
    part: usize,
    parts: [Real; SUBSTEPS],
    part_s: Real,
    part_way: Real,
    /// Speed at the beginning of the part, m/s.
    part_mps: Real,
    /// Largest random walk of the accelerometer, m/s/√s, and possible delay of the traction, s.
    seen_walk: Real,
    lag_s: Real,
    /// First and last traction, N.
    tractions: Option<[Real; 2]>,
    length_s: Real,
}

impl BlockBuilder {
    /// Takes a sample, with the total mass by the last block, kg; returns a block when it is complete.
    pub fn take(
        &mut self,
        z: &BlockInput,
        mass_kg: Real,
        rail: &RailMemory,
        dt: Real,
    ) -> Option<Block> {
        let (start, start_mps) = *self.started.get_or_insert((rail.here(), z.speed_mps));
        if self.length_s == 0.0 {
            self.part_mps = start_mps;
        }
        self.speed += z.speed_mps * dt;
        self.seen_walk = self.seen_walk.max(z.seen_walk);
        self.lag_s = self.lag_s.max(z.traction_lag_s);
        self.noise = self.noise.max(z.speed_noise_mps);
        if let Some([traction, variance]) = z.traction {
            self.with_traction += 1;
            self.traction += traction;
            let [first, _] = self.tractions.unwrap_or([traction; 2]);
            self.tractions = Some([first, traction]);
            self.variance += variance;
        }
        self.brake = self.brake.max(z.brake);
        self.unsound |= !z.sound || z.traction.is_none();
        self.slip |= z.slip;
        self.doubt |= z.doubt;
        self.part_way += z.acceleration_mps2 * dt;
        self.part_s += dt;
        self.length_s += dt;
        if self.part_s < BLOCK.substep_s - 1e-6 {
            return None;
        }
        let by_speed = (z.speed_mps - self.part_mps) / self.part_s;
        let [_, share] = self.part_noise();
        if let Some(part) = self.parts.get_mut(self.part) {
            let by_force = self.part_way / self.part_s;
            *part = by_force + share * (by_speed - by_force);
        }
        self.part_mps = z.speed_mps;
        self.part += 1;
        (self.part_s, self.part_way) = (0.0, 0.0);
        if self.part < SUBSTEPS {
            return None;
        }
        let by_speed = (z.speed_mps - start_mps) / self.length_s;
        let shift = by_speed - self.parts.iter().sum::<Real>() / SUBSTEPS as Real;
        let count = self.with_traction.max(1) as Real;
        let block = Block {
            place: rail.between(start, rail.here()),
            traction_n: stored(self.traction / count),
            variance: stored(
                self.variance / (count * count)
                    + self.inertia_variance(mass_kg)
                    + self.late_variance(),
            ),
            speed_mps: stored(self.speed / self.length_s),
            part_noise_mps2: stored(self.part_noise()[0]),
            acceleration_mps2: self.parts.map(|a| stored(a + shift)),
            substep_s: stored(self.length_s / SUBSTEPS as Real),
            outcome: self.outcome(),
        };
        *self = Self {
            started: Some((rail.here(), z.speed_mps)),
            ..Self::default()
        };
        Some(block)
    }
}

impl BlockBuilder {
    fn outcome(&self) -> AidOutcome {
        if self.brake > BLOCK.max_brake {
            AidOutcome::Rejected(Rejection::NotRunning)
        } else if self.unsound {
            AidOutcome::Stale
        } else if self.slip {
            AidOutcome::Rejected(Rejection::Slip)
        } else if self.doubt {
            AidOutcome::Rejected(Rejection::Gate)
        } else {
            AidOutcome::Fused
        }
    }

    /// Standard deviation of the noise of the acceleration of a part, m/s², 0 up to the nominal noise, and the share of
    /// the speed at its ends in it, beside the shaken accelerometer.
    fn part_noise(&self) -> [Real; 2] {
        let by_force = self.seen_walk * self.seen_walk / BLOCK.substep_s;
        if by_force < BLOCK.nominal_part_mps2 * BLOCK.nominal_part_mps2 {
            return [0.0; 2];
        }
        let speed = self.noise / BLOCK.substep_s;
        let by_speed = 2.0 * speed * speed;
        let share = by_force / (by_force + by_speed);
        [sqrt(share * by_speed), share]
    }

    /// Variance of the traction due to its possible delay, N².
    fn late_variance(&self) -> Real {
        let [first, last] = self.tractions.unwrap_or_default();
        let late = self.lag_s / self.length_s.max(BLOCK.substep_s) * (last - first);
        late * late
    }

    /// Variance of the force of inertia of `mass_kg` due to the noise of the speed, beyond the model's noise, N².
    fn inertia_variance(&self, mass_kg: Real) -> Real {
        let noise = self.noise / self.length_s.max(BLOCK.substep_s);
        let beyond = (2.0 * noise * noise - BLOCK.nominal_mps2 * BLOCK.nominal_mps2).max(0.0);
        mass_kg * mass_kg * beyond
    }
}

impl Blank for Block {
    fn blank() -> Self {
        Self::default()
    }
}

impl Blank for Place {
    fn blank() -> Self {
        Self::default()
    }
}

state!(Block { place, traction_n, variance, speed_mps, part_noise_mps2, acceleration_mps2, substep_s, outcome; });
state!(BlockBuilder { started, with_traction, traction, variance, speed, noise, brake, unsound, slip, doubt, part, parts, part_s, part_way, part_mps, seen_walk, lag_s, tractions, length_s; } where |this| this.part < SUBSTEPS);

#[cfg(test)]
mod tests {
    use super::*;

    const DT: Real = 0.01;

    /// The block of the samples 1 to 50, which begins at sample 0; the total mass is 10 t.
    fn block(sample: impl Fn(i32) -> BlockInput) -> Block {
        let (mut builder, mut rail) = (BlockBuilder::default(), RailMemory::new(12.0));
        let mut last = None;
        for k in -49..=50 {
            let z = sample(k);
            rail.step(z.speed_mps * DT, Some([0.0, 0.0]));
            last = last.or(builder.take(&z, 10_000.0, &rail, DT).filter(|_| k == 50));
        }
        last.unwrap()
    }

    fn running(k: i32) -> BlockInput {
        BlockInput {
            speed_mps: 1.0 + 0.3 * DT * Real::from(k as i16),
            acceleration_mps2: 0.3,
            traction: Some([1_000.0 + 10.0 * Real::from(k as i16), 400.0]),
            sound: true,
            ..BlockInput::default()
        }
    }

    /// Speed and traction are means over the samples, the acceleration is that of the speeds at its ends; the mean of
    /// 50 tractions has a fiftieth of their variance.
    #[test]
    fn a_block_is_the_mean_of_its_samples() {
        let block = block(running);
        let near = |found: f32, expected: Real| {
            assert!(
                (Real::from(found) / expected - 1.0).abs() < 1e-6,
                "{found} {expected}"
            );
        };
        near(block.traction_n, 1_255.0);
        near(block.variance, 8.0);
        near(block.speed_mps, 1.0 + 0.3 * 0.255);
        assert!((block.length_s() - 0.5).abs() < 1e-6 && (block.substep_s() - 0.1).abs() < 1e-6);
        assert!((block.mean_acceleration() - 0.3).abs() < 1e-6);
        assert_eq!(block.outcome, AidOutcome::Fused);
    }

    /// On a rail whose reading is a thousandth of the way, that at a block is that of the middle of its way.
    #[test]
    fn a_block_is_in_the_middle_of_its_way() {
        let (mut builder, mut rail) = (BlockBuilder::default(), RailMemory::new(12.0));
        let (mut way_m, mut start_m, mut blocks) = (0.0, 0.0, 0);
        for k in 0..250 {
            let z = running(k);
            way_m += z.speed_mps * DT;
            rail.step(z.speed_mps * DT, Some([1e-3 * way_m, 0.0]));
            if k == 0 {
                start_m = way_m;
            }
            if let Some(block) = builder.take(&z, 10_000.0, &rail, DT) {
                let found_m = 1e3 * rail.at(block.place, 0.0, 0.0).u;
                let middle_m = 0.5 * (start_m + way_m);
                assert!((found_m - middle_m).abs() < 0.01, "{found_m} {middle_m}");
                (start_m, blocks) = (way_m, blocks + 1);
            }
        }
        assert_eq!(blocks, 5);
    }

    /// The accelerometer shares the acceleration out within the block, whatever its bias. One that is shaken is weighed
    /// against the speeds at the ends of each part, by what both know of it.
    #[test]
    fn the_parts_are_those_of_the_instrument_that_knows_them() {
        let shape = [0.2, -0.1, 0.3, 0.0, 0.1];
        let other = [-0.1, 0.3, 0.0, 0.1, 0.2];
        for (walk, noise) in [
            (0.0, 0.01),
            (0.03, 0.01),
            (0.1, 0.01),
            (0.1, 0.002),
            (-0.1, 0.01),
        ] {
            let walk = walk as Real;
            let found = block(|k| {
                let part = |of: [Real; SUBSTEPS]| of[((k - 1).max(0) / 10) as usize];
                let speed: Real = (1..=k).map(|k| DT * other[((k - 1) / 10) as usize]).sum();
                BlockInput {
                    speed_mps: 1.0 + speed,
                    acceleration_mps2: part(shape) + 0.7,
                    speed_noise_mps: noise,
                    seen_walk: walk.abs(),
                    ..running(k)
                }
            });
            let by_force = walk * walk / 0.1;
            let by_speed = 2.0 * (noise / 0.1) * (noise / 0.1);
            let shaken = by_force >= 1e-4;
            let share = if shaken {
                by_force / (by_force + by_speed)
            } else {
                0.0
            };
            for (found, (by_force, by_speed)) in
                found.accelerations().iter().zip(shape.iter().zip(other))
            {
                let expected = by_force + share * (by_speed - by_force);
                assert!(
                    (found - expected).abs() < 1e-6,
                    "{walk}: {found} {expected}"
                );
            }
            let sd = (share * by_speed).sqrt();
            assert!((found.part_noise_mps2() - sd).abs() < 1e-6, "{walk}: {sd}");
        }
    }

    /// The force of inertia has the noise of the speeds at both ends over the length beyond 2.5 mm/s², and a traction
    /// that may be late what it changes by in that time: by squares.
    #[test]
    fn each_noise_adds_its_variance() {
        for (noise, lag_s) in [
            (0.0, 0.0),
            (5e-4, 0.0),
            (0.003, 0.0),
            (0.0, 0.2),
            (0.003, 0.4),
        ] {
            // the largest of the block counts
            let largest = |k: i32, of: Real| if k == 20 { of } else { 0.5 * of };
            let found = block(|k| BlockInput {
                speed_noise_mps: largest(k, noise),
                traction_lag_s: largest(k, lag_s),
                ..running(k)
            });
            let by_speed = 2.0 * (noise / 0.5) * (noise / 0.5);
            let late = lag_s / 0.5 * 490.0;
            let inertia = 1e8 * (by_speed - 2.5e-3 * 2.5e-3).max(0.0);
            let expected = 8.0 + late * late + inertia;
            assert!((Real::from(found.variance) / expected - 1.0).abs() < 1e-6);
        }
    }

    /// One sample that is of no use spoils its block, and says why: the brake before a missing instrument, that before
    /// slip, and slip before torques in doubt.
    #[test]
    fn one_sample_spoils_a_block() {
        let fine = running(20);
        let doubted = BlockInput {
            doubt: true,
            ..fine
        };
        let slips = BlockInput {
            slip: true,
            ..doubted
        };
        let unsound = BlockInput {
            sound: false,
            ..slips
        };
        let untorqued = BlockInput {
            traction: None,
            ..slips
        };
        let braked = BlockInput {
            brake: 0.0021,
            ..unsound
        };
        let brushed = BlockInput {
            brake: 0.0019,
            ..fine
        };
        for (sample, outcome) in [
            (fine, AidOutcome::Fused),
            (brushed, AidOutcome::Fused),
            (doubted, AidOutcome::Rejected(Rejection::Gate)),
            (slips, AidOutcome::Rejected(Rejection::Slip)),
            (unsound, AidOutcome::Stale),
            (untorqued, AidOutcome::Stale),
            (braked, AidOutcome::Rejected(Rejection::NotRunning)),
        ] {
            for at in [1, 20, 50] {
                let found = block(|k| if k == at { sample } else { running(k) });
                assert_eq!(found.outcome, outcome, "{at}");
            }
            // the next block is another
            assert_eq!(
                block(|k| if k == 0 { sample } else { running(k) }).outcome,
                AidOutcome::Fused
            );
        }
        // the mean is that of the torques there are
        let half = block(|k| BlockInput {
            traction: running(k).traction.filter(|_| k % 2 == 0),
            ..running(k)
        });
        assert!((half.traction_n - 1_260.0).abs() < 1e-3 && (half.variance - 16.0).abs() < 1e-3);
    }
}
