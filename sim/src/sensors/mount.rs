//! Finding the link of the train that a sheet names.

use crate::config::file::input_error;
use crate::config::sensor_sheet::Sheet;
use crate::error::Error;
use crate::train::Train;

impl Sheet {
    /// Index in `Train::mounts` of the place the inertial instruments sit at: the accelerometer's, else the gyro's;
    /// `None` when neither is fitted.
    pub fn imu_mount(&self, train: &Train) -> Result<Option<usize>, Error> {
        let fitted = [
            ("accelerometer", &self.data.accelerometer),
            ("gyro", &self.data.gyro),
        ];
        let Some((name, sensor)) = fitted.iter().find_map(|(n, s)| s.as_ref().map(|s| (n, s)))
        else {
            return Ok(None);
        };
        self.find_mount(train, name, &sensor.mount).map(Some)
    }

    /// Index of a mount by `unit/link`, or by `link` alone: the first unit that has it.
    pub(super) fn find_mount(
        &self,
        train: &Train,
        sensor: &str,
        wanted: &str,
    ) -> Result<usize, Error> {
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
            let differs = distance(n, wanted).min(distance(link, wanted));
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
        Err(input_error(
            &self.file,
            format!("{sensor}.mount"),
            format!("the train `{}` has no link `{wanted}`", train.name),
            help,
        ))
    }
}

/// Edit distance (Levenshtein): how many letters to insert, delete or replace.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = i;
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensors::tests::{asset, train};

    #[test]
    fn mounts_are_found_by_full_name_and_by_link() {
        let (sheet, train) = (asset("ideal.yaml"), train(4));
        assert_eq!(
            sheet
                .find_mount(&train, "gyro", "drive_3/imu_link")
                .unwrap(),
            5
        );
        assert_eq!(sheet.find_mount(&train, "gyro", "imu_link").unwrap(), 1);
        assert_eq!(sheet.imu_mount(&train).unwrap(), Some(1));
    }

    #[test]
    fn a_missing_mount_is_reported_with_near_matches() {
        let (sheet, train) = (asset("ideal.yaml"), train(4));
        let Err(Error::Input(e)) = sheet.find_mount(&train, "gyro", "drive_3/imu_lnk") else {
            panic!("found a mount that does not exist");
        };
        assert_eq!(e.key, "gyro.mount");
        assert!(
            e.help.starts_with("near matches: drive_3/imu_link"),
            "{}",
            e.help
        );
    }

    #[test]
    fn distances_are_those_of_the_textbook() {
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("", "abc"), 3);
        assert_eq!(distance("abc", "abc"), 0);
    }
}
