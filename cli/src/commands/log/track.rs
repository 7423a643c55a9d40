//! `monorig log track`: write the rail profile that a run measured.

use crate::command::CommandOutcome;
use crate::files::report;
use crate::ui::errors::CliError;
use crate::ui::note::note;
use crate::ui::output;
use monorig_lab::mapping::{MapPoint, Passage, profile, to_csv, to_track};
use monorig_sim::config::file::input_error;
use monorig_sim::rail::Rail;
use monorig_sim::record::manifest::Manifest;
use std::path::{Path, PathBuf};

const TRACK_EXAMPLES: &str = "\
Examples:
  monorig run scenarios/liu2023_section1.yaml
  monorig log track runs/liu2023_section1/1 --profile assets/rails/i140e.yaml \\
      --out maps/section1.yaml
  monorig run scenarios/liu2023_section1.yaml --set track=../maps/section1.yaml
      drive on it
  monorig replay --map crane.map.yaml && monorig log track runs/crane/1 --from 120 \\
      --profile assets/rails/i140e.yaml

The run or replay needs an estimator with an attitude filter. The grade of a
place is read when the middle of the unit with the IMU has reached it, and is
corrected for the bias of the accelerometer known at the end. OUT is a track
file; beside it is a CSV file with chainage, grade and standard deviation, and
the heading from the first place on with its own. Rail before the start and
beyond the end goes on at the first and the last grade and heading, with a
standard deviation of 1.1°.";

/// Write the rail profile that a run or a recorded log measured, as a track file.
#[derive(Debug, clap::Args)]
#[command(after_help = TRACK_EXAMPLES)]
pub struct TrackArgs {
    /// Folder of a run or of a replay
    pub run: PathBuf,
    /// Estimator to read, by its name in the run
    #[arg(long, value_name = "NAME", default_value = "rail_fusion")]
    pub estimator: String,
    /// Chainage of the IMU at the start, m; without this option the chainage in the run, 0 for a recorded log
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub from: Option<f64>,
    /// Distance between two points of the map, m
    #[arg(long, value_name = "M", default_value_t = 0.25)]
    pub every: f64,
    /// Rail profile of the track file
    #[arg(long, value_name = "FILE", conflicts_with = "road_width")]
    pub profile: Option<PathBuf>,
    /// Width of the lane, m: the track is a road
    #[arg(long, value_name = "M")]
    pub road_width: Option<f64>,
    /// Leave out the bends: the rail of the map is straight
    #[arg(long)]
    pub straight: bool,
    /// Track file to write
    #[arg(long, value_name = "FILE", default_value = "map.yaml")]
    pub out: PathBuf,
}

/// Read the run, write the map, and check that it is a track.
pub fn run(task: &TrackArgs) -> Result<CommandOutcome, CliError> {
    let wrong =
        |message: String, help: &str| CliError::from(input_error(&task.run, "", message, help));
    if !(task.every >= 0.05 && task.every <= 10.0) {
        return Err(wrong(format!("--every {} m", task.every), "0.05 to 10 m"));
    }
    let manifest = Manifest::of_run(&task.run)?;
    manifest.verify(&task.run, "channels.parquet")?;
    let passage = Passage::read(&task.run, &task.estimator)?;
    let start_m = task.from.or(passage.start_m).unwrap_or(0.0);
    let points = profile(&passage, start_m, task.every).map_err(|why| {
        wrong(
            why,
            "use a run in which the grade is marked valid while the vehicle moves",
        )
    })?;
    let csv = task.out.with_extension("csv");
    if csv == task.out {
        return Err(wrong(
            "the track file and its survey would be the same file".into(),
            "use --out NAME.yaml",
        ));
    }
    let about = format!(
        "Map of {} seed {} by {}: grade{} at the middle of the unit with the IMU, with the bias known at the end.",
        manifest.scenario,
        manifest.seed,
        task.estimator,
        if task.straight { "" } else { " and heading" }
    );
    let csv_name = csv.file_name().unwrap_or_default().to_string_lossy();
    let track = to_track(
        &format!("map of {}", manifest.scenario),
        &about,
        &section(task)?,
        &csv_name,
        !task.straight,
    );
    output::write(&csv, &to_csv(&points, &about, !task.straight))?;
    output::write(&task.out, &track)?;
    Rail::load(&task.out)?;
    output::print(&text(&points, &task.out))?;
    note(&format!("points in {}", csv.display()));
    Ok(CommandOutcome::Held)
}

/// Writes the line of the track file for the rail profile or the width of the road.
fn section(task: &TrackArgs) -> Result<String, CliError> {
    if let Some(width) = task.road_width {
        return Ok(format!("road_width_m: {width}"));
    }
    let Some(profile) = &task.profile else {
        return Err(input_error(
            &task.run,
            "",
            "the command line gives neither a rail profile nor the width of a road",
            "use --profile assets/rails/i140e.yaml, or --road-width 3.5",
        )
        .into());
    };
    let full = std::path::absolute(profile).unwrap_or(profile.clone());
    let folder = task.out.parent().unwrap_or(Path::new(""));
    let folder = std::path::absolute(Path::new(".").join(folder)).unwrap_or_default();
    let name = report::relative(&folder, &full);
    Ok(format!("profile: {}", serde_json::Value::from(name)))
}

/// Describes the map in a line.
fn text(points: &[MapPoint], out: &Path) -> String {
    let read: Vec<&MapPoint> = points.iter().filter(|p| p.read).collect();
    let (first, last) = (
        read.first().map_or(0.0, |p| p.s_m),
        read.last().map_or(0.0, |p| p.s_m),
    );
    let mut sds: Vec<f64> = read.iter().map(|p| p.sd_rad.to_degrees()).collect();
    sds.sort_by(f64::total_cmp);
    let median = sds.get(sds.len() / 2).copied().unwrap_or(f64::NAN);
    let most = sds.last().copied().unwrap_or(f64::NAN);
    let headings = read.iter().map(|p| p.heading_sd_rad.to_degrees());
    let heading = headings.fold(0.0, f64::max);
    format!(
        "{}: rail read from {first:.2} m to {last:.2} m, {} points; standard deviation of the grade {median:.3}° (median), {most:.3}° (largest), of the \
         heading {heading:.2}° (largest)\n",
        out.display(),
        read.len()
    )
}
