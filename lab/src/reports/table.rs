//! Tables.

use crate::reports::html::escape;
use crate::text::number;
use maud::{Markup, PreEscaped, html};

/// A table. Columns of numbers stand to the right.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// Caption above the table; may be empty.
    pub(crate) caption: String,
    /// Column titles and whether the column holds numbers.
    pub(crate) columns: Vec<(String, bool)>,
    /// Rows, one cell a column.
    pub(crate) rows: Vec<Vec<Cell>>,
}

/// A cell and how it is meant.
#[derive(Clone, Debug, Default)]
pub struct Cell {
    pub(crate) text: String,
    /// Good news (true), bad news (false) or neither.
    pub(crate) good: Option<bool>,
}

impl Cell {
    /// A number; a dash if it is not finite.
    pub fn number(x: f64) -> Self {
        number(x).into()
    }

    fn markup(&self) -> Markup {
        html! {
            @match self.good {
                Some(true) => { span.good { (breakable(&self.text)) } }
                Some(false) => { span.bad { (breakable(&self.text)) } }
                None => (breakable(&self.text)),
            }
        }
    }

    /// Marks the cell as good or bad news.
    pub fn judged(self, good: bool) -> Self {
        Self {
            good: Some(good),
            ..self
        }
    }
}

impl<T: Into<String>> From<T> for Cell {
    fn from(text: T) -> Self {
        Self {
            text: text.into(),
            good: None,
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

/// Text in which a long name may be broken after an underscore.
fn breakable(text: &str) -> Markup {
    PreEscaped(escape(text).replace('_', "_<wbr/>"))
}
