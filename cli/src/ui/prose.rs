//! Sentences that fit a terminal.

use crate::ui::terminal;

/// Indentation of the further lines of a paragraph.
const HANGING: &str = "  ";

/// A paragraph of lines that fit the terminal, each after `indent`; all but the first are indented by two more. A word
/// longer than a line, such as a path, stays whole. The paragraph has no line break at its end.
pub fn paragraph(text: &str, indent: &str) -> String {
    let further = format!("{indent}{HANGING}");
    let options = textwrap::Options::new(usize::from(terminal::width()))
        .initial_indent(indent)
        .subsequent_indent(&further)
        .break_words(false)
        .word_splitter(textwrap::WordSplitter::NoHyphenation)
        .word_separator(textwrap::WordSeparator::AsciiSpace);
    textwrap::fill(text, options)
}

/// A number of things, such as `1 run` or `3 runs`.
pub fn counted(n: usize, thing: &str) -> String {
    match n {
        1 => format!("1 {thing}"),
        n => format!("{n} {thing}s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_line_is_wider_than_a_terminal_and_no_word_is_lost() {
        let words = "an estimate that is 38 % off ".repeat(20);
        let text = paragraph(words.trim(), "    ");
        assert!(text.lines().all(|l| l.chars().count() <= 80), "{text}");
        assert!(
            text.starts_with("    an") && text.lines().skip(1).all(|l| l.starts_with("      "))
        );
        let back: Vec<&str> = text.split_whitespace().collect();
        assert_eq!(back.join(" "), words.trim());
        let path = "x".repeat(100);
        assert_eq!(paragraph(&path, ""), path);
    }
}
