//! Values of the nominal vehicle, drawn about the truth once in each run.

use crate::config::scenario::{NominalVehicle, Scenario, ToldValue};
use crate::sensors::stream::Stream;
use monorig_estimators::api::tolerances::{TOLERANCES, Tolerances};

/// Draws the nominal vehicle for estimators and controller. Each value has a stream of its own: to fix one leaves the
/// others as they were.
pub struct Told<'a> {
    nominal: &'a NominalVehicle,
    tolerances: Tolerances,
    /// Name of the scenario: scenarios of the same seed draw different values.
    name: &'a str,
    seed: u64,
}

impl<'a> Told<'a> {
    /// Makes the drawn values of the run of a scenario with this seed.
    pub fn new(scenario: &'a Scenario, seed: u64) -> Self {
        Self {
            nominal: &scenario.file.vehicle,
            tolerances: tolerances(scenario),
            name: &scenario.name,
            seed,
        }
    }

    /// Returns the nominal value for this true value: the given value, or one drawn with this standard deviation of its
    /// logarithm.
    pub fn near(
        &self,
        name: &str,
        given: Option<impl Into<f64>>,
        truth: f64,
        sd: fn(&Tolerances) -> f64,
    ) -> f64 {
        given.map_or_else(
            || {
                let by = sd(&self.tolerances);
                truth * libm::exp(by * tolerated(&mut self.stream(name)))
            },
            Into::into,
        )
    }

    /// Returns the nominal efficiency; a value above 1 is drawn to the other side of the truth.
    pub fn efficiency(&self, truth: f64) -> f64 {
        let told = self.near("efficiency", self.nominal.efficiency, truth, |t| {
            t.efficiency
        });
        match told > 1.0 && self.nominal.efficiency.is_none() {
            true => truth * truth / told,
            false => told,
        }
    }

    /// The first guess of the total mass, kg: given, or anywhere between the empty and the loaded train; none if it is
    /// the middle.
    pub fn mass_guess_kg(&self, [empty, loaded]: [f64; 2]) -> Option<f64> {
        let given = self.nominal.total_mass_guess_kg.map(f64::from);
        given.or_else(|| {
            let drawn = !self.nominal.is_exact(ToldValue::TotalMassGuessKg);
            drawn.then(|| empty + (loaded - empty) * self.stream("mass_guess").uniform())
        })
    }

    /// Rotation of the IMU against its unit, a rotation vector in degrees.
    pub fn mount_deg(&self) -> [f64; 3] {
        let mut stream = self.stream("mount");
        std::array::from_fn(|_| self.tolerances.mount_deg * tolerated(&mut stream))
    }

    fn stream(&self, name: &str) -> Stream {
        Stream::new(self.seed, &format!("{}/told/{name}", self.name))
    }
}

/// Largest drawn difference, standard deviations: a larger difference is noticed when a train is put into service.
const MOST_SD: f64 = 3.0;

/// A normal value, limited to differences that a workshop would not notice.
fn tolerated(stream: &mut Stream) -> f64 {
    loop {
        let x = stream.normal();
        if x.abs() <= MOST_SD {
            return x;
        }
    }
}

/// Returns the standard deviations of the drawn values: 0 for given and exact values, and for a car.
pub fn tolerances(scenario: &Scenario) -> Tolerances {
    let nominal = &scenario.file.vehicle;
    let car = scenario.file.car.is_some() || scenario.is_recorded();
    let unless =
        |value: ToldValue, given: bool, sd: f64| match car || given || nominal.is_exact(value) {
            true => 0.0,
            false => sd,
        };
    let all = TOLERANCES;
    Tolerances {
        mount_deg: unless(ToldValue::Mount, false, all.mount_deg),
        tare: unless(ToldValue::TareKg, nominal.tare_kg.is_some(), all.tare),
        wheel_radius: unless(
            ToldValue::WheelRadiusM,
            nominal.wheel_radius_m.is_some(),
            all.wheel_radius,
        ),
        efficiency: unless(
            ToldValue::Efficiency,
            nominal.efficiency.is_some(),
            all.efficiency,
        ),
        running_resistance: unless(
            ToldValue::RunningResistance,
            nominal.running_resistance.is_some(),
            all.running_resistance,
        ),
        chain: unless(ToldValue::ChainM, nominal.chain_m.is_some(), all.chain),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::checked::Positive;

    fn scenario() -> Scenario {
        Scenario::in_code("", Some("train"), None)
    }

    /// Mean and standard deviation of the logarithm of what 4 000 seeds tell of a value of 2.
    fn spread(of: impl Fn(Told<'_>) -> f64) -> (f64, f64) {
        let (scenario, n) = (scenario(), 4_000);
        let logs: Vec<f64> = (0..n)
            .map(|seed| libm::log(of(Told::new(&scenario, seed)) / 2.0))
            .collect();
        let mean = logs.iter().sum::<f64>() / n as f64;
        let variance = logs.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n as f64;
        (mean, variance.sqrt())
    }

    #[test]
    fn what_is_told_has_its_tolerance_about_the_truth() {
        let none = None::<f64>;
        let (mean, sd) = spread(|told| told.near("tare", none, 2.0, |t| t.tare));
        assert!((sd / TOLERANCES.tare - 1.0).abs() < 0.06, "{sd}");
        assert!(mean.abs() < 5.0 * sd / 4_000f64.sqrt(), "{mean}");
        let (_, sd) = spread(|told| 2.0 + told.mount_deg()[1]);
        assert!(
            (sd / (0.5 * TOLERANCES.mount_deg) - 1.0).abs() < 0.06,
            "{sd}"
        );
    }

    /// An efficiency of 0.95 is told between what four standard deviations reach and 1, and its spread stays.
    #[test]
    fn no_efficiency_is_told_above_one() {
        let scenario = scenario();
        let all = (0..4_000).map(|seed| Told::new(&scenario, seed).efficiency(0.95));
        let all: Vec<f64> = all.collect();
        assert!(all.iter().all(|x| (0.7..=1.0).contains(x)));
        let squares = all.iter().map(|x| libm::log(x / 0.95).powi(2)).sum::<f64>();
        let sd = (squares / all.len() as f64).sqrt();
        assert!((sd / TOLERANCES.efficiency - 1.0).abs() < 0.06, "{sd}");
    }

    #[test]
    fn the_first_guess_is_anywhere_the_load_can_be() {
        let scenario = scenario();
        let of = |seed| {
            Told::new(&scenario, seed)
                .mass_guess_kg([10e3, 30e3])
                .unwrap()
        };
        let all: Vec<f64> = (0..4_000).map(of).collect();
        assert!(all.iter().all(|kg| (10e3..=30e3).contains(kg)));
        let below = all.iter().filter(|kg| **kg < 15e3).count() as f64 / 4_000.0;
        assert!(
            (below - 0.25).abs() < 5.0 * (0.25 * 0.75 / 4_000f64).sqrt(),
            "{below}"
        );
    }

    /// A value that is given or exact is not drawn, and the others are what they were.
    #[test]
    fn to_fix_one_value_leaves_the_others() {
        let plain = scenario();
        let mut fixed = scenario();
        fixed.file.vehicle.wheel_radius_m = Some(Positive::new(0.2));
        let why = "the test is about it".to_owned();
        fixed
            .file
            .vehicle
            .exact
            .insert(ToldValue::Efficiency, why.clone());
        let (a, b) = (Told::new(&plain, 3), Told::new(&fixed, 3));
        assert_eq!(b.efficiency(0.95), 0.95);
        assert_ne!(a.efficiency(0.95), 0.95);
        let radius = fixed.file.vehicle.wheel_radius_m;
        assert_eq!(
            b.near("wheel_radius", radius, 0.17, |t| t.wheel_radius),
            0.2
        );
        let chain = |told: &Told<'_>| told.near("chain", None::<f64>, 1.2, |t| t.chain);
        assert_eq!(chain(&a).to_bits(), chain(&b).to_bits());
        assert_eq!(a.mount_deg(), b.mount_deg());
        let mut all = scenario();
        all.file.vehicle.exact.insert(ToldValue::All, why);
        let told = Told::new(&all, 3);
        assert_eq!((told.mount_deg(), chain(&told)), ([0.0; 3], 1.2));
        assert_eq!(told.mass_guess_kg([1.0, 2.0]), None);
    }
}
