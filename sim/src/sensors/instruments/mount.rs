//! Finds the link of a vehicle that a data sheet names.

use crate::error::DataError;
use crate::train::Train;
use strsim::levenshtein;

/// Index in `Train::mounts` of a mount by `unit/link`, or by `link` alone: the first unit that has it. `sensor` is
/// named in errors.
pub fn find(train: &Train, sensor: &str, wanted: &str) -> Result<usize, DataError> {
    let link = |name: &str| name.rsplit('/').next().is_some_and(|l| l == wanted);
    let names = || train.mounts.iter().map(|m| m.name.as_str());
    if let Some(i) = names()
        .position(|n| n == wanted)
        .or_else(|| names().position(link))
    {
        return Ok(i);
    }
    let mut near: Vec<&str> = names().collect();
    near.sort_by_key(|n| {
        let link = n.rsplit('/').next().unwrap_or(n);
        let differs = levenshtein(n, wanted).min(levenshtein(link, wanted));
        (!n.contains(wanted), differs)
    });
    let help = if near.is_empty() {
        "this train has no links to mount a sensor on".into()
    } else {
        near.truncate(4);
        format!(
            "near matches: {}; `imu_link` alone means the first unit that has one",
            near.join(", ")
        )
    };
    Err(DataError::new(
        format!("{sensor}.mount"),
        format!("the train `{}` has no link `{wanted}`", train.name),
        help,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensors::behaviour::train;

    #[test]
    fn mounts_are_found_by_full_name_and_by_link() {
        let train = train(4);
        assert_eq!(find(&train, "gyro", "drive_3/imu_link").unwrap(), 5);
        assert_eq!(find(&train, "gyro", "imu_link").unwrap(), 1);
    }

    #[test]
    fn a_missing_mount_is_reported_with_near_matches() {
        let e = find(&train(4), "gyro", "drive_3/imu_lnk").unwrap_err();
        assert_eq!(e.key, "gyro.mount");
        assert!(
            e.help.starts_with("near matches: drive_3/imu_link"),
            "{}",
            e.help
        );
    }
}
