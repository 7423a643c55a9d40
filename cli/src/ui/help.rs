//! Help on one screen: the first clause of each option, and as many examples as fit. `monorig help COMMAND` prints the
//! full help.

use clap::{Arg, ArgAction, Command};
use std::ffi::OsString;

/// The screen, in characters.
const WIDTH: usize = 80;
const LINES: usize = 24;

/// The command line with its help on one screen, if the words ask for help by an option.
pub(crate) fn for_words(command_line: Command, words: &[OsString]) -> Command {
    match words.iter().any(|word| word == "-h" || word == "--help") {
        true => one_screen(command_line, "monorig help"),
        false => command_line,
    }
}

fn one_screen(command: Command, more: &str) -> Command {
    let help = Arg::new("help")
        .short('h')
        .long("help")
        .action(ArgAction::HelpShort);
    let mut command = command
        .mut_subcommands(|c| {
            let more = format!("{more} {}", c.get_name());
            one_screen(c, &more)
        })
        .mut_args(brief)
        .disable_help_flag(true)
        .arg(help.help("Print help"));
    let Some(text) = command.get_after_help().map(ToString::to_string) else {
        return command;
    };
    if !text.starts_with("Examples:\n") {
        return command;
    }
    let sized = command
        .clone()
        .after_help("")
        .term_width(WIDTH)
        .render_help();
    let used = sized.to_string().trim_end().lines().count();
    let end = format!("Everything: {more}");
    let mut shown: Vec<&str> = Vec::new();
    // an example is its command with the lines that say what it does
    for line in text.lines().take_while(|line| !line.is_empty()) {
        // a blank line before them, and the last line
        if used + shown.len() + 3 > LINES {
            let last = shown.iter().rposition(|l| !l.starts_with("   "));
            shown.truncate(last.unwrap_or(0));
            break;
        }
        shown.push(line);
    }
    if shown.len() < 2 {
        shown.clear();
    }
    shown.push(&end);
    let end = shown.join("\n");
    command = command.after_help(end);
    command
}

/// Option with only the first clause of its text, without a long list of values.
fn brief(arg: Arg) -> Arg {
    let Some(text) = arg.get_help().map(ToString::to_string) else {
        return arg;
    };
    let ends = [
        "; ",
        ": ",
        ". ",
        " [",
        ", such as",
        ", with",
        ", and",
        "; without",
    ];
    let end = ends.iter().filter_map(|end| text.find(end)).min();
    let short = text.get(..end.unwrap_or(text.len())).unwrap_or(&text);
    let many = arg.get_possible_values().len() > 3 && !arg.is_positional();
    arg.help(short.to_owned()).hide_possible_values(many)
}
