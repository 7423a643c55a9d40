//! The error budget of a run, if `monorig explain` has made one.

use crate::explain::{Budget, METRICS, NAME};
use crate::reports::page::Section;
use crate::reports::run::recorded::Recorded;
use crate::reports::table::{Cell, Table};
use monorig_sim::config::file::{input_error, read_result};
use monorig_sim::error::Error;

/// Tables; none without a budget. One of another run is an error.
pub(crate) fn section(run: &Recorded) -> Result<Option<Section>, Error> {
    let path = run.folder.join(NAME);
    if !path.is_file() {
        return Ok(None);
    }
    let wrong = |message: String| {
        input_error(
            &path,
            "",
            message,
            "make the budget again with `monorig explain`",
        )
    };
    let budget: Budget = serde_json::from_str(&read_result(&path)?)
        .map_err(|e| wrong(format!("this is not an error budget: {e}")))?;
    if (budget.kind.as_str(), budget.version) != ("explain", 1) {
        return Err(wrong(format!(
            "this is version {} of `{}`",
            budget.version, budget.kind
        )));
    }
    if budget.scenario != run.summary.scenario {
        return Err(wrong(format!(
            "this is the error budget of {}",
            budget.scenario
        )));
    }
    let (name, sentence) = budget.sentence(run.in_loop());
    let mut section = Section::new("Error budget").text(sentence);
    if budget.changed {
        section = section.text(
            "Files of this run were changed before the budget was made: the budget is of the changed files, not of this run.",
        );
    }
    section = section.table(greatest(&budget, name)).text(
        "95 % intervals over the seeds are in brackets. The mean squares of independent sources add up; a negative share means that the error is \
         larger without the source.",
    );
    section = section.folded("The sources", legend(&budget));
    for metric in METRICS {
        if let Some(error) = budget.of(metric).next() {
            let what = format!("Every estimator and source: {}", error.title());
            section = section.folded(what, table(&budget, metric));
        }
    }
    Ok(Some(section))
}

/// Largest sources of the errors of an estimator.
fn greatest(budget: &Budget, name: &str) -> Table {
    let mut errors: Vec<_> = METRICS
        .iter()
        .flat_map(|metric| budget.of(metric))
        .collect();
    errors.retain(|e| e.estimator == name);
    let titles: Vec<String> = errors.iter().map(|e| e.title()).collect();
    let titles: Vec<&str> = titles.iter().map(String::as_str).collect();
    let mut table = Table::new(&["share of the mean square error"], &titles);
    for source in budget.greatest(name) {
        let title = budget.sources.get(source).map_or("", |s| s.name.as_str());
        let cells = errors.iter().map(|e| e.share_words(source).into());
        table.row(std::iter::once(title.into()).chain(cells));
    }
    table
}

fn legend(budget: &Budget) -> Table {
    let mut table = Table::new(&["without", "which is"], &[]);
    for source in &budget.sources {
        let what = match &source.failed {
            Some(why) => format!("{}; could not be run: {why}", source.what),
            None => source.what.clone(),
        };
        table.row([source.name.clone().into(), what.into()]);
    }
    table
}

fn table(budget: &Budget, metric: &str) -> Table {
    let mut table = Table::new(&["estimator"], &["as it is"]);
    for source in &budget.sources {
        let title = match source.name.as_str() {
            "excitation" => "with more excitation".to_owned(),
            name => format!("without {name}"),
        };
        table.columns.push((title, true));
    }
    for error in budget.of(metric) {
        let values = std::iter::once(error.with_all).chain(error.without.iter().copied());
        let values = values.map(Cell::number);
        table.row(std::iter::once(error.estimator.clone().into()).chain(values));
    }
    table
}
