//! Mass layout: where the masses of a train sit, by its drawings.

use crate::Real;
use crate::api::fingerprint::Fingerprint;

/// Largest number of masses of a layout.
pub const MAX_MASSES: usize = 24;

/// A rigid mass carried by the rail at two places: a unit on its own wheels, or a body on two trolleys.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CarriedMass {
    /// The two places, m behind the middle of the unit with the IMU (negative = ahead of it), the foremost first.
    pub places_m: [Real; 2],
    /// kg.
    pub mass_kg: Real,
    /// Depth of its centre of mass below the rail's line, m.
    pub depth_m: Real,
}

/// The load and the gear that swings with it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SuspendedLoad {
    /// The two places at which its weight acts on the rail, as in [`CarriedMass::places_m`].
    pub places_m: [Real; 2],
    /// Mass of spreader and hooks, which is tare and swings with the load, kg.
    pub swinging_tare_kg: Real,
    /// Depth of the upper ends of the chains below the rail's line, m.
    pub hook_depth_m: Real,
    /// Depth of the load's centre of mass below the lower ends of the chains, m.
    pub below_chains_m: Real,
    /// Length of the chains, m; 0 for a load that does not swing.
    pub chain_m: Real,
    /// Longitudinal stiffness between the chains' upper ends and the unit with the IMU (drawbars, hangers), N/m; `None`
    /// if rigid.
    pub longitudinal_stiffness_npm: Option<Real>,
}

/// Mass layout of a train, by its drawings: nominal geometry, no measured value.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MassLayout {
    /// The rigid masses without the swinging tare; unused places have no mass. They are scaled to the vehicle's tare.
    pub masses: [CarriedMass; MAX_MASSES],
    /// The load.
    pub load: SuspendedLoad,
    /// Depth of the IMU below the rail's line, m.
    pub imu_depth_m: Real,
    /// Share of the nominal running resistance that grows with the load (running wheels), 0…1.
    pub load_share_of_resistance: Real,
}

impl MassLayout {
    /// A rigid train: the tare spread evenly over `tare_span_m`, the load over `load_span_m`, both at the rail's line.
    pub fn even(tare_kg: Real, tare_span_m: [Real; 2], load_span_m: [Real; 2]) -> Self {
        let mut layout = Self {
            load: SuspendedLoad {
                places_m: load_span_m,
                ..SuspendedLoad::default()
            },
            load_share_of_resistance: 1.0,
            ..Self::default()
        };
        let [near, far] = tare_span_m;
        let count = if far > near { EVEN_MASSES } else { 1 };
        let part = (far - near) / count as Real;
        for (k, mass) in layout.masses.iter_mut().take(count).enumerate() {
            let start = near + k as Real * part;
            *mass = CarriedMass {
                places_m: [start + 0.25 * part, start + 0.75 * part],
                mass_kg: tare_kg / count as Real,
                depth_m: 0.0,
            };
        }
        layout
    }

    /// Mass of everything except the load, kg.
    pub fn tare_kg(&self) -> Real {
        self.masses.iter().map(|mass| mass.mass_kg).sum::<Real>() + self.load.swinging_tare_kg
    }

    /// The layout with all tare masses scaled to a sum of `tare_kg`.
    pub fn scaled_to(mut self, tare_kg: Real) -> Self {
        let sum = self.tare_kg();
        if sum > 0.0 {
            let scale = tare_kg / sum;
            self.masses
                .iter_mut()
                .for_each(|mass| mass.mass_kg *= scale);
            self.load.swinging_tare_kg *= scale;
        }
        self
    }

    /// All numbers of the layout in a fixed order; the last is 1 with a longitudinal stiffness, else 0.
    pub fn numbers(&self) -> impl Iterator<Item = Real> {
        let SuspendedLoad {
            places_m: [front, rear],
            swinging_tare_kg,
            hook_depth_m,
            below_chains_m,
            chain_m,
            longitudinal_stiffness_npm,
        } = self.load;
        let masses = self.masses;
        masses
            .into_iter()
            .flat_map(|mass| {
                let [front, rear] = mass.places_m;
                [front, rear, mass.mass_kg, mass.depth_m]
            })
            .chain([
                front,
                rear,
                swinging_tare_kg,
                hook_depth_m,
                below_chains_m,
                chain_m,
                longitudinal_stiffness_npm.unwrap_or(0.0),
                self.imu_depth_m,
                self.load_share_of_resistance,
                Real::from(u8::from(longitudinal_stiffness_npm.is_some())),
            ])
    }

    /// The layout with these numbers, in the order of [`MassLayout::numbers`]; `None` if there are too few.
    pub fn from_numbers(mut next: impl FnMut() -> Option<Real>) -> Option<Self> {
        let mut layout = Self::default();
        for mass in &mut layout.masses {
            *mass = CarriedMass {
                places_m: [next()?, next()?],
                mass_kg: next()?,
                depth_m: next()?,
            };
        }
        layout.load = SuspendedLoad {
            places_m: [next()?, next()?],
            swinging_tare_kg: next()?,
            hook_depth_m: next()?,
            below_chains_m: next()?,
            chain_m: next()?,
            longitudinal_stiffness_npm: next(),
        };
        layout.imu_depth_m = next()?;
        layout.load_share_of_resistance = next()?;
        if next()? == 0.0 {
            layout.load.longitudinal_stiffness_npm = None;
        }
        Some(layout)
    }

    /// Returns true if the numbers are physically possible.
    pub(crate) fn is_possible(&self) -> bool {
        let length = |m: Real| m.abs() < MAX_LENGTH_M;
        let places = |[front, rear]: [Real; 2]| front <= rear && length(front) && length(rear);
        let mass = |kg: Real| (0.0..MAX_KG).contains(&kg);
        let load = &self.load;
        let stiff = load.longitudinal_stiffness_npm;
        self.masses
            .iter()
            .all(|m| places(m.places_m) && mass(m.mass_kg) && length(m.depth_m))
            && places(load.places_m)
            && mass(load.swinging_tare_kg)
            && [load.hook_depth_m, load.below_chains_m, self.imu_depth_m]
                .into_iter()
                .all(length)
            && (0.0..MAX_LENGTH_M).contains(&load.chain_m)
            && stiff.is_none_or(|k| k > 0.0 && k.is_finite())
            && (0.0..=1.0).contains(&self.load_share_of_resistance)
            && self.tare_kg() > 0.0
    }

    pub(crate) fn fingerprint(&self, print: &mut Fingerprint) {
        for number in self.numbers() {
            print.numbers(&[number]);
        }
    }
}

/// Largest length, m, and mass, kg, of a train.
const MAX_LENGTH_M: Real = 1e3;
const MAX_KG: Real = 1e7;

/// Number of masses of a uniform distribution.
const EVEN_MASSES: usize = 12;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_even_spread_has_the_mass_and_the_middle_of_its_span() {
        let layout = MassLayout::even(9_000.0, [-2.0, 14.0], [5.0, 8.0]);
        let moment: Real = layout
            .masses
            .iter()
            .map(|m| m.mass_kg * 0.5 * (m.places_m[0] + m.places_m[1]))
            .sum();
        assert!((layout.tare_kg() - 9_000.0).abs() < 1e-3);
        assert!((moment / 9_000.0 - 6.0).abs() < 1e-5 && layout.is_possible());
        assert!((layout.scaled_to(8_000.0).tare_kg() - 8_000.0).abs() < 1e-3);
    }

    #[test]
    fn numbers_make_the_layout_again() {
        for stiffness in [None, Some(1.4e6)] {
            let mut layout = MassLayout::even(9_000.0, [-2.0, 14.0], [5.0, 8.0]);
            layout.load.longitudinal_stiffness_npm = stiffness;
            layout.load.chain_m = 0.6;
            let mut numbers = layout.numbers();
            assert_eq!(MassLayout::from_numbers(|| numbers.next()), Some(layout));
        }
        assert_eq!(MassLayout::from_numbers(|| None), None);
    }
}
