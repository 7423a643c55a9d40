//! Specification of a car: plain numbers, checked by [`Car::new`](super::car::Car::new).

/// A car.
#[derive(Clone, Debug, PartialEq)]
pub struct CarSpec {
    /// Name of the car.
    pub name: String,
    /// Mass and size.
    pub body: BodySpec,
    /// Axles and wheels.
    pub wheels: AxlesSpec,
    /// Tyres.
    pub tyres: TyresSpec,
    /// Motors and gears.
    pub motors: MotorsSpec,
    /// Friction brakes.
    pub brakes: BrakesSpec,
    /// Air drag.
    pub air: AirSpec,
    /// Springs and dampers of the body.
    pub suspension: SuspensionSpec,
    /// The driver.
    pub driver: DriverSpec,
    /// What the car can run on.
    pub limits: LimitsSpec,
}

/// Mass and size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodySpec {
    /// Mass as it is driven, kg.
    pub mass_kg: f64,
    /// Inertia about the vertical axis, kg·m².
    pub yaw_inertia_kgm2: f64,
    /// Centre of gravity over the road, m.
    pub gravity_height_m: f64,
    /// Length, width, height, m: for viewing.
    pub size_m: [f64; 3],
}

/// Axles and wheels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxlesSpec {
    /// From the centre of gravity forward to the front axle, m.
    pub front_axle_m: f64,
    /// From the centre of gravity back to the rear axle, m.
    pub rear_axle_m: f64,
    /// Distance of left and right wheels, m.
    pub track_width_m: f64,
    /// Rolling radius, m.
    pub radius_m: f64,
    /// Inertia of one wheel about its axle, kg·m².
    pub inertia_kgm2: f64,
    /// Rolling resistance over load.
    pub rolling_resistance: f64,
    /// Largest angle of the front wheels, degrees.
    pub steering_max_deg: f64,
}

/// Tyres; stiffnesses are over the load, at the load the tyre carries on the level at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TyresSpec {
    /// Longitudinal force per unit of slip over load.
    pub slip_stiffness: f64,
    /// Lateral force per radian over load, front tyres.
    pub cornering_stiffness_front: f64,
    /// The same of the rear tyres.
    pub cornering_stiffness_rear: f64,
    /// Share of the stiffness lost when the load doubles.
    pub load_loss: f64,
    /// Adhesion coefficient along the wheel on a clean dry road.
    pub adhesion_along: f64,
    /// The same across.
    pub adhesion_across: f64,
    /// Relaxation length, m.
    pub relaxation_m: f64,
}

/// Motors and gears: one for each axle, half of its torque to each wheel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorsSpec {
    /// Front motor.
    pub front: MotorSpec,
    /// Rear motor.
    pub rear: MotorSpec,
    /// Motor revolutions per wheel revolution.
    pub ratio: f64,
    /// Share of power that passes when driving, and when braking.
    pub efficiency: f64,
}

/// A motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorSpec {
    /// N·m.
    pub torque_max_nm: f64,
    /// kW.
    pub power_kw: f64,
    /// Revolutions per minute.
    pub speed_max_rpm: f64,
    /// Rotor, at its shaft, kg·m².
    pub inertia_kgm2: f64,
    /// First-order lag of the torque, s.
    pub lag_s: f64,
    /// Fastest change of the torque, N·m/s.
    pub torque_rate_nmps: f64,
}

/// Friction brakes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BrakesSpec {
    /// Largest force of all four at the road, N.
    pub force_max_n: f64,
    /// Share of it at the front axle.
    pub front_share: f64,
    /// First-order lag, s.
    pub lag_s: f64,
}

/// Air drag ½ ρ c_D A v².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AirSpec {
    /// c_D.
    pub drag_coefficient: f64,
    /// A, m².
    pub frontal_area_m2: f64,
    /// ρ, kg/m³.
    pub density_kgpm3: f64,
}

/// Springs and dampers of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SuspensionSpec {
    /// Pitch per longitudinal specific force, degrees per 9.81 m/s²; 0 = rigid.
    pub pitch_deg_per_g: f64,
    /// Roll per lateral specific force, degrees per 9.81 m/s²; 0 = rigid.
    pub roll_deg_per_g: f64,
    /// Share of the roll moment that the front axle carries.
    pub front_roll_share: f64,
    /// Undamped natural frequency of pitch and roll, Hz.
    pub frequency_hz: f64,
    /// Damping ratio.
    pub damping: f64,
}

/// The driver, who steers along the middle of the lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriverSpec {
    /// How far ahead the driver looks, m.
    pub lookahead_m: f64,
    /// Steering per metre beside the middle, rad/m.
    pub gain_radpm: f64,
    /// First-order lag of driver and steering gear, s.
    pub lag_s: f64,
}

/// What the car can run on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitsSpec {
    /// Least horizontal radius, m.
    pub min_radius_horizontal_m: f64,
    /// Least vertical radius, m.
    pub min_radius_vertical_m: f64,
    /// Steepest grade, degrees.
    pub max_grade_deg: f64,
    /// Highest speed, m/s.
    pub max_speed_mps: f64,
}
