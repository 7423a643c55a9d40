//! Means of the grade over a train's masses, from the rail memory and the mass layout.
//!
//! A mass m at depth h below the rail's line, carried at two places with u₁ (front) and u₂ a distance w apart, has the
//! potential energy m g (z − h cos θ), so that along the rail it weighs m g S*, S* = ½(u₁ + u₂) + h tan θ (u₁ − u₂)/w:
//! on the edges of a ramp ±1.3 kN for a train of 19 t. Without depth it is S, by which the effective grade is defined.

use crate::Real;
use crate::api::mass_layout::{CarriedMass, MAX_MASSES, MassLayout, SuspendedLoad};
use crate::api::real::sqrt;
use crate::rail::rail_memory::{Place, RailMemory};
use crate::tuning::RAIL;

/// Means at one place of the train.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrainMeans {
    /// Σ m S* of the tare, kg.
    pub tare_deep_kg: Real,
    /// Σ m S of the tare, kg.
    pub tare_kg: Real,
    /// S* of the load.
    pub load_deep: Real,
    /// S of the load.
    pub load: Real,
    /// Cosine of the grade under the load.
    pub load_cos: Real,
    /// Curvature of the grade under the load, (u₁ − u₂)/w/cos θ, 1/m.
    pub load_curvature_per_m: Real,
    /// Σ m x of the tare on rail behind the read rail, with x the distance behind, kg·m.
    pub behind_tare_kgm: Real,
    /// The same x of the load, m.
    pub behind_load_m: Real,
    /// Σ m x ahead of the read rail, kg·m.
    pub ahead_kgm: Real,
    /// Largest x ahead of the read rail, m.
    pub ahead_m: Real,
    /// Standard deviation of the grade ahead of the read rail, rad/m.
    pub ahead_rad_per_m: Real,
    /// Mean horizontal curvature under the tare, 1/m.
    pub bend_per_m: Real,
}

/// Computes means from a memory for a layout.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainOnRail {
    masses: [CarriedMass; MAX_MASSES],
    count: usize,
    load: SuspendedLoad,
    rigid_kg: Real,
    deep: bool,
}

/// u₁, u₂ and the places of their reading.
struct Ends {
    mean: Real,
    gradient_per_m: Real,
    behind_m: Real,
    ahead_m: Real,
    ahead_max_m: Real,
}

impl TrainOnRail {
    /// Builds the train on its rail for a layout; `deep`: with the depths of the masses.
    pub fn new(layout: &MassLayout, deep: bool) -> Self {
        let mut train = Self {
            masses: Default::default(),
            count: 0,
            load: layout.load,
            rigid_kg: 0.0,
            deep,
        };
        let there = layout.masses.iter().filter(|mass| mass.mass_kg > 0.0);
        for (place, mass) in train.masses.iter_mut().zip(there) {
            *place = *mass;
            train.count += 1;
            train.rigid_kg += mass.mass_kg;
        }
        train
    }

    /// Span of the train, m behind the unit's middle.
    pub fn span_m(&self) -> [Real; 2] {
        let places = self.masses.iter().take(self.count).map(|m| m.places_m);
        places
            .chain([self.load.places_m])
            .fold([0.0, 0.0], |[near, far]: [Real; 2], [front, rear]| {
                [near.min(front), far.max(rear)]
            })
    }

    fn ends(&self, rail: &RailMemory, place: Place, at_m: [Real; 2], gradient: Real) -> Ends {
        let [front, rear] = at_m;
        let (a, b) = (
            rail.at(place, -front, gradient),
            rail.at(place, -rear, gradient),
        );
        Ends {
            mean: 0.5 * (a.u + b.u),
            gradient_per_m: (a.u - b.u) / (rear - front).max(0.05),
            behind_m: 0.5 * (a.behind_m + b.behind_m),
            ahead_m: 0.5 * (a.ahead_m + b.ahead_m),
            ahead_max_m: a.ahead_m.max(b.ahead_m),
        }
    }

    /// Means with the unit's middle at `place`.
    pub fn at(&self, rail: &RailMemory, place: Place) -> TrainMeans {
        let gradient = rail.end_gradient();
        let mut means = TrainMeans::default();
        let mut bend = 0.0;
        for mass in self.masses.iter().take(self.count) {
            let ends = self.ends(rail, place, mass.places_m, gradient);
            let depth = if self.deep { mass.depth_m } else { 0.0 };
            let tan = ends.mean / cosine(ends.mean);
            means.tare_kg += mass.mass_kg * ends.mean;
            means.tare_deep_kg += mass.mass_kg * (ends.mean + depth * tan * ends.gradient_per_m);
            means.behind_tare_kgm += mass.mass_kg * ends.behind_m;
            means.ahead_kgm += mass.mass_kg * ends.ahead_m;
            means.ahead_m = means.ahead_m.max(ends.ahead_max_m);
            let [front, rear] = mass.places_m;
            bend += mass.mass_kg * rail.curvature_per_m(place, -0.5 * (front + rear));
        }
        means.ahead_rad_per_m = RAIL.ahead_rad_per_m + RAIL.ahead_m * gradient.abs();
        means.bend_per_m = bend / self.rigid_kg.max(1.0);
        let ends = self.ends(rail, place, self.load.places_m, gradient);
        let cos = cosine(ends.mean);
        let depth = if self.deep {
            self.load.hook_depth_m + self.load.below_chains_m
        } else {
            0.0
        };
        means.load = ends.mean;
        means.load_cos = cos;
        means.load_curvature_per_m = ends.gradient_per_m / cos;
        means.load_deep = ends.mean + depth * ends.mean * means.load_curvature_per_m;
        means.behind_load_m = ends.behind_m;
        let gear = self.load.swinging_tare_kg;
        means.tare_kg += gear * means.load;
        means.tare_deep_kg += gear * means.load_deep;
        means.behind_tare_kgm += gear * ends.behind_m;
        means
    }
}

fn cosine(sine: Real) -> Real {
    sqrt((1.0 - sine * sine).max(0.1))
}
