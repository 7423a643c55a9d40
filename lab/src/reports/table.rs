//! Tables.

use crate::reports::html::escape;
use crate::text::number;

/// A table. Columns of numbers stand to the right.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// What it shows, above it; may be empty.
    pub caption: String,
    /// Column titles and whether the column holds numbers.
    pub columns: Vec<(String, bool)>,
    /// Rows, one cell a column.
    pub rows: Vec<Vec<Cell>>,
}

/// A cell and how it is meant.
#[derive(Clone, Debug, Default)]
pub struct Cell {
    /// What stands in it.
    pub text: String,
    /// Whether it is good or bad news, if it is either.
    pub good: Option<bool>,
}

impl Cell {
    /// A number; a dash if it is not finite.
    pub fn number(x: f64) -> Self {
        number(x).into()
    }

    /// The same cell, as good or bad news.
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

    /// As HTML; one that is too wide for the screen scrolls by itself.
    pub fn to_html(&self) -> String {
        let class = |i: usize| match self.columns.get(i) {
            Some((_, true)) => " class=\"number\"",
            _ => "",
        };
        let mut out = String::from("<div class=\"scroll\"><table>\n");
        if !self.caption.is_empty() {
            out += &format!("<caption>{}</caption>\n", escape(&self.caption));
        }
        out += "<thead><tr>";
        for (i, (title, _)) in self.columns.iter().enumerate() {
            let title = escape(title).replace('_', "_<wbr/>");
            out += &format!("<th{}>{title}</th>", class(i));
        }
        out += "</tr></thead>\n<tbody>\n";
        for row in &self.rows {
            out += "<tr>";
            for (i, cell) in row.iter().enumerate() {
                // long names may be broken
                let text = escape(&cell.text).replace('_', "_<wbr/>");
                let text = match cell.good {
                    Some(true) => format!("<span class=\"good\">{text}</span>"),
                    Some(false) => format!("<span class=\"bad\">{text}</span>"),
                    None => text,
                };
                out += &format!("<td{}>{text}</td>", class(i));
            }
            out += "</tr>\n";
        }
        out + "</tbody></table></div>\n"
    }
}
