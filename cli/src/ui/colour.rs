//! Verdicts in colour, where standard output is a terminal.

use clap::builder::styling::{AnsiColor, Style};

const GOOD: Style = AnsiColor::Green.on_default();
const BAD: Style = AnsiColor::Red.on_default().bold();
const KNOWN: Style = AnsiColor::Yellow.on_default();
const UNASKED: Style = AnsiColor::BrightBlack.on_default();

/// Words of a verdict, each with its style; a longer word comes before its own beginning.
const WORDS: [(&str, Style); 10] = [
    ("held but for", KNOWN),
    ("held with weakened limits", KNOWN),
    ("nothing was expected", UNASKED),
    ("known failure", KNOWN),
    ("not finished", BAD),
    ("finding:", KNOWN),
    ("damaged", BAD),
    ("FAILED", BAD),
    ("worse", BAD),
    ("held", GOOD),
];

/// Colours the verdict at the beginning or end of each line.
pub fn verdicts(text: &str) -> String {
    text.split_inclusive('\n').map(line).collect()
}

fn line(line: &str) -> String {
    let bare = line.trim_end_matches('\n');
    let begun = bare.trim_start();
    let begins = |word: &str| follows(begun.strip_prefix(word)).then(|| bare.len() - begun.len());
    let ends = |word: &str| {
        let ends = bare.ends_with(&format!("  {word}"));
        // a word with more behind it, such as a count
        let within = || bare.find(&format!("  {word} ")).map(|at| at + 2);
        match ends {
            true => Some(bare.len() - word.len()),
            false if word.contains(' ') => within(),
            false => None,
        }
    };
    let place = |of: &dyn Fn(&str) -> Option<usize>| {
        WORDS
            .iter()
            .find_map(|(word, style)| Some((of(word)?, *word, *style)))
    };
    let Some((at, word, style)) = place(&begins).or_else(|| place(&ends)) else {
        return line.to_owned();
    };
    let (before, rest) = line.split_at(at);
    let (word, after) = rest.split_at(word.len());
    // `held` is green only where the line hides nothing
    let style = match after {
        _ if word != "held" => style,
        after if after.contains(" but for ") || after.contains(" weakened ") => KNOWN,
        after if after.contains("nothing was expected") => UNASKED,
        _ => style,
    };
    format!("{before}{style}{word}{style:#}{after}")
}

/// Returns true if a word ends before `rest`.
fn follows(rest: Option<&str>) -> bool {
    rest.is_some_and(|r| !r.starts_with(|c: char| c.is_alphanumeric() || c == '_'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_word_of_the_verdict_is_coloured() {
        let (green, end) = ("\u{1b}[32m", "\u{1b}[0m");
        let text = "held    minimal  seed 1\n slope  ≤ 1  0.5   held\nheld_up\nnothing held here\n";
        let coloured = format!(
            "{green}held{end}    minimal  seed 1\n slope  ≤ 1  0.5   {green}held{end}\nheld_up\nnothing held here\n"
        );
        assert_eq!(verdicts(text), coloured);
        assert!(verdicts("        finding: x\n").contains("finding:\u{1b}[0m x"));
        let yellow = "\u{1b}[33m";
        for (line, begun) in [
            (
                "held but for 2 known failures: 3 runs",
                format!("{yellow}held but for{end} 2"),
            ),
            (
                "held    a  2 seeds  but for 2 known failures",
                format!("{yellow}held{end}    a"),
            ),
            (
                "held    a  2 seeds  nothing was expected",
                format!("\u{1b}[90mheld{end}    a"),
            ),
            (
                "nothing was expected; 4",
                format!("\u{1b}[90mnothing was expected{end}; 4"),
            ),
        ] {
            assert!(verdicts(line).starts_with(&begun), "{line}");
        }
        assert!(verdicts(" a   known failure").contains("known failure\u{1b}[0m"));
    }
}
