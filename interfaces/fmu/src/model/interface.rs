//! The functions of the model behind the variables of an FMU.

/// Result of a step without an error.
pub(crate) enum Stepped {
    /// The outputs are new.
    Done,
    /// The step was refused for this reason; the outputs are marked not valid, and the next step is possible.
    Refused(String),
    /// A step of this length is not possible; nothing has changed.
    NotMade(String),
}

/// An estimator or a plant. `values` are those of all variables, in their order.
pub(crate) trait Model {
    /// Starts with the present parameters, and writes the first outputs.
    fn begin(&mut self, values: &mut [f64]) -> Result<(), String>;
    /// Makes a step from `t_s` to `t_s + dt_s`. An error ends the instance.
    fn step(&mut self, values: &mut [f64], t_s: f64, dt_s: f64) -> Result<Stepped, String>;
    /// The state beside the values; `None` if it cannot be saved.
    fn save(&self) -> Option<Vec<u8>>;
    /// Starts with these values and continues from a state.
    fn load(&mut self, values: &mut [f64], state: &[u8]) -> Result<(), String>;
}
