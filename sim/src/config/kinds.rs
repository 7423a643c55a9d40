//! Kinds of files of ours, told by the keys at their top.

use crate::sensors::instruments::SHEET_KEYS;

/// A line for each kind: its name, then keys of its files. A sensor sheet has those of its instruments.
const KINDS: &str = "\
scenario why track train car sensors start stop physics estimators in_loop events expect
track profile road_width_m horizontal vertical survey joints
train consist drawbar limits resistance
unit urdf length_m running_gear carried_by connections
car body wheels tyres motors brakes air suspension
sensors
rail-profile height_m flange_width_m web_m flange_tip_m flange_root_m
ranges trains sensors noise_factor bias_factor track drive estimators
condition condition group told_factor events
study scenario runs first_seed set vary
tuning estimator parameters tuning validation objective budget optimiser
map files dbc time clocks step channels reference nominal
vehicle nominal_vehicle
parameters estimator parameters provenance";

/// The kinds: the name of each, and the keys by which its files are recognised.
pub fn kinds() -> impl Iterator<Item = (&'static str, Vec<&'static str>)> {
    KINDS.lines().map(|line| match line.split_once(' ') {
        Some((name, keys)) => (name, keys.split(' ').collect()),
        None => (line, SHEET_KEYS.to_vec()),
    })
}

/// The kind of a file with these keys at its top: that with most of them. None if they do not decide it.
pub fn kind_of(keys: &[String]) -> Option<&'static str> {
    let hits = |of: &[&str]| of.iter().filter(|t| keys.iter().any(|k| k == *t)).count();
    let found = kinds().map(|(name, of)| (name, hits(&of)));
    let found = found.filter(|(_, hits)| *hits > 0);
    found.max_by_key(|(_, hits)| *hits).map(|(name, _)| name)
}
