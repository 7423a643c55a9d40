//! Input files: all reading of YAML, URDF, CSV and STL.
//!
//! | file | what it holds |
//! |---|---|
//! | `file` | reading a YAML file: errors with file, line, column, key and help; `--set path=value` |
//! | `input_files` | every input file read once, with its check sum |
//! | `kinds` | the kinds of files, told by the keys at their top |
//! | `scenario` | the scenario file, and the files it names |
//! | `track` | the track file: elements or survey points, and how they become an alignment |
//! | `rail_profile` | the profile file: the section of a rail |
//! | `train` | the YAML files of a train and of its units, and how they become a train |
//! | `urdf` | URDF files and the meshes they name |
//! | `motor_file` | a traction motor in the files of drive units and cars |
//! | `sensor_sheet` | reads and checks the data sheet of the sensors; its format is that of `sensors::spec` |

pub mod file;
pub mod input_files;
pub mod kinds;
pub(crate) mod motor_file;
pub mod rail_profile;
pub mod scenario;
pub mod sensor_sheet;
pub mod track;
pub mod train;
pub(crate) mod urdf;

pub use crate::checked;
