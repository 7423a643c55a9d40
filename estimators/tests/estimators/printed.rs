//! The methods as printed: each slip alone, on a small crane, beside the form that is right; and what no slip may do,
//! leave something that is not finite.
//!
//! `right` in a test is the same code with the switch at 0, on the same data. So no test here passes with the right
//! form in place of the print.

use crate::common::{
    Random, vehicle,
    world::{DT, G, MASS_KG, MU, World, hills, level, ramp, start, steady, steep, steps, world},
};
use monorig_estimators::Time;
use monorig_estimators::api::estimator::Estimator;
use monorig_estimators::api::params::Setting;
use monorig_estimators::api::signals::{Command, MAX_DRIVES, Measurements, Sample};
use monorig_estimators::filters::adaptive_low_pass::AdaptiveSmoother;
use monorig_estimators::printed::huainan::Smoother;
use monorig_estimators::registry::{AnyEstimator, PRINTED_NAMES};
use monorig_estimators::{Real, registry};

const SEEDS: u64 = 5;
const J: Real = 1_045.0;

type Settings = [(&'static str, Setting<'static>)];

/// Results of a run.
struct Outcome {
    mass_kg: Real,
    /// Root mean square of the grade error in the second half, deg.
    grade_rms: Real,
    internals: Vec<(&'static str, Real)>,
    /// Largest value of each in the run.
    most: Vec<Real>,
}

impl Outcome {
    fn of(&self, name: &str) -> Real {
        let found = self.internals.iter().find(|(n, _)| *n == name);
        found.unwrap().1
    }

    fn most(&self, name: &str) -> Real {
        let place = self.internals.iter().position(|(n, _)| *n == name);
        self.most[place.unwrap()]
    }
}

/// A printed method with all slips mended but those in `settings`.
fn mended(name: &str, settings: &Settings) -> AnyEstimator {
    let switches = registry::keys(name).unwrap().map(|key| key.name);
    let off = switches
        .filter(|key| key.starts_with("eq"))
        .map(|key| (key, Setting::Choice("corrected")));
    let all = off.chain(settings.iter().copied());
    registry::build(name, &vehicle(2), all).unwrap()
}

fn drive(world: &World, estimator: &mut AnyEstimator) -> Outcome {
    let names: Vec<_> = estimator.internals().iter().map(|i| i.name).collect();
    let (mut values, mut most) = (vec![0.0; names.len()], vec![0.0; names.len()]);
    let rows = world.run_watched(estimator, |estimator| {
        estimator.internal_values(&mut values);
        assert!(values.iter().all(|v| v.is_finite()), "{values:?}");
        for (most, value) in most.iter_mut().zip(&values) {
            *most = value.max(*most);
        }
    });
    let late = &rows[rows.len() / 2..];
    let square = late
        .iter()
        .map(|(e, theta)| (e.grade_rad.value - theta).to_degrees().powi(2));
    Outcome {
        mass_kg: rows.last().unwrap().0.total_mass_kg.value,
        grade_rms: (square.sum::<Real>() / late.len() as Real).sqrt(),
        internals: names.iter().copied().zip(values).collect(),
        most,
    }
}

/// The same drive with a slip and without it, for each seed.
fn beside(
    name: &str,
    world: World,
    slip: &Settings,
    settings: &Settings,
) -> Vec<(Outcome, Outcome)> {
    let pair = |seed| {
        let world = World { seed, ..world };
        let all = [slip, settings].concat();
        let printed = drive(&world, &mut mended(name, &all));
        let right = drive(&world, &mut mended(name, settings));
        println!(
            "{name} {slip:?}: mass {:.0} kg, grade {:.3}°; right {:.0} kg, {:.3}°; {:?}",
            printed.mass_kg, printed.grade_rms, right.mass_kg, right.grade_rms, printed.internals
        );
        (printed, right)
    };
    (1..=SEEDS).map(pair).collect()
}

/// All slips at once.
fn whole(name: &str, world: World) -> Vec<Outcome> {
    let one = |seed| {
        let mut estimator = registry::build(name, &vehicle(2), []).unwrap();
        drive(&World { seed, ..world }, &mut estimator)
    };
    (1..=SEEDS).map(one).collect()
}

/// Forgetting that does not follow noise, so that a slip shows alone.
const CALM: [(&str, Setting); 2] = [
    ("delta", Setting::Number(0.9995)),
    ("lambda0", Setting::Number(0.9995)),
];
/// The true mass, held.
const HELD: [(&str, Setting); 4] = [
    ("mass0_kg", Setting::Number(MASS_KG)),
    ("p0", Setting::Number(1e-6)),
    ("delta", Setting::Number(1.0)),
    ("lambda0", Setting::Number(1.0)),
];

mod liu_2023 {
    use super::*;

    const NAME: &str = "dffrls_aekf_printed";
    const RESISTANCE: &str = "resistance_dffrls_printed";
    const KNOWN: (&str, Setting) = ("known_mass_kg", Setting::Number(MASS_KG));

    /// With g J in place of J the balance (M + J) v̇ = F reads M̂ v̇ = F − g J v̇: M̂ = M − (g − 1) J.
    #[test]
    fn eq_6_the_stray_g_takes_rotating_masses_off_the_mass() {
        for (printed, right) in beside(
            NAME,
            world(level, steps),
            &[("eq6", Setting::Choice("printed"))],
            &CALM,
        ) {
            let law = right.mass_kg - (G - 1.0) * J;
            assert!((printed.mass_kg - law).abs() < 0.05 * MASS_KG, "{law}");
            assert!((right.mass_kg / MASS_KG - 1.0).abs() < 0.05);
        }
    }

    /// F − J f = M f + μ M g − J g sin θ: at constant speed M̂ = M − J, and χ₂ is no slope but sin θ_μ.
    #[test]
    fn eq_16_an_accelerometer_for_v_dot_takes_j_off_and_hides_the_slope() {
        for (printed, right) in beside(
            NAME,
            world(ramp, steady),
            &[("eq16", Setting::Choice("printed"))],
            &CALM,
        ) {
            let law = right.mass_kg - J;
            assert!((printed.mass_kg - law).abs() < 0.02 * MASS_KG, "{law}");
            // 8° and θ_μ would be 0.159.
            assert!((printed.of("chi2") - MU).abs() < 0.01);
        }
    }

    /// v̇ of the wheels: on a ramp at constant speed F varies and v̇ does not.
    #[test]
    fn eq_16_wheels_for_v_dot_make_the_mass_infinite_on_a_ramp() {
        for (printed, right) in beside(
            NAME,
            world(ramp, steady),
            &[("eq16", Setting::Choice("other"))],
            &CALM,
        ) {
            assert!(printed.mass_kg > 10.0 * MASS_KG, "{}", printed.mass_kg);
            assert!((right.mass_kg / MASS_KG - 1.0).abs() < 0.02);
        }
    }

    /// A slip of the index: hardly anything follows from it.
    #[test]
    fn eq_21_the_forgetting_of_the_step_before_hardly_matters() {
        for (printed, right) in beside(
            NAME,
            world(hills, steps),
            &[("eq21", Setting::Choice("printed"))],
            &[],
        ) {
            assert!(printed.mass_kg != right.mass_kg);
            assert!((printed.mass_kg / right.mass_kg - 1.0).abs() < 0.01);
        }
    }

    /// θ̂ + μ = sin θ + μ cos θ.
    #[test]
    fn eq_23_small_angles_are_more_than_a_degree_short_at_28_degrees() {
        fn steep(_: Real) -> Real {
            28f64.to_radians()
        }
        for (printed, right) in beside(
            NAME,
            world(steep, steady),
            &[("eq23", Setting::Choice("printed"))],
            &HELD,
        ) {
            let theta = steep(0.0);
            let law = (theta - theta.sin() + MU * (1.0 - theta.cos())).to_degrees();
            assert!((printed.grade_rms - law).abs() < 0.15, "{law}");
            assert!(right.grade_rms < 0.3);
        }
    }

    /// Differences of covariances that noise makes negative, in most steps.
    #[test]
    fn eq_30_loses_its_covariances_and_its_slope() {
        for reading in ["printed", "other"].map(Setting::Choice) {
            for (printed, right) in beside(NAME, world(ramp, steady), &[("eq30", reading)], &HELD) {
                assert!(printed.of("indefinite_share") > 0.5);
                assert!(printed.grade_rms > 5.0);
                assert!(right.of("indefinite_share") == 0.0 && right.grade_rms < 0.3);
            }
        }
    }

    #[test]
    fn all_of_it_finds_neither_mass_nor_slope() {
        for outcome in whole(NAME, world(ramp, steady)) {
            let error = (outcome.mass_kg / MASS_KG - 1.0).abs();
            assert!(error > 0.3 && outcome.grade_rms > 5.0, "{error}");
        }
    }

    /// P ← (1 − K h) P/φ with K = P h (φ + P h²) turns negative where x (φ + x) > 1, x = P h².
    #[test]
    fn eq_14_a_gain_without_its_inverse_makes_a_negative_variance_of_any_but_a_small_one() {
        let at = |x: Real| [KNOWN, ("p0", (x / (G * G)).into())];
        for (printed, right) in beside(
            RESISTANCE,
            world(level, steady),
            &[("eq14", Setting::Choice("printed"))],
            &at(0.66),
        ) {
            assert!(printed.of("covariance") < 0.0 && right.of("covariance") > 0.0);
            assert!(printed.of("negative_steps") > 1000.0 && right.of("negative_steps") == 0.0);
        }
        // Below the root, by accident: S is near 1.
        for (printed, _) in beside(
            RESISTANCE,
            world(level, steady),
            &[("eq14", Setting::Choice("printed"))],
            &at(0.6),
        ) {
            assert_eq!(printed.of("negative_steps"), 0.0);
        }
        // P₀ = 1: out of all bounds at the second step, again and again.
        let wide = [KNOWN, ("p0", 1.0.into())];
        for (printed, right) in beside(
            RESISTANCE,
            world(level, steady),
            &[("eq14", Setting::Choice("printed"))],
            &wide,
        ) {
            assert!(printed.of("breakdowns") > 1000.0 && right.of("breakdowns") == 0.0);
            assert!((right.of("running_resistance") - MU).abs() < 0.003);
            assert!((printed.of("running_resistance") - MU).abs() > 0.5 * MU);
        }
    }

    /// While it starts: μ̂ = μ − (g − 1) J v̇/(M g).
    #[test]
    fn eq_9_the_stray_g_makes_resistance_of_acceleration() {
        let starting = World {
            seconds: 4.0,
            ..world(level, start)
        };
        let law = -(G - 1.0) * J * 0.25 / (MASS_KG * G);
        for (printed, right) in beside(
            RESISTANCE,
            starting,
            &[("eq9", Setting::Choice("printed"))],
            &[KNOWN],
        ) {
            let moved = printed.of("running_resistance") - right.of("running_resistance");
            assert!((moved / law - 1.0).abs() < 0.35, "{moved} {law}");
            assert!((right.of("running_resistance") - MU).abs() < 0.003);
        }
    }
}

mod huainan {
    use super::*;

    const NAME: &str = "dffrls_aukf_printed";

    /// ρ̂ = ρ cos θ.
    #[test]
    fn eq_6_without_its_cosine_the_curvature_is_short_by_it() {
        fn arc(s: Real) -> Real {
            0.35 + 0.01 * s
        }
        let climbing = World {
            seconds: 19.0,
            ..world(arc, steady)
        };
        // with a memory long enough that noise does not count
        let settings = [
            ("grade0_sd_deg", 30.0.into()),
            ("delta", 0.85.into()),
            ("sigma", 1.0.into()),
        ];
        for (printed, right) in beside(
            NAME,
            climbing,
            &[("eq6", Setting::Choice("printed"))],
            &settings,
        ) {
            let ratio = printed.of("curvature_per_m") / right.of("curvature_per_m");
            // The regression averages over the last few metres.
            assert!(
                ratio > arc(19.0).cos() && ratio < arc(14.0).cos(),
                "{ratio}"
            );
            assert!((right.of("curvature_per_m") / 0.01 - 1.0).abs() < 0.03);
        }
    }

    /// (1 − Γₐ/Γ) m₀ is 0 just where motion sets in, and a difference with its sign does not react to a fall.
    #[test]
    fn eq_9_freezes_at_the_onset_of_motion() {
        let smoother = Smoother::new(false, 0.15, 0.1, 0.02);
        assert_eq!(smoother.gain(0.0), 0.15);
        assert!(smoother.gain(0.0201) < 0.001);
        assert!((1..1000).all(|k| smoother.gain(0.02 + 0.001 * Real::from(k)) < 0.15));
        assert_eq!(smoother.gain(-5.0), 0.15);
        for (printed, right) in beside(
            NAME,
            world(ramp, steady),
            &[("eq9", Setting::Choice("printed"))],
            &[],
        ) {
            assert!(printed.grade_rms > 1.2 * right.grade_rms);
        }
    }

    /// The last branch adds to a gain that nothing takes back while motion lasts. Beyond 1 the output runs ahead of its
    /// input, which no smoothing does; then Γ changes its sign and the gain falls back to m₀.
    #[test]
    fn eq_10_adds_to_its_gain_until_it_overshoots() {
        let mut smoother = Smoother::new(true, 0.15, 0.1, 0.02);
        let ahead = (0..60).filter(|k| {
            let input = 0.4 * Real::from(*k);
            smoother.step(input) > input
        });
        assert!(ahead.count() > 5);
        let mut right = AdaptiveSmoother::<1>::new([3.0, 9.0, 30.0], 0.02, [3.0, 6.0]);
        let ahead = (0..60).filter(|k| {
            let input = 0.4 * Real::from(*k);
            right.step([input], DT)[0] > input
        });
        assert_eq!(ahead.count(), 0);
    }

    /// Units: a where a′ belongs makes degrees by the hundred of it; with a′ the open sum of θ′ is still worse than the
    /// filter of [v, θ].
    #[test]
    fn eq_14_an_input_of_the_wrong_unit_and_an_open_sum() {
        for (printed, right) in beside(
            NAME,
            world(ramp, steady),
            &[("eq14", Setting::Choice("printed"))],
            &[],
        ) {
            assert!(printed.grade_rms > 20.0 && right.grade_rms < 0.2);
        }
        for (printed, right) in beside(
            NAME,
            world(ramp, steady),
            &[("eq14", Setting::Choice("other"))],
            &[],
        ) {
            assert!(printed.grade_rms > 2.0 * right.grade_rms);
        }
    }

    /// W_c0 = W_m0 + 1 − α² − β: alone it hardly shows, as the model is all but linear.
    #[test]
    fn eq_19_the_sign_hardly_shows_alone() {
        for (printed, right) in beside(
            NAME,
            world(ramp, steady),
            &[("eq19", Setting::Choice("printed"))],
            &[],
        ) {
            assert!(printed.grade_rms != right.grade_rms);
            assert!((printed.grade_rms / right.grade_rms - 1.0).abs() < 0.05);
        }
    }

    /// The weights of covariances add up to 1 + (1 − α² + β) = 3.06, with the sign of eq. 19 to −0.94: a mean with them
    /// is no mean.
    #[test]
    fn eq_26_a_mean_whose_weights_do_not_add_up_to_one() {
        for (printed, right) in beside(
            NAME,
            world(ramp, steady),
            &[("eq26", Setting::Choice("printed"))],
            &[],
        ) {
            assert!(printed.grade_rms > 5.0 * right.grade_rms);
        }
        let both = [
            ("eq19", Setting::Choice("printed")),
            ("eq26", Setting::Choice("printed")),
        ];
        for (printed, right) in beside(NAME, world(ramp, steady), &both, &[]) {
            assert!(printed.grade_rms > 10.0 && printed.of("breakdowns") > 10.0);
            assert!(right.of("breakdowns") == 0.0);
        }
    }

    #[test]
    fn eq_34_loses_its_covariances_again_and_again() {
        for (printed, right) in beside(
            NAME,
            world(ramp, steady),
            &[("eq34", Setting::Choice("printed"))],
            &[],
        ) {
            assert!(printed.of("breakdowns") > 100.0 && printed.grade_rms > 3.0);
            assert!(right.of("breakdowns") == 0.0 && right.grade_rms < 0.2);
        }
    }

    #[test]
    fn all_of_it_finds_no_slope() {
        let all = whole(NAME, world(ramp, steady));
        assert!(all.iter().all(|outcome| outcome.grade_rms > 10.0));
    }
}

mod guo_2024 {
    use super::*;

    const NAME: &str = "imm_stf_printed";
    /// The true mass; no change of force is considerable.
    const FROZEN: [(&str, Setting); 2] = [
        ("mass0_kg", Setting::Number(MASS_KG)),
        ("force_gate_n", Setting::Number(1e6)),
    ];
    const LIGHT: [(&str, Setting); 1] = [("mass0_kg", Setting::Number(12_000.0))];

    /// In a steady bend the accelerometer reads little along and much across: η takes away the force that holds the
    /// train on its slope.
    #[test]
    fn eq_1_the_lateral_factor_takes_away_traction_that_is_there() {
        let bend = World {
            across_mps2: 1.5,
            ..world(steep, steady)
        };
        for (printed, right) in beside(NAME, bend, &[("eq1", Setting::Choice("printed"))], &FROZEN)
        {
            let off = |o: &Outcome| (o.of("dynamic_i") - steep(0.0).sin()).abs();
            assert!(off(&printed) > 0.05 && off(&right) < 0.02);
        }
    }

    /// M + J for M.
    #[test]
    fn eq_3_without_rotating_masses_the_mass_has_them_in_it() {
        for (printed, right) in beside(
            NAME,
            world(level, steps),
            &[("eq3", Setting::Choice("printed"))],
            &LIGHT,
        ) {
            let law = right.mass_kg + J;
            assert!((printed.mass_kg - law).abs() < 0.01 * MASS_KG, "{law}");
            assert!((right.mass_kg / MASS_KG - 1.0).abs() < 0.05);
        }
    }

    /// The difference of one sample is all noise, and noise in the regressor draws the parameter to 0.
    #[test]
    fn eq_4_differences_of_one_sample_find_no_mass() {
        for (printed, right) in beside(
            NAME,
            world(level, steps),
            &[("eq4", Setting::Choice("printed"))],
            &LIGHT,
        ) {
            assert!(printed.mass_kg.abs() < 0.15 * MASS_KG);
            assert!((right.mass_kg / MASS_KG - 1.0).abs() < 0.05);
        }
    }

    #[test]
    fn eq_10_the_derivative_of_a_measurement_beside_it_adds_its_noise() {
        for (printed, right) in beside(
            NAME,
            world(ramp, steady),
            &[("eq10", Setting::Choice("printed"))],
            &FROZEN,
        ) {
            assert!(printed.grade_rms > right.grade_rms);
        }
    }

    /// a is drawn to a_sen, so that nothing is left for g i.
    #[test]
    fn eq_11_the_full_difference_leaves_no_slope() {
        for (printed, right) in beside(
            NAME,
            world(ramp, steady),
            &[("eq11", Setting::Choice("printed"))],
            &FROZEN,
        ) {
            assert!(printed.grade_rms > 5.0 && right.grade_rms < 0.5);
        }
    }

    /// i = −a/g + u: nothing of i is carried on, so that it follows every sample of the force.
    #[test]
    fn eq_16_a_slope_without_memory_follows_the_noise_of_the_force() {
        let roughness = |settings: &Settings| {
            let mut estimator = mended(NAME, settings);
            let (mut last, mut sum) = (None, 0.0);
            let mut values = [0.0; 6];
            world(steep, steady).run_watched(&mut estimator, |estimator| {
                estimator.internal_values(&mut values);
                sum += last.map_or(0.0, |last: Real| (values[2] - last).powi(2));
                last = Some(values[2]);
            });
            sum.sqrt()
        };
        let (printed, right) = (
            roughness(&[&[("eq16", Setting::Choice("printed"))], &FROZEN[..]].concat()),
            roughness(&FROZEN),
        );
        println!("{printed} {right}");
        assert!(printed > 1.5 * right, "{printed} {right}");
    }

    /// Each model goes its own way; in the combined slope it hardly shows.
    #[test]
    fn eq_23_models_that_never_mix_drift_apart() {
        let apart = |settings: &Settings| {
            let mut sum = 0.0;
            for seed in 1..=SEEDS {
                let mut values = [0.0; 6];
                let world = World {
                    seed,
                    ..world(ramp, steady)
                };
                world.run_watched(&mut mended(NAME, settings), |estimator| {
                    estimator.internal_values(&mut values);
                    sum += (values[1] - values[2]).powi(2);
                });
            }
            sum.sqrt()
        };
        let printed = apart(&[&[("eq23", Setting::Choice("printed"))], &FROZEN[..]].concat());
        let right = apart(&FROZEN);
        println!("{printed} {right}");
        assert!(printed > 1.5 * right, "{printed} {right}");
    }

    #[test]
    fn eq_28_fading_by_raw_traces_is_on_for_noise_and_knows_no_end() {
        for (printed, right) in beside(
            NAME,
            world(ramp, steady),
            &[("eq28", Setting::Choice("printed"))],
            &FROZEN,
        ) {
            let most = printed.most("dynamic_fading");
            assert!(
                most > 50.0 && right.most("dynamic_fading") <= 50.0,
                "{most}"
            );
            assert!(printed.grade_rms > right.grade_rms);
        }
    }

    #[test]
    fn all_of_it_finds_neither_mass_nor_slope() {
        for outcome in whole(NAME, world(ramp, steady)) {
            assert!(outcome.mass_kg.abs() < 0.1 * MASS_KG && outcome.grade_rms > 5.0);
            assert!(outcome.of("breakdowns") > 1000.0);
        }
    }
}

mod patent {
    use super::*;

    const NAME: &str = "mmrls_sh_stf_printed";

    /// Any mass has a slope to go with it: where it ends is where it started.
    #[test]
    fn eq_20_mass_and_slope_from_one_balance_keep_their_start() {
        let from = |kg: Real| {
            beside(
                NAME,
                world(ramp, steady),
                &[("eq20", Setting::Choice("printed"))],
                &[("mass0_kg", kg.into())],
            )
        };
        for ((light, right_light), (heavy, right_heavy)) in
            from(10_000.0).iter().zip(from(22_000.0).iter())
        {
            assert!(heavy.mass_kg > 1.3 * light.mass_kg);
            assert!((right_heavy.mass_kg / right_light.mass_kg - 1.0).abs() < 0.01);
        }
    }

    /// At constant speed on a slope F/v̇ is no mass, and it is weighed all the same.
    #[test]
    fn eq_22_a_turning_model_without_slope_spoils_the_mass_on_a_straight() {
        for (printed, right) in beside(
            NAME,
            world(ramp, steady),
            &[("eq22", Setting::Choice("printed"))],
            &[],
        ) {
            assert!(printed.of("turning_mass_kg") > 3.0 * MASS_KG);
            assert!(printed.mass_kg > 1.5 * MASS_KG);
            assert!((right.mass_kg / MASS_KG - 1.0).abs() < 0.01);
        }
    }

    /// The sigmoid of a residual in N is 0 or 1; a wrong model with a large negative residual gets the whole weight.
    #[test]
    fn eq_26_a_signed_residual_makes_the_wrong_model_the_likely_one() {
        fn down(s: Real) -> Real {
            -ramp(s)
        }
        let slips = [
            ("eq22", Setting::Choice("printed")),
            ("eq26", Setting::Choice("printed")),
        ];
        for seed in 1..=SEEDS {
            let world = World {
                seed,
                ..world(down, steady)
            };
            let share = |settings: &Settings| {
                let mut estimator = mended(NAME, settings);
                let (mut wrong, mut steps) = (0, 0);
                let mut values = [0.0; 6];
                world.run_watched(&mut estimator, |estimator| {
                    estimator.internal_values(&mut values);
                    wrong += u32::from(values[2] < 0.4);
                    steps += 1;
                });
                Real::from(wrong) / Real::from(steps)
            };
            let (printed, right) = (share(&slips), share(&slips[..1]));
            println!(
                "wrong model leads in {printed:.3}, by the size of the residual in {right:.3}"
            );
            assert!(printed > right + 0.1, "{printed} {right}");
        }
    }

    /// (1 − K h) P (1 − K h) falls as P does; the variance of a residual does not fall below that of its noise.
    #[test]
    fn eq_28_the_variance_of_the_residual_falls_to_nothing() {
        for (printed, right) in beside(
            NAME,
            world(ramp, steady),
            &[("eq28", Setting::Choice("printed"))],
            &[],
        ) {
            assert!(printed.of("residual_variance") < 0.01);
            assert!(right.of("residual_variance") >= 1.0);
        }
    }

    #[test]
    fn eq_46_loses_its_covariances_and_its_slope() {
        for (printed, right) in beside(
            NAME,
            world(ramp, steady),
            &[("eq46", Setting::Choice("printed"))],
            &[],
        ) {
            assert!(printed.of("indefinite_share") > 0.5 && printed.grade_rms > 5.0);
            assert!(right.of("indefinite_share") == 0.0 && right.grade_rms < 0.5);
        }
    }

    #[test]
    fn all_of_it_finds_neither_mass_nor_slope() {
        for outcome in whole(NAME, world(ramp, steady)) {
            let error = (outcome.mass_kg / MASS_KG - 1.0).abs();
            assert!(error > 0.3 && outcome.grade_rms > 5.0, "{error}");
        }
    }
}

/// A number from a sensor: mostly within reason, sometimes not a number at all.
fn any(random: &mut Random) -> Real {
    match random.below(40) {
        0 => Real::NAN,
        1 => Real::INFINITY,
        2 => 1e300,
        3 => 0.0,
        4..=8 => 50.0 * random.normal(),
        _ => 0.8 + 0.3 * random.normal(),
    }
}

/// A print may break down, and counts it; nothing that is not finite gets out, and a refused step changes nothing.
#[test]
fn nonsense_in_never_makes_infinities_out() {
    for name in PRINTED_NAMES {
        let mut estimator = registry::build(name, &vehicle(2), []).unwrap();
        let mut random = Random::new(31);
        let (mut taken, mut refused) = (0, 0);
        for k in 1..=200_000 {
            let t_s = Real::from(k) * DT;
            let mut sample = |size: Real| {
                (!random.chance(0.1)).then(|| Sample {
                    t: Time::from_s(t_s),
                    value: size * any(&mut random),
                })
            };
            let mut z = Measurements {
                t: Time::from_s(t_s),
                ..Measurements::default()
            };
            for i in 0..2.min(MAX_DRIVES) {
                z.motor_torque_nm[i] = sample(100.0);
                z.wheel_speed_mps[i] = sample(1.0);
            }
            let along = sample(1.0);
            z.specific_force_mps2 = along.map(|s| Sample {
                t: Time::from_s(t_s),
                value: [s.value, 0.5 * s.value, -G],
            });
            z.angular_rate_radps = sample(0.1).map(|s| Sample {
                t: Time::from_s(t_s),
                value: [0.0, 0.0, s.value],
            });
            let before = estimator;
            match estimator.step(&z, &Command::default(), DT) {
                Ok(estimate) => {
                    taken += 1;
                    assert!(estimate.is_finite(), "{name}: {estimate:?}");
                    let sds = [estimate.total_mass_kg, estimate.grade_rad].map(|v| v.sd);
                    assert!(sds.iter().all(|sd| *sd >= 0.0), "{name}: {estimate:?}");
                }
                Err(_) => {
                    refused += 1;
                    assert_eq!(estimator, before, "{name}");
                }
            }
            let mut internals = [0.0; 16];
            estimator.internal_values(&mut internals);
            assert!(
                internals.iter().all(|v| v.is_finite()),
                "{name}: {internals:?}"
            );
        }
        println!("{name}: {taken} taken, {refused} refused");
        assert!(
            taken > 20_000 && refused > 20_000,
            "{name}: {taken} {refused}"
        );
    }
}

#[test]
fn every_switch_is_on_by_default_and_all_keys_are_unique() {
    for name in PRINTED_NAMES {
        let keys: Vec<_> = registry::keys(name).unwrap().collect();
        for key in &keys {
            let switch = key.name.starts_with("eq");
            let printed = key.default() == Some(Setting::Choice("printed"));
            assert!(!switch || printed, "{name}.{}", key.name);
            let same = keys.iter().filter(|other| other.name == key.name);
            assert_eq!(same.count(), 1, "{name}.{}", key.name);
            let default = key.default().map(|default| (key.name, default));
            registry::build(name, &vehicle(2), default).unwrap();
        }
        assert!(keys.iter().any(|key| key.name.starts_with("eq")));
        let mut estimator = registry::build(name, &vehicle(2), []).unwrap();
        drive(&world(ramp, steady), &mut estimator);
        estimator.reset();
        assert_eq!(estimator, registry::build(name, &vehicle(2), []).unwrap());
    }
}
