//! The laws the rapier world must obey. Each bound is a law of mechanics with the accuracy the rig promises, not a
//! record of what the code happened to give.

use monorig_estimators::api::signals::Command;
use monorig_sim::plant::Plant;
use monorig_sim::plant::rapier::World;
use monorig_sim::plant::train::adhesion::AdhesionZone;
use monorig_tests::*;
use nalgebra::Vector3;

fn momentum(w: &World) -> Vector3<f64> {
    w.bodies()
        .iter()
        .zip(&w.dynamics().train.bodies)
        .map(|(s, b)| s.v * b.mass_kg)
        .sum()
}

#[test]
fn momentum_changes_by_the_impulse_of_rail_and_gravity_on_any_track() {
    let train = train("dx80_176y");
    let rail = asset_track("winding");
    let mut w = world(&train, &rail, 20.0, 0.0);
    let mass: f64 = train.bodies.iter().map(|b| b.mass_kg).sum();
    let dt = 2e-3;
    let mut cruise = Cruise::new(&train, 1.5);
    let before = momentum(&w);
    let mut scale: f64 = 0.0;
    for k in 1..=20_000 {
        let c = cruise.command(&train, &w, dt);
        w.step(&c, dt).unwrap();
        let impulse = w.rail_impulse() - Vector3::z() * (mass * G * dt * k as f64);
        let change = momentum(&w) - before;
        scale = scale.max(change.norm());
        assert!(
            (change - impulse).norm() <= 1e-4 * scale.max(mass * 0.01),
            "t = {:.3}: {change} against {impulse}",
            dt * k as f64
        );
    }
    assert!(
        w.truth().sway_rad[0].abs().max(w.truth().sway_rad[1].abs()) > 1e-4,
        "the load swings in this test"
    );
}

#[test]
fn momentum_along_a_slope_is_traction_minus_gravity_minus_resistance() {
    // The published channels, on a straight 8° slope with the load swinging from the start.
    let train = train("dx80_176y");
    let rail = slope(8.0);
    let mut w = world(&train, &rail, 40.0, 0.0);
    let t = rail.frame(40.0).t;
    let mass: f64 = train.bodies.iter().map(|b| b.mass_kg).sum();
    let (dt, mut impulse) = (2e-3, 0.0);
    let before = momentum(&w).dot(&t);
    let mut cruise = Cruise::new(&train, 0.5);
    for _ in 0..15_000 {
        let c = cruise.command(&train, &w, dt);
        w.step(&c, dt).unwrap();
        let s = w.sums();
        impulse += dt * (s.traction_n + s.brake_n - s.body_resistance_n - mass * G * t.z);
    }
    let change = momentum(&w).dot(&t) - before;
    assert!(
        (change - impulse).abs() <= 1e-4 * change.abs(),
        "{change} against {impulse}"
    );
}

#[test]
fn constant_torque_on_8_degrees_accelerates_as_newton_says() {
    // No load on the hook, so that nothing swings for long; mean acceleration over the last 4 s.
    let train = train("dx80_176y").with_load_mass(0.0).unwrap();
    let rail = slope(8.0);
    let mut w = world(&train, &rail, 40.0, 0.0);
    let mass: f64 = train.bodies.iter().map(|b| b.mass_kg).sum();
    let d = train.drives[0];
    let n = train.drives.len() as f64;
    // Enough for about 0.1 m/s² beyond the slope.
    let force = mass * (G * libm::sin(8f64.to_radians()) + 0.1) + 0.02 * mass * G;
    let c = torque(
        &train,
        force * d.wheel_radius_m / (n * d.gear_ratio * d.efficiency_drive),
    );
    let dt = 1e-3;
    run(&mut w, &c, 4.0, dt);
    let (v0, mut resistance, mut steps) = (mean_speed(&w), 0.0, 0);
    let rim = d.motor_torque_rim(c.motor_torque_nm[0]) * n;
    for _ in 0..4000 {
        w.step(&c, dt).unwrap();
        resistance += w.truth().resistance_n;
        steps += 1;
    }
    let measured = (mean_speed(&w) - v0) / (steps as f64 * dt);
    let resistance = resistance / steps as f64;
    let rotating = train.rotating_mass_kg();
    let expected = (rim - mass * G * libm::sin(8f64.to_radians()) - resistance) / (mass + rotating);
    assert!(
        (measured / expected - 1.0).abs() < 5e-4,
        "{measured} against {expected}"
    );
}

/// Speed of the centre of mass along a straight track.
fn mean_speed(w: &World) -> f64 {
    let mass: f64 = w.dynamics().train.bodies.iter().map(|b| b.mass_kg).sum();
    momentum(w).norm() / mass
}

trait Rim {
    fn motor_torque_rim(&self, motor: f64) -> f64;
}
impl Rim for monorig_sim::train::Drive {
    /// Force at the rims of a drive unit, N.
    fn motor_torque_rim(&self, motor: f64) -> f64 {
        motor * self.gear_ratio * self.efficiency_drive / self.wheel_radius_m
    }
}

#[test]
fn break_away_traction_is_twice_adhesion_times_clamp_force_per_unit() {
    // Wheels spun up against a train that is held by nothing but its inertia: full slip gives µN per wheel, two per
    // unit.
    let train = train("dx80_176y");
    let rail = slope(0.0);
    let mu = 0.05;
    let mut o = options(&train, 40.0, 0.0);
    o.zones = vec![AdhesionZone {
        from_m: -100.0,
        to_m: 1000.0,
        adhesion: mu,
    }];
    let mut w = World::new(train.clone(), rail, &o).unwrap();
    let d = train.drives[0];
    let c = torque(&train, d.torque_max_nm);
    let expected = 2.0 * mu * d.clamp_mpa * 1e6 * d.piston_area_m2 * train.drives.len() as f64;
    let mut most: f64 = 0.0;
    for _ in 0..1500 {
        w.step(&c, 2e-3).unwrap();
        most = most.max(w.truth().traction_n);
    }
    assert!(w.truth().drives[0].slip_mps > 0.05, "the wheels spin");
    assert!(
        (most / expected - 1.0).abs() < 0.01,
        "{most} against {expected}"
    );
}

#[test]
fn sliding_on_locked_brakes_down_8_degrees_covers_the_distance_of_a_sliding_block() {
    let mut train = train("dx80_176y").with_load_mass(0.0).unwrap();
    // A brake that carries less than the slope asks for, and no running resistance: what is left is gravity and the
    // shoes.
    train.resistance = monorig_sim::train::Resistance {
        clamped_wheel: 0.0,
        running_wheel: 0.0,
        guide_wheel: 0.0,
        bearing_n: 0.0,
        bearing_nspm: 0.0,
        air_nspm2: 0.0,
    };
    let mass: f64 = train.bodies.iter().map(|b| b.mass_kg).sum();
    let n = train.drives.len() as f64;
    let brake = 0.5 * mass * G * libm::sin(8f64.to_radians());
    for d in &mut train.drives {
        d.brake_max_n = brake / n;
        d.wheel_inertia = 1e-6;
        d.motor_inertia = 0.0;
        d.kappa = 0.0;
    }
    let rail = slope(-8.0);
    let mut w = world(&train, &rail, 60.0, 0.3);
    let c = Command {
        clamp_pressure_mpa: 0.0,
        brake: 1.0,
        ..Default::default()
    };
    let dt = 1e-3;
    run(&mut w, &c, 2.0, dt);
    let (s0, v0) = (w.truth().chainage_m, mean_speed(&w));
    run(&mut w, &c, 5.0, dt);
    let distance = w.truth().chainage_m - s0;
    let a = G * libm::sin(8f64.to_radians()) - brake / mass;
    let expected = v0 * 5.0 + 0.5 * a * 25.0;
    assert!(
        (distance / expected - 1.0).abs() < 5e-3,
        "{distance} against {expected}"
    );
}

#[test]
fn static_wheel_loads_carry_the_weight_on_any_slope() {
    let train = train("dx80_176y");
    let mass: f64 = train.bodies.iter().map(|b| b.mass_kg).sum();
    for deg in [0.0, 8.0, 15.0, -20.0] {
        let rail = slope(deg);
        let mut w = world(&train, &rail, 60.0, 0.0);
        let hold = Command {
            brake: 1.0,
            ..torque(&train, 0.0)
        };
        run(&mut w, &hold, 10.0, 2e-3);
        let f = rail.frame(60.0);
        // All wheel forces of one step: running wheels carry the part across the rail, shoes and friction wheels the
        // part along it.
        let normal = w.sums().external.dot(&f.u);
        let expected = mass * G * libm::cos(deg.to_radians());
        assert!(
            (normal / expected - 1.0).abs() < 1e-6,
            "{deg}°: {normal} against {expected}"
        );
        let along = w.sums().external.dot(&f.t);
        let expected = mass * G * libm::sin(deg.to_radians());
        assert!(
            (along - expected).abs() < 1e-6 * mass * G,
            "{deg}°: {along} against {expected}"
        );
    }
}

#[test]
fn the_load_swings_with_the_period_of_its_pendulum() {
    // Empty hook: the gear is light, its chains do not give, T = 2π √(L/g). Full load: chains, hangers and wheels give,
    // and the period is that of the linearised model below, written from the drawing and not from the code.
    for payload in [0.0, 20_000.0] {
        let train = train("dx80_176y").with_load_mass(payload).unwrap();
        let load = train.load.unwrap();
        let rail = slope(0.0);
        let mut w = world(&train, &rail, 60.0, 0.0);
        let hold = Command {
            brake: 1.0,
            ..torque(&train, 0.0)
        };
        w.set_velocity(load, rail.frame(60.0).t * 0.05);
        let dt = 1e-3;
        let (mut before, mut crossings, mut t) = (w.truth().sway_rad[0], Vec::new(), 0.0);
        for _ in 0..20_000 {
            w.step(&hold, dt).unwrap();
            t += dt;
            let now = w.truth().sway_rad[0];
            if before < 0.0 && now >= 0.0 {
                crossings.push(t - dt * now / (now - before));
            }
            before = now;
        }
        let periods = crossings.len() - 1;
        let period = (crossings[periods] - crossings[0]) / periods as f64;
        let expected = swing_period(&train);
        assert!(periods >= 8, "{periods} swings seen");
        assert!(
            (period / expected - 1.0).abs() < 0.01,
            "{payload} kg: {period} s against {expected} s"
        );
    }
}

/// Longest period of beam and load along the rail, trolleys held, s. Coordinates: beam shift and pitch, load shift (of
/// its chain anchors) and pitch; springs: hangers on wheels, chains; geometric stiffness of the weights.
fn swing_period(train: &monorig_sim::train::Train) -> f64 {
    let load = train.load.unwrap();
    let beam = train.supports(load)[0];
    let (m, mb) = (train.bodies[load].mass_kg, train.bodies[beam].mass_kg);
    let (i, ib) = (
        train.bodies[load].inertia[(1, 1)],
        train.bodies[beam].inertia[(1, 1)],
    );
    let chains: Vec<_> = train
        .connections
        .iter()
        .filter(|c| c.a == load || c.b == load)
        .collect();
    let on = |c: &monorig_sim::train::Connection, body: usize| {
        if c.a == body { c.anchor_a } else { c.anchor_b }
    };
    let hangers: Vec<_> = train
        .connections
        .iter()
        .filter(|c| (c.a == beam || c.b == beam) && c.a != load && c.b != load)
        .collect();
    let trolley = |c: &monorig_sim::train::Connection| if c.a == beam { c.b } else { c.a };
    // A hanger in series with the four running wheels of its trolley.
    let vertical = |c: &monorig_sim::train::Connection| {
        let wheels: f64 = train.bodies[trolley(c)]
            .stations
            .iter()
            .map(|s| 2.0 * s.wheel_k)
            .sum();
        1.0 / (1.0 / c.k + 1.0 / wheels)
    };
    let length = chains[0].length_m + m * G / chains.iter().map(|c| c.k).sum::<f64>();
    let kb_pitch: f64 = hangers
        .iter()
        .map(|c| vertical(c) * on(c, beam).x.powi(2))
        .sum();
    // Along the rail: hanger, pitch of its trolley on its wheels, drawbar, bristles of the braked drive unit behind it.
    let kb_shift: f64 = hangers
        .iter()
        .map(|c| {
            let t = trolley(c);
            let bar = train
                .connections
                .iter()
                .find(|b| {
                    b.kind == monorig_sim::train::ConnectionKind::Drawbar && (b.a == t || b.b == t)
                })
                .unwrap();
            let pitch: f64 = train.bodies[t]
                .stations
                .iter()
                .map(|s| 2.0 * s.wheel_k * s.x_m * s.x_m)
                .sum();
            let arm = on(c, t).z - on(bar, t).z;
            let bristles = 3.0 * train.drives[0].sigma0;
            1.0 / (1.0 / c.k + arm * arm / pitch + 1.0 / bar.k + 1.0 / bristles)
        })
        .sum();
    let kc_pitch: f64 = chains.iter().map(|c| c.k * on(c, load).x.powi(2)).sum();
    let hang = on(hangers[0], beam).z;
    let (cb, d) = (
        hang - train.bodies[beam].com.z,
        hang - on(chains[0], beam).z,
    );
    let h = on(chains[0], load).z - train.bodies[load].com.z;
    let kp = m * G / length;
    let mass = nalgebra::Matrix4::new(
        mb,
        -mb * cb,
        0.0,
        0.0, //
        -mb * cb,
        mb * cb * cb + ib,
        0.0,
        0.0, //
        0.0,
        0.0,
        m,
        -m * h, //
        0.0,
        0.0,
        -m * h,
        m * h * h + i,
    );
    // A chain leans by (X − (Xb − d φb)) / length.
    let lean = nalgebra::Vector4::new(-1.0, d, 1.0, 0.0);
    let twist = nalgebra::Vector4::new(0.0, -1.0, 0.0, 1.0);
    let mut stiffness = lean * lean.transpose() * kp + twist * twist.transpose() * kc_pitch;
    stiffness[(0, 0)] += kb_shift;
    stiffness[(1, 1)] += kb_pitch + mb * G * cb + m * G * d;
    stiffness[(3, 3)] += m * G * h;
    let l = mass.cholesky().unwrap().l().try_inverse().unwrap();
    let w2 = (l * stiffness * l.transpose())
        .symmetric_eigenvalues()
        .min();
    2.0 * std::f64::consts::PI / w2.sqrt()
}

#[test]
fn energy_of_the_drives_is_kinetic_potential_or_lost() {
    let train = train("dx80_176y");
    let rail = asset_track("liu2023_section1");
    let mut w = world(&train, &rail, 22.0, 0.0);
    let e0 = w.energy();
    let dt = 1e-3;
    let mut cruise = Cruise::new(&train, 1.0);
    for _ in 0..40_000 {
        let c = cruise.command(&train, &w, dt);
        w.step(&c, dt).unwrap();
    }
    let (work, lost) = w.work();
    let gained = w.energy() - e0;
    assert!(work > 1e4, "{work}");
    assert!(
        (work - gained - lost).abs() < 5e-3 * work,
        "work {work}, gained {gained}, lost {lost}"
    );
}

#[test]
fn the_whole_train_stays_on_a_winding_rail() {
    for (track, seconds, speed) in [("winding", 300.0, 0.9), ("steep_30deg", 100.0, 1.0)] {
        let train = train("dx80_176y")
            .with_load_mass(if track == "winding" {
                10_000.0
            } else {
                2_000.0
            })
            .unwrap();
        let rail = asset_track(track);
        let mut w = world(&train, &rail, 20.0, 0.0);
        let dt = 2e-3;
        let mut cruise = Cruise::new(&train, speed);
        let mut worst: f64 = 0.0;
        for _ in 0..(seconds / dt) as usize {
            let c = cruise.command(&train, &w, dt);
            w.step(&c, dt).unwrap();
            worst = worst.max(w.truth().off_rail_m);
            if w.truth().chainage_m > rail.length() - 15.0 {
                break;
            }
        }
        assert!(
            w.truth().chainage_m > (0.8 * seconds * speed).min(rail.length() - 20.0),
            "{track}: got to {} m",
            w.truth().chainage_m
        );
        assert!(worst <= 0.015, "{track}: {worst} m off the rail");
    }
}

#[test]
fn a_train_parked_on_15_degrees_for_ten_minutes_moves_less_than_a_millimetre() {
    let train = train("dx80_176y");
    let rail = slope(15.0);
    let mut w = world(&train, &rail, 60.0, 0.0);
    let hold = Command {
        brake: 1.0,
        ..torque(&train, 0.0)
    };
    let start = w.truth().chainage_m;
    let load = train.load.unwrap();
    // Someone bumps the load, so that it swings while the train is parked.
    w.set_velocity(load, Vector3::new(0.1, 0.05, 0.0));
    let mut worst: f64 = 0.0;
    for _ in 0..300_000 {
        w.step(&hold, 2e-3).unwrap();
        worst = worst.max((w.truth().chainage_m - start).abs());
    }
    assert!(worst < 1e-3, "moved {} mm", worst * 1e3);
}

#[test]
fn a_million_metres_from_the_origin_the_run_is_the_same() {
    let train = train("dx80_176y");
    let dt = 2e-3;
    let go = |origin: &str| {
        let rail = track(&format!(
            "{origin}vertical: [{{kind: grade, length_m: 60}}, {{kind: arc, to_grade_deg: 8, radius_m: 20}}, {{kind: grade, length_m: 100}}]\n"
        ));
        let mut w = world(&train, &rail, 40.0, 0.0);
        let mut cruise = Cruise::new(&train, 1.0);
        for _ in 0..10_000 {
            let c = cruise.command(&train, &w, dt);
            w.step(&c, dt).unwrap();
        }
        (
            w.truth().chainage_m - 40.0,
            w.truth().speed_mps,
            w.truth().traction_n,
        )
    };
    let near = go("");
    let far = go("start: {x_m: 1.0e6}\n");
    for (a, b) in [(near.0, far.0), (near.1, far.1), (near.2, far.2)] {
        assert!((a / b - 1.0).abs() < 1e-5, "{a} against {b}");
    }
}

#[test]
fn halving_the_step_divides_the_error_by_four() {
    // A step of second order: |x(dt) − x(dt/2)| shrinks by about 4 each time dt is halved. The torque is that of the
    // middle of a step, and no rate limit answers its stairs: both would make the input of first order.
    let mut train = train("dx80_176y");
    for d in &mut train.drives {
        d.rate_nmps = 1e9;
    }
    let rail = asset_track("liu2023_section1");
    let at = |dt: f64| {
        let mut w = world(&train, &rail, 22.0, 1.0);
        // Rolling from the start (standing start and stop are not smooth), smooth torque by time, across the
        // transition.
        let d = train.drives[0];
        let steps = (16.0 / dt).round() as usize;
        for k in 0..steps {
            let t = (k as f64 + 0.5) * dt;
            let c = torque(&train, d.torque_max_nm * 0.12 * (1.0 - libm::exp(-t)));
            w.step(&c, dt).unwrap();
        }
        w.truth().chainage_m
    };
    let x: Vec<f64> = [4e-3, 2e-3, 1e-3, 5e-4].map(at).to_vec();
    let d: Vec<f64> = x.windows(2).map(|p| (p[1] - p[0]).abs()).collect();
    for p in d.windows(2) {
        let order = (p[0] / p[1]).log2();
        assert!(order > 1.7, "order {order}: differences {d:?}");
    }
}

#[test]
fn specific_force_is_smooth_at_constant_speed() {
    // Change of specific force at the IMU from step to step, noise off, on straights and constant slopes.
    let train = train("dx80_176y").with_load_mass(10_000.0).unwrap();
    let i = imu(&train);
    for (deg, speed) in [(0.0, 2.0), (8.0, 0.5), (-15.0, 0.5)] {
        let rail = slope(deg);
        let mut w = world(&train, &rail, 40.0, speed);
        let dt = 2e-3;
        let mut cruise = Cruise::new(&train, speed);
        let mut last: Option<(Vector3<f64>, Vector3<f64>)> = None;
        let (mut worst, mut v) = (0.0f64, w.truth().mounts[i].v_w);
        for k in 0..20_000 {
            let c = cruise.command(&train, &w, dt);
            w.step(&c, dt).unwrap();
            let m = w.truth().mounts[i];
            let f = (m.v_w - v) / dt + Vector3::z() * G;
            v = m.v_w;
            if k > 15_000
                && let Some((before, _)) = last
            {
                worst = worst.max((f - before).norm());
            }
            last = Some((f, v));
        }
        assert!(worst <= 1e-3, "{deg}°: {worst} m/s² from step to step");
    }
}

#[test]
fn a_point_mass_and_the_train_agree_where_they_should() {
    // Same track, same torque, adhesion plenty: the train's centre of mass is what the point mass computes, apart from
    // the length of the train, which does not matter on a constant slope.
    let train = train("dx80_176y");
    let rail = slope(4.0);
    let mut w = world(&train, &rail, 60.0, 0.0);
    let o = options(&train, 60.0, 0.0);
    let mut p = monorig_sim::plant::point_mass::PointMass::new(train.clone(), rail.clone(), &o);
    let d = train.drives[0];
    let c = torque(&train, 0.6 * d.torque_max_nm);
    for _ in 0..10_000 {
        w.step(&c, 2e-3).unwrap();
        p.step(&c, 2e-3).unwrap();
    }
    let (a, b) = (mean_speed(&w), p.truth().speed_mps);
    assert!(a > 0.5, "{a}");
    assert!((a / b - 1.0).abs() < 0.01, "train {a} m/s, point {b} m/s");
}

#[test]
fn a_world_is_the_same_whoever_builds_it_and_however_often() {
    let train = train("dx80_176y");
    let rail = asset_track("winding");
    let go = || {
        let mut w = World::new(train.clone(), rail.clone(), &options(&train, 20.0, 0.0)).unwrap();
        let mut cruise = Cruise::new(&train, 1.0);
        for _ in 0..3000 {
            let c = cruise.command(&train, &w, 2e-3);
            w.step(&c, 2e-3).unwrap();
        }
        w.bodies()
            .iter()
            .flat_map(|b| [b.p.x, b.p.y, b.p.z, b.v.x, b.w.z])
            .map(f64::to_bits)
            .collect::<Vec<_>>()
    };
    let here = go();
    let there = std::thread::scope(|s| {
        let other = s.spawn(go);
        (go(), other.join().unwrap())
    });
    assert_eq!(here, there.0);
    assert_eq!(here, there.1);
}

#[test]
fn a_rolling_start_in_a_bend_gives_every_body_its_speed_along_the_rail_where_it_is() {
    // 18 m of train round three quarters of a circle of R = 4 m: front and rear point in different directions, and the
    // rail nearest to one end is not that under it.
    let train = train("dx80_176y");
    let rail = track(
        "horizontal: [{kind: line, length_m: 25}, {kind: arc, radius_m: 4, angle_deg: 270}, {kind: line, length_m: 60}]\n",
    );
    let (front, speed) = (44.0, 0.8);
    let w = world(&train, &rail, front, speed);
    for (b, s) in train.bodies.iter().zip(w.bodies()) {
        let t = rail.frame(front + b.start_s).t;
        let along = s.v.dot(&t);
        assert!(
            (along / speed - 1.0).abs() < 0.02,
            "{}: {along} m/s along the rail",
            b.name
        );
    }
}
