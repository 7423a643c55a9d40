//! Effective grade: mean over the masses by the rail memory, and by the force balance where the rail was not read.

use crate::Real;
use crate::api::aid::AidOutcome;
use crate::api::real::{GRAVITY, asin, exp, sqrt};
use crate::api::signals::Value;
use crate::api::snapshot::state;
use crate::fusion::swing_balance::SwingMass;
use crate::fusion::swing_balance::block::Block;
use crate::models::force_balance::MAX_GRADE_RAD;
use crate::models::swing_balance::{ANGLE, B, CV, MASS, Nominal, QC, R0};
use crate::rail::mass_on_rail::MassOnRail;
use crate::rail::rail_memory::RailMemory;
use crate::rail::train_means::TrainOnRail;
use crate::tuning;

/// The effective grade.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EffectiveGrade {
    correction: Real,
    age_s: Real,
    way_m: Real,
    sine: Real,
    variance: Real,
    looked: bool,
    /// Way gone back over unread rail since the force last measured the grade, m.
    blind_m: Real,
}

/// Motion of the unit that carries the IMU, and how well its grade is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UnitGrade {
    /// Speed, m/s.
    pub speed_mps: Real,
    /// Bias of the accelerometer along the body, m/s².
    pub bias_mps2: Real,
    /// Standard deviation of the pitch, rad.
    pub pitch_sd_rad: Real,
    /// Standard deviation that the mount and the reading of the rail add to it, rad.
    pub constant_sd_rad: Real,
}

impl EffectiveGrade {
    /// Takes a new block for the correction by force.
    pub fn correct(
        &mut self,
        block: &Block,
        mass: &SwingMass,
        nominal: &Nominal,
        rail: &RailMemory,
    ) {
        let v = Real::from(block.speed_mps);
        let use_it = block.outcome == AidOutcome::Fused
            && v.abs() > tuning::MOTION.force_mps
            && mass.has_weighed();
        let (means, carried) = (mass.train().at(rail, block.place), mass.carried());
        if !use_it {
            let way = v.abs() * block.length_s();
            if carried.behind_variance(&means)
                > tuning::EFFECTIVE.unread_sd_rad * tuning::EFFECTIVE.unread_sd_rad
            {
                self.correction *= exp(-way / tuning::RAIL.fade_m);
                // only going back brings rail under the train that nothing has read
                let back = if v < 0.0 { way } else { 0.0 };
                self.blind_m = (self.blind_m + back).min(tuning::RAIL.max_blind_m);
            } else {
                self.correction *= tuning::EFFECTIVE.left;
                self.blind_m = 0.0;
            }
            return;
        }
        self.blind_m = 0.0;
        let x = &mass.found().x;
        let (M, s, a) = (
            mass.mass_kg(),
            if v < 0.0 { -1.0 } else { 1.0 },
            block.mean_acceleration(),
        );
        let resistance = nominal.mu_load * GRAVITY * means.load_cos * M
            + x[R0] * (1.0 - nominal.load_share * (1.0 - means.load_cos))
            + x[CV] * v.abs()
            + x[QC] * means.bend_per_m;
        let uphill = Real::from(block.traction_n) - (nominal.rotating_kg + M) * a - s * resistance
            + M * x[B];
        let read = GRAVITY * (means.tare_deep_kg + x[MASS] * means.load_deep);
        // The part that η explains is in the mean already.
        let by_eta = carried.eta_rad * carried.behind(&means);
        let difference = (uphill - read) / (M * GRAVITY) - by_eta;
        let unread = carried.unread_variance(&means, rail);
        let of = |sd: Real| sd * sd;
        let force = of(tuning::EFFECTIVE.force_sd_rad)
            + of(tuning::EFFECTIVE.force_motion * a / GRAVITY)
            + of(tuning::EFFECTIVE.force_motion * x[ANGLE] * x[MASS] / M);
        let weight = unread / (unread + force);
        self.correction += tuning::EFFECTIVE.share * (weight * difference - self.correction);
    }

    /// Counts the way gone back onto rail that nothing has read, for an estimator without a correction by force.
    pub fn go(&mut self, way_m: Real, train: &TrainOnRail, mass: &MassOnRail, rail: &RailMemory) {
        if way_m >= 0.0 {
            return;
        }
        let means = train.at(rail, rail.here());
        match mass.behind_variance(&means)
            > tuning::EFFECTIVE.unread_sd_rad * tuning::EFFECTIVE.unread_sd_rad
        {
            true => self.blind_m = (self.blind_m - way_m).min(tuning::RAIL.max_blind_m),
            false => self.blind_m = 0.0,
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
        if self.looked
            && self.age_s < tuning::BLOCK.substep_s - 1e-6
            && self.way_m < tuning::MEMORY.min_pitch_m
        {
            return;
        }
        (self.age_s, self.way_m, self.looked) = (0.0, 0.0, true);
        let means = train.at(rail, rail.here());
        let behind = mass.behind(&means);
        let mean = (means.tare_kg + mass.load_kg * means.load) / mass.mass_kg;
        self.sine = mean - unit.bias_mps2 / GRAVITY + mass.eta_rad * behind + self.correction;
        let (pitch, constant) = (unit.pitch_sd_rad, unit.constant_sd_rad);
        let blind = tuning::RAIL.blind_rad_per_m * self.blind_m * behind.min(1.0);
        let doubt_m = rail.doubt_m();
        let by_place = match doubt_m > 0.0 {
            true => {
                let off = train.at(rail, rail.ahead(rail.here(), -doubt_m));
                (off.tare_kg + mass.load_kg * off.load) / mass.mass_kg - mean
            }
            false => 0.0,
        };
        let by_load = (means.load - mean) / mass.mass_kg * mass.load_sd_kg;
        self.variance = pitch * pitch
            + constant * constant
            + mass.unread_variance(&means, rail)
            + blind * blind
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

state!(EffectiveGrade { correction, age_s, way_m, sine, variance, looked, blind_m; });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::mass_layout::MassLayout;
    use crate::fusion::swing_balance::block::{BlockBuilder, BlockInput};
    use crate::testing::vehicles::vehicle;

    const DT: Real = 0.01;
    const SINE: Real = 0.2;
    const BEND_PER_M: Real = 0.05;

    /// A block of half a second from the speed `from_mps` on, with this acceleration and traction.
    fn block(rail: &RailMemory, from_mps: Real, a: Real, traction_n: Real, sound: bool) -> Block {
        let mut builder = BlockBuilder::default();
        let take = |k: u16| {
            let z = BlockInput {
                speed_mps: from_mps + a * DT * Real::from(k),
                acceleration_mps2: a,
                traction: Some([traction_n, 100.0]),
                sound,
                ..BlockInput::default()
            };
            builder.take(&z, 10_000.0, rail, DT)
        };
        (0..60).find_map(take).unwrap()
    }

    /// A train of 12 m with its IMU in the middle and its load on chains of this length or none, weighed on a slope in
    /// a bend, which has been read up to the IMU.
    fn weighed(chain_m: Real) -> (RailMemory, SwingMass, Nominal) {
        let of = vehicle();
        let mut layout = MassLayout::even(of.tare_kg, [-6.0, 6.0], [-6.0, 6.0]);
        (layout.load_share_of_resistance, layout.load.chain_m) = (0.6, chain_m);
        let train = TrainOnRail::new(&layout, true);
        let nominal = Nominal::new(&of, &layout, None, 0.01);
        let (params, supervision) = (Default::default(), Default::default());
        let mut mass = SwingMass::new(nominal, train, params, supervision, of.drives);
        let mut rail = RailMemory::new(12.0);
        for k in 0..4_000 {
            let a: Real = 0.2 * (0.02 * Real::from(k as f32)).sin();
            let z = BlockInput {
                speed_mps: 1.0 - 0.1 * (0.02 * Real::from(k as f32)).cos(),
                acceleration_mps2: a,
                traction: Some([15_000.0 * (9.81 * (SINE + 0.021) + 1.1 * a), 100.0]),
                bend_per_m: BEND_PER_M,
                sound: true,
                ..BlockInput::default()
            };
            rail.step(z.speed_mps * DT, Some([SINE, BEND_PER_M]));
            let mass_kg = mass.mass_kg();
            mass.step(&z, mass_kg, &rail, DT);
        }
        assert!(mass.has_weighed());
        (rail, mass, nominal)
    }

    /// Mechanics say what force takes the train up a grade that is another by 0.03 in the mean than the one read, to
    /// both sides and while it gathers speed: the correction comes to that, weighed by how uncertain the rail ahead is
    /// against the balance. It is added to the mean over the train less the bias. After blocks of no use it fades.
    #[test]
    fn the_force_tells_the_grade_of_rail_that_is_not_read() {
        for chain_m in [0.0, 0.6] {
            let (rail, mass, nominal) = weighed(chain_m);
            let (x, M, carried) = (mass.found().x, mass.mass_kg(), mass.carried());
            let means = mass.train().at(&rail, rail.here());
            let square = |value: Real| value * value;
            for (from_mps, a, other) in [
                (1.0, 0.0, 0.03),
                (-1.0, 0.0, 0.03),
                (0.5, 0.3, -0.03),
                (-2.0, 0.1, 0.01),
            ] {
                let at_rest = block(&rail, from_mps, a, 0.0, true);
                let (v, a) = (Real::from(at_rest.speed_mps), at_rest.mean_acceleration());
                let against = 0.6 * nominal.mu * GRAVITY * M * means.load_cos
                    + x[R0] * (1.0 - 0.6 * (1.0 - means.load_cos))
                    + x[CV] * v.abs()
                    + x[QC] * BEND_PER_M;
                let weight = GRAVITY * (means.tare_deep_kg + x[MASS] * means.load_deep + M * other);
                let traction =
                    (nominal.rotating_kg + M) * a + v.signum() * against - M * x[B] + weight;
                let now = block(&rail, from_mps, a, traction, true);
                let mut effective = EffectiveGrade::default();
                (0..40).for_each(|_| effective.correct(&now, &mass, &nominal, &rail));
                // 0.02 rad for each metre ahead on a rail of one gradient, against 0.001 rad and twice the acceleration
                // over g and the swing
                let ahead_m = means.ahead_kgm / M;
                let unread = square(0.02 * ahead_m) + carried.behind_variance(&means);
                let swing = x[ANGLE] * x[MASS] / M;
                assert_eq!(swing.abs() > 1e-3, chain_m > 0.0, "{swing}");
                let force = square(0.001) + square(2.0 * a / GRAVITY) + square(2.0 * swing);
                let eta = carried.eta_rad * carried.behind(&means);
                let expected = unread / (unread + force) * (other - eta);
                let found = effective.correction;
                assert!(
                    (found - expected).abs() < 2e-4,
                    "{from_mps} {a}: {found} {expected}"
                );
                let unit = UnitGrade {
                    bias_mps2: 0.1,
                    ..UnitGrade::default()
                };
                effective.step(&unit, mass.train(), &carried, &rail, DT);
                let sine = SINE - 0.1 / GRAVITY + found + eta;
                assert!((effective.value(true).value.sin() - sine).abs() < 1e-4);
                let useless = block(&rail, from_mps, a, traction, false);
                effective.correct(&useless, &mass, &nominal, &rail);
                assert!((effective.correction / found - tuning::EFFECTIVE.left).abs() < 1e-9);
            }
        }
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
    /// turn by 0.05 rad a metre, and all the train is on it at most.
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
        assert!(((variance - ahead).sqrt() / (0.05 * 4.0 * behind) - 1.0).abs() < 1e-6);
        (0..3_000).for_each(|_| rail.step(-0.01, None));
        let [_, ahead] = looked(&none, &mass, &rail, 0.0);
        let [_, variance] = looked(&none, &mass, &rail, 4.0);
        assert!(((variance - ahead).sqrt() / 0.2 - 1.0).abs() < 1e-6);
    }

    /// The way gone back is counted while rail behind is unread, up to ten metres; forwards none is, and where the rail
    /// is known it is forgotten.
    #[test]
    fn the_way_gone_back_onto_unread_rail_is_counted() {
        let (_, train, mass) = curved();
        let mut rail = RailMemory::new(12.0);
        (0..500).for_each(|_| rail.step(0.01, Some([0.0, 0.0])));
        let unread = MassOnRail {
            eta_variance: 1.0,
            ..mass
        };
        let mut effective = EffectiveGrade::default();
        let mut go = |way_m: Real, mass: &MassOnRail| {
            effective.go(way_m, &train, mass, &rail);
            effective.blind_m
        };
        assert_eq!(
            [go(-1.5, &unread), go(2.0, &unread), go(-1.0, &unread)],
            [1.5, 1.5, 2.5]
        );
        assert_eq!(
            [go(-9.0, &unread), go(0.5, &mass), go(-0.5, &mass)],
            [10.0, 10.0, 0.0]
        );
        // the limit is 0.002 rad in the mean
        let means = train.at(&rail, rail.here());
        let behind = (means.behind_tare_kgm + 10_000.0 * means.behind_load_m) / 9.0 / 15_000.0;
        for (by, counted) in [(0.99, 0.0), (1.01, 0.5)] {
            let eta_sd = by * 0.002 / behind;
            let limit = MassOnRail {
                eta_variance: eta_sd * eta_sd,
                ..mass
            };
            assert_eq!(go(-0.5, &limit), counted);
        }
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
