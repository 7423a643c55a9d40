//! Tables as CSV.

use crate::ui::errors::CliError;

/// Writes a table as CSV (RFC 4180, lines end with a line feed).
pub(crate) fn text<R>(
    titles: &[&str],
    rows: impl IntoIterator<Item = R>,
) -> Result<String, CliError>
where
    R: IntoIterator<Item = String>,
{
    let refused = |e: String| CliError::NotWritten("CSV", e);
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer
        .write_record(titles)
        .map_err(|e| refused(e.to_string()))?;
    for row in rows {
        writer
            .write_record(row.into_iter().map(String::into_bytes))
            .map_err(|e| refused(e.to_string()))?;
    }
    let bytes = writer.into_inner().map_err(|e| refused(e.to_string()))?;
    String::from_utf8(bytes).map_err(|e| refused(e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotes_commas_and_lines_come_back_as_they_were() {
        let row = ["a \"b\", c", "two\nlines", "", "é"].map(str::to_owned);
        let text = text(&["w", "x", "y", "z"], [row.clone()]).unwrap();
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let back = reader.records().next().unwrap().unwrap();
        assert_eq!(back, csv::StringRecord::from(row.to_vec()));
        assert!(text.starts_with("w,x,y,z\n"), "{text}");
    }
}
