//! Second stages: estimators of the grade.

pub mod attitude;
pub mod curvature_rls;
pub mod force_balance_ekf;
pub mod imm;
pub mod inertial;
