//! Algorithms of estimation, one a file; none depends on the vehicle.

pub mod adaptive_low_pass;
pub mod ekf;
pub mod ewma_variance;
pub mod forgetting;
pub mod gaussian;
pub mod imm;
pub mod lag_share;
pub mod low_pass;
pub mod model;
pub mod ring_buffer;
pub mod rls;
pub mod sage_husa;
pub mod strong_tracking;
pub mod ud;
pub mod ukf;
