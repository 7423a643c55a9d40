//! Effective grade: mean over the masses by the rail memory, and by the force balance where the rail was not read.

use crate::Real;
use crate::api::real::{GRAVITY, asin, exp, sqrt};
use crate::api::signals::Value;
use crate::api::snapshot::state;
use crate::models::force_balance::MAX_GRADE_RAD;
use crate::rail::mass_on_rail::MassOnRail;
use crate::rail::rail_memory::RailMemory;
use crate::rail::train_means::TrainOnRail;
use crate::tuning::{BLOCK, EFFECTIVE, MEMORY, RAIL};

/// The effective grade.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EffectiveGrade {
    correction: Real,
    age_s: Real,
    way_m: Real,
    sine: Real,
    variance: Real,
    looked: bool,
    /// Distance gone back since the last check, m.
    back_m: Real,
    /// Distance gone back onto unread rail, m, less what the force has measured of it since.
    blind_m: Real,
    /// Standard deviation of the mean grade due to this distance, rad.
    blind_rad: Real,
}

/// Effective grade of a block by its force, compared with the grade of the rail as read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GradeByForce {
    /// Way of the block, m.
    pub way_m: Real,
    /// Variance of the mean grade due to unread rail, rad².
    pub unread_variance: Real,
    /// Sine of the grade by the force minus sine of the grade by the rail as read, and its variance; `None` if the
    /// force of the block cannot be used.
    pub difference: Option<[Real; 2]>,
}

/// Motion of the unit that carries the IMU, and the uncertainty of its grade.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UnitGrade {
    /// Speed, m/s.
    pub speed_mps: Real,
    /// Bias of the accelerometer along the body, m/s².
    pub bias_mps2: Real,
    /// Standard deviation of the pitch, rad.
    pub pitch_sd_rad: Real,
    /// Additional standard deviation from the mount and the reading of the rail, rad.
    pub constant_sd_rad: Real,
}

impl EffectiveGrade {
    /// Corrects the grade of unread rail by the force of a block: its doubt against the noise of the force. Where the
    /// force is of no use, the correction fades over the way.
    pub fn correct(&mut self, block: &GradeByForce) {
        let unread = block.unread_variance + self.blind_rad * self.blind_rad;
        match block.difference {
            Some([difference, variance]) => {
                self.blind_m *= sqrt(variance / (unread + variance));
                let correction = unread / (unread + variance) * difference;
                self.correction += EFFECTIVE.share * (correction - self.correction);
            }
            None => self.correction *= exp(-block.way_m / RAIL.eta_m),
        }
    }

    /// One step: the mean over the masses of a train on its rail.
    pub fn step(
        &mut self,
        unit: &UnitGrade,
        train: &TrainOnRail,
        mass: &MassOnRail,
        rail: &RailMemory,
        dt: Real,
    ) {
        self.age_s += dt;
        self.way_m += unit.speed_mps.abs() * dt;
        self.back_m += (-unit.speed_mps * dt).max(0.0);
        if self.looked && self.age_s < BLOCK.substep_s - 1e-6 && self.way_m < MEMORY.min_pitch_m {
            return;
        }
        (self.age_s, self.way_m, self.looked) = (0.0, 0.0, true);
        let means = train.at(rail, rail.here());
        let behind = mass.behind(&means);
        if self.back_m > 0.0 {
            self.blind_m = match behind > 0.0 {
                true => (self.blind_m + self.back_m).min(RAIL.eta_m),
                false => 0.0,
            };
            self.back_m = 0.0;
        }
        let mean = (means.tare_kg + mass.load_kg * means.load) / mass.mass_kg;
        self.sine = mean - unit.bias_mps2 / GRAVITY + mass.eta_rad * behind + self.correction;
        let (pitch, constant) = (unit.pitch_sd_rad, unit.constant_sd_rad);
        self.blind_rad = 0.5 * RAIL.max_turn_radpm * self.blind_m * behind.min(1.0);
        let off = train.at(rail, rail.ahead(rail.here(), -rail.doubt_m()));
        let by_place = (off.tare_kg + mass.load_kg * off.load) / mass.mass_kg - mean;
        let by_load = (means.load - mean) / mass.mass_kg * mass.load_sd_kg;
        self.variance = pitch * pitch
            + constant * constant
            + mass.unread_variance(&means)
            + self.blind_rad * self.blind_rad
            + by_place * by_place
            + by_load * by_load;
    }

    /// The effective grade, marked `valid` or not.
    pub fn value(&self, valid: bool) -> Value {
        Value {
            value: asin(self.sine).clamp(-MAX_GRADE_RAD, MAX_GRADE_RAD),
            sd: sqrt(self.variance),
            valid,
        }
    }
}

state!(EffectiveGrade { correction, age_s, way_m, sine, variance, looked, back_m, blind_m, blind_rad; });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::mass_layout::MassLayout;

    const DT: Real = 0.01;

    /// Where the rail was not read, the correction comes to the share of the difference that its doubt has in that of
    /// both; it is added to the mean over the train. Where the force is of no use it fades over nine metres.
    #[test]
    fn the_force_corrects_the_grade_of_rail_that_is_not_read() {
        let (rail, train, mass) = curved();
        let [sine, _] = looked(&UnitGrade::default(), &mass, &rail, 0.0);
        for (unread, variance, difference) in [(9e-4, 1e-4, 0.03), (4e-4, 4e-4, -0.02)] {
            let mut block = GradeByForce {
                way_m: 0.5,
                unread_variance: unread,
                difference: Some([difference, variance]),
            };
            let mut effective = EffectiveGrade::default();
            (0..60).for_each(|_| effective.correct(&block));
            let expected = unread / (unread + variance) * difference;
            effective.step(&UnitGrade::default(), &train, &mass, &rail, DT);
            assert!((effective.value(true).value.sin() - sine - expected).abs() < 1e-9);
            block.difference = None;
            (0..18).for_each(|_| effective.correct(&block));
            assert!((effective.correction / expected * (1.0 as Real).exp() - 1.0).abs() < 1e-9);
        }
    }

    /// Rail onto which the train has gone back is unread by its share of the masses, too; a block leaves of this doubt
    /// what is left of the variance of two independent measurements.
    #[test]
    fn the_force_measures_the_rail_behind() {
        let blind_rad = 0.03;
        let mut effective = EffectiveGrade {
            blind_m: 4.0,
            blind_rad,
            ..EffectiveGrade::default()
        };
        effective.correct(&GradeByForce {
            way_m: 0.5,
            unread_variance: 3e-4,
            difference: Some([0.02, 4e-4]),
        });
        let unread = 3e-4 + blind_rad * blind_rad;
        let share = unread / (unread + 4e-4);
        assert!((effective.correction / (EFFECTIVE.share * share * 0.02) - 1.0).abs() < 1e-9);
        let left = 1.0 / (1.0 / unread + 1.0 / 4e-4);
        assert!((effective.blind_m / (4.0 * (left / unread).sqrt()) - 1.0).abs() < 1e-9);
    }

    /// A rail that grows steeper by 0.004 rad a metre, read up to the IMU; the load hangs ahead of the tare's middle.
    fn curved() -> (RailMemory, TrainOnRail, MassOnRail) {
        let layout = MassLayout::even(5_000.0, [-2.0, 10.0], [-1.0, 3.0]);
        let train = TrainOnRail::new(&layout, true);
        let mut rail = RailMemory::new(12.0);
        for k in 0..3_000 {
            rail.step(0.01, Some([4e-5 * Real::from(k), 0.0]));
        }
        let mass = MassOnRail {
            mass_kg: 15_000.0,
            load_kg: 10_000.0,
            load_sd_kg: 0.0,
            eta_rad: 0.0,
            eta_variance: 0.0,
        };
        (rail, train, mass)
    }

    fn looked(unit: &UnitGrade, mass: &MassOnRail, rail: &RailMemory, blind_m: Real) -> [Real; 2] {
        let (_, train, _) = curved();
        let mut effective = EffectiveGrade {
            blind_m,
            ..EffectiveGrade::default()
        };
        effective.step(unit, &train, mass, rail, DT);
        [effective.sine, effective.variance]
    }

    /// Errors of different sources add by squares: pitch, mount, grade ahead of what was read, load, place, and rail
    /// behind. A place that is known to 0.4 m makes the mean uncertain by what it changes by over them; a load of
    /// another mass has the mean nearer to its own grade.
    #[test]
    fn what_is_not_known_of_the_mean_adds_by_squares() {
        let (rail, train, mass) = curved();
        let means = train.at(&rail, rail.here());
        let none = UnitGrade::default();
        let [sine, ahead] = looked(&none, &mass, &rail, 0.0);
        let per_m = 0.02 + 0.7 * rail.end_gradient();
        let ahead_m = means.ahead_kgm / 15_000.0;
        assert!(ahead_m > 0.05 && (rail.end_gradient() / 0.004 - 1.0).abs() < 0.01);
        assert!((ahead.sqrt() / (ahead_m * per_m) - 1.0).abs() < 1e-9);
        let mean = (means.tare_kg + 10_000.0 * means.load) / 15_000.0;
        assert!((sine - mean).abs() < 1e-12);
        let unit = UnitGrade {
            pitch_sd_rad: 0.003,
            constant_sd_rad: 0.004,
            ..none
        };
        let [_, variance] = looked(&unit, &mass, &rail, 0.0);
        assert!(((variance - ahead).sqrt() / 0.005 - 1.0).abs() < 1e-9);
        let unsure = MassOnRail {
            load_sd_kg: 500.0,
            ..mass
        };
        let [_, variance] = looked(&none, &unsure, &rail, 0.0);
        let heavier = (means.tare_kg + 10_500.0 * means.load) / 15_500.0;
        let by_load = (variance - ahead).sqrt();
        assert!(
            (by_load / (heavier - mean).abs() - 1.0).abs() < 0.05,
            "{by_load}"
        );
        let mut lost = rail;
        lost.doubt(0.4);
        let [_, variance] = looked(&none, &mass, &lost, 0.0);
        let by_place = (variance - ahead).sqrt();
        // the piece of the train that is ahead of the rail read is on its straight extension
        assert!((by_place / (0.4 * 0.004) - 1.0).abs() < 0.1, "{by_place}");
    }

    /// The place that is not known is looked for behind, where the rail was read: a step that the train has just left
    /// counts, and none ahead could.
    #[test]
    fn a_place_that_is_not_known_may_be_the_one_behind() {
        let (_, train, mass) = curved();
        let mut rail = RailMemory::new(14.0);
        (0..2_000).for_each(|_| rail.step(0.01, Some([0.05, 0.0])));
        (0..1_020).for_each(|_| rail.step(0.01, Some([0.0, 0.0])));
        let none = UnitGrade::default();
        let [sine, known] = looked(&none, &mass, &rail, 0.0);
        assert!(sine.abs() < 1e-9);
        rail.doubt(0.45);
        let [_, variance] = looked(&none, &mass, &rail, 0.0);
        let means = train.at(&rail, rail.ahead(rail.here(), -0.45));
        let expected = (means.tare_kg + 10_000.0 * means.load) / 15_000.0;
        assert!(expected > 1e-4, "{expected}");
        assert!(((variance - known).sqrt() / expected - 1.0).abs() < 1e-6);
    }

    /// Behind the rail read the grade is another by η nine metres behind, with its variance; going back blindly it may
    /// turn by 0.065 rad a metre, and all the train is on it at most.
    #[test]
    fn rail_behind_counts_by_the_masses_on_it() {
        let (_, train, mass) = curved();
        let mut rail = RailMemory::new(12.0);
        (0..500).for_each(|_| rail.step(0.01, Some([0.0, 0.0])));
        let means = train.at(&rail, rail.here());
        let behind = (means.behind_tare_kgm + 10_000.0 * means.behind_load_m) / 9.0 / 15_000.0;
        let none = UnitGrade::default();
        let [_, ahead] = looked(&none, &mass, &rail, 0.0);
        let steeper = MassOnRail {
            eta_rad: 0.05,
            eta_variance: 4e-4,
            ..mass
        };
        let [sine, variance] = looked(&none, &steeper, &rail, 0.0);
        assert!(behind > 0.02 && (sine / (0.05 * behind) - 1.0).abs() < 1e-9);
        assert!(((variance - ahead).sqrt() / (0.02 * behind) - 1.0).abs() < 1e-6);
        let [_, variance] = looked(&none, &mass, &rail, 4.0);
        assert!(((variance - ahead).sqrt() / (0.065 * 4.0 * behind) - 1.0).abs() < 1e-6);
        (0..3_000).for_each(|_| rail.step(-0.01, None));
        let [_, ahead] = looked(&none, &mass, &rail, 0.0);
        let [_, variance] = looked(&none, &mass, &rail, 4.0);
        assert!(((variance - ahead).sqrt() / 0.26 - 1.0).abs() < 1e-6);
    }

    /// The way gone back is counted while a part of the train is behind the read rail, up to nine metres; forwards none
    /// is, and once all the train is on read rail it is forgotten.
    #[test]
    fn the_way_gone_back_onto_unread_rail_is_counted() {
        let (_, train, mass) = curved();
        let mut rail = RailMemory::new(12.0);
        (0..500).for_each(|_| rail.step(0.01, Some([0.0, 0.0])));
        let mut effective = EffectiveGrade::default();
        let mut go = |way_m: Real, rail: &RailMemory| {
            let unit = UnitGrade {
                speed_mps: way_m,
                ..UnitGrade::default()
            };
            effective.step(&unit, &train, &mass, rail, 1.0);
            effective.blind_m
        };
        assert_eq!(
            [go(-1.5, &rail), go(2.0, &rail), go(-1.0, &rail)],
            [1.5, 1.5, 2.5]
        );
        assert_eq!(go(-9.0, &rail), 9.0);
        let unread = rail;
        (0..1_000).for_each(|_| rail.step(0.01, Some([0.0, 0.0])));
        assert_eq!([go(0.5, &rail), go(-0.5, &rail)], [9.0, 0.0]);
        assert_eq!(go(-0.5, &unread), 0.5);
    }

    /// The memory is looked at every tenth of a second or of a metre, whichever comes first.
    #[test]
    fn the_memory_is_looked_at_every_tenth() {
        let (rail, train, mass) = curved();
        for (speed_mps, steps) in [(0.0, 10_u8), (0.9, 10), (2.0, 5), (-2.0, 5)] {
            let mut effective = EffectiveGrade::default();
            let mut last = None;
            for k in 0..=steps {
                let unit = UnitGrade {
                    speed_mps: 1.001 * speed_mps,
                    bias_mps2: 0.01 * Real::from(k),
                    ..UnitGrade::default()
                };
                effective.step(&unit, &train, &mass, &rail, DT);
                let now = Some(effective.value(true).value);
                assert_eq!(now != last, k % steps == 0, "{speed_mps}: {k}");
                last = now;
            }
        }
    }
}
