//! First stages: estimators of the mass.

pub mod differenced_rls;
pub mod force_balance_rls;
pub mod multi_model_rls;
pub mod swing_balance;
