//! The laws a car on a road must obey. Each bound is a law of mechanics with the accuracy the rig promises, not a
//! record of what the code happened to give.

use monorig_estimators::api::signals::{Command, MAX_DRIVES};
use monorig_sim::config::checked::NonNegative;
use monorig_sim::plant::Plant;
use monorig_sim::plant::PlantOptions;
use monorig_sim::plant::train::adhesion::AdhesionZone;
use monorig_sim::rail::Rail;
use monorig_sim::road::{Car, RoadPlant};
use monorig_sim::sensors::instruments::MotionStep;
use monorig_sim::sensors::instruments::accelerometer::specific_force;
use monorig_tests::*;
use std::sync::Arc;

const DT: f64 = 2e-3;

/// The same car on springs that do not give way.
fn rigid() -> Car {
    let mut car = car();
    car.data.suspension.pitch_deg_per_g = NonNegative::new(0.0);
    car.data.suspension.roll_deg_per_g = NonNegative::new(0.0);
    car
}

fn options(front_m: f64, speed_mps: f64) -> PlantOptions {
    PlantOptions {
        front_m,
        speed_mps,
        gravity_mps2: G,
        ..PlantOptions::default()
    }
}

fn plant(rail: &Arc<Rail>, front_m: f64, speed_mps: f64) -> RoadPlant {
    RoadPlant::new(&car(), rail.clone(), &options(front_m, speed_mps))
}

fn drive(torque_nm: f64, brake: f64) -> Command {
    Command {
        motor_torque_nm: [torque_nm; MAX_DRIVES],
        clamp_pressure_mpa: 0.0,
        brake,
    }
}

fn steps(p: &mut RoadPlant, c: &Command, seconds: f64, dt: f64) {
    for _ in 0..(seconds / dt).round() as usize {
        p.step(c, dt).expect("step");
    }
}

/// Torque of each motor that brings the car to `speed` and keeps it there: proportional, with what rolling and air ask.
fn cruise(p: &RoadPlant, speed: f64) -> Command {
    let m = &p.car.model;
    let (v, grade) = (p.truth().speed_mps, p.truth().grade_effective_rad);
    let mass = m.geometry.mass_kg;
    let force = mass * (1.5 * (speed - v) + m.gravity * (grade.sin() + m.wheels[0].rolling))
        + m.drag * v * v;
    let d = &m.drives[0];
    let torque = force * d.wheel_radius_m / (2.0 * d.gear_ratio * d.efficiency_drive);
    drive(torque.clamp(-300.0, 300.0), 0.0)
}

/// Hills and bends to both sides.
fn winding(mirror: f64) -> Arc<Rail> {
    road(&format!(
        "horizontal:
  - {{kind: line, length_m: 60}}
  - {{kind: arc, radius_m: 40, angle_deg: {a}, easement_m: 20}}
  - {{kind: arc, radius_m: 60, angle_deg: {b}, easement_m: 25}}
  - {{kind: line, length_m: 100}}
vertical:
  - {{kind: grade, length_m: 40}}
  - {{kind: transition, to_grade_deg: 8, length_m: 40}}
  - {{kind: grade, length_m: 40}}
  - {{kind: transition, to_grade_deg: -6, length_m: 60}}
  - {{kind: grade, length_m: 200}}
",
        a = 90.0 * mirror,
        b = -80.0 * mirror,
    ))
}

fn level() -> Arc<Rail> {
    road("vertical: [{kind: grade, length_m: 2000}]\n")
}

fn grade(deg: f64) -> Arc<Rail> {
    road(&format!(
        "vertical: [{{kind: grade, grade_deg: {deg}, length_m: 400}}]\n"
    ))
}

fn circle(radius: f64) -> Arc<Rail> {
    road(&format!(
        "horizontal: [{{kind: line, length_m: 20}}, {{kind: clothoid, length_m: 40, to_radius_m: {radius}}}, {{kind: arc, radius_m: {radius}, angle_deg: 700}}]\n"
    ))
}

/// Height of the centre of gravity: that of the chord between the axles.
fn height(p: &RoadPlant, rail: &Rail) -> f64 {
    let (g, s) = (&p.car.model.geometry, p.car.state.s);
    let (front, rear) = (rail.frame(s + g.front_m).p.z, rail.frame(s - g.rear_m).p.z);
    (g.rear_m * front + g.front_m * rear) / g.wheelbase_m()
}

/// The work of the motors is found again in motion, height and losses.
#[test]
fn energy_is_neither_made_nor_lost_over_hills_and_bends() {
    let rail = winding(1.0);
    let mut p = plant(&rail, 10.0, 0.0);
    let start = height(&p, &rail);
    let (mut turned, mut worst) = (0.0f64, 0.0f64);
    for k in 0..(40.0 / DT) as usize {
        let t = k as f64 * DT;
        let c = cruise(&p, if t < 20.0 { 9.0 } else { 5.0 });
        p.step(&c, DT).unwrap();
        turned = turned.max(p.truth().road.unwrap().lateral_mps2.abs());
        let (w, mass) = (p.car.work, p.car.model.geometry.mass_kg);
        let stored = p.car.kinetic_j() + mass * G * (height(&p, &rail) - start);
        let lost = w.brake_j + w.rolling_j + w.drag_j + w.tyre_j;
        let spent = w.motor_j.abs() + lost + stored.abs();
        if t > 2.0 {
            worst = worst.max((w.motor_j - lost - stored).abs() / spent);
        }
    }
    assert!(
        p.car.state.s > 250.0 && turned > 1.5,
        "the test drives through the bends: {turned}"
    );
    assert!(worst < 2e-3, "{worst}");
}

/// (M + J) v̇ = −f M g − D v²: v = c tan(φ₀ − k t), c² = f M g / D, k = √(f M g D) / (M + J).
#[test]
fn coasting_follows_the_closed_form() {
    let (car, v0) = (car(), 20.0);
    let mut p = RoadPlant::new(&car, level(), &options(10.0, v0));
    let m = &p.car.model;
    let (mass, drag) = (m.geometry.mass_kg, m.drag);
    let rolling = m.wheels[0].rolling * mass * G;
    let (c, k) = (
        (rolling / drag).sqrt(),
        (rolling * drag).sqrt() / (mass + car.rotating_mass_kg()),
    );
    for second in 1..=40 {
        steps(&mut p, &drive(0.0, 0.0), 1.0, DT);
        let expected = c * ((v0 / c).atan() - k * second as f64).tan();
        let v = p.truth().speed_mps;
        assert!(
            (v - expected).abs() < 1e-3 * v0,
            "{second} s: {v} against {expected}"
        );
    }
}

/// A constant torque on a constant grade.
#[test]
fn torque_on_a_grade_accelerates_as_newton_says() {
    for deg in [-6.0, 0.0, 11.31, 16.17] {
        let car = car();
        let mut p = RoadPlant::new(&car, grade(deg), &options(20.0, 3.0));
        let m = p.car.model;
        let torque = 260.0;
        steps(&mut p, &drive(torque, 0.0), 1.5, DT);
        let (v0, mut drag, n) = (p.truth().speed_mps, 0.0, 500);
        for _ in 0..n {
            p.step(&drive(torque, 0.0), DT).unwrap();
            drag += p.car.forces.drag_n / n as f64;
        }
        let d = &m.drives[0];
        let rim = 2.0 * torque * d.gear_ratio * d.efficiency_drive / d.wheel_radius_m;
        let (mass, angle) = (m.geometry.mass_kg, deg.to_radians());
        let force = rim - drag - mass * G * (angle.sin() + m.wheels[0].rolling * angle.cos());
        let expected = force / (mass + car.rotating_mass_kg());
        let measured = (p.truth().speed_mps - v0) / (n as f64 * DT);
        // creep of the tyres: rims turn up to 2 % faster than the road goes by, and with them their inertia
        assert!(
            (measured / expected - 1.0).abs() < 2e-3,
            "{deg}°: {measured} against {expected}"
        );
    }
}

/// δ = L/R + K a, β = b/R − a m v²/(C_r L R) (Rajamani 2012, section 3.3), with the slip angles of a brush tyre: 1 + γ
/// times the linear ones, γ = a/(3 µ g), 3.8 % at 1 m/s². Without rolling resistance, which is more on the loaded outer
/// wheels and turns the car outwards a little.
#[test]
fn steady_circles_are_those_of_the_single_track_model() {
    let (mut car, radius) = (car(), 100.0);
    car.data.wheels.rolling_resistance = NonNegative::new(0.0);
    let steady = |speed: f64| {
        let mut p = RoadPlant::new(&car, circle(radius), &options(10.0, speed));
        for _ in 0..((60.0 + 300.0) / speed / DT) as usize {
            let c = cruise(&p, speed);
            p.step(&c, DT).unwrap();
        }
        (p.truth().road.unwrap(), p.truth().speed_mps)
    };
    let m = car.model(G);
    let g = &m.geometry;
    let weight = g.mass_kg * G;
    let front =
        car.data.tyres.cornering_stiffness_front.get() * weight * g.rear_m / g.wheelbase_m();
    let rear = car.data.tyres.cornering_stiffness_rear.get() * weight * g.front_m / g.wheelbase_m();
    let understeer = g.mass_kg / g.wheelbase_m() * (g.rear_m / front - g.front_m / rear);

    let (slow, v) = steady(2.0);
    let expected = g.wheelbase_m() / radius + understeer * v * v / radius;
    assert!(
        (slow.steering_rad / expected - 1.0).abs() < 0.01,
        "{} against {expected}",
        slow.steering_rad
    );

    let (fast, v) = steady(10.0);
    let lateral = v * v / radius;
    assert!((fast.lateral_mps2 / lateral - 1.0).abs() < 0.01, "{fast:?}");
    assert!(
        (fast.yaw_rate_radps * radius / v - 1.0).abs() < 0.01,
        "{fast:?}"
    );
    // against the circle driven, a little beside the middle of the lane
    let by_speed = fast.steering_rad - g.wheelbase_m() * fast.yaw_rate_radps / v;
    let softer = 1.0 + lateral / (3.0 * car.data.tyres.adhesion_across.get() * G);
    let expected = understeer * lateral * softer;
    assert!(
        (by_speed / expected - 1.0).abs() < 0.02,
        "{by_speed} against {expected}"
    );
    let rear_slip = g.front_m * g.mass_kg * lateral / (rear * g.wheelbase_m()) * softer;
    let beta = g.rear_m / radius - rear_slip;
    assert!(
        (fast.sideslip_rad - beta).abs() < 0.02 * rear_slip,
        "{} against {beta}",
        fast.sideslip_rad
    );
    assert!(
        fast.offset_m.abs() < 0.1,
        "the driver keeps the middle: {fast:?}"
    );
}

#[test]
fn a_braked_car_stands_on_a_grade_and_its_tyres_hold_its_weight() {
    for deg in [16.17, -16.17] {
        let rail = grade(deg);
        let mut p = plant(&rail, 100.0, 0.0);
        steps(&mut p, &drive(0.0, 1.0), 5.0, DT);
        let (s, mass) = (p.truth().chainage_m, p.car.model.geometry.mass_kg);
        steps(&mut p, &drive(0.0, 1.0), 60.0, DT);
        let moved = (p.truth().chainage_m - s).abs();
        assert!(moved < 1e-4, "{deg}°: {moved} m in a minute");
        let force = p.car.forces.tyre_n[0];
        let weight = mass * G * deg.to_radians().sin();
        assert!(
            (force / weight - 1.0).abs() < 1e-3,
            "{force} against {weight}"
        );
        // and without the brake it rolls
        steps(&mut p, &drive(0.0, 0.0), 3.0, DT);
        let rolled = p.truth().chainage_m - s;
        assert!(rolled * deg < 0.0 && rolled.abs() > 2.0, "{rolled}");
    }
}

#[test]
fn wheel_loads_carry_the_weight_and_balance_its_moments() {
    let rail = winding(1.0);
    let mut p = plant(&rail, 10.0, 0.0);
    let m = p.car.model;
    let (mut most, mut shifted) = (0.0f64, 0.0f64);
    for _ in 0..(35.0 / DT) as usize {
        let c = cruise(&p, 8.0);
        let (v, s) = (p.car.state.v[0], p.car.state.s);
        p.step(&c, DT).unwrap();
        let g = &m.geometry;
        let [front, rear] = [s + g.front_m, s - g.rear_m].map(|s| rail.frame(s));
        let share = |f: f64, r: f64| (g.rear_m * f + g.front_m * r) / g.wheelbase_m();
        let sine = share(front.t.z, rear.t.z);
        let sag = share(
            rail.curvature_vertical(front.s),
            rail.curvature_vertical(rear.s),
        );
        let normal = g.mass_kg * (G * (1.0 - sine * sine).sqrt() + sag * v * v);
        let loads = p.truth().road.unwrap().wheel_load_n;
        most = most.max((loads.iter().sum::<f64>() / normal - 1.0).abs());
        shifted = shifted.max((loads[0] - loads[1]).abs());
    }
    assert!(most < 2e-3, "{most}");
    assert!(shifted > 500.0, "bends shift load: {shifted}");

    // steady climb: moments about the rear contacts, by hand
    let mut p = plant(&grade(11.31), 20.0, 4.0);
    for _ in 0..(6.0 / DT) as usize {
        let c = cruise(&p, 4.0);
        p.step(&c, DT).unwrap();
    }
    let (g, f) = (&m.geometry, &p.car.forces);
    let specific = (f.tyre_n[0] - f.drag_n) / g.mass_kg;
    let front = f.load_n[0] + f.load_n[1];
    let expected = (f.normal_n * g.rear_m - g.mass_kg * specific * g.height_m) / g.wheelbase_m();
    assert!(
        (front / expected - 1.0).abs() < 1e-3,
        "{front} against {expected}"
    );
}

/// Full throttle and full brake, in bends, on dry and on icy road.
#[test]
fn no_tyre_leaves_its_friction_ellipse_and_ice_limits_the_acceleration() {
    let ice = AdhesionZone {
        from_m: 0.0,
        to_m: 1e4,
        adhesion: 0.15,
    };
    for zones in [vec![], vec![ice]] {
        let mut p = RoadPlant::new(
            &car(),
            circle(60.0),
            &PlantOptions {
                zones: zones.clone(),
                ..options(10.0, 0.0)
            },
        );
        let mut most = 0.0f64;
        for k in 0..(12.0 / DT) as usize {
            let c = match k as f64 * DT {
                t if t < 4.0 => drive(300.0, 0.0),
                t if t < 6.0 => drive(0.0, 1.0),
                _ => drive(150.0, 0.0),
            };
            // on ice the car may well slide off its lane: the law holds up to there
            if p.step(&c, DT).is_err() {
                break;
            }
            let f = &p.car.forces;
            for (i, w) in p.car.state.wheels.iter().enumerate() {
                let tyre = &p.car.model.tyres[i / 2];
                let [x, y] = tyre.limits(f.load_n[i], f.grip[i / 2]);
                most = most.max((w.force[0] / x).powi(2) + (w.force[1] / y).powi(2));
            }
        }
        assert!(most <= 1.0 + 1e-9, "{most}");
        assert!(
            most > 0.2 || !zones.is_empty(),
            "the test asks something of the tyres: {most}"
        );
    }
    let mut p = RoadPlant::new(
        &car(),
        level(),
        &PlantOptions {
            zones: vec![ice],
            ..options(10.0, 0.0)
        },
    );
    steps(&mut p, &drive(340.0, 0.0), 3.0, DT);
    let (v, t) = (p.truth().speed_mps, p.truth().t_s);
    let limit = 0.15 * G * t;
    assert!(v < limit && v > 0.8 * limit, "{v} against {limit}");
    assert!(
        p.truth().drives[0].slip_mps > 5.0,
        "the wheels spin: {:?}",
        p.truth().drives[0]
    );
}

/// An accelerometer on a rigid car feels what tyres, air and road do to its mass: two separate ways through the
/// code.
#[test]
fn the_accelerometer_reads_the_forces_on_the_mass() {
    let rail = winding(1.0);
    let mut p = RoadPlant::new(&rigid(), rail, &options(10.0, 0.0));
    let mass = p.car.model.geometry.mass_kg;
    let (mut n, mut sum) = (0.0, [0.0; 3]);
    for k in 0..(35.0 / DT) as usize {
        let c = cruise(&p, 7.0);
        let before = p.truth().mounts[0];
        p.step(&c, DT).unwrap();
        let [_, read] = specific_force(&MotionStep {
            before: &before,
            now: &p.truth().mounts[0],
            dt_s: DT,
            gravity_mps2: G,
        });
        if k as f64 * DT > 1.0 {
            let f = &p.car.forces;
            let acting = [f.tyre_n[0] - f.drag_n, f.tyre_n[1], f.normal_n];
            for ((sum, read), acting) in sum.iter_mut().zip(read.iter()).zip(acting) {
                *sum += (read - acting / mass).powi(2);
            }
            n += 1.0;
        }
    }
    // up and down: the chord's ends and its middle curve a little differently in the transitions
    for (axis, bound) in [(0, 0.01), (1, 0.02), (2, 0.05)] {
        let rms = f64::sqrt(sum[axis] / n);
        assert!(rms < bound, "axis {axis}: {rms} m/s²");
    }
}

/// The body squats on a grade by its gradient, and the accelerometer reads it.
#[test]
fn a_standing_car_reads_grade_and_squat() {
    let mut p = plant(&grade(11.31), 100.0, 0.0);
    steps(&mut p, &drive(0.0, 1.0), 5.0, DT);
    let road = f64::to_radians(11.31);
    let squat = f64::to_radians(1.0) * G * road.sin() / 9.81;
    let t = p.truth();
    assert!((t.grade_at_imu_rad - road).abs() < 1e-9);
    assert!(
        (t.pitch_at_imu_rad - road - squat).abs() < 1e-5,
        "{}",
        t.pitch_at_imu_rad
    );
    let m = t.mounts[0];
    let [force, _] = specific_force(&MotionStep {
        before: &m,
        now: &m,
        dt_s: DT,
        gravity_mps2: G,
    });
    assert!((force.x - G * (road + squat).sin()).abs() < 1e-3, "{force}");
}

/// First order in the step: half the step, half the error; and the step in use is far below what the sensors can tell.
#[test]
fn the_path_converges_with_the_step() {
    let end = |dt: f64| {
        let rail = winding(1.0);
        let mut p = plant(&rail, 10.0, 6.0);
        // torque over time, the same whatever the step
        for k in 0..(12.0 / dt).round() as usize {
            let t = k as f64 * dt;
            p.step(&drive(20.0 + 30.0 * (0.7 * t).sin(), 0.0), dt)
                .unwrap();
        }
        let x = &p.car.state;
        [x.s, x.offset, x.v[0], x.yaw_rate]
    };
    let [coarse, middle, fine] = [5e-4, 2.5e-4, 1.25e-4].map(end);
    let first = (coarse[0] - middle[0]).abs();
    let second = (middle[0] - fine[0]).abs();
    assert!((1.6..2.6).contains(&(first / second)), "{first} {second}");
    assert!(
        2.0 * first < 0.01,
        "chainage is off by {first} m after 12 s"
    );
    assert!(
        (coarse[2] - fine[2]).abs() < 1e-3,
        "speed {} {}",
        coarse[2],
        fine[2]
    );
}

#[test]
fn left_and_right_are_mirror_images() {
    let run = |mirror: f64| {
        let rail = winding(mirror);
        let mut p = plant(&rail, 10.0, 0.0);
        for _ in 0..(30.0 / DT) as usize {
            let c = cruise(&p, 8.0);
            p.step(&c, DT).unwrap();
        }
        p
    };
    let (a, b) = (run(1.0), run(-1.0));
    let (x, y) = (&a.car.state, &b.car.state);
    assert!(
        x.yaw_rate.abs() > 0.02 || x.offset.abs() > 1e-3,
        "the car is in a bend: {x:?}"
    );
    for (name, same, mirrored) in [
        ("chainage", x.s, y.s),
        ("speed", x.v[0], y.v[0]),
        ("offset", x.offset, -y.offset),
        ("heading", x.heading, -y.heading),
        ("drift", x.v[1], -y.v[1]),
        ("yaw rate", x.yaw_rate, -y.yaw_rate),
        ("steering", x.steering, -y.steering),
        ("load", a.car.forces.load_n[0], b.car.forces.load_n[1]),
    ] {
        assert!(
            (same - mirrored).abs() < 1e-6 * same.abs().max(1.0),
            "{name}: {same} {mirrored}"
        );
    }
}

#[test]
fn the_same_run_gives_the_same_bits() {
    let run = || {
        let rail = winding(1.0);
        let mut p = plant(&rail, 10.0, 0.0);
        let mut bits = Vec::new();
        for _ in 0..(15.0 / DT) as usize {
            let c = cruise(&p, 8.0);
            p.step(&c, DT).unwrap();
            let m = &p.truth().mounts[0];
            bits.extend([p.truth().speed_mps, m.v_w.y, m.w_w.z, m.q_wm.coords.w].map(f64::to_bits));
        }
        bits
    };
    assert_eq!(run(), run());
}
