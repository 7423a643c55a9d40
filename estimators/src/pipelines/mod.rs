//! Whole estimators, put together from stages.

pub mod dffrls_aekf_inclination_robust;
pub mod dffrls_aekf_robust;
pub mod dffrls_aukf_robust;
pub mod dffrls_ukf_robust;
pub mod dynamic_stf_robust;
pub mod ffrls_aukf_robust;
pub mod ffrls_robust;
pub mod imm_ekf_fixed_robust;
pub mod imm_ekf_robust;
pub mod imm_stf_fixed_robust;
pub mod imm_stf_no_lateral_robust;
pub mod imm_stf_robust;
pub mod joint_ekf_robust;
pub mod kinematic_stf_robust;
pub mod mmrls_sh_stf_robust;
pub mod regression;
pub mod resistance_dffrls_robust;
pub mod rls_ekf_robust;
pub mod rls_mff_aukf_robust;
pub mod runner;
pub mod two_stage;
