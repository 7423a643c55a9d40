//! Suspended units: cabs and beams below their trolleys, the load on its chains.

use super::consist::{ConsistBuilder, PlacedUnit, couplings};
use super::train_file::LoadEntry;
use super::unit::Unit;
use super::unit_file::LoadFile;
use crate::config::file::{input_error, named};
use crate::error::Error;
use crate::train::{Connection, ConnectionKind, Payload};
use nalgebra::{Isometry3, Vector3};

impl ConsistBuilder<'_> {
    /// A suspended unit, then its trolleys from front to rear.
    pub fn add_suspended_unit(
        &mut self,
        unit: &Unit,
        trolley: &Unit,
        name: &str,
        middle: f64,
        turn: &Isometry3<f64>,
    ) -> Result<[(usize, Vector3<f64>); 2], Error> {
        let Some(carried) = &unit.file.carried_by else {
            return Ok([(0, Vector3::zeros()); 2]);
        };
        let top = trolley.link("hanger")?.pose.translation.vector;
        let mut hangers = Vec::new();
        for link in &carried.links {
            hangers.push(turn * unit.link(link)?.pose.translation.vector);
        }
        hangers.sort_by(|a, b| b.x.total_cmp(&a.x));
        if hangers
            .iter()
            .any(|h| (h.z - hangers[0].z).abs() > 1e-6 || h.y.abs() > 1e-6)
        {
            return Err(input_error(
                &unit.path,
                "carried_by.links",
                "the hangers differ in height or are not in the middle",
                "same z, y = 0",
            ));
        }
        let suspended = self.train.bodies.len();
        self.add_bodies(unit, name, middle, top.z - hangers[0].z, turn)?;
        let (mut front, mut rear) = (suspended, suspended);
        for (i, anchor) in hangers.iter().enumerate() {
            rear = self.train.bodies.len();
            front = if i == 0 { rear } else { front };
            let name = format!("{name}/trolley_{}", i + 1);
            self.add_bodies(
                trolley,
                &name,
                middle + anchor.x - top.x,
                0.0,
                &Isometry3::identity(),
            )?;
            self.train.connections.push(Connection {
                kind: ConnectionKind::Hanger,
                a: rear,
                b: suspended,
                anchor_a: top,
                anchor_b: *anchor,
                k: carried.stiffness_npm.get(),
                c: carried.damping_nspm.get(),
                length_m: 0.0,
            });
        }
        couplings(trolley, front, rear, &Isometry3::identity())
    }

    /// The load on its chains.
    pub fn suspend_load(&mut self, entry: &LoadEntry) -> Result<(), Error> {
        let unit = self.unit(named(self.path, "load.unit", &entry.unit)?)?;
        let Some(LoadFile {
            payload_link,
            chain_links,
            drop_m,
            stiffness_npm,
            damping_nspm,
            offset_m,
        }) = unit.file.load.clone()
        else {
            return Err(input_error(
                self.path,
                "load.unit",
                "this unit's file has no `load`",
                "payload_link, chain_links, drop_m, stiffness and damping",
            ));
        };
        let Some((nominal, gear)) = unit.payload(&payload_link) else {
            let help = "use a link with mass, and have other links with mass: these are the lifting gear, which stays without the payload";
            return Err(input_error(
                &unit.path,
                "load.payload_link",
                format!("`{payload_link}` cannot be the payload"),
                help,
            ));
        };
        let Some(above) = self.file.consist.iter().position(|e| e.name == entry.under) else {
            return Err(input_error(
                self.path,
                "load.under",
                format!("this train has no unit `{}`", entry.under),
                "the name of a unit of the consist",
            ));
        };
        let PlacedUnit {
            unit: carrier,
            turn,
            first,
            ..
        } = &self.spans[above];
        let (turn, first) = (*turn, *first);
        let mut chains = Vec::new();
        for (i, link) in chain_links.iter().enumerate() {
            let key = format!("load.chain_links[{i}]");
            let Some(down) = unit.urdf.place(link) else {
                return Err(unit.unknown_link(key, link));
            };
            let Some(up) = carrier.urdf.place(link) else {
                return Err(input_error(
                    &unit.path,
                    key,
                    format!(
                        "`{}`, which carries the load, has no link `{link}`",
                        entry.under
                    ),
                    "a chain ends at links of one name in both URDF files",
                ));
            };
            chains.push((
                first + up.body,
                turn * up.pose.translation.vector,
                down.pose.translation.vector,
            ));
        }
        let Some((body, up, down)) = chains.first().copied() else {
            return Err(input_error(
                &unit.path,
                "load.chain_links",
                "no chain holds the load",
                "at least one link",
            ));
        };
        let load = self.train.bodies.len();
        let height = self.at(body, &up).z - drop_m.get() - down.z;
        let middle = self.train.bodies[body].start_s + offset_m.get();
        self.add_bodies(&unit, &entry.name, middle, height, &Isometry3::identity())?;
        for (b, anchor_b, anchor_a) in chains {
            self.train.connections.push(Connection {
                kind: ConnectionKind::Chain,
                a: b,
                b: load,
                anchor_a: anchor_b,
                anchor_b: anchor_a,
                k: stiffness_npm.get(),
                c: damping_nspm.get(),
                length_m: (self.at(b, &anchor_b) - self.at(load, &anchor_a)).norm(),
            });
        }
        self.train.load = Some(load);
        self.train.payload = Some(Payload {
            mass_kg: nominal.mass_kg,
            nominal,
            gear,
        });
        Ok(())
    }
}
