//! Tests of [`super`].

use super::*;
use crate::testing::Random;
use crate::testing::vehicles::vehicle;
use core::cmp::Ordering;

/// u along a rail with a sine of wavelength 20 m and a step in its mean.
fn u(s: Real) -> Real {
    1.3 * (0.314 * s).sin() + 0.05 * s
}

fn run(rail: &mut GradeMap, from: Real, to: Real) {
    let step = if to > from { 0.005 } else { -0.005 };
    for k in 0..=((to - from) / step) as usize {
        let s = from + k as Real * step;
        rail.visit(s, [u(s), 0.1 * s]);
    }
}

#[test]
fn the_mean_over_a_train_is_the_integral_over_the_rail() {
    let mut rail = GradeMap::new(18.0);
    run(&mut rail, 3.0, 45.0);
    let integral = |s: Real| -1.3 / 0.314 * (0.314 * s).cos() + 0.025 * s * s;
    for [rear, front] in [[27.3, 45.0], [30.0, 34.7], [36.02, 36.07]] {
        let mean = rail.mean(rear, front).unwrap();
        let exact = (integral(front) - integral(rear)) / (front - rear);
        assert!(
            (mean.value[0] - exact).abs() < 0.05,
            "{} {exact}",
            mean.value[0]
        );
        assert!((mean.value[1] - 0.05 * (rear + front)).abs() < 0.02);
        assert!(mean.doubt_mps2.abs() < 1e-12);
    }
}

#[test]
fn sums_by_block_are_sums_by_cell() {
    let mut rail = GradeMap::new(18.0);
    let mut random = Random::new(62);
    let mut place = 0.0;
    for _ in 0..3000 {
        place += 0.3 * random.normal();
        rail.visit(place, [random.normal(), random.normal()]);
        let known = rail.known.unwrap();
        let rear = place + 12.0 * random.normal();
        let front = rear + 30.0 * random.normal().abs().min(1.0);
        let (mut value, mut doubt) = ([0.0; 2], 0.0);
        for cell in rail.cell(rear)..=rail.cell(front) {
            let [start, end] = [cell, cell + 1].map(|cell| cell as Real * rail.cell_m);
            let share = (end.min(front) - start.max(rear)) / (front - rear);
            let near = cell.clamp(known[0], known[1]);
            let away = (cell - near).abs() as Real * rail.cell_m;
            let onward = match cell.cmp(&near) {
                Ordering::Less => rail.gradient(known, near, 1),
                Ordering::Equal => 0.0,
                Ordering::Greater => rail.gradient(known, near, -1),
            };
            let [u, curvature] = rail.cells[GradeMap::slot(near)];
            value[0] += share * (u + onward * away.min(ONWARD_M));
            value[1] += share * curvature;
            doubt += share * away * (UNSEEN_MPS2_PER_M + onward.abs());
        }
        let mean = rail.mean(rear, front).unwrap();
        assert!((mean.value[0] - value[0]).abs() < 1e-9 * (1.0 + value[0].abs()));
        assert!((mean.value[1] - value[1]).abs() < 1e-9);
        assert!((mean.doubt_mps2 - doubt).abs() < 1e-9 * (1.0 + doubt));
    }
}

#[test]
fn a_place_revisited_backwards_is_still_known_and_a_jump_forgets() {
    let mut rail = GradeMap::new(18.0);
    run(&mut rail, 0.0, 15.0);
    run(&mut rail, 15.0, 4.0);
    let mean = rail.mean(14.0, 14.2).unwrap();
    assert!((mean.value[0] - u(14.1)).abs() < 0.06);
    assert!(mean.doubt_mps2 == 0.0);
    rail.visit(1e5, [7.0, 0.0]);
    assert!((rail.mean(14.0, 14.2).unwrap().value[0] - 7.0).abs() < 1e-12);
}

#[test]
fn unseen_rail_continues_the_seen_and_is_doubted_the_more_the_farther_and_the_steeper() {
    let mut level = GradeMap::new(18.0);
    let mut bend = level;
    for k in 0..1000 {
        let s = k as Real * 0.005;
        level.visit(s, [0.4, 0.0]);
        bend.visit(s, [0.4 * s, 0.0]);
    }
    let [near, far] = [level.mean(-2.0, 0.0), level.mean(-8.0, 0.0)].map(Option::unwrap);
    assert!((near.value[0] - 0.4).abs() < 1e-12);
    assert!(near.doubt_mps2 > 0.0 && far.doubt_mps2 > 3.0 * near.doubt_mps2);
    assert!(bend.mean(-2.0, 0.0).unwrap().doubt_mps2 > 10.0 * near.doubt_mps2);
}

#[test]
fn a_point_feels_what_its_instrument_reads() {
    let mut train = MappedTrain::new(&vehicle());
    assert_eq!(train.felt(0.0), None);
    for k in 0..1000 {
        let now = u(0.004 * k as Real);
        train.step(Some([now, 0.0]), 0.8, 0.8, 0.005);
        let felt = train.felt(train.place_m()).unwrap();
        assert_eq!(felt.whole(5e3, 1e4), (now, 0.0));
        let (felt, here) = train.felt_now().unwrap();
        assert_eq!(felt.whole(5e3, 1e4).0, here);
        assert!(train.seen(train.place_m()));
    }
}

#[test]
fn garbage_places_are_survived() {
    let mut rail = GradeMap::new(1e6);
    for place in [0.0, 1e300, -1e300, Real::NAN, 1e12, 3.0] {
        rail.visit(place, [1.0, 0.0]);
        assert!(
            rail.mean(place - 18.0, place)
                .is_none_or(|m| m.value[0].is_finite())
        );
    }
}

#[test]
fn rail_passed_over_between_two_visits_is_a_straight_line() {
    for direction in [1.0, -1.0] {
        let mut rail = GradeMap::new(20.0);
        rail.visit(direction * 0.1, [1.0, 0.5]);
        rail.visit(direction * 2.1, [2.0, 0.0]);
        let first = rail.cell(direction * 0.1);
        for k in 0..=10 {
            let cell = first + direction as i64 * k;
            let [u, curvature] = rail.cells[GradeMap::slot(cell)];
            assert!((u - 1.0 - 0.1 * k as Real).abs() < 1e-12);
            assert!((curvature - 0.5 + 0.05 * k as Real).abs() < 1e-12);
        }
        assert_eq!(rail.known.map(|[low, high]| high - low), Some(10));
    }
}

#[test]
fn as_much_rail_is_known_as_there_are_cells_and_a_jump_beyond_them_forgets() {
    for direction in [1, -1] {
        let mut rail = GradeMap::new(20.0);
        let at = |cell: i64| (cell as Real + 0.5) * 0.2;
        for k in 0..300 {
            rail.visit(at(direction * k), [1.0, 0.0]);
        }
        let [low, high] = rail.known.unwrap();
        let (near, far) = (direction * 299, direction * (299 - 127));
        assert_eq!((low, high), (near.min(far), near.max(far)));
        // As far as there are cells it goes on, farther it begins anew.
        for (jump, kept) in [(127, true), (129, false)] {
            let mut jumped = rail;
            jumped.visit(at(direction * (299 + jump)), [2.0, 0.0]);
            let [low, high] = jumped.known.unwrap();
            assert_eq!(high > low, kept, "{direction} {jump}");
            let mut back = rail;
            back.visit(at(direction * (299 - 127 - jump)), [2.0, 0.0]);
            let [low, high] = back.known.unwrap();
            assert_eq!(high > low, kept, "{direction} back {jump}");
        }
    }
}

#[test]
fn the_gradient_at_an_end_takes_a_metre_of_known_rail() {
    let mut rail = GradeMap::new(20.0); // cells of 0.2 m: five to the metre
    for k in 0..=5 {
        assert_eq!(
            rail.known
                .map_or(0.0, |known| rail.gradient(known, known[1], -1)),
            0.0
        );
        rail.visit((k as Real + 0.5) * 0.2, [0.4 * 0.2 * k as Real, 0.0]);
    }
    let known = rail.known.unwrap();
    assert!((rail.gradient(known, known[1], -1) - 0.4).abs() < 1e-12);
    assert!((rail.gradient(known, known[0], 1) + 0.4).abs() < 1e-12);
    assert!(rail.seen_up_to(1.19) && !rail.seen_up_to(1.21));
}

/// Rail not read goes on with the gradient of its end for 3 m, then level, and its doubt grows with its distance.
#[test]
fn beyond_its_ends_rail_goes_on_for_three_metres() {
    let mut rail = GradeMap::new(20.0);
    for k in 0..50 {
        rail.visit((k as Real + 0.5) * 0.2, [0.4 * 0.2 * k as Real, 0.0]);
    }
    let (first, last) = (0.0, 0.4 * 0.2 * 49.0);
    for (at, expected) in [
        (10.1 + 1.0, last + 0.4 * 1.2),
        (10.1 + 5.0, last + 0.4 * 3.0),
        (0.1 - 1.0, first - 0.4 * 1.0),
        (0.1 - 5.0, first - 0.4 * 3.0),
    ] {
        let mean = rail.mean(at, at).unwrap();
        assert!(
            (mean.value[0] - expected).abs() < 1e-9,
            "{at}: {mean:?} {expected}"
        );
        let away = if at > 5.0 { at - 9.9 } else { 0.1 - at };
        assert!((mean.unseen_m - away).abs() < 1e-9, "{at}: {mean:?}");
        assert!(
            (mean.doubt_mps2 - away * (0.01 + 0.4)).abs() < 1e-9,
            "{at}: {mean:?}"
        );
    }
}

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
        assert!((train.place_m - 0.5 * direction).abs() < 1e-9);
        assert!((train.now_m - direction).abs() < 1e-9);
        for _ in 0..1_000 {
            train.step(Some([0.0, 0.0]), 0.5 * direction, direction, 0.01);
        }
        assert!((train.now_m - train.place_m - 2.0 * direction).abs() < 1e-9);
    }
}
