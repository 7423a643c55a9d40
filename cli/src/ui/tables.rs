//! Tables and numbers as text.

use crate::ui::terminal;
use comfy_table::presets::{ASCII_MARKDOWN, NOTHING};
use comfy_table::{
    CellAlignment, ColumnConstraint, ContentArrangement, Row, Table, TableComponent,
};

/// Makes an empty table with one rule, below its titles.
pub fn table<'a>(titles: impl IntoIterator<Item = &'a str>) -> Table {
    let mut table = Table::new();
    table.load_preset(NOTHING);
    table.set_style(TableComponent::HeaderLines, '─');
    table.set_style(TableComponent::MiddleHeaderIntersections, '─');
    table.set_header(titles);
    table
}

/// Breaks cells that are too long for the terminal into lines.
pub fn within_terminal(table: &mut Table) {
    table.set_content_arrangement(ContentArrangement::Dynamic);
    table.set_width(terminal::width());
}

/// Keeps the cells of a column in one line.
pub fn whole(table: &mut Table, column: usize) {
    if let Some(column) = table.column_mut(column) {
        column.set_constraint(ColumnConstraint::ContentWidth);
    }
}

/// Aligns columns of numbers to the right.
pub fn right(table: &mut Table, columns: impl IntoIterator<Item = usize>) {
    for i in columns {
        if let Some(column) = table.column_mut(i) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
}

/// Text of the table without blanks at the ends of its lines.
pub fn lines(table: &Table) -> String {
    let lines: Vec<String> = table.lines().map(|l| l.trim_end().to_owned()).collect();
    lines.join("\n")
}

/// The table as Markdown; a line break in a cell becomes a blank.
pub fn markdown(mut table: Table) -> String {
    table.load_preset(ASCII_MARKDOWN);
    table.set_content_arrangement(ContentArrangement::Disabled);
    let escaped = |text: String| text.replace('\n', " ").replace('|', "\\|");
    if let Some(titles) = table.header().cloned() {
        table.set_header(titles.cell_iter().map(|cell| escaped(cell.content())));
    }
    for row in table.row_iter_mut() {
        *row = Row::from(row.cell_iter().map(|cell| escaped(cell.content())));
    }
    lines(&table)
}

/// A table whose rows belong to groups: the name of a group has a line of its own, however long it is, and the rows
/// below it are indented. All columns but the first are numbers.
pub fn grouped(titles: &[&str], groups: &[(String, Vec<Vec<String>>)]) -> String {
    let mut table = table(titles.iter().copied());
    let header = titles.iter().map(|t| t.split('\n').count()).max();
    let header = header.unwrap_or(1) + 1;
    let mut names = Vec::new();
    for (name, rows) in groups {
        names.push((table.row_count() + header, name));
        table.add_row([""]);
        for row in rows {
            let indented = row.iter().enumerate().map(|(i, cell)| match i {
                0 => format!("  {cell}"),
                _ => cell.clone(),
            });
            table.add_row(indented);
        }
    }
    right(&mut table, 1..titles.len());
    let mut all: Vec<String> = table.lines().map(|l| l.trim_end().to_owned()).collect();
    for (place, name) in names {
        if let Some(line) = all.get_mut(place) {
            *line = format!(" {name}");
        }
    }
    all.join("\n")
}

/// Width of a narrow title.
pub const TITLE: usize = 8;

/// Name of a metric for a narrow column, broken into lines after underscores.
pub fn narrow(metric: &str) -> String {
    let mut lines = vec![String::new()];
    for part in metric.split_inclusive('_') {
        match lines.last_mut() {
            Some(line) if line.is_empty() || line.len() + part.len() <= TITLE => *line += part,
            _ => lines.push(part.to_owned()),
        }
    }
    lines.join("\n")
}

/// A share in %.
pub fn percent(share: Option<f64>) -> String {
    match share.map(|x| 100.0 * x) {
        None => "-".into(),
        Some(0.0) => "0".into(),
        Some(x) if x < 0.95 => format!("{x:.1}"),
        Some(x) => format!("{x:.0}"),
    }
}

/// A number with three significant digits or more; zero is `0`.
pub fn number(x: f64) -> String {
    match x.abs() {
        0.0 => "0".to_owned(),
        a if !(1e-3..1e6).contains(&a) => format!("{x:.2e}"),
        a if a < 0.09995 => format!("{x:.4}"),
        a if a < 9.9995 => format!("{x:.3}"),
        a if a < 999.95 => format!("{x:.1}"),
        _ => format!("{x:.0}"),
    }
}

/// The number, or a dash if there is none.
pub fn shown(x: Option<f64>) -> String {
    x.map_or("-".to_owned(), number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_do_not_change_their_width_where_they_are_rounded() {
        for (x, text) in [
            (0.0, "0"),
            (0.0999, "0.0999"),
            (0.09996, "0.100"),
            (9.9996, "10.0"),
            (999.96, "1000"),
            (5.0, "5.000"),
            (1.0e-4, "1.00e-4"),
        ] {
            assert_eq!(number(x), text);
        }
    }

    #[test]
    fn a_groups_name_widens_no_column() {
        let name = "a_very_long_name_".repeat(5);
        let rows = vec![vec!["slope".to_owned(), "1.0".to_owned()]];
        let text = grouped(&["", "RMSE"], &[(name.clone(), rows)]);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[2], format!(" {name}"));
        assert_eq!(lines[3], "   slope    1.0");
    }
}
