//! A road vehicle in a bend, by the single-track model (Riekert & Schunck 1940; Guo et al. 2024, §1; patent CN
//! 111507019 B, step 1 ②).
//!
//! Along the body, with steering angle δ, yaw rate r, lateral speed v_y, front traction F_f and front tyre side force
//! F_y:
//!
//! M (v̇ − v_y r) = F + F_f (cos δ − 1) − F_y sin δ − M g sin θ − s μ M g cos θ − drag
//!
//! The accelerometer across reads a_y. While the yaw rate changes slowly the front axle carries Y = M a_y l_r/L of it,
//! of which the traction gives F_f sin δ and the tyre the rest, F_y = (Y − F_f sin δ)/cos δ; with the rear axle's slip
//! α = M a_y l_f/(L c_r) the lateral speed at the centre of gravity is v_y = l_r r − v α. So
//!
//! M (v̇ + b) = F + F_f (1/cos δ − 1) − M g sin θ − …,  b = a_y (l_r/L) tan δ − v_y r
//!
//! and the accelerometer along reads f = v̇ − v_y r + g sin θ. All but the small second term is in proportion to the
//! mass.
//!
//! Against the prints: Guo et al. eq. 1 multiplies the traction by |a_x|/√(a_x² + a_y²), which is 0 in steady
//! cornering; the side force does not scale the traction. The patent takes the front slip from β = δ l_r/L, the
//! attitude without any side force: its slip is then (l_f/L)(δ − L r/v), which is 0 for a neutral vehicle however hard
//! it corners.

use crate::Real;
use crate::api::reading::Reading;
use crate::api::real::{cos, sin};
use crate::api::signals::{RoadVehicle, Vehicle};
use crate::api::snapshot::{Archive, Blank, State, state};
use crate::models::force_balance::ForceBalance;

/// Speed, m/s, below which the slip angles of the model are not well defined; the model does not hold backwards.
const SLOW_MPS: Real = 1.0;
/// Largest steering angle of the front wheels, rad.
const MAX_STEER: Real = 0.7;

/// Effects of a bend on the force balance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bend {
    /// F_f (1/cos δ − 1): what the steered traction pushes more along the body, N.
    pub gained_n: Real,
    /// b: mass times this is what the bend takes from the traction, m/s².
    pub taken_mps2: Real,
    /// v_y r: what the accelerometer along the body reads too little, m/s².
    pub drift_mps2: Real,
}

impl Bend {
    /// Loss of traction in a bend for a vehicle of `mass_kg`, N.
    pub fn force_n(&self, mass_kg: Real) -> Real {
        mass_kg * self.taken_mps2 - self.gained_n
    }
}

/// The bend of a road under the vehicle. A rail has none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bends {
    road: Option<RoadVehicle>,
    now: Bend,
}

impl Bends {
    /// Builds the bend signals for a vehicle.
    pub fn new(vehicle: &Vehicle) -> Self {
        Self {
            road: vehicle.road,
            now: Bend::default(),
        }
    }

    /// One step for a vehicle of about `mass_kg`.
    pub fn step(&mut self, reading: &Reading, balance: &ForceBalance, mass_kg: Real) {
        let Some(road) = self.road else { return };
        self.now = bend(&road, reading, balance, mass_kg).unwrap_or_default();
    }

    /// Returns true on a road; on a rail bends do not count.
    pub fn on_road(&self) -> bool {
        self.road.is_some()
    }

    /// The measured bend.
    pub fn now(&self) -> Bend {
        self.now
    }
}

/// The measured bend; `None` if an instrument is stale, or the vehicle is slow or goes backwards.
fn bend(
    road: &RoadVehicle,
    reading: &Reading,
    balance: &ForceBalance,
    mass_kg: Real,
) -> Option<Bend> {
    let speed = reading.speed_mps.filter(|v| *v > SLOW_MPS)?;
    let steer = reading.steering_angle_rad?.clamp(-MAX_STEER, MAX_STEER);
    let (across, yaw_rate) = (reading.lateral_force_mps2?, reading.yaw_rate_radps?);
    let length = road.front_axle_m + road.rear_axle_m;
    let slip = mass_kg * across * road.front_axle_m / (length * road.rear_cornering_npr);
    let drift = (road.rear_axle_m * yaw_rate - speed * slip) * yaw_rate;
    let front = reading
        .front_torque_nm
        .map_or(0.0, |torque| balance.traction(torque, speed));
    Some(Bend {
        gained_n: front * (1.0 / cos(steer) - 1.0),
        taken_mps2: across * road.rear_axle_m / length * sin(steer) / cos(steer) - drift,
        drift_mps2: drift,
    })
}

impl Blank for Bend {
    fn blank() -> Self {
        Self::default()
    }
}

state!(Bend { gained_n, taken_mps2, drift_mps2; });

/// A snapshot on a rail has no bend, so it is empty.
impl State for Bends {
    fn visit(&mut self, archive: &mut Archive) {
        if self.road.is_some() {
            self.now.visit(archive);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::vehicles::{Turn, car, vehicle};

    #[test]
    fn the_balance_holds_in_a_steady_turn_solved_from_the_axle_forces() {
        let balance = ForceBalance::new(&car());
        for (speed, yaw_rate) in [(16.7, 0.12), (8.0, -0.4), (4.0, 0.6)] {
            let turn = Turn::solve(2_170.0, speed, yaw_rate, 0.0);
            let bend = bend(&car().road.unwrap(), &turn.reading(), &balance, 2_170.0).unwrap();
            // At steady speed all traction less drag goes into resistance and the bend.
            let needed = 2_170.0 * 9.81 * car().running_resistance;
            let net = balance.net_traction(turn.reading().motor_torque_nm.unwrap(), speed);
            let left = net - bend.force_n(2_170.0) - needed;
            assert!(left.abs() < 0.02 * bend.force_n(2_170.0), "{left} {bend:?}");
            // Level road: what the accelerometer reads is −v_y r.
            let f = turn.reading().specific_force_mps2.unwrap();
            assert!(
                (f + bend.drift_mps2).abs() < 0.02 * f.abs() + 1e-4,
                "{f} {bend:?}"
            );
        }
    }

    #[test]
    fn left_and_right_are_alike_and_a_rail_has_no_bend() {
        let balance = ForceBalance::new(&car());
        let at = |r| {
            bend(
                &car().road.unwrap(),
                &Turn::solve(2e3, 10.0, r, 0.0).reading(),
                &balance,
                2e3,
            )
        };
        let (left, right) = (at(0.3).unwrap(), at(-0.3).unwrap());
        assert!((left.taken_mps2 - right.taken_mps2).abs() < 1e-9);
        assert!((left.drift_mps2 - right.drift_mps2).abs() < 1e-9);
        let mut rail = Bends::new(&vehicle());
        rail.step(&Turn::solve(2e3, 10.0, 0.3, 0.0).reading(), &balance, 2e3);
        assert_eq!(rail.now(), Bend::default());
    }

    #[test]
    fn without_an_instrument_or_slow_or_backwards_there_is_no_correction() {
        let balance = ForceBalance::new(&car());
        let full = Turn::solve(2e3, 10.0, 0.3, 0.0).reading();
        let bad = [
            Reading {
                steering_angle_rad: None,
                ..full
            },
            Reading {
                yaw_rate_radps: None,
                ..full
            },
            Reading {
                lateral_force_mps2: None,
                ..full
            },
            Reading {
                speed_mps: Some(0.5),
                ..full
            },
            Reading {
                speed_mps: Some(-10.0),
                ..full
            },
        ];
        for reading in bad {
            assert_eq!(bend(&car().road.unwrap(), &reading, &balance, 2e3), None);
        }
    }

    #[test]
    fn the_bend_now_is_the_one_read() {
        let balance = ForceBalance::new(&car());
        let reading = Turn::solve(2e3, 10.0, 0.3, 0.0).reading();
        let mut bends = Bends::new(&car());
        bends.step(&reading, &balance, 2e3);
        let read = bend(&car().road.unwrap(), &reading, &balance, 2e3).unwrap();
        assert_eq!(bends.now(), read);
    }
}
