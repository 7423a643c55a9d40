use super::*;
use crate::api::mass_layout::MassLayout;
use crate::testing::vehicles::vehicle;
use std::vec::Vec;

const DT: Real = 0.01;
const MU: Real = 0.02;

/// A train of 5 t with a load, rigid or on chains, evenly over a span, on a rail that is read where the IMU passes.
/// Its force is that of mechanics.
#[derive(Clone, Copy)]
struct World {
    mass: SwingMass,
    rail: RailMemory,
    load_kg: Real,
    chain_m: Real,
    /// Angle of the chains against their rest, + forward, rad, and its rate.
    swing: [Real; 2],
    speed_mps: Real,
    way_m: Real,
    /// Force beside that of mechanics, N.
    extra_n: Real,
}

impl World {
    fn new(span_m: [Real; 2], params: SwingBalanceParams, supervision: SwingSupervision) -> Self {
        let (of, layout) = (vehicle(), MassLayout::even(5_000.0, span_m, span_m));
        let train = TrainOnRail::new(&layout, true);
        let nominal = Nominal::new(&of, &layout, None, 0.01);
        let [front, rear] = train.span_m();
        Self {
            mass: SwingMass::new(nominal, train, params, supervision, of.drives),
            rail: RailMemory::new(rear - front),
            load_kg: 10_000.0,
            chain_m: 0.0,
            swing: [0.0; 2],
            speed_mps: 0.0,
            way_m: 0.0,
            extra_n: 0.0,
        }
    }

    fn by_default(span_m: [Real; 2]) -> Self {
        Self::new(span_m, Default::default(), Default::default())
    }

    /// The load hangs on chains of 0.6 m, and the running resistance is that of the tare, which does not weigh it.
    fn swinging() -> Self {
        let mut layout = MassLayout::even(5_000.0, [0.0; 2], [0.0; 2]);
        (layout.load.chain_m, layout.load_share_of_resistance) = (0.6, 0.0);
        let train = TrainOnRail::new(&layout, true);
        let nominal = Nominal::new(&vehicle(), &layout, None, 0.01);
        let (params, supervision) = (Default::default(), Default::default());
        Self {
            mass: SwingMass::new(nominal, train, params, supervision, 8),
            chain_m: 0.6,
            ..Self::by_default([0.0; 2])
        }
    }

    /// Goes on towards a speed for some seconds on the level; `see` looks at it after each step.
    fn go(&mut self, wanted_mps: Real, seconds: Real, mut see: impl FnMut(&Self)) {
        let of = vehicle();
        for _ in 0..(seconds / DT) as usize {
            let a = ((wanted_mps - self.speed_mps) / DT).clamp(-0.3, 0.3);
            self.speed_mps += a * DT;
            let total = of.tare_kg + self.load_kg;
            let [angle, rate] = &mut self.swing;
            let (rigid_kg, pull) = match self.chain_m > 0.0 {
                false => (total, 0.0),
                true => {
                    *rate -= (GRAVITY * *angle + a) / self.chain_m * DT;
                    *angle += *rate * DT;
                    (of.tare_kg, -self.load_kg * GRAVITY * *angle)
                }
            };
            let rolling = match self.speed_mps == 0.0 {
                true => 0.0,
                false => self.speed_mps.signum() * MU * rigid_kg * GRAVITY,
            };
            let inertia = (rigid_kg + of.rotating_mass_kg) * a;
            let force = inertia + pull + rolling + self.extra_n;
            self.way_m += self.speed_mps * DT;
            self.rail.step(self.speed_mps * DT, Some([0.0, 0.0]));
            let z = BlockInput {
                speed_mps: self.speed_mps,
                speed_noise_mps: 1e-4,
                sum_sd: 1e-4,
                acceleration_mps2: a,
                traction: Some([force, 100.0]),
                sound: true,
                ..BlockInput::default()
            };
            let mass_kg = self.mass.mass_kg();
            self.mass.step(&z, mass_kg, &self.rail, DT);
            see(self);
        }
    }

    /// Starts and stops, by which the load is weighed; it ends at the speed.
    fn weigh(&mut self, wanted_mps: Real) {
        for _ in 0..6 {
            self.go(1.0, 8.0, |_| ());
            self.go(0.2, 8.0, |_| ());
        }
        self.go(wanted_mps, 12.0, |_| ());
        assert!(self.mass.is_known());
    }

    fn outcome(&self) -> AidOutcome {
        self.mass.status().outcome
    }
}

/// Starts and stops weigh the load, to what its standard deviation says; the scale of the force, which nothing can
/// see, adds its share of the total mass by squares.
#[test]
fn starts_and_stops_weigh_the_load() {
    let exact = SwingBalanceParams {
        torque_gain_sd: 0.0,
        efficiency_sd: 0.0,
        radius_sd: 0.0,
        ..Default::default()
    };
    let mut sds = [0.0; 2];
    let doubted = SwingBalanceParams {
        radius_sd: 0.03,
        ..exact
    };
    for (sd, params) in sds.iter_mut().zip([exact, doubted]) {
        let mut world = World::new([0.0, 12.0], params, Default::default());
        world.weigh(1.0);
        let [mass_kg, sd_kg] = world.mass.published();
        assert!((mass_kg - 15_000.0).abs() < 300.0, "{mass_kg}");
        assert!(
            (mass_kg - 15_000.0).abs() < 3.0 * sd_kg,
            "{mass_kg} {sd_kg}"
        );
        *sd = sd_kg;
    }
    let more = (sds[1] * sds[1] - sds[0] * sds[0]).sqrt();
    assert!((more / (0.03 * 15_000.0) - 1.0).abs() < 0.05, "{more}");
}

/// Largest jump of the force, N, up to which the mass stays known, by bisection.
fn largest_jump(span_m: [Real; 2], speed_mps: Real) -> Real {
    let mut weighed = World::by_default(span_m);
    weighed.weigh(speed_mps);
    // over the way that waits for its rail
    weighed.go(speed_mps, 20.0 / speed_mps, |_| ());
    let (mut low, mut high) = (0.0, 100_000.0);
    for _ in 0..14 {
        let extra_n = 0.5 * (low + high);
        let mut known = true;
        let mut world = World { extra_n, ..weighed };
        world.go(speed_mps, 1.1, |world| known &= world.mass.is_known());
        (low, high) = if known {
            (extra_n, high)
        } else {
            (low, extra_n)
        };
    }
    low
}

/// A force may jump from one block to the next by eight standard deviations of the balance, which is of 1.6 mm/s²
/// on the mass, and by as much as the masses ahead of what was read may weigh more on a rail that turns as sharply
/// as one can: it turns by 0.13 rad/m of the way of a block, and what was read is taken to go on by that.
#[test]
fn a_jump_of_the_force_that_no_rail_explains_takes_the_mark() {
    let balance = 8.0 * (2.0 as Real).sqrt() * 0.0016 * 15_000.0;
    let behind = largest_jump([0.0, 12.0], 0.5);
    assert!((behind / balance - 1.0).abs() < 0.2, "{behind} {balance}");
    for (front_m, speed_mps) in [(2.0, 0.5), (4.0, 0.5), (4.0, 0.25)] {
        let found = largest_jump([-front_m, 12.0 - front_m], speed_mps);
        let ahead_kg = 5_000.0 * front_m / 12.0;
        let turn = 0.13 * speed_mps * 0.5 * (1.0 + front_m);
        let expected = balance + GRAVITY * ahead_kg * turn;
        assert!(
            (found / expected - 1.0).abs() < 0.15,
            "{front_m}: {found} {expected}"
        );
    }
}

/// A jump takes the mark for three blocks and no longer, unless residuals keep to one side.
#[test]
fn after_a_jump_that_was_none_the_mass_is_known_again() {
    let mut world = World::by_default([0.0, 12.0]);
    world.weigh(1.0);
    world.extra_n = 600.0;
    world.go(1.0, 0.5, |_| ());
    world.extra_n = 0.0;
    let mut unknown_s = 0.0;
    world.go(1.0, 20.0, |world| {
        unknown_s += if world.mass.is_known() { 0.0 } else { DT };
    });
    assert!((1.0..6.0).contains(&unknown_s), "{unknown_s}");
    assert!(world.mass.is_known() && world.mass.changes() == 0);
}

/// A block is of use while the train runs, from 0.3 s after it has stood.
#[test]
fn a_train_that_stands_weighs_nothing() {
    let not_running = AidOutcome::Rejected(Rejection::NotRunning);
    for (speed, used) in [(0.05, false), (0.07, true), (0.5, true)] {
        let mut world = World::by_default([0.0, 12.0]);
        world.weigh(0.5);
        assert_ne!(world.outcome(), not_running);
        world.go(0.0, 4.0, |_| ());
        assert_eq!(world.outcome(), not_running);
        world.go(speed, 4.0, |_| ());
        assert_eq!(world.outcome() != not_running, used, "{speed}");
    }
}

/// Ahead of what was read up to 0.8 m of the train may stand, and behind it 0.3 m in the mean of the tare.
#[test]
fn a_train_on_unread_rail_weighs_nothing() {
    let not_excited = AidOutcome::Rejected(Rejection::NotExcited);
    let at_once = SwingSupervision {
        wait_for_rail: false,
        ..Default::default()
    };
    for (front_m, used) in [(0.5, true), (0.9, true), (1.3, false), (6.0, false)] {
        let span_m = [-front_m, 12.0 - front_m];
        let mut world = World::new(span_m, Default::default(), at_once);
        world.go(1.0, 20.0, |_| ());
        assert_eq!(world.outcome() != not_excited, used, "{front_m}");
    }
    // evenly over 2 m, a train x beyond the first rail read is behind it by (2 − x)²/4 in the mean
    for (way_m, used) in [(1.2, true), (0.6, false)] {
        let mut world = World::by_default([0.0, 2.0]);
        world.go(1.0, 20.0, |_| ());
        while world.way_m > way_m {
            world.go(-0.2, 0.1, |_| ());
        }
        assert_eq!(world.outcome() != not_excited, used, "{way_m}");
    }
}

/// A force that is off by 150 N to one side and the other, ten times what the balance is known to: the noise of the
/// filter follows, and the load is known less well by a third at least. Where there is no such force, it is
/// nominal.
#[test]
fn the_noise_follows_the_residuals() {
    let mut ratios = Vec::new();
    for off_n in [0.0, 150.0] {
        let sd_of = |residual_noise: bool| {
            let supervision = SwingSupervision {
                residual_noise,
                load_change_detector: false,
                ..Default::default()
            };
            let mut world = World::new([0.0, 12.0], Default::default(), supervision);
            for k in 0..80 {
                world.extra_n = if k % 2 == 0 { off_n } else { -off_n };
                world.go(if k % 20 < 10 { 1.0 } else { 0.2 }, 0.5, |_| ());
            }
            world.mass.found().mass_variance.sqrt()
        };
        ratios.push(sd_of(true) / sd_of(false));
    }
    assert_eq!(ratios[0], 1.0);
    assert!(ratios[1] > 4.0 / 3.0, "{ratios:?}");
}

/// Six tonnes more from one moment to the next, on the way: the force that is needed keeps to one side of what is
/// expected, the load is found to be another, once, and weighed anew. With the detector off it is not.
#[test]
fn another_load_is_found_once_and_weighed_anew() {
    for on in [true, false] {
        let supervision = SwingSupervision {
            load_change_detector: on,
            residual_noise: false,
            ..Default::default()
        };
        let mut world = World::new([0.0, 12.0], Default::default(), supervision);
        world.weigh(1.0);
        world.load_kg += 6_000.0;
        world.go(1.0, 1.2, |_| ());
        assert!(!world.mass.is_known());
        // the blocks since the change are gone over again at once: a second after it is found it is weighed
        let (mut since_s, mut soon_kg) = (0.0, 0.0);
        world.go(0.2, 8.0, |world| {
            since_s += if world.mass.changes() > 0 { DT } else { 0.0 };
            if since_s < 1.0 {
                soon_kg = world.mass.found().x[MASS] + 5_000.0;
            }
        });
        world.go(1.0, 8.0, |_| ());
        assert_eq!((soon_kg / 21_000.0 - 1.0).abs() < 0.1, on, "{soon_kg}");
        for _ in 0..4 {
            world.go(0.2, 8.0, |_| ());
            world.go(1.0, 8.0, |_| ());
        }
        assert_eq!(world.mass.changes(), u32::from(on));
        let mass_kg = world.mass.mass_kg();
        assert_eq!((mass_kg - 21_000.0).abs() < 400.0, on, "{mass_kg}");
    }
}

/// A load that swings is weighed by its swing; the search for where to start takes its time, and what is published
/// stays as it was until it is over. Opened meanwhile, or at another place, the load is searched for anew.
#[test]
fn a_search_of_the_start_that_is_given_up_is_made_again() {
    for given_up in [0, 1, 2] {
        let mut world = World::swinging();
        let mut seen = 0;
        for k in 0..12 {
            for (speed, seconds) in [(1.0, 6.0), (0.3, 6.0)] {
                for _ in 0..(seconds / DT) as usize {
                    let (before, was) = (world.mass.published(), world.mass.search.is_active());
                    world.go(speed, 1.5 * DT, |_| ());
                    let now = world.mass.search.is_active();
                    if was && now {
                        assert_eq!(world.mass.published(), before);
                        assert!(!world.mass.is_known() || seen > 1);
                    }
                    seen += usize::from(now && !was);
                    if now && seen == 1 && given_up > 0 {
                        match given_up {
                            1 => world.mass.open_load(),
                            _ => world.mass.lose_place(0.1),
                        }
                        assert!(!world.mass.search.is_active() && !world.mass.is_known());
                        assert!(!world.mass.has_weighed());
                        seen = 2;
                    }
                }
            }
            assert!(k < 6 || world.mass.is_known(), "{given_up}");
        }
        let [mass_kg, sd_kg] = world.mass.published();
        assert!(
            (mass_kg - 15_000.0).abs() < 3.0 * sd_kg,
            "{given_up}: {mass_kg} {sd_kg}"
        );
        assert!((mass_kg - 15_000.0).abs() < 750.0, "{given_up}: {mass_kg}");
        assert!(seen > 1, "{given_up}");
    }
}

/// A force that takes the train up a grade that is another by 0.03 than the one read says so, to both sides, with a
/// load that is rigid or swings. Without it the force of a rigid load says the grade that was read. Acceleration over g
/// and the swing count twice in the standard deviation, beside 0.001 rad and the noise of the balance.
#[test]
fn the_force_tells_the_grade_of_a_block() {
    for mut world in [World::by_default([0.0, 12.0]), World::swinging()] {
        world.weigh(1.0);
        let World { mass, rail, .. } = world;
        let block = mass.block(mass.written - 1);
        let by_force = |other: Real| {
            let mut block = block;
            block.traction_n += (other * mass.mass_kg() * GRAVITY) as f32;
            let mut mass = mass;
            mass.watch(&block, &rail).difference.unwrap()
        };
        let [none, variance] = by_force(0.0);
        let swing_rad = mass.found.x[ANGLE] * (1.0 - 5_000.0 / mass.mass_kg());
        let moved = (block.mean_acceleration() / GRAVITY).powi(2) + swing_rad.powi(2);
        let noise = variance - 1e-6 - 4.0 * moved;
        assert!((1e-8..2e-6).contains(&noise), "{noise}");
        assert_eq!(swing_rad.abs() > 1e-3, world.chain_m > 0.0, "{swing_rad}");
        assert!(world.chain_m > 0.0 || none.abs() < 1e-3, "{none}");
        for other in [0.03, -0.03] {
            let [difference, same] = by_force(other);
            assert!((difference - none - other).abs() < 1e-6);
            assert_eq!(same, variance);
        }
    }
}

/// Over rail that was not read the force may jump by what the grade behind the rail read may be, too: that is known to
/// a standard deviation that is published, and becomes another over nine metres.
#[test]
fn a_jump_may_be_of_the_rail_behind() {
    let speeds = [(false, 0.5), (true, 0.5), (true, -0.5), (true, 1.0)];
    for (behind, speed_mps) in speeds as [(bool, Real); 4] {
        let mut world = World::by_default([0.0, 12.0]);
        world.weigh(speed_mps.abs());
        if behind {
            world.rail = RailMemory::new(12.0);
            (0..100).for_each(|_| world.rail.step(0.01, Some([0.0, 0.0])));
        }
        let World { mut mass, rail, .. } = world;
        let mut block = mass.block(mass.written - 1);
        (block.place, block.speed_mps) = (rail.here(), speed_mps as f32);
        mass.found.eta_variance = 0.05 * 0.05;
        mass.outlook = None;
        mass.watch(&block, &rail);
        let [_, variance] = mass.outlook.unwrap();
        let may_be = if behind {
            0.05 * speed_mps.abs() * block.length_s() / 9.0
        } else {
            0.0
        };
        let limit = 8.0 * (2.0 * variance).sqrt() + GRAVITY * mass.mass_kg() * may_be;
        for by in [0.99, 1.01, -0.99, -1.01] {
            let mut mass = mass;
            let mut next = block;
            next.traction_n += (by * limit) as f32;
            assert!(mass.is_known());
            mass.watch(&next, &rail);
            assert_eq!(
                mass.jumped > mass.written,
                by.abs() > 1.0,
                "{behind} {speed_mps} {by}"
            );
        }
    }
}

/// The mass of before a standstill is that of now once more than twenty blocks have weighed the same, not sooner; it
/// is then as certain as it was.
#[test]
fn the_mass_of_before_a_standstill_is_recalled_by_more_than_twenty_blocks() {
    let mut world = World::by_default([0.0, 12.0]);
    world.weigh(0.0);
    let before = world.mass.published();
    world.mass.open_load();
    let opened = world.mass.published();
    assert!(opened[0] == before[0] && opened[1] > 5.0 * before[1]);
    let (mut recalled_by, mut moved) = (None, false);
    for k in 0..8 {
        let speed = if k % 2 == 0 { 1.0 } else { 0.2 };
        world.go(speed, 6.0, |World { mass, .. }| {
            let Some(kept_kg) = mass.kept.mass() else {
                recalled_by = recalled_by.or(Some(mass.used));
                return;
            };
            assert_eq!((kept_kg, recalled_by), (before[0], None));
            // until it has been weighed anew it is that of before, however the filter sees it
            if !mass.searched {
                assert_eq!((mass.mass_kg(), mass.published()), (before[0], opened));
                assert!(!mass.has_weighed());
                moved |= mass.filter.mass_kg() != before[0];
            }
        });
    }
    let used = recalled_by.unwrap();
    assert!(moved && (21..60).contains(&used), "{used}");
    let [mass_kg, sd_kg] = world.mass.published();
    assert!((mass_kg - before[0]).abs() < before[1] && sd_kg < 1.05 * before[1]);
}

/// While nothing hints at another load the block to go back to is the one that comes next, before the first weighing
/// and from the twenty-first block on; in between it is where the weighing began, for the search of the start.
#[test]
fn a_change_goes_back_to_the_last_block_without_a_hint() {
    let mut world = World::by_default([0.0, 12.0]);
    let mut begun = None;
    for k in 0..10 {
        world.go(if k % 2 == 0 { 1.0 } else { 0.2 }, 6.0, |world| {
            let SwingMass { used, taken, .. } = world.mass;
            let back = world.mass.roll_back.next;
            match used {
                0 => assert_eq!(back, taken),
                1..=20 => assert_eq!(back, *begun.get_or_insert(back)),
                _ if world.mass.residuals.at_rest() => assert_eq!(back, taken),
                _ => assert!(back <= taken),
            }
        });
    }
    assert!(world.mass.used > 40 && begun.is_some());
}

/// The last 26 blocks are kept. A pass of the search may begin with any of them, and is given up if its next block is
/// no longer there; a change of load goes back to a block that is kept, and else begins with the next one.
#[test]
fn a_block_that_is_kept_is_gone_over_again_and_one_that_is_not_is_not() {
    let mut weighed = World::by_default([0.0, 12.0]);
    weighed.weigh(1.0);
    let written = weighed.mass.written;
    assert!(written > 40);
    for back in [5, 25, 26, 27, 30] {
        let World { mut mass, rail, .. } = weighed;
        mass.search.begin([0.5, 1.0]);
        mass.trial_next = written - back;
        mass.search_step(&rail);
        let goes_on = back <= 26;
        assert_eq!(mass.search.is_active(), goes_on, "{back}");
        assert_eq!(mass.used > 0 && mass.searched, goes_on, "{back}");
    }
    for (back, spent) in [(5, false), (25, false), (30, false), (5, true)] {
        let SwingMass { taken, .. } = weighed.mass;
        let mut mass = weighed.mass;
        (mass.roll_back.next, mass.roll_back.spent) = (written - back, spent);
        mass.go_back();
        let kept = back < 26 && !spent;
        assert_eq!(
            mass.taken,
            if kept { written - back } else { taken },
            "{back}"
        );
        assert_eq!(mass.roll_back.next, mass.taken, "{back}");
        assert!(mass.roll_back.spent && mass.kept.mass().is_none());
    }
}

/// While a search goes on blocks wait; those that are written over are left out.
#[test]
fn blocks_that_are_no_longer_kept_are_not_waited_for() {
    let mut world = World::by_default([0.0, 12.0]);
    world.weigh(1.0);
    let mut most = 0;
    for _ in 0..2_000 {
        world.mass.search.begin([0.5, 1.0]);
        world.mass.trial_next = world.mass.written;
        world.go(1.0, 1.5 * DT, |_| ());
        most = most.max(world.mass.written - world.mass.taken);
    }
    assert_eq!(most, 25);
}

/// A train that comes to another place, or to another load, begins there: with the block that comes next, and no
/// residual against it.
#[test]
fn what_is_another_place_or_load_goes_on_from_there() {
    for (opens, changes) in [(true, false), (false, true)] {
        let mut world = World::by_default([0.0, 12.0]);
        world.weigh(0.5);
        let mass = &mut world.mass;
        mass.residuals.alarm(4.0, 0.5);
        mass.roll_back.next = 3;
        mass.roll_back.spent = true;
        assert!(!mass.residuals.at_rest());
        match opens {
            true => mass.open_load(),
            false => mass.lose_place(0.1),
        }
        assert!(mass.residuals.at_rest() && !mass.roll_back.spent);
        assert_eq!(
            (mass.roll_back.next, mass.roll_back.filter),
            (mass.taken, mass.filter)
        );
        assert_eq!(*mass.found(), BalanceState::by(&mass.filter));
        assert_eq!(
            (mass.found().eta_variance.sqrt() - 0.1).abs() < 1e-9,
            changes
        );
    }
}

/// A train whose front is far ahead of what its IMU has read waits with its blocks for as long as they are kept, and
/// then looks at them all the same: none that is ahead by more than 0.8 m is of use.
#[test]
fn blocks_wait_for_rail_for_as_long_as_they_are_kept() {
    let mut world = World::by_default([-8.0, 4.0]);
    let mut waited = 0;
    world.go(0.2, 30.0, |World { mass, .. }| {
        waited = waited.max(mass.written - mass.taken);
    });
    assert!((24..=25).contains(&waited), "{waited}");
    assert_eq!(world.outcome(), AidOutcome::Rejected(Rejection::NotExcited));
}

/// Each block that has weighed the load is told once, with its length.
#[test]
fn a_block_that_weighs_is_told_once() {
    let mut world = World::by_default([0.0, 12.0]);
    world.weigh(1.0);
    let (mut told, used) = (0, world.mass.used);
    for speed in [0.2, 1.0] {
        world.go(speed, 2.0, |world| {
            if let Some((nis, length_s)) = world.mass.new_nis() {
                assert!(nis >= 0.0 && (length_s - 0.5).abs() < 1e-3);
                told += 1;
            }
        });
    }
    assert_eq!(told, world.mass.used - used);
    assert!((6..=9).contains(&told), "{told}");
}

/// On the level the resistance is that of the load's weight, a constant, and a part that grows with the speed to either
/// side.
#[test]
fn the_resistance_is_the_sum_of_its_parts() {
    let mut world = World::by_default([0.0, 12.0]);
    let x = &mut world.mass.found.x;
    (x[R0], x[CV], x[MASS]) = (500.0, 40.0, 9_000.0);
    let layout = MassLayout::even(5_000.0, [0.0; 2], [0.0; 2]);
    let mut nominal = Nominal::new(&vehicle(), &layout, None, 0.01);
    nominal.mu_load = 0.015;
    for speed in [1.5, -1.5] {
        let expected = 0.015 * 9.81 * 14_000.0 + 500.0 + 40.0 * 1.5;
        let found = world.mass.resistance_n(&nominal, speed);
        assert!((found / expected - 1.0).abs() < 1e-3, "{found}");
    }
}

/// A search goes over a block for each hundredth of a second that a step takes: one at least, and ten at most.
#[test]
fn a_search_takes_as_long_at_every_rate() {
    let mut weighed = World::by_default([0.0, 12.0]);
    weighed.weigh(1.0);
    for (dt, blocks) in [(0.002, 1), (0.012, 1), (0.025, 2), (0.055, 5), (0.3, 10)] {
        let World { mut mass, rail, .. } = weighed;
        mass.search.begin([0.5, 1.0]);
        mass.trial_next = mass.written - 24;
        let (from, mass_kg) = (mass.trial_next, mass.mass_kg());
        mass.step(&BlockInput::default(), mass_kg, &rail, dt);
        assert_eq!(mass.trial_next - from, blocks, "{dt} s");
    }
}
