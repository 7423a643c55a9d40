//! Files of tracks, surveys and profiles, their errors, and the assets.

use super::*;
use crate::config::rail_profile::ProfileFile;
use crate::rail::profile::ProfileSpec;
use crate::train::Limits;

/// The tracks have the properties that their comments promise.
#[test]
fn the_tracks_are_what_they_say() {
    let steepest = |r: &Rail| {
        r.samples(0.05)
            .iter()
            .map(|f| r.grade(f.s).abs())
            .fold(0.0, f64::max)
            .to_degrees()
    };
    for name in TRACKS {
        let r = load(name);
        for f in r.samples(0.1).iter().filter(|f| f.s < 19.95) {
            assert!(
                f.p.z == 0.0 && f.k.norm() == 0.0 && f.t.x == 1.0,
                "{name} starts straight and level"
            );
        }
    }
    let r = load("liu2023_section1.yaml");
    assert!((r.length() - 140.0).abs() < 1e-9 && r.grade(40.0) == 0.0);
    assert!(
        (r.grade(50.0).to_degrees() - 8.0).abs() < 1e-12
            && (r.grade(140.0).to_degrees() - 8.0).abs() < 1e-12
    );
    assert!((steepest(&load("liu2023_section2.yaml")) - 8.0).abs() < 0.01);
    let r = load("liu2023_vehicle_test.yaml");
    assert!((r.grade(63.0)).abs() < 1e-12 && (r.grade(70.0).to_degrees() - 14.0).abs() < 1e-12);
    assert!(
        r.length() >= 140.0
            && steepest(&r) < 15.0
            && (83..145).all(|s| r.grade(f64::from(s)).abs() < 1.01_f64.to_radians())
    );
    let r = load("surveyed_300m.yaml");
    assert!(
        r.length() == 300.0 && (steepest(&r) - 5.0).abs() < 0.2,
        "{}",
        steepest(&r)
    );
    assert_eq!(
        load("jointed_100m.yaml")
            .joints()
            .map(|j| j.chainages().count()),
        Some(33)
    );
    let r = load("winding.yaml");
    assert!(r.length() > 630.0 && (steepest(&r) - 20.0).abs() < 1e-6);
    assert!((steepest(&load("steep_30deg.yaml")) - 30.0).abs() < 1e-6);
    assert!((steepest(&load("straight_15deg.yaml")) - 15.0).abs() < 1e-6);
}

const LIMITS: Limits = Limits {
    min_radius_horizontal_m: 4.0,
    min_radius_vertical_m: 10.0,
    max_grade_rad: 0.53,
    max_speed_mps: 2.4,
    length_m: 18.1,
    max_load_kg: 20_000.0,
};

#[test]
fn every_asset_track_carries_the_reference_train() {
    for name in TRACKS
        .iter()
        .chain(&["jointed_100m.yaml", "surveyed_300m.yaml"])
    {
        load(name).check(&LIMITS).unwrap();
    }
}

#[test]
fn the_element_a_train_cannot_run_on_is_named() {
    for (body, says) in [
        (
            "horizontal: [{kind: line, length_m: 30}, {kind: arc, radius_m: 3.9, angle_deg: 90}]",
            "horizontal[1].radius_m",
        ),
        (
            "horizontal: [{kind: line, length_m: 30}, {kind: clothoid, length_m: 5, to_radius_m: -3}]",
            "horizontal[1].to_radius_m",
        ),
        (
            "horizontal: [{kind: line, length_m: 30}]\nvertical: [{kind: transition, length_m: 3, to_grade_deg: 10}]",
            "vertical[0].length_m",
        ),
        (
            "vertical: [{kind: grade, length_m: 30}, {kind: arc, radius_m: 9, to_grade_deg: 10}]",
            "vertical[1].radius_m",
        ),
        (
            "vertical: [{kind: grade, length_m: 30, grade_deg: -31}]",
            "vertical[0].grade_deg",
        ),
        (
            "vertical: [{kind: repeat, times: 2, elements: [{kind: arc, radius_m: 40, to_grade_deg: 31}, {kind: arc, radius_m: 40, to_grade_deg: 0}]}]",
            "vertical[0].elements[0].to_grade_deg",
        ),
        ("horizontal: [{kind: line, length_m: 18}]", "18.000 m long"),
    ] {
        let e = rail(body).unwrap().check(&LIMITS).unwrap_err().to_string();
        assert!(e.contains(says), "{body}: {e}");
    }
    let just = "horizontal: [{kind: arc, radius_m: 4, angle_deg: 300}]\nvertical: [{kind: arc, radius_m: 10, to_grade_deg: 10}]";
    rail(just).unwrap().check(&LIMITS).unwrap();
}

#[test]
fn a_bad_element_is_named() {
    for (body, says) in [
        ("", "horizontal: the track has no elements"),
        (
            "horizontal: [{kind: line}]",
            "horizontal[0].length_m: a line needs length_m",
        ),
        (
            "horizontal: [{kind: line, length_m: 3, radius_m: 4}]",
            "horizontal[0].radius_m: a line has no radius_m",
        ),
        (
            "horizontal: [{kind: arc, radius_m: 4}]",
            "horizontal[0].angle_deg",
        ),
        (
            "horizontal: [{kind: arc, radius_m: 4, length_m: 3, angle_deg: 20}]",
            "horizontal[0]: needs either",
        ),
        (
            "horizontal: [{kind: arc, radius_m: 4, angle_deg: 0}]",
            "horizontal[0].angle_deg",
        ),
        (
            "horizontal: [{kind: arc, radius_m: 0.2, angle_deg: 90}]",
            "horizontal[0].radius_m",
        ),
        (
            "horizontal: [{kind: clothoid, length_m: 1, to_radius_m: 0}]",
            "horizontal[0].to_radius_m",
        ),
        (
            "horizontal: [{kind: repeat, times: 3}]",
            "horizontal[0].elements",
        ),
        (
            "horizontal: [{kind: repeat, times: 0, elements: [{kind: line, length_m: 1}]}]",
            "horizontal[0].times",
        ),
        (
            "horizontal: [{kind: line, length_m: 2e5}]",
            "at most 50000 m",
        ),
        (
            "vertical: [{kind: grade, length_m: 3}, {kind: grade, length_m: 3, grade_deg: 2}]",
            "vertical[1].grade_deg: 2° does not fit",
        ),
        (
            "vertical: [{kind: grade, length_m: 3, grade_deg: 80}]",
            "vertical[0].grade_deg",
        ),
        (
            "vertical: [{kind: transition, length_m: 3, to_grade_deg: 0}]",
            "vertical[0].to_grade_deg",
        ),
        (
            "vertical: [{kind: transition, length_m: 3, to_grade_deg: 3, easement_m: 1}]",
            "vertical[0].easement_m",
        ),
        (
            "horizontal: [{kind: line, length_m: 30}]\njoints: {every_m: 0.01}",
            "joints.every_m",
        ),
    ] {
        let e = rail(body).unwrap_err().to_string();
        assert!(e.contains(says), "{body}: {e}");
    }
    for body in [
        "horizontal: [{kind: line, length_m: -3}]",
        "horizontal: [{kind: line, length_m: 0}]",
        "horizontal: [{kind: line, lenght_m: 3}]",
        "horizontal: [{kind: curve, length_m: 3}]",
        "vertical: [{kind: arc, radius_m: .nan, to_grade_deg: 3}]",
    ] {
        let text = format!("version: 1\nname: x\nprofile: none\n{body}");
        assert!(serde_yaml::from_str::<TrackFile>(&text).is_err(), "{body}");
    }
}

#[test]
fn a_survey_becomes_a_rail() {
    let folder = std::env::temp_dir().join(format!("monorig-rail-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let mut csv = String::from("# the roadway\ns_m,height_m,heading_deg\n");
    for i in 0..=100 {
        let s = 2.0 * f64::from(i);
        csv += &format!(
            "{},{},{}\n",
            500.0 + s,
            300.0 + 0.05 * s,
            (350.0 + 0.4 * s) % 360.0
        );
    }
    std::fs::write(folder.join("survey.csv"), csv).unwrap();
    let text = "version: 1\nname: surveyed\nprofile: none\nsurvey: {file: survey.csv, height_noise_m: 0.01, heading_noise_deg: 0.1}";
    let track: TrackFile = serde_yaml::from_str(text).unwrap();
    let r = Rail::build(&track, profile(), &folder.join("track.yaml")).unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    assert_eq!(r.length(), 200.0);
    for f in r.samples(0.7) {
        // a constant grade with sin θ = 0.05 and a helix turning 0.4°/m
        assert!(
            (f.p.z - 0.05 * f.s).abs() < 1e-9 && (r.grade(f.s) - libm::asin(0.05)).abs() < 1e-9
        );
        assert!((r.heading(f.s) - (350.0 + 0.4 * f.s).to_radians()).abs() < 1e-9);
    }
    assert!((r.heading(1e9) - 430_f64.to_radians()).abs() < 1e-9);
}

#[test]
fn the_profile_is_an_i_beam() {
    let p = profile();
    // two tapered flanges and a web, by hand
    let flange = 0.007 * 0.0165 + (0.068 - 0.007) * 0.5 * (0.0165 + 0.0125);
    assert!((p.area() - (2.0 * flange + 0.007 * (0.155 - 2.0 * 0.0165))).abs() < 1e-12);
    assert!((p.running_surface(0.0035) - (0.0165 - 0.0775)).abs() < 1e-15);
    assert!((p.running_surface(-0.034) - (0.0125 - 0.0775)).abs() < 1e-15);
    let right = ProfileSpec {
        name: "x".into(),
        height_m: 0.155,
        flange_width_m: 0.068,
        web_m: 0.007,
        flange_tip_m: 0.0125,
        flange_root_m: 0.0165,
    };
    for (key, change) in [
        ("web_m", (|p| p.web_m = 0.07) as fn(&mut ProfileSpec)),
        ("flange_tip_m", |p| p.flange_tip_m = 0.02),
        ("flange_root_m", |p| p.flange_root_m = 0.08),
        ("height_m", |p| p.height_m = 155.0),
    ] {
        let mut wrong = right.clone();
        change(&mut wrong);
        assert_eq!(Profile::new(&wrong).unwrap_err().key, key);
    }
}

/// Any number of a track file may be wrong: the answer is a rail or an error, never a panic, and a rail is finite.
#[test]
fn wrong_numbers_are_no_panics() {
    let text = std::fs::read_to_string(asset("tracks/winding.yaml")).unwrap();
    let body = text
        .replace("times: 11", "times: 1")
        .replace("times: 10", "times: 1");
    let numbers: Vec<(usize, usize)> = body
        .match_indices(": ")
        .filter_map(|(i, _)| {
            let from = i + 2;
            let length = body[from..]
                .find(|c: char| !c.is_ascii_digit() && !".-".contains(c))
                .unwrap_or(0);
            (length > 0).then_some((from, from + length))
        })
        .collect();
    assert!(numbers.len() > 30);
    let (mut rails, mut errors) = (0, 0);
    for (from, to) in numbers {
        for slip in [
            "0", "-1", "1e-12", "1e-4", "7", "-700", "1e9", ".nan", ".inf", "x", "",
        ] {
            let slipped = format!("{}{slip}{}", &body[..from], &body[to..]);
            let built = serde_yaml::from_str::<TrackFile>(&slipped)
                .ok()
                .and_then(|t| Rail::build(&t, profile(), Path::new("t.yaml")).ok());
            match built {
                Some(r) => {
                    rails += 1;
                    assert!(
                        r.samples(1.0)
                            .iter()
                            .all(|f| f.p.norm().is_finite() && (f.t.norm() - 1.0).abs() < 1e-9),
                        "{slipped}"
                    );
                }
                None => errors += 1,
            }
        }
    }
    assert!(rails > 20 && errors > 200, "{rails} rails, {errors} errors");
}

#[test]
fn the_file_formats_have_a_schema() {
    for (schema, key) in [
        (schemars::schema_for!(TrackFile), "easement_m"),
        (schemars::schema_for!(ProfileFile), "flange_tip_m"),
    ] {
        assert!(serde_json::to_string(&schema).unwrap().contains(key));
    }
}
