use super::*;
use crate::api::mass_layout::MassLayout;
use crate::testing::vehicles::vehicle;

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
            mass: SwingMass::new(nominal, train, params, supervision, of.drives, 3.89),
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
            mass: SwingMass::new(nominal, train, params, supervision, 8, 3.89),
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

/// A jump takes the mark for three blocks and no longer.
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
    assert!(world.mass.is_known());
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

/// Ahead of what was read up to 0.5 m of the train may stand, and behind it 0.5 m in the mean of the tare.
#[test]
fn a_train_on_unread_rail_weighs_nothing() {
    let not_excited = AidOutcome::Rejected(Rejection::NotExcited);
    let at_once = SwingSupervision {
        wait_for_rail: false,
        ..Default::default()
    };
    for (front_m, used) in [(0.4, true), (0.6, true), (1.0, false), (6.0, false)] {
        let span_m = [-front_m, 12.0 - front_m];
        let mut world = World::new(span_m, Default::default(), at_once);
        world.go(1.0, 20.0, |_| ());
        assert_eq!(world.outcome() != not_excited, used, "{front_m}");
    }
    // evenly over 2 m, a train x beyond the first rail read is behind it by (2 − x)²/4 in the mean
    for (way_m, used) in [(0.8, true), (0.4, false)] {
        let mut world = World::by_default([0.0, 2.0]);
        world.go(1.0, 20.0, |_| ());
        while world.way_m > way_m {
            world.go(-0.2, 0.1, |_| ());
        }
        assert_eq!(world.outcome() != not_excited, used, "{way_m}");
    }
}

/// A force that takes the train up a grade that is another by 0.03 than the one read says so, to both sides, with a
/// load that is rigid or swings. Without it the force of a rigid load says the grade that was read. Acceleration over g
/// and the swing count twice in the standard deviation, beside 0.002 rad and the noise of the balance.
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
        let noise = variance - 4e-6 - 4.0 * moved;
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

/// A train whose front is far ahead of what its IMU has read waits with its blocks for as long as they are kept, and
/// then looks at them all the same: none that is ahead by more than 0.5 m is of use.
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

/// Six tonnes more or less from one moment to the next, on the way: the force jumps, which takes the mark, and another
/// hypothesis becomes the heaviest and is weighed.
#[test]
fn another_load_is_found_on_the_way() {
    for more_kg in [6_000.0, -6_000.0] {
        let mut world = World::by_default([0.0, 12.0]);
        world.weigh(1.0);
        world.load_kg += more_kg;
        world.go(1.0, 1.2, |_| ());
        assert!(!world.mass.is_known());
        for _ in 0..4 {
            world.go(0.2, 8.0, |_| ());
            world.go(1.0, 8.0, |_| ());
        }
        let [mass_kg, sd_kg] = world.mass.published();
        assert!(
            (mass_kg - 15_000.0 - more_kg).abs() < 3.0 * sd_kg && sd_kg < 0.1 * mass_kg,
            "{more_kg}: {mass_kg} {sd_kg}"
        );
    }
}

/// A load that swings is weighed by its swing, whatever it is, and whatever was guessed first.
#[test]
fn a_load_that_swings_is_weighed_from_every_start() {
    for load_kg in [1_500.0, 10_000.0, 19_000.0] {
        let mut world = World::swinging();
        world.load_kg = load_kg;
        for _ in 0..6 {
            world.go(1.0, 6.0, |_| ());
            world.go(0.3, 6.0, |_| ());
        }
        let [mass_kg, sd_kg] = world.mass.published();
        assert!(world.mass.is_known());
        assert!(
            (mass_kg - 5_000.0 - load_kg).abs() < 3.0 * sd_kg && sd_kg < 0.1 * mass_kg,
            "{load_kg}: {mass_kg} {sd_kg}"
        );
    }
}

/// After a stand the mass keeps its value, is as uncertain as other loads make it, which is at least a tenth of the
/// variance of an even spread over all of them, and is not known until it has been
/// weighed anew; the same load is found at once, another one by its force.
#[test]
fn a_stand_opens_the_load_and_keeps_the_mass() {
    for load_kg in [10_000.0, 4_000.0] {
        let mut world = World::by_default([0.0, 12.0]);
        world.weigh(0.0);
        let before = world.mass.published();
        world.mass.open_load();
        let opened = world.mass.published();
        let least_kg = 22_000.0 * (0.1 / 12.0 as Real).sqrt();
        assert!(opened[0] == before[0] && opened[1] > least_kg && least_kg > before[1]);
        assert!(!world.mass.is_known() && !world.mass.has_weighed());
        world.load_kg = load_kg;
        for _ in 0..3 {
            world.go(1.0, 6.0, |_| ());
            world.go(0.2, 6.0, |_| ());
        }
        let [mass_kg, sd_kg] = world.mass.published();
        assert!(world.mass.is_known());
        assert!(
            (mass_kg - 5_000.0 - load_kg).abs() < 3.0 * sd_kg && sd_kg < 0.1 * mass_kg,
            "{load_kg}: {mass_kg} {sd_kg}"
        );
    }
}

/// At another place the blocks that wait are of no use, and the grade behind is open; the mass stays.
#[test]
fn another_place_keeps_the_mass() {
    let mut world = World::by_default([0.0, 12.0]);
    world.weigh(0.5);
    let before = world.mass.published();
    world.mass.lose_place(0.1);
    assert_eq!(world.mass.published(), before);
    assert_eq!(world.mass.written, world.mass.taken);
    assert!((world.mass.found().eta_variance.sqrt() - 0.1).abs() < 1e-9);
}
