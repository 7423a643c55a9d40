//! Verbosity and colour of the terminal, set once before anything is shown.

use clap::ValueEnum;
use std::io::IsTerminal;
use std::sync::OnceLock;

/// Use of drawings and colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Color {
    /// On a terminal, unless NO_COLOR is set
    #[default]
    Auto,
    /// Always
    Always,
    /// Never
    Never,
}

/// Options that every command takes.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct TerminalArgs {
    /// Say nothing on standard error but errors: no progress, no notes
    #[arg(long, short, global = true, hide_short_help = true)]
    pub quiet: bool,
    /// Say more: every check and number of a result, which files were read, what runs, and how fast
    #[arg(
        long,
        short,
        global = true,
        hide_short_help = true,
        conflicts_with = "quiet"
    )]
    pub verbose: bool,
    /// Draw errors and verdicts in colour
    #[arg(
        long,
        value_name = "WHEN",
        global = true,
        default_value = "auto",
        hide_possible_values = true,
        hide_short_help = true,
        long_help = "Draw errors and verdicts in colour: auto (on a terminal, unless NO_COLOR is set), always or never"
    )]
    pub color: Color,
}

/// Columns where the width of the terminal is not known, such as in a file.
const USUAL_WIDTH: u16 = 80;
/// Lines are made no longer, however wide the terminal: longer ones are hard to read.
const WIDEST: u16 = 140;

/// Columns of standard output.
pub fn width() -> u16 {
    let known = terminal_size::terminal_size_of(std::io::stdout());
    known.map_or(USUAL_WIDTH, |(width, _)| width.0.clamp(USUAL_WIDTH, WIDEST))
}

static WANTED: OnceLock<TerminalArgs> = OnceLock::new();

/// Set what is wanted, once.
pub fn set(wanted: TerminalArgs) {
    // a second time would be a mistake of the program: the first holds
    let _ = WANTED.set(wanted);
}

/// Returns whether notes and progress are left out.
pub fn quiet() -> bool {
    WANTED.get().is_some_and(|w| w.quiet)
}

/// Returns whether details are shown.
pub fn verbose() -> bool {
    WANTED.get().is_some_and(|w| w.verbose)
}

/// Returns whether errors are drawn.
pub fn drawn() -> bool {
    on(|| std::io::stderr().is_terminal())
}

/// Returns whether verdicts on standard output are coloured.
pub fn coloured() -> bool {
    on(|| std::io::stdout().is_terminal())
}

fn on(terminal: impl FnOnce() -> bool) -> bool {
    match WANTED.get().map(|w| w.color).unwrap_or_default() {
        Color::Always => true,
        Color::Never => false,
        Color::Auto => terminal() && std::env::var_os("NO_COLOR").is_none(),
    }
}
