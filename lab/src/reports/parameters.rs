//! Table of the estimators: name, type, and the parameters that are not the defaults.

use crate::reports::table::Table;
use monorig_sim::config::scenario::Settings;
use std::collections::BTreeMap;

/// A row for each estimator; none without estimators.
pub(crate) fn table(estimators: &BTreeMap<String, Settings>) -> Option<Table> {
    if estimators.is_empty() {
        return None;
    }
    let mut table = Table::new(&["estimator", "type", "parameters"], &[]);
    table.caption = "Estimators and their parameters".into();
    for (name, settings) in estimators {
        let values = settings.named();
        let values = values.iter().map(|(key, x)| format!("{key} = {x}"));
        let given = match settings.values.is_empty() {
            true => "defaults".to_owned(),
            false => values.collect::<Vec<_>>().join(", "),
        };
        let of_type = settings.origin(name);
        table.row([name.clone().into(), of_type.into(), given.into()]);
    }
    Some(table)
}
