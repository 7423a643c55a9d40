//! A page: title, verdict, sections.

use crate::reports::html::{escape, link};
use crate::reports::plot::Figure;
use crate::reports::table::Table;

/// The style sheet: light and dark by the reader's choice, one column on a phone, black on white in print.
const STYLE: &str = include_str!("style.css");

/// What a page may load: nothing. Its style sheet and figures stand in it.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'";

/// A whole report.
#[derive(Clone, Debug, Default)]
pub struct Page {
    /// Title.
    pub title: String,
    /// A line or two below it.
    pub subtitle: String,
    /// The outcome in a sentence and whether it is good; shown first.
    pub banner: Option<(String, bool)>,
    /// Sections in order.
    pub sections: Vec<Section>,
}

/// A part of a page.
#[derive(Clone, Debug, Default)]
pub struct Section {
    /// Heading.
    pub title: String,
    /// What stands in it, in order.
    pub blocks: Vec<Block>,
}

/// Something in a section.
#[derive(Clone, Debug)]
pub enum Block {
    /// A paragraph of plain text.
    Text(String),
    /// A table.
    Table(Table),
    /// Figures side by side as the width allows.
    Figures(Vec<Figure>),
    /// A link: text and address, relative to the report.
    Link(String, String),
    /// Long text that is folded away: what it is, and the text as it is.
    Folded(String, String),
    /// A long table that is folded away: what it is, and the table. In print it is open.
    FoldedTable(String, Table),
}

impl Page {
    /// An empty page.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            ..Self::default()
        }
    }

    /// The page as one self-contained HTML file. It is well-formed XML too.
    pub fn to_html(&self) -> String {
        let title = escape(&self.title);
        let mut out = format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\"/>\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
             <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n"
        );
        if !self.subtitle.is_empty() {
            out += &format!("<p class=\"muted\">{}</p>\n", escape(&self.subtitle));
        }
        if let Some((text, good)) = &self.banner {
            let class = if *good { "good" } else { "bad" };
            out += &format!("<p class=\"banner {class}\">{}</p>\n", escape(text));
        }
        if self.sections.len() > 2 {
            out += "<nav>";
            for (i, section) in self.sections.iter().enumerate() {
                out += &format!("<a href=\"#part-{i}\">{}</a> ", escape(&section.title));
            }
            out += "</nav>\n";
        }
        for (i, section) in self.sections.iter().enumerate() {
            out += &format!(
                "<section>\n<h2 id=\"part-{i}\">{}</h2>\n",
                escape(&section.title)
            );
            for block in &section.blocks {
                out += &block.to_html();
            }
            out += "</section>\n";
        }
        out + "</body>\n</html>\n"
    }
}

impl Section {
    /// An empty section.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            blocks: Vec::new(),
        }
    }

    /// With a paragraph.
    pub fn text(mut self, text: impl Into<String>) -> Self {
        self.blocks.push(Block::Text(text.into()));
        self
    }

    /// With a table.
    pub fn table(mut self, table: Table) -> Self {
        self.blocks.push(Block::Table(table));
        self
    }

    /// With a table that is folded away.
    pub fn folded(mut self, what: impl Into<String>, table: Table) -> Self {
        self.blocks.push(Block::FoldedTable(what.into(), table));
        self
    }

    /// With a figure, beside the last one if that was one too.
    pub fn figure(mut self, figure: Figure) -> Self {
        match self.blocks.last_mut() {
            Some(Block::Figures(all)) => all.push(figure),
            _ => self.blocks.push(Block::Figures(vec![figure])),
        }
        self
    }

    /// With figures.
    pub fn figures(self, figures: impl IntoIterator<Item = Figure>) -> Self {
        figures.into_iter().fold(self, Self::figure)
    }
}

impl Block {
    fn to_html(&self) -> String {
        match self {
            Self::Text(text) => format!("<p class=\"intro\">{}</p>\n", escape(text)),
            Self::Table(table) => table.to_html(),
            Self::Figures(all) => {
                let all: String = all.iter().map(Figure::to_html).collect();
                format!("<div class=\"figures\">\n{all}</div>\n")
            }
            Self::Link(text, to) => {
                format!("<p><a href=\"{}\">{}</a></p>\n", link(to), escape(text))
            }
            Self::Folded(what, text) => format!(
                "<details><summary>{}</summary><pre>{}</pre></details>\n",
                escape(what),
                escape(text)
            ),
            Self::FoldedTable(what, table) => format!(
                "<details class=\"table\"><summary>{}</summary>{}</details>\n",
                escape(what),
                table.to_html()
            ),
        }
    }
}
