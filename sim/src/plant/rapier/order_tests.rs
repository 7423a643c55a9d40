//! Every element of a step is of second order: halving the step divides its error by about four.

use super::free_motion::FreeBody;
use crate::plant::train::body_state::{BodyState, Wrench};
use crate::plant::train::friction::{Bristle, Contact};
use crate::plant::train::implicit::Implicit;
use crate::plant::train::motor::{Lag, TractionMotor};
use crate::plant::train::running_gear::grip;
use crate::plant::train::{coupling, resistance};
use crate::testing::{drive, slope};
use crate::train::{Body, Connection, ConnectionKind, Resistance, Station, Train};
use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};

/// Longest of the steps that are compared, s, each half of the one before; and for running gear, of which 4 ms are a
/// quarter of a period.
const LONGEST_S: f64 = 4e-3;
const LONGEST_OF_GEAR_S: f64 = 1e-3;

/// Holds the errors of an element at four steps against second order: log2 of their ratios is 2, less or more by what
/// the next order adds.
fn second_order(name: &str, error: impl Fn(f64) -> f64) {
    second_order_from(LONGEST_S, name, error);
}

fn second_order_from(longest_s: f64, name: &str, error: impl Fn(f64) -> f64) {
    let errors = [1.0, 0.5, 0.25, 0.125].map(|share| error(share * longest_s));
    let orders: Vec<f64> = errors
        .windows(2)
        .map(|e| (e[0] / e[1]).abs().log2())
        .collect();
    let shown = errors.map(|e| format!("{e:9.2e}")).join(" ");
    println!("{name:32} {shown}   {orders:5.2?}");
    assert!(orders.iter().all(|o| *o > 1.7), "{name}: {shown}");
}

fn steps(seconds: f64, dt: f64) -> usize {
    (seconds / dt).round() as usize
}

/// Displacement of m ẍ + c ẋ + k x = 0 from `x` at rest, after `t`.
fn oscillator(m: f64, c: f64, k: f64, x: f64, t: f64) -> f64 {
    let (d, w2) = (0.5 * c / m, k / m);
    let w = (w2 - d * d).sqrt();
    x * libm::exp(-d * t) * (libm::cos(w * t) + d / w * libm::sin(w * t))
}

fn body(mass_kg: f64, stations: Vec<Station>) -> Body {
    Body {
        name: "b".into(),
        mass_kg,
        com: Vector3::zeros(),
        inertia: Matrix3::from_diagonal(&Vector3::new(3.0, 7.0, 9.0)),
        start_s: 0.0,
        start_pose: Isometry3::identity(),
        stations,
        shapes: Vec::new(),
    }
}

fn at_rest(p: Vector3<f64>) -> BodyState {
    BodyState {
        p,
        q: UnitQuaternion::identity(),
        r: Matrix3::identity(),
        c: p,
        v: Vector3::zeros(),
        w: Vector3::zeros(),
        gained: Default::default(),
    }
}

/// Moves the one body of a train for a while, as the world moves it. `forces` adds what acts on it as expected, and
/// then what that gains as the velocities change by more.
fn moved(
    train: &Train,
    mut s: BodyState,
    (seconds, dt): (f64, f64),
    gravity: f64,
    mut forces: impl FnMut(&BodyState, Option<&[Vector3<f64>; 2]>, &mut Wrench),
) -> BodyState {
    let (free, mut implicit) = (FreeBody::new(&train.bodies[0]), Implicit::default());
    for _ in 0..steps(seconds, dt) {
        free.reach_middle(&mut s, dt);
        let (before, mut wrench) = (s.with(-0.5), [Wrench::ZERO]);
        forces(&s, None, &mut wrench[0]);
        implicit.solve(train, &[s], gravity, dt, &mut wrench);
        forces(&s, Some(&implicit.more[0]), &mut wrench[0]);
        [s.v, s.w] = before;
        free.push(&mut s, &wrench[0], gravity, dt);
        free.reach_end(&mut s, &before, dt, false);
    }
    s
}

fn train(b: Body) -> Train {
    Train {
        bodies: vec![b],
        ..Train::default()
    }
}

#[test]
fn free_body() {
    // A fall is exact; a tumbling body keeps its angular momentum.
    let train = train(body(100.0, vec![]));
    let start = BodyState {
        v: Vector3::new(1.0, 0.0, 2.0),
        w: Vector3::new(1.0, 2.0, 0.5),
        ..at_rest(Vector3::zeros())
    };
    let run = |dt| moved(&train, start, (1.0, dt), 9.81, |_, _, _| ());
    let fell = run(4e-3).c - Vector3::new(1.0, 0.0, 2.0 - 0.5 * 9.81);
    assert!(fell.norm() < 1e-12, "{fell}");
    let momentum = |s: &BodyState| s.r * train.bodies[0].inertia * s.r.transpose() * s.w;
    second_order("tumbling body", |dt| {
        (momentum(&run(dt)) - momentum(&start)).norm()
    });
    let exact = run(0.05e-3);
    second_order("its attitude", |dt| exact.q.angle_to(&run(dt).q));
}

#[test]
fn spring_damper_between_bodies() {
    let m = 290.0;
    let train = train(body(m, vec![]));
    for (k, c) in [(4e5, 0.0), (4e5, 5e3), (0.0, 2e3)] {
        let bar = Connection {
            kind: ConnectionKind::Hanger,
            a: 1,
            b: 0,
            anchor_a: Vector3::zeros(),
            anchor_b: Vector3::zeros(),
            k,
            c,
            length_m: 0.0,
        };
        let wall = at_rest(Vector3::zeros());
        let (x, v, t) = if k > 0.0 {
            (1e-3, 0.0, 0.2)
        } else {
            (0.0, 1.0, 0.2)
        };
        second_order(&format!("spring {k:.0e}, damper {c:.0e}"), |dt| {
            let mut s = at_rest(Vector3::new(x, 0.0, 0.0));
            s.v.x = v;
            let s = moved(&train, s, (t, dt), 0.0, |s, more, wrench| {
                let pull = coupling::pull(&bar, &wall, s);
                let force = match more {
                    None => pull.force,
                    Some(more) => pull.gains(&bar, &more[0], dt),
                };
                wrench.add(s, &-force, &pull.at_b);
            });
            if k > 0.0 {
                s.c.x / x - oscillator(m, c, k, 1.0, t)
            } else {
                s.v.x - libm::exp(-c / m * t)
            }
        });
    }
}

#[test]
fn running_gear() {
    // A trolley that bounces on its wheels without leaving them: two stations, two wheels each.
    let station = |x_m| Station {
        x_m,
        half_gauge_m: 0.05,
        wheel_radius_m: 0.09,
        wheel_k: 1e7,
        wheel_c: 1.5e4,
        holddown_play_m: 3e-3,
        guide_k: 5e6,
        guide_c: 1e4,
        guide_z_m: 0.0,
    };
    let m = 290.0;
    let train = train(body(m, vec![station(-0.2), station(0.2)]));
    let rail = slope(0.0);
    let f = rail.frame(50.0);
    let (sag, up) = (m * 9.81 / 4e7, 2e-5);
    for (t, name) in [(0.012, "a trolley's bounce"), (0.02, "the same, faded")] {
        second_order_from(LONGEST_OF_GEAR_S, name, |dt| {
            let start = at_rest(f.p + f.u * (up - sag));
            let s = moved(&train, start, (t, dt), 9.81, |s, more, wrench| {
                for st in &train.bodies[0].stations {
                    let at = s.point(&Vector3::new(st.x_m, 0.0, 0.0));
                    let f = rail.frame(at.x);
                    let g = grip(st, s, &at, &f, dt);
                    let loads = more.map_or(g.loads, |more| g.gained(st, s, more));
                    g.press(st, s, 0.0, loads, wrench);
                }
            });
            ((s.c - f.p).dot(&f.u) + sag - oscillator(m, 6e4, 4e7, up, t)) / up
        });
    }
}

/// Steps a wheel under a body that moves as expected.
fn stepped(c: &mut Contact, wheel: &Bristle, g: f64, torque: f64, under: [f64; 2], dt: f64) {
    c.begin(wheel, g, [torque, 0.0], under, dt);
    c.end(wheel, 0.0, dt);
}

#[test]
fn bristles() {
    let bristle = Bristle {
        sigma0: 1.2e6,
        sigma1: 2e3,
        kappa: 0.0,
        radius: 0.0,
        inertia: f64::INFINITY,
    };
    let (m, t) = (580.0, 0.2);
    // A body swings on a shoe that holds.
    second_order("body on a bristle that holds", |dt| {
        let train = train(body(m, vec![]));
        let mut shoe = Contact::default();
        shoe.z = -1e-3;
        let start = at_rest(Vector3::x() * 1e-3);
        let s = moved(&train, start, (t, dt), 0.0, |s, more, w| {
            w.force.x += match more {
                None => shoe.begin(&bristle, 1e6, [0.0; 2], [s.v.x, s.gained[0].x], dt),
                Some(more) => -shoe.force + shoe.end(&bristle, more[0].x, dt),
            };
        });
        s.c.x / 1e-3 - oscillator(m, 2e3, 1.2e6, 1.0, t)
    });
    // A wheel swings on bristles of a body at rest.
    let wheel = Bristle {
        inertia: 2.36,
        radius: 0.17,
        ..bristle
    };
    second_order("wheel on a bristle that holds", |dt| {
        let mut c = Contact::default();
        c.z = 1e-3;
        for _ in 0..steps(t, dt) {
            stepped(&mut c, &wheel, 1e6, 0.0, [0.0; 2], dt);
        }
        let m = wheel.inertia / (wheel.radius * wheel.radius);
        c.z / 1e-3 - oscillator(m, 2e3, 1.2e6, 1.0, t)
    });
    // A driven wheel creeps along a web that gains speed: v = 1 + t.
    let creeping = Bristle {
        kappa: 20.0,
        ..wheel
    };
    let driven = |dt: f64| {
        let mut c = Contact::rolling(1.0 / wheel.radius);
        c.gained = dt / wheel.radius;
        for k in 0..steps(t, dt) {
            let v = 1.0 + (k as f64 + 0.5) * dt;
            stepped(&mut c, &creeping, 1e4, 500.0, [v, dt], dt);
        }
        c.omega
    };
    let exact = driven(0.02e-3);
    second_order("driven wheel that creeps", |dt| driven(dt) - exact);
    // Torque beyond adhesion: the wheel spins, T − r g.
    let mut c = Contact::default();
    for _ in 0..250 {
        stepped(&mut c, &wheel, 1e3, 400.0, [0.0; 2], 4e-3);
    }
    let spun = (400.0 - 0.17 * 1e3) / 2.36;
    assert!((c.omega / spun - 1.0).abs() < 5e-3, "{} {spun}", c.omega);
}

#[test]
fn motor_and_lags() {
    let (tau, t) = (0.05, 0.1);
    second_order("lag", |dt| {
        let mut lag = Lag::default();
        (0..steps(t, dt)).for_each(|_| {
            lag.step(1.0, tau, dt);
        });
        lag.value - (1.0 - libm::exp(-t / tau))
    });
    // A ramp of 1000 N·m/s through the lag, up to 40 N·m at 0.04 s.
    let d = drive();
    let ramp = |t: f64| t - tau * (1.0 - libm::exp(-t / tau));
    let exact = d.rate_nmps * (ramp(t) - ramp(t - 0.04));
    second_order("motor with ramp and lag", |dt| {
        let mut motor = TractionMotor::default();
        (0..steps(t, dt)).for_each(|_| {
            motor.step(&d, 40.0, 0.0, dt);
        });
        motor.torque() - exact
    });
}

#[test]
fn running_resistance() {
    // Bearings alone: m v̇ = −b v above standstill.
    let train = train(body(290.0, vec![]));
    let res = Resistance {
        bearing_nspm: 1e3,
        ..Resistance::default()
    };
    second_order("coasting against bearings", |dt| {
        let mut start = at_rest(Vector3::zeros());
        start.v.x = 2.0;
        let s = moved(&train, start, (0.2, dt), 0.0, |s, more, w| {
            if more.is_none() {
                w.force.x -= resistance::bearing(&res, s.v.x);
            }
        });
        s.v.x / 2.0 - libm::exp(-1e3 / 290.0 * 0.2)
    });
}
