//! Train and unit files, and how they become a [`Train`](crate::train::Train).
//!
//! | file | what it holds |
//! |---|---|
//! | `train_file` `unit_file` | the formats |
//! | `unit` | a unit: its YAML file and its URDF put together |
//! | `consist` | the train: units from front to rear, joined by drawbars |
//! | `suspended_units` | cabs and beams below their trolleys, the load on its chains |

mod consist;
mod suspended_units;
pub mod train_file;
pub mod unit;
pub mod unit_file;
