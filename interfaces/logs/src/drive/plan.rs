//! The channels of a map, and the nominal vehicle for the estimators.

use super::channel::{Channel, MAX_TERMS, Target, VectorPath};
use crate::map::{
    Axis, CommandChannel, Formula, Map, MeasuredChannel, Mount, Nominal, ScalarChannel, Traction,
    VectorChannel, key, quantity,
};
use crate::notation::{Expression, Quantity, STANDARD_GRAVITY_MPS2, Unit, UnitName};
use monorig_estimators::api::signals::{Measurand, RoadVehicle, Slot, Vehicle, VehicleData};
use monorig_sim::closed_loop::recorded::nominal_vehicle;
use monorig_sim::config::checked::{Finite, Fraction, NonNegative, Positive};
use monorig_sim::config::file::named;
use monorig_sim::config::scenario::NominalVehicle;
use monorig_sim::error::Error;
use nalgebra::{Matrix3, Rotation3, Vector3};
use std::collections::BTreeSet;
use std::slice;

/// The channels that are made of a log's columns.
#[derive(Clone, Debug)]
pub struct Plan {
    pub(super) channels: Vec<Channel>,
    /// Nominal vehicle for the estimators.
    pub(crate) vehicle: Vehicle,
    /// Wheels that are measured.
    pub(crate) wheels: usize,
    /// Motors whose torque is measured.
    pub(crate) motors: usize,
    /// Number of motors whose commanded torque is recorded; 0 without a command.
    pub(crate) commanded: usize,
    /// Axes of specific force and angular rate in the order forward, left, up that the log does not have.
    pub(crate) absent: Vec<(Measurand, usize)>,
    /// Values that the map does not give, with their replacements.
    pub(crate) taken: Vec<String>,
}

/// Standard deviations of the biases of uncalibrated instruments, if a map does not give them: m/s² and rad/s. Of a box
/// whose mount nobody told two of them are a pitch of 3°.
const ACCEL_BIAS_MPS2: f64 = 0.1;
const UNTOLD_MOUNT_MPS2: f64 = 0.25;
const GYRO_BIAS_RADPS: f64 = 0.01;

impl Plan {
    /// The plan of a map.
    pub fn new(map: &Map) -> Result<Self, Error> {
        let c = &map.file.channels;
        let mut channels = Vec::new();
        for (measurand, channel) in &c.measured {
            if let MeasuredChannel::Vector(channel) = channel {
                channels.push(vector(map, *measurand, channel)?);
            }
        }
        // wheels that are not driven do not slip: where there are some, the others are left out
        let undriven = c.wheel_speed.iter().any(|w| !w.driven);
        let mut wheels = 0;
        for (i, w) in c
            .wheel_speed
            .iter()
            .enumerate()
            .filter(|(_, w)| !(undriven && w.driven))
        {
            let key = format!("channels.wheel_speed[{i}]");
            for column in &w.columns {
                let mut channel = Channel::of(
                    map,
                    &key,
                    Target::Measured(Measurand::WheelSpeed.slot(wheels)),
                    w.file.as_deref(),
                    &[column],
                    &w.unit,
                    Quantity::Speed,
                )?;
                channel.settle(map, w.valid_if.as_ref().map(|c| &c.0), w.latency_ms, w.sign)?;
                channel.factor *= w.gain.map_or(1.0, Positive::get);
                channels.push(channel);
                wheels += 1;
            }
        }
        let (mut vehicle, tells_all) = vehicle(map)?;
        if wheels > 0 {
            vehicle.drives = wheels;
        }
        let mut motors = 0;
        if let Some(t) = &c.traction {
            motors = traction(map, t, &vehicle, &mut channels)?;
        }
        for (measurand, channel) in &c.measured {
            let list = match channel {
                MeasuredChannel::Vector(_) => &[],
                MeasuredChannel::Scalar(one) => slice::from_ref(one),
                MeasuredChannel::List(list) => list.as_slice(),
            };
            for (i, s) in list.iter().enumerate() {
                channels.push(scalar(map, measurand.slot(i), s)?);
            }
        }
        if let Some(command) = &c.command {
            commands(map, command, &mut channels)?;
        }
        super::put_faults::add(map, &mut channels)?;
        let mut taken = Vec::new();
        let mut bias = |measurand, of_vehicle: Option<f64>, default: f64| {
            let channel = c.vector(measurand)?;
            let told = channel.bias_sd.map(Positive::get).or(of_vehicle);
            if told.is_none() && !tells_all {
                let (name, unit) = (measurand.name(), measurand.unit());
                taken.push(format!("bias_sd of the {name} ({default} {unit})"));
                return Some(default);
            }
            told
        };
        let told = VehicleData {
            accel_bias_sd_mps2: bias(
                Measurand::SpecificForce,
                vehicle.accel_bias_sd_mps2,
                match tells_mount(map) {
                    true => ACCEL_BIAS_MPS2,
                    false => UNTOLD_MOUNT_MPS2,
                },
            )
            .or(vehicle.accel_bias_sd_mps2),
            gyro_bias_sd_radps: bias(
                Measurand::AngularRate,
                vehicle.gyro_bias_sd_radps,
                GYRO_BIAS_RADPS,
            )
            .or(vehicle.gyro_bias_sd_radps),
            ..vehicle
        };
        let vehicle = Vehicle::new(told).map_err(|e| {
            map.error(
                "nominal",
                e.to_string(),
                "use values that the data sheet of a vehicle can have",
            )
        })?;
        Ok(Self {
            channels,
            vehicle,
            wheels,
            motors,
            commanded: c.command.as_ref().map_or(0, |c| c.torque.len()),
            absent: c.measured.iter().flat_map(absent).collect(),
            taken,
        })
    }

    /// The columns that are wanted of each file, in the order of their names.
    pub(super) fn wanted(&self, map: &Map) -> Vec<BTreeSet<String>> {
        let mut wanted = vec![BTreeSet::new(); map.files.len()];
        for channel in &self.channels {
            for (column, source) in channel.slots.iter().zip(&channel.sources) {
                if let Some(of) = wanted.get_mut(*source) {
                    of.insert(column.clone());
                }
            }
        }
        wanted
    }

    /// The measurements that there are.
    pub(crate) fn targets(&self) -> impl Iterator<Item = Target> + '_ {
        self.channels.iter().map(|c| c.target)
    }
}

impl Channel {
    fn of(
        map: &Map,
        key: &str,
        target: Target,
        file: Option<&str>,
        formulas: &[&Formula],
        unit: &UnitName,
        quantity: Quantity,
    ) -> Result<Self, Error> {
        let unit = unit_of(map, key, unit, quantity)?;
        Self::in_unit(map, key, target, file, formulas, unit)
    }

    fn in_unit(
        map: &Map,
        key: &str,
        target: Target,
        file: Option<&str>,
        formulas: &[&Formula],
        unit: &Unit,
    ) -> Result<Self, Error> {
        // a channel whose columns are all of one other file is of that file
        let columns = || formulas.iter().flat_map(|f| &f.expression.columns);
        let of = columns().next().and_then(|c| map.elsewhere(c));
        let of = of.filter(|(source, _)| {
            columns().all(|c| map.elsewhere(c).is_some_and(|(other, _)| other == *source))
        });
        let mut channel = Self {
            target,
            key: key.to_owned(),
            source: match of {
                Some((source, _)) => source,
                None => map.file_of(key, file)?,
            },
            formulas: Vec::new(),
            main: formulas.len(),
            valid_if: None,
            slots: Vec::new(),
            sources: Vec::new(),
            values: Vec::new(),
            came_ns: Vec::new(),
            tables: Vec::new(),
            unit: *unit,
            factor: 1.0,
            vector: None,
            latency_ns: 0,
            faults: None,
            waiting: Default::default(),
            offered: false,
            watched: None,
        };
        for formula in formulas {
            let compiled = channel.compile(map, &formula.expression)?;
            channel.formulas.push(compiled);
        }
        if channel.slots.is_empty() {
            return Err(map.error(
                key,
                "this channel has no column",
                "use the name of a column, or an expression with a column",
            ));
        }
        Ok(channel)
    }

    fn compile(
        &mut self,
        map: &Map,
        expression: &Expression,
    ) -> Result<(Expression, Vec<usize>), Error> {
        if expression.columns.len() > MAX_TERMS {
            return Err(map.error(
                self.key.clone(),
                format!(
                    "the expression `{}` has {} columns",
                    expression.text,
                    expression.columns.len()
                ),
                format!("at most {MAX_TERMS}"),
            ));
        }
        let own = self.source;
        let place = |c: &String| match map.elsewhere(c) {
            Some((source, column)) => (source, column.to_owned()),
            None => (own, c.clone()),
        };
        let places: Vec<_> = expression.columns.iter().map(place).collect();
        let slots = places
            .iter()
            .map(|(source, c)| self.slot(*source, c))
            .collect();
        Ok((expression.clone(), slots))
    }

    fn settle(
        &mut self,
        map: &Map,
        valid_if: Option<&Expression>,
        latency_ms: Option<NonNegative>,
        sign: Finite,
    ) -> Result<(), Error> {
        self.valid_if = valid_if.map(|e| self.compile(map, e)).transpose()?;
        self.latency_ns = latency_ms.map_or(0, |ms| (ms.get() * 1e6).round() as i64);
        self.factor *= sign.get();
        Ok(())
    }
}

/// The channel of a quantity of one value.
fn scalar(map: &Map, slot: Slot, s: &ScalarChannel) -> Result<Channel, Error> {
    let mut channel = Channel::of(
        map,
        &key(slot.measurand, slot.index),
        Target::Measured(slot),
        s.file.as_deref(),
        &[&s.column],
        &s.unit,
        quantity(slot.measurand),
    )?;
    channel.settle(map, s.valid_if.as_ref().map(|c| &c.0), s.latency_ms, s.sign)?;
    Ok(channel)
}

/// The channel of a vector.
fn vector(map: &Map, measurand: Measurand, v: &VectorChannel) -> Result<Channel, Error> {
    let unit = unit_of(map, &key(measurand, 0), &v.unit, quantity(measurand))?;
    let at_rest = at_rest(measurand, v.axes, unit);
    let columns = v.columns.iter().zip(at_rest);
    let columns: Vec<Formula> = columns
        .map(|(column, x)| match column.is_none() {
            true => Formula::constant(x),
            false => column.clone(),
        })
        .collect();
    let mut channel = Channel::in_unit(
        map,
        &key(measurand, 0),
        Target::Measured(measurand.slot(0)),
        v.file.as_deref(),
        &columns.iter().collect::<Vec<_>>(),
        unit,
    )?;
    channel.settle(
        map,
        v.valid_if.as_ref().map(|c| &c.0),
        v.latency_ms,
        Finite::new(1.0),
    )?;
    let bias = v.bias.map_or([0.0; 3], |b| b.map(Finite::get));
    let turn = mount(&v.mount_deg).matrix() * axes(v.axes);
    let lean = v
        .lean_deg_per_g
        .map_or(0.0, |d| d.get().to_radians() / STANDARD_GRAVITY_MPS2);
    channel.vector = Some(VectorPath {
        is_identity: bias == [0.0; 3]
            && lean == 0.0
            && turn == Matrix3::identity()
            && v.calibrate.is_none(),
        bias,
        found_bias: Vector3::zeros(),
        turn,
        lean,
    });
    Ok(channel)
}

/// True if the map gives the accelerometer's mounting or bias.
pub(crate) fn tells_mount(map: &Map) -> bool {
    let force = map.file.channels.vector(Measurand::SpecificForce);
    force.is_none_or(|v| {
        let m = &v.mount_deg;
        let turned = [m.roll, m.pitch, m.yaw].iter().any(|x| x.get() != 0.0);
        turned || v.bias.is_some() || v.calibrate.is_some() || v.bias_sd.is_some()
    })
}

/// The axes of a vector, in the order forward, left, up, that only columns which are not there would show.
fn absent((measurand, channel): (&Measurand, &MeasuredChannel)) -> Vec<(Measurand, usize)> {
    let MeasuredChannel::Vector(v) = channel else {
        return Vec::new();
    };
    let turn = axes(v.axes);
    let none = |axis: &usize| {
        let mut columns = v.columns.iter().enumerate();
        columns.all(|(i, c)| c.is_none() || turn[(*axis, i)] == 0.0)
    };
    (0..3).filter(none).map(|axis| (*measurand, axis)).collect()
}

/// The three columns on a level vehicle at rest, in their unit: gravity on the axis that points up or down.
fn at_rest(measurand: Measurand, of: Option<[Axis; 3]>, unit: &Unit) -> [f64; 3] {
    let up = axes(of).transpose() * Vector3::z();
    match measurand {
        Measurand::SpecificForce => (up * STANDARD_GRAVITY_MPS2 / unit.to_si(1.0)).into(),
        _ => [0.0; 3],
    }
}

/// From the columns to forward, left, up.
pub(crate) fn axes(axes: Option<[Axis; 3]>) -> Matrix3<f64> {
    let Some(axes) = axes else {
        return Matrix3::identity();
    };
    let direction = |axis| match axis {
        Axis::Forward => Vector3::x(),
        Axis::Backward => -Vector3::x(),
        Axis::Left => Vector3::y(),
        Axis::Right => -Vector3::y(),
        Axis::Up => Vector3::z(),
        Axis::Down => -Vector3::z(),
    };
    Matrix3::from_columns(&axes.map(direction))
}

/// From a box that is rolled, pitched and yawed to the vehicle.
pub(crate) fn mount(m: &Mount) -> Rotation3<f64> {
    turned(
        m.roll.get().to_radians(),
        m.pitch.get().to_radians(),
        m.yaw.get().to_radians(),
    )
}

/// From a box rolled right side down, then pitched nose up, then yawed to the left (rad) to the vehicle.
pub(crate) fn turned(roll: f64, pitch: f64, yaw: f64) -> Rotation3<f64> {
    let about = |axis: Vector3<f64>, angle: f64| Rotation3::from_scaled_axis(axis * angle);
    about(Vector3::z(), yaw) * about(Vector3::y(), -pitch) * about(Vector3::x(), roll)
}

/// The channels of the traction; how many motors there are.
fn traction(
    map: &Map,
    t: &Traction,
    vehicle: &VehicleData,
    channels: &mut Vec<Channel>,
) -> Result<usize, Error> {
    let key = "channels.traction";
    let valid_if = t.valid_if.as_ref().map(|c| &c.0);
    let one = |target, formula: &Formula, quantity| -> Result<Channel, Error> {
        let mut channel = Channel::of(
            map,
            key,
            target,
            t.file.as_deref(),
            &[formula],
            &t.unit,
            quantity,
        )?;
        channel.settle(map, valid_if, t.latency_ms, t.sign)?;
        channel.factor *= t.gain.map_or(1.0, Positive::get);
        Ok(channel)
    };
    if let Some(force) = &t.force {
        channels.push(one(Target::Force, force, Quantity::Force)?);
    }
    if let Some(power) = &t.power {
        let mut channel = one(Target::Power, power, Quantity::Power)?;
        channel.factor *= t.efficiency.map_or(1.0, Fraction::get);
        channels.push(channel);
    }
    for (i, torque) in t.torque.iter().flatten().enumerate() {
        let mut channel = one(
            Target::Measured(Measurand::MotorTorque.slot(i)),
            torque,
            Quantity::Torque,
        )?;
        if let Some(ratio) = &t.gear_ratio {
            let compiled = channel.compile(map, &ratio.expression)?;
            channel.formulas.push(compiled);
            channel.factor /= vehicle.gear_ratio;
        }
        channels.push(channel);
    }
    Ok(t.torque.as_ref().map_or(0, Vec::len))
}

/// Nominal values with the changes of a map.
fn changed(v: VehicleData, changes: NominalVehicle) -> VehicleData {
    let or = |x: Option<f64>, old: f64| x.unwrap_or(old);
    VehicleData {
        tare_kg: or(changes.tare_kg.map(f64::from), v.tare_kg),
        running_resistance: or(
            changes.running_resistance.map(f64::from),
            v.running_resistance,
        ),
        wheel_radius_m: or(changes.wheel_radius_m.map(f64::from), v.wheel_radius_m),
        ..v
    }
}

/// The channels of the command.
fn commands(map: &Map, c: &CommandChannel, channels: &mut Vec<Channel>) -> Result<(), Error> {
    let key = "channels.command";
    let mut add = |target, formula: &Formula, unit: &Unit, sign: Finite| {
        let mut channel = Channel::in_unit(map, key, target, c.file.as_deref(), &[formula], unit)?;
        channel.factor = sign.get();
        channels.push(channel);
        Ok::<(), Error>(())
    };
    if let Some(unit) = &c.unit {
        let torque = unit_of(map, key, unit, Quantity::Torque)?;
        for (i, formula) in c.torque.iter().enumerate() {
            add(Target::CommandTorque(i), formula, torque, c.sign)?;
        }
    }
    let one = Finite::new(1.0);
    if let (Some(formula), Some(mpa)) = (&c.clamp_pressure_mpa, Quantity::Pressure.unit("MPa")) {
        add(Target::CommandClamp, formula, mpa, one)?;
    }
    if let (Some(formula), Some(number)) = (&c.brake, Quantity::Number.unit("1")) {
        add(Target::CommandBrake, formula, number, one)?;
    }
    Ok(())
}

/// The unit of a channel, which must be one of its quantity.
fn unit_of(
    map: &Map,
    key: &str,
    unit: &UnitName,
    quantity: Quantity,
) -> Result<&'static Unit, Error> {
    quantity.unit(unit.as_str()).ok_or_else(|| {
        map.error(
            format!("{key}.unit"),
            format!("this is not a unit of {}", quantity.words()),
            quantity.names(),
        )
    })
}

/// The nominal vehicle: that of a file, with the changes of the map; and true for a file that tells each value, so that
/// one it does not tell is not known.
fn vehicle(map: &Map) -> Result<(VehicleData, bool), Error> {
    let n = &map.file.nominal;
    let changes = NominalVehicle {
        tare_kg: n.tare_kg,
        running_resistance: n.running_resistance,
        wheel_radius_m: n.wheel_radius_m,
        ..NominalVehicle::default()
    };
    let (mut v, tells_all) = match &map.file.vehicle {
        Some(name) => map.inputs.during(|| {
            let file = named(map.document.path(), "vehicle", name)?;
            match super::vehicle_file::read(&file)? {
                Some(vehicle) => Ok((changed(vehicle, changes), true)),
                None => nominal_vehicle(&file, changes).map(|v| (v, false)),
            }
        })?,
        None => {
            let tare = n.tare_kg.map_or(0.0, Positive::get);
            let nominal = VehicleData {
                tare_kg: tare,
                mass_range_kg: [0.5 * tare, 2.0 * tare],
                wheel_radius_m: n.wheel_radius_m.map_or(0.0, Positive::get),
                running_resistance: n.running_resistance.map_or(0.0, NonNegative::get),
                ..VehicleData::default()
            };
            (nominal, false)
        }
    };
    if let Some(range) = n.mass_range_kg {
        v.mass_range_kg = range.map(Positive::get);
    }
    if let Some(drives) = n.drives {
        v.drives = drives.get() as usize;
    }
    v.gear_ratio = n.gear_ratio.map_or(v.gear_ratio, Positive::get);
    v.efficiency = n.efficiency.map_or(v.efficiency, Fraction::get);
    v.rotating_mass_kg = n
        .rotating_mass_kg
        .map_or(v.rotating_mass_kg, NonNegative::get);
    v.imu_arm_m = n.imu_arm_m.map_or(v.imu_arm_m, Finite::get);
    v.road = road(n, v.road);
    Ok((v, tells_all))
}

/// Values of the road vehicle with the changes of the map; none of a train.
fn road(n: &Nominal, of_file: Option<RoadVehicle>) -> Option<RoadVehicle> {
    let positive = |x: Option<Positive>, old: f64| x.map_or(old, Positive::get);
    let told = n.drag_area_m2.is_some()
        || [
            n.air_density_kgpm3,
            n.front_axle_m,
            n.rear_axle_m,
            n.front_cornering_npr,
            n.rear_cornering_npr,
        ]
        .iter()
        .any(Option::is_some);
    let r = of_file.or(told.then_some(COMPACT_CAR))?;
    Some(RoadVehicle {
        drag_area_m2: n.drag_area_m2.map_or(r.drag_area_m2, NonNegative::get),
        air_density_kgpm3: positive(n.air_density_kgpm3, r.air_density_kgpm3),
        front_axle_m: positive(n.front_axle_m, r.front_axle_m),
        rear_axle_m: positive(n.rear_axle_m, r.rear_axle_m),
        front_cornering_npr: positive(n.front_cornering_npr, r.front_cornering_npr),
        rear_cornering_npr: positive(n.rear_cornering_npr, r.rear_cornering_npr),
    })
}

/// Values of a compact car, for values that are missing in a map.
const COMPACT_CAR: RoadVehicle = RoadVehicle {
    drag_area_m2: 0.65,
    air_density_kgpm3: 1.2,
    front_axle_m: 1.1,
    rear_axle_m: 1.5,
    front_cornering_npr: 8e4,
    rear_cornering_npr: 8e4,
};

#[cfg(test)]
mod tests {
    use super::*;
    use STANDARD_GRAVITY_MPS2 as G;

    /// A box pitched nose up by p on the level reads g sin p forward, one rolled right side down by r reads g sin r to
    /// the left; the mount turns both back to g upwards.
    #[test]
    fn a_mount_is_turned_back() {
        let (p, r) = (0.1f64, 0.2f64);
        let near = |a: Vector3<f64>, b: Vector3<f64>| assert!((a - b).norm() < 1e-12, "{a} {b}");
        near(
            turned(0.0, p, 0.0) * Vector3::new(G * p.sin(), 0.0, G * p.cos()),
            Vector3::z() * G,
        );
        near(
            turned(r, 0.0, 0.0) * Vector3::new(0.0, G * r.sin(), G * r.cos()),
            Vector3::z() * G,
        );
        // the nose of a box yawed to the left points to the left
        near(
            turned(0.0, 0.0, p) * Vector3::x(),
            Vector3::new(p.cos(), p.sin(), 0.0),
        );
        let front_right_down = Some([Axis::Forward, Axis::Right, Axis::Down]);
        near(
            axes(front_right_down) * Vector3::new(1.0, 2.0, 3.0),
            Vector3::new(1.0, -2.0, -3.0),
        );
    }
}
