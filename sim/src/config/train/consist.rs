//! A train file becomes a [`Train`]: units from front to rear, joined by drawbars, with a load below one of them.

use super::train_file::{Drawbar, TrainFile};
use super::unit::{Unit, check_wheel_limits};
use crate::config::checked::{NonNegative, Positive};
use crate::config::file::{Sets, input_error, named, read_yaml_with, with_sets};
use crate::config::urdf::half_turn;
use crate::error::Error;
use crate::train::{Body, Connection, ConnectionKind, Limits, Mount, Resistance, Train};
use monorig_estimators::api::signals::MAX_DRIVES;
use nalgebra::{Isometry3, Translation3, Vector3};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::{Path, PathBuf};

impl Train {
    /// Read a train file and every unit it names. The load is the one in its URDF.
    pub fn load(path: &Path) -> Result<Self, Error> {
        Self::load_with(path, &Sets::default())
    }

    /// Loads a consist with changes of the train file.
    pub(crate) fn load_with(path: &Path, sets: &Sets) -> Result<Self, Error> {
        load(path, sets).map_err(|e| with_sets(e, sets))
    }
}

fn load(path: &Path, sets: &Sets) -> Result<Train, Error> {
    let file: TrainFile = read_yaml_with(path, sets)?;
    let mut builder = ConsistBuilder {
        path,
        file: &file,
        train: Train::default(),
        spans: Vec::new(),
        length_m: 0.0,
        read: BTreeMap::new(),
    };
    builder.check_names()?;
    for i in 0..file.consist.len() {
        builder.add(i)?;
    }
    builder.join()?;
    if let Some(entry) = &file.load {
        builder.suspend_load(entry)?;
    }
    builder.finish()
}

/// A unit in place.
pub(super) struct PlacedUnit {
    pub unit: Unit,
    pub turn: Isometry3<f64>,
    /// Index of the first body of the unit.
    pub first: usize,
    /// Couplings at its front and rear: body and anchor.
    couplings: [(usize, Vector3<f64>); 2],
}

pub(super) struct ConsistBuilder<'a> {
    pub path: &'a Path,
    pub file: &'a TrainFile,
    pub train: Train,
    pub spans: Vec<PlacedUnit>,
    length_m: f64,
    /// Units that were read, by path: a train has many of the same.
    read: BTreeMap<PathBuf, Unit>,
}

/// Most units of a train: each is several bodies of the physics.
const MAX_UNITS: usize = 200;

impl ConsistBuilder<'_> {
    fn check_names(&self) -> Result<(), Error> {
        let units = self.file.consist.len();
        if units > MAX_UNITS {
            return Err(input_error(
                self.path,
                "consist",
                format!("this train has {units} units"),
                format!("at most {MAX_UNITS}"),
            ));
        }
        let consist = self
            .file
            .consist
            .iter()
            .enumerate()
            .map(|(i, e)| (format!("consist[{i}].name"), &e.name));
        let load = self
            .file
            .load
            .iter()
            .map(|l| ("load.name".to_owned(), &l.name));
        let mut seen: Vec<&str> = Vec::new();
        for (key, name) in consist.chain(load) {
            if name.is_empty() || name.contains('/') {
                return Err(input_error(
                    self.path,
                    key,
                    format!("`{name}` is not a valid name for a unit"),
                    "letters, digits and `_`; `/` separates unit and link",
                ));
            }
            if seen.contains(&name.as_str()) {
                return Err(input_error(
                    self.path,
                    key,
                    format!("two units are named `{name}`"),
                    "give each unit its own name",
                ));
            }
            seen.push(name);
        }
        if self.file.consist.is_empty() {
            return Err(input_error(
                self.path,
                "consist",
                "this train has no unit",
                "a list of {name, unit}, front to rear",
            ));
        }
        Ok(())
    }

    /// Unit of this file; the file is read only once.
    pub fn unit(&mut self, path: PathBuf) -> Result<Unit, Error> {
        match self.read.entry(path) {
            Entry::Occupied(unit) => Ok(unit.get().clone()),
            Entry::Vacant(place) => {
                let unit = Unit::load(place.key())?;
                Ok(place.insert(unit).clone())
            }
        }
    }

    /// Places the next unit behind the last unit.
    fn add(&mut self, index: usize) -> Result<(), Error> {
        let entry = &self.file.consist[index];
        let key = format!("consist[{index}].unit");
        let unit = self.unit(named(self.path, &key, &entry.unit)?)?;
        let Some(length) = unit.file.length_m else {
            return Err(input_error(
                self.path,
                key,
                "this unit's file gives no length_m",
                "only the load has no length",
            ));
        };
        let middle = -(self.length_m + 0.5 * length.get());
        self.length_m += length.get();
        let turn = if entry.reversed {
            half_turn()
        } else {
            Isometry3::identity()
        };
        let first = self.train.bodies.len();
        let couplings = match &unit.trolley {
            None => {
                self.add_bodies(&unit, &entry.name, middle, 0.0, &turn)?;
                if unit.stations.iter().all(Vec::is_empty) {
                    let help = "running wheels in its URDF, or `carried_by` in its file";
                    return Err(input_error(
                        self.path,
                        key,
                        "nothing holds this unit to the rail",
                        help,
                    ));
                }
                couplings(&unit, first, first, &turn)?
            }
            Some(trolley) => self.add_suspended_unit(&unit, trolley, &entry.name, middle, &turn)?,
        };
        self.spans.push(PlacedUnit {
            unit,
            turn,
            first,
            couplings,
        });
        Ok(())
    }

    /// Adds the bodies of one URDF, including floating bodies.
    pub fn add_bodies(
        &mut self,
        unit: &Unit,
        name: &str,
        middle: f64,
        height: f64,
        turn: &Isometry3<f64>,
    ) -> Result<(), Error> {
        let first = self.train.bodies.len();
        for (i, b) in unit.urdf.bodies.iter().enumerate() {
            // A turned unit keeps x forward as the axis of its body frames: what is on them is turned instead.
            let in_unit = turn * b.pose * turn.inverse();
            let along = in_unit.translation.x;
            let mass = b.mass.seen_from(turn);
            let mut stations = unit.stations[i].clone();
            stations
                .iter_mut()
                .for_each(|s| s.x_m = (turn * Vector3::new(s.x_m, 0.0, 0.0)).x);
            stations.sort_by(|a, b| b.x_m.total_cmp(&a.x_m));
            let mut shapes = b.shapes.clone();
            for s in &mut shapes {
                s.pose = turn * s.pose;
                let side = usize::from(s.pose.translation.y < 0.0);
                s.spins = s.spins.map(|_| (self.train.drives.len(), side));
            }
            self.train.bodies.push(Body {
                name: if i == 0 {
                    name.to_owned()
                } else {
                    format!("{name}/{}", b.root)
                },
                mass_kg: mass.mass_kg,
                com: mass.com,
                inertia: mass.inertia,
                start_s: middle + along,
                start_pose: Translation3::new(-along, 0.0, height) * in_unit,
                stations,
                shapes,
            });
        }
        for p in &unit.urdf.places {
            self.train.mounts.push(Mount {
                name: format!("{name}/{}", p.link),
                body: first + p.body,
                pose: turn * p.pose,
            });
        }
        for c in &unit.file.connections {
            let (a, b) = (unit.link(&c.from)?, unit.link(&c.to)?);
            let (a, anchor_a) = (first + a.body, turn * a.pose.translation.vector);
            let (b, anchor_b) = (first + b.body, turn * b.pose.translation.vector);
            let (k, cc) = (c.stiffness_npm.get(), c.damping_nspm.get());
            let length_m = (self.at(a, &anchor_a) - self.at(b, &anchor_b)).norm();
            self.train.connections.push(Connection {
                kind: c.kind.into(),
                a,
                b,
                anchor_a,
                anchor_b,
                k,
                c: cc,
                length_m,
            });
        }
        if let Some(mut drive) = unit.drive {
            let change = &self.file.drive;
            drive.body += first;
            drive.contact = turn * drive.contact;
            drive.torque_max_nm = change
                .torque_max_nm
                .map_or(drive.torque_max_nm, Positive::get);
            drive.power_w = change.power_kw.map_or(drive.power_w, |p| 1e3 * p.get());
            drive.adhesion = change.adhesion.map_or(drive.adhesion, NonNegative::get);
            drive.clamp_mpa = change.clamp_mpa.map_or(drive.clamp_mpa, NonNegative::get);
            check_wheel_limits(
                self.path,
                "drive",
                &drive,
                unit.wheel_rate_max_radps(),
                unit.wheel_torque_max_nm(),
            )?;
            self.train.drives.push(drive);
        }
        Ok(())
    }

    /// Position of a point of a body at the start on a straight level rail, from the train's front.
    pub fn at(&self, body: usize, point: &Vector3<f64>) -> Vector3<f64> {
        let b = &self.train.bodies[body];
        (b.start_pose * nalgebra::Point3::from(*point)).coords + Vector3::new(b.start_s, 0.0, 0.0)
    }

    /// Drawbars between neighbours.
    fn join(&mut self) -> Result<(), Error> {
        for (i, pair) in self.spans.windows(2).enumerate() {
            let ((a, anchor_a), (b, anchor_b)) = (pair[0].couplings[1], pair[1].couplings[0]);
            let bar = self.at(a, &anchor_a) - self.at(b, &anchor_b);
            if bar.x < 0.02 {
                let message = format!(
                    "its coupling is {:.3} m from the coupling of the unit ahead",
                    bar.x
                );
                return Err(input_error(
                    self.path,
                    format!("consist[{}]", i + 1),
                    message,
                    "check length_m of both units: a drawbar of at least 0.02 m must fit between them",
                ));
            }
            let Drawbar {
                stiffness_npm,
                damping_nspm,
            } = self.file.drawbar;
            self.train.connections.push(Connection {
                kind: ConnectionKind::Drawbar,
                a,
                b,
                anchor_a,
                anchor_b,
                k: stiffness_npm.get(),
                c: damping_nspm.get(),
                length_m: bar.norm(),
            });
        }
        Ok(())
    }

    fn finish(self) -> Result<Train, Error> {
        let Self {
            path,
            file,
            mut train,
            spans,
            ..
        } = self;
        let count = train.drives.len();
        if !(1..=MAX_DRIVES).contains(&count) {
            return Err(input_error(
                path,
                "consist",
                format!("{count} drive units"),
                format!("at least one, at most {MAX_DRIVES}"),
            ));
        }
        let fastest = spans
            .iter()
            .map(|s| s.unit.max_speed_mps)
            .fold(f64::INFINITY, f64::min);
        let speed = file.limits.max_speed_mps.get();
        if speed > fastest {
            return Err(input_error(
                path,
                "limits.max_speed_mps",
                format!("the drive units reach {fastest:.2} m/s"),
                "use a speed that motors and wheels can reach",
            ));
        }
        if file.limits.max_grade_deg.get() >= 90.0 {
            return Err(input_error(
                path,
                "limits.max_grade_deg",
                "this rail is too steep",
                "less than 90 degrees",
            ));
        }
        let wheels = train
            .bodies
            .iter()
            .flat_map(|b| b.stations.iter().map(move |s| b.start_s + s.x_m));
        let (rear, front) = wheels.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| {
            (lo.min(x), hi.max(x))
        });
        let r = file.resistance;
        train.name = file.name.clone();
        train.limits = Limits {
            min_radius_horizontal_m: file.limits.min_radius_horizontal_m.get(),
            min_radius_vertical_m: file.limits.min_radius_vertical_m.get(),
            max_grade_rad: file.limits.max_grade_deg.get().to_radians(),
            max_speed_mps: speed,
            length_m: front - rear,
            max_load_kg: file.limits.max_load_kg.get(),
        };
        train.resistance = Resistance {
            clamped_wheel: r.clamped_wheel.get(),
            running_wheel: r.running_wheel.get(),
            guide_wheel: r.guide_wheel.get(),
            bearing_n: r.bearing_n.get(),
            bearing_nspm: r.bearing_nspm.get(),
            air_nspm2: r.air_nspm2.get(),
        };
        let load = train.load_mass_kg();
        train.with_load_mass(load).map_err(|e| e.in_file(path))
    }
}

/// Front and rear couplings: its links `coupling_front` and `coupling_rear`, on bodies counted from `front` and `rear`.
pub(super) fn couplings(
    unit: &Unit,
    front: usize,
    rear: usize,
    turn: &Isometry3<f64>,
) -> Result<[(usize, Vector3<f64>); 2], Error> {
    let end = |link| {
        unit.link(link)
            .map(|p| (p.body, turn * p.pose.translation.vector))
    };
    let (a, b) = (end("coupling_front")?, end("coupling_rear")?);
    let (a, b) = if a.1.x >= b.1.x { (a, b) } else { (b, a) };
    Ok([(front + a.0, a.1), (rear + b.0, b.1)])
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests;
