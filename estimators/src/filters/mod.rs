//! Algorithms of estimation, one a file; none depends on the vehicle.

pub mod adaptive_low_pass;
pub mod ekf;
pub(crate) mod ewma_variance;
pub mod forgetting;
pub mod gaussian;
pub mod imm;
pub(crate) mod lag_share;
pub mod low_pass;
pub mod model;
pub(crate) mod ring_buffer;
pub mod rls;
pub mod sage_husa;
pub mod strong_tracking;
pub(crate) mod ud;
pub mod ukf;
