//! The functions of what stands behind the variables of an FMU.

/// Result of a step that did not break.
pub(crate) enum Stepped {
    /// The outputs are new.
    Done,
    /// The step was refused for this reason; the outputs are marked not valid, and the next step is possible.
    Refused(String),
    /// No step of this length can be made; nothing has changed.
    NotMade(String),
}

/// An estimator or a plant. `values` are those of all variables, in their order.
pub(crate) trait Model {
    /// Starts with the parameters there are now, and writes the first outputs.
    fn begin(&mut self, values: &mut [f64]) -> Result<(), String>;
    /// Makes a step from `t_s` to `t_s + dt_s`. An error ends the instance.
    fn step(&mut self, values: &mut [f64], t_s: f64, dt_s: f64) -> Result<Stepped, String>;
    /// The state beside the values; none if it cannot be saved.
    fn save(&self) -> Option<Vec<u8>>;
    /// Starts with these values and goes on from a state.
    fn load(&mut self, values: &mut [f64], state: &[u8]) -> Result<(), String>;
}
