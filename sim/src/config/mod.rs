//! Input files: all reading of YAML, URDF, CSV and STL.
//!
//! | file | what it holds |
//! |---|---|
//! | `file` | reading a YAML file: errors with file, line, column, key and help; `--set path=value` |
//! | `input_files` | every input file read once, with its check sum |
//! | `scenario` | the scenario file, and the files it names |
//! | `track` | the track file: elements or survey points, and how they become an alignment |
//! | `rail_profile` | the profile file: the section of a rail |
//! | `train` | the YAML files of a train and of its units, and how they become a train |
//! | `urdf` `urdf_file` `urdf_tree` `urdf_geometry` `urdf_limits` `urdf_diagnostics` `stl` | URDF files and the meshes they name |
//! | `car_file` | the YAML file of a car |
//! | `motor_file` | a traction motor in the files of drive units and cars |
//! | `sensor_sheet` | reads and checks the data sheet of the sensors; its format is that of [`sensors::spec`](crate::sensors::spec) |

pub mod car_file;
pub mod file;
pub mod input_files;
pub mod motor_file;
pub mod rail_profile;
pub mod scenario;
pub mod sensor_sheet;
pub mod stl;
pub mod track;
pub mod train;
pub mod urdf;
mod urdf_diagnostics;
mod urdf_file;
pub(crate) mod urdf_geometry;
mod urdf_limits;
mod urdf_tree;

pub use crate::checked;
