//! A page: title, verdict, sections.

use crate::reports::html::link;
use crate::reports::plot::Figure;
use crate::reports::table::{Table, class};
use crate::text::marked;
use crate::verdicts::judgement::Grade;
use maud::{DOCTYPE, Markup, PreEscaped, html};

/// The style sheet: light and dark by the reader's choice, one column on a phone, black on white in print.
const STYLE: &str = include_str!("style.css");

/// The page loads nothing: its style sheet and figures stand in it. These elements are closed as XML requires.
const META: &str = r#"<meta charset="utf-8"/>
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"/>
<meta name="viewport" content="width=device-width, initial-scale=1"/>
"#;

/// A whole report.
#[derive(Clone, Debug, Default)]
pub struct Page {
    /// Title.
    pub title: String,
    /// Text below the title.
    pub subtitle: String,
    /// The outcome in a sentence, and its grade; shown first.
    pub banner: Option<(String, Grade)>,
    /// Sections in order.
    pub sections: Vec<Section>,
}

/// A part of a page.
#[derive(Clone, Debug, Default)]
pub struct Section {
    /// Heading.
    pub(crate) title: String,
    /// Blocks, in order.
    pub(crate) blocks: Vec<Block>,
}

/// Block of a section.
#[derive(Clone, Debug)]
pub(crate) enum Block {
    /// A paragraph of plain text.
    Text(String),
    /// A table.
    Table(Table),
    /// Figures side by side as the width allows.
    Figures(Vec<Figure>),
    /// A link: text and address, relative to the report.
    Link(String, String),
    /// Long text that is folded away: its description, and the unchanged text.
    Folded(String, String),
    /// A long table that is folded away: its description, and the table. In print it is unfolded.
    FoldedTable(String, Table),
    /// Figures that are folded away.
    FoldedFigures(String, Vec<Figure>),
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
        let navigation = self.sections.len() > 2;
        let page = html! {
            (DOCTYPE) "\n"
            html lang="en" {
                head {
                    (PreEscaped(META))
                    title { (self.title) }
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    h1 { (self.title) }
                    @if !self.subtitle.is_empty() { p.muted { (self.subtitle) } }
                    @if let Some((text, grade)) = &self.banner {
                        p.banner.(class(*grade)) { (text) }
                    }
                    @if navigation {
                        nav {
                            @for (i, section) in self.sections.iter().enumerate() {
                                a href={ "#part-" (i) } { (section.title) } " "
                            }
                        }
                    }
                    @for (i, section) in self.sections.iter().enumerate() {
                        "\n"
                        section {
                            h2 id={ "part-" (i) } { (section.title) }
                            @for block in &section.blocks { "\n" (block.markup()) }
                        }
                    }
                }
            }
            "\n"
        };
        marked(&page.into_string())
    }
}

impl Section {
    /// Removes empty figures.
    pub(crate) fn drop_empty_figures(&mut self) {
        for block in &mut self.blocks {
            if let Block::Figures(figures) = block {
                figures.retain(|figure| figure.svg.is_some());
            }
        }
        self.blocks
            .retain(|block| !matches!(block, Block::Figures(figures) if figures.is_empty()));
    }

    /// An empty section.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            blocks: Vec::new(),
        }
    }

    /// Adds a paragraph.
    pub fn text(mut self, text: impl Into<String>) -> Self {
        self.blocks.push(Block::Text(text.into()));
        self
    }

    /// Adds a table.
    pub fn table(mut self, table: impl Into<Option<Table>>) -> Self {
        self.blocks.extend(table.into().map(Block::Table));
        self
    }

    /// Adds a folded table.
    pub(crate) fn folded(mut self, what: impl Into<String>, table: Table) -> Self {
        self.blocks.push(Block::FoldedTable(what.into(), table));
        self
    }

    /// Adds folded figures.
    pub(crate) fn folded_figures(mut self, what: impl Into<String>, all: Vec<Figure>) -> Self {
        self.blocks.push(Block::FoldedFigures(what.into(), all));
        self
    }

    /// Adds a figure, beside the last block if this is a figure too.
    pub fn figure(mut self, figure: Figure) -> Self {
        match self.blocks.last_mut() {
            Some(Block::Figures(all)) => all.push(figure),
            _ => self.blocks.push(Block::Figures(vec![figure])),
        }
        self
    }

    /// Adds figures.
    pub(crate) fn figures(self, figures: impl IntoIterator<Item = Figure>) -> Self {
        figures.into_iter().fold(self, Self::figure)
    }
}

impl Block {
    fn markup(&self) -> Markup {
        html! {
            @match self {
                Self::Text(text) => { p.intro { (text) } }
                Self::Table(table) => (table.markup()),
                Self::Figures(all) => (side_by_side(all)),
                Self::FoldedFigures(what, all) => {
                    details { summary { (what) } (side_by_side(all)) }
                }
                Self::Link(text, to) => { p { a href=(link(to)) { (text) } } }
                Self::Folded(what, text) => {
                    details { summary { (what) } pre { (text) } }
                }
                Self::FoldedTable(what, table) => {
                    details.table { summary { (what) } (table.markup()) }
                }
            }
        }
    }
}

/// Figures side by side as the width allows.
fn side_by_side(all: &[Figure]) -> Markup {
    html! { div.figures { @for figure in all { "\n" (figure.markup()) } } }
}
