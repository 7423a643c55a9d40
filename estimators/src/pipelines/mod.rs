//! Whole estimators, put together from stages.

pub mod dffrls_aekf;
pub mod dffrls_aekf_inclination;
pub mod dffrls_aukf;
pub mod dffrls_ukf;
pub mod dynamic_stf;
pub mod ffrls;
pub mod ffrls_aukf;
pub mod imm_ekf;
pub mod imm_ekf_fixed;
pub mod imm_stf;
pub mod imm_stf_fixed;
pub mod imm_stf_no_lateral;
pub mod joint_ekf;
pub mod kinematic_stf;
pub mod mmrls_sh_stf;
pub mod regression;
pub mod resistance_dffrls;
pub mod rls_ekf;
pub mod rls_mff_aukf;
pub mod runner;
pub mod two_stage;
