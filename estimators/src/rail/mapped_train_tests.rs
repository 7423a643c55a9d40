//! Tests of [`super`]: the means, their doubt, and the delay of the signals.

use super::*;
use crate::testing::vehicles::vehicle;

#[test]
fn the_mean_of_a_train_weighs_tare_and_load_by_their_masses() {
    let mean = |u, doubt_mps2| Mean {
        value: [u, 0.3],
        doubt_mps2,
        unseen_m: 0.0,
    };
    let felt = LoadedGrade {
        tare: mean(1.0, 0.2),
        load: mean(2.0, 0.6),
    };
    let (u, doubt) = felt.whole(5_000.0, 20_000.0);
    assert!((u - 1.75).abs() < 1e-12 && (doubt - 0.5).abs() < 1e-12);
    assert_eq!(felt.whole(5_000.0, 4_000.0), (1.0, 0.2));
    assert_eq!(felt.curvature_per_m(), 0.3);
}

/// The signals are late by their filters; the way in between is made up for, but never more than 2 m of it.
#[test]
fn the_delay_of_the_signals_is_made_up_for() {
    for direction in [1.0, -1.0] {
        let mut train = MappedTrain::new(&vehicle());
        for _ in 0..100 {
            train.step(Some([0.0, 0.0]), 0.5 * direction, direction, 0.01);
        }
        assert!((train.late_m - 0.5 * direction).abs() < 1e-9);
        for _ in 0..1_000 {
            train.step(Some([0.0, 0.0]), 0.5 * direction, direction, 0.01);
        }
        assert!((train.late_m - 2.0 * direction).abs() < 1e-9);
    }
}
