//! Tables.

use crate::metrics::find;
use crate::reports::html::{escape, link};
use crate::text::number;
use crate::verdicts::judgement::Grade;
use maud::{Markup, PreEscaped, html};

/// A table. Aligns columns of numbers to the right.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// Caption above the table; may be empty.
    pub(crate) caption: String,
    /// Column titles and whether the column holds numbers.
    pub(crate) columns: Vec<(String, bool)>,
    /// Rows, one cell a column.
    pub(crate) rows: Vec<Vec<Cell>>,
}

/// A cell and its meaning.
#[derive(Clone, Debug, Default)]
pub struct Cell {
    pub(crate) text: String,
    /// Grade of a cell with an outcome.
    pub(crate) grade: Option<Grade>,
    /// Address of a linked page, relative to the report.
    link: Option<String>,
}

impl Cell {
    /// A number; a dash if it is missing or not finite.
    pub fn number(x: impl Into<Option<f64>>) -> Self {
        number(x.into().unwrap_or(f64::NAN)).into()
    }

    /// A difference of a metric with its interval, judged if the interval does not contain zero.
    pub(crate) fn difference(metric: &str, mean: f64, low: f64, high: f64) -> Self {
        let cell = Self::number(mean);
        let less = match (low > 0.0, high < 0.0) {
            (true, _) => Some(false),
            (_, true) => Some(true),
            _ => None,
        };
        match less.zip(find(metric).and_then(|m| m.best.less_is_better())) {
            Some((less, less_is_better)) => cell.judged(less == less_is_better),
            None => cell,
        }
    }

    fn markup(&self) -> Markup {
        html! {
            @match (self.grade, &self.link) {
                (_, Some(to)) => { a href=(link(to)) { (breakable(&self.text)) } }
                (Some(grade), None) => { span.(class(grade)) { (breakable(&self.text)) } }
                (None, None) => (breakable(&self.text)),
            }
        }
    }

    /// Marks the cell as good or bad news.
    pub fn judged(self, good: bool) -> Self {
        self.graded(if good { Grade::Held } else { Grade::Failed })
    }

    /// Adds a link to another page.
    pub(crate) fn linked(self, to: &str) -> Self {
        Self {
            link: Some(to.to_owned()),
            ..self
        }
    }

    /// Shows the cell in the colour of a grade.
    pub(crate) fn graded(self, grade: Grade) -> Self {
        Self {
            grade: Some(grade),
            ..self
        }
    }
}

impl<T: Into<String>> From<T> for Cell {
    fn from(text: T) -> Self {
        Self {
            text: text.into(),
            grade: None,
            link: None,
        }
    }
}

impl Table {
    /// An empty table: `texts` columns of text, then columns of `numbers`.
    pub fn new(texts: &[&str], numbers: &[&str]) -> Self {
        let texts = texts.iter().map(|t| ((*t).to_owned(), false));
        let numbers = numbers.iter().map(|t| ((*t).to_owned(), true));
        Self {
            columns: texts.chain(numbers).collect(),
            ..Self::default()
        }
    }

    /// Add a row.
    pub fn row(&mut self, cells: impl IntoIterator<Item = Cell>) {
        self.rows.push(cells.into_iter().collect());
    }

    /// The table as HTML. A table that is too wide for the screen scrolls by itself.
    pub(crate) fn markup(&self) -> Markup {
        let class = |i: usize| self.columns.get(i).filter(|c| c.1).map(|_| "number");
        html! {
            div.scroll {
                table {
                    @if !self.caption.is_empty() { caption { (self.caption) } }
                    thead {
                        tr {
                            @for (i, (title, _)) in self.columns.iter().enumerate() {
                                th class=[class(i)] { (breakable(title)) }
                            }
                        }
                    }
                    tbody {
                        @for row in &self.rows {
                            "\n"
                            tr { @for (i, cell) in row.iter().enumerate() { td class=[class(i)] { (cell.markup()) } } }
                        }
                    }
                }
            }
        }
    }
}

/// The class of a grade in the style sheet.
pub(crate) fn class(grade: Grade) -> &'static str {
    match grade {
        Grade::Failed => "bad",
        Grade::HeldBut => "but",
        Grade::Held => "good",
        Grade::Unasked => "muted",
    }
}

/// Text in which a long name may be broken after an underscore.
fn breakable(text: &str) -> Markup {
    PreEscaped(escape(text).replace('_', "_<wbr/>"))
}
