//! Verbosity and colour of the terminal, set once before anything is shown.

use clap::ValueEnum;
use std::io::IsTerminal;
use std::sync::OnceLock;

/// Choice of drawings and colour.
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

/// Options of every command.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct TerminalArgs {
    /// Print only errors on standard error: no progress, no notes
    #[arg(long, short, global = true, hide_short_help = true)]
    pub quiet: bool,
    /// Print more: every check and number of a result, the files read, the steps and their speed
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

/// Columns if the width of the terminal is not known, as for a file.
const USUAL_WIDTH: u16 = 80;
/// Largest length of a line, also on a wider terminal: longer lines are hard to read.
const WIDEST: u16 = 140;

/// Columns of standard output.
pub fn width() -> u16 {
    let known = terminal_size::terminal_size_of(std::io::stdout());
    known.map_or(USUAL_WIDTH, |(width, _)| width.0.clamp(USUAL_WIDTH, WIDEST))
}

static WANTED: OnceLock<TerminalArgs> = OnceLock::new();

/// Sets verbosity and colour, once.
pub fn set(wanted: TerminalArgs) {
    // a second time would be a mistake of the program: the first holds
    let _ = WANTED.set(wanted);
}

/// Returns true if notes and progress are left out.
pub fn quiet() -> bool {
    WANTED.get().is_some_and(|w| w.quiet)
}

/// Returns true if details are shown.
pub fn verbose() -> bool {
    WANTED.get().is_some_and(|w| w.verbose)
}

/// Returns true if errors are drawn.
pub fn drawn() -> bool {
    on(|| std::io::stderr().is_terminal())
}

/// Returns true if verdicts on standard output are coloured.
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
