//! Expressions of columns: `torque_nm * engine_rpm * 0.104720`, `engine_rpm / turbine_rpm < 1.1`.
//!
//! Numbers, names of columns (in backquotes where they are more than letters, digits, `_`, `.`, `:` and `/` at the
//! front: `` `Acc X [g]` ``), `+ - * /`, brackets, comparisons, `&&`, `||`, `!`, and `abs`, `sqrt`, `min`, `max`. A
//! comparison is 1 or 0; whatever is not a number makes all that is computed from it not a number.

/// A parsed expression over columns by index.
#[derive(Clone, Debug)]
pub(crate) struct Expression {
    /// The text that was parsed.
    pub text: String,
    /// The columns it names, each once, in the order in which they appear.
    pub columns: Vec<String>,
    root: Node,
}

#[derive(Clone, Debug)]
enum Node {
    Number(f64),
    Column(usize),
    Unary(Unary, Box<Node>),
    Binary(Binary, Box<Node>, Box<Node>),
}

type Unary = fn(f64) -> f64;
/// Of two numbers: where one is not a number, no operator is asked.
type Binary = fn(f64, f64) -> f64;

/// Operators before a value.
const SIGNS: [(&str, Unary); 2] = [("-", |a| -a), ("!", |a| truth(a == 0.0))];

/// Operators between two values, and how strongly they bind.
const OPERATORS: [(&str, u8, Binary); 12] = [
    ("||", 0, |a, b| truth(a != 0.0 || b != 0.0)),
    ("&&", 1, |a, b| truth(a != 0.0 && b != 0.0)),
    ("<=", 2, |a, b| truth(a <= b)),
    (">=", 2, |a, b| truth(a >= b)),
    ("==", 2, |a, b| truth(a == b)),
    ("!=", 2, |a, b| truth(a != b)),
    ("<", 2, |a, b| truth(a < b)),
    (">", 2, |a, b| truth(a > b)),
    ("+", 3, |a, b| a + b),
    ("-", 3, |a, b| a - b),
    ("*", 4, |a, b| a * b),
    ("/", 4, |a, b| a / b),
];

/// Functions of one value and of two.
const OF_ONE: [(&str, Unary); 2] = [("abs", f64::abs), ("sqrt", f64::sqrt)];
const OF_TWO: [(&str, Binary); 2] = [("min", f64::min), ("max", f64::max)];

/// All marks; of those that begin alike the longer one first.
const MARKS: [&str; 16] = [
    "<=", ">=", "==", "!=", "&&", "||", "<", ">", "+", "-", "*", "/", "(", ")", ",", "!",
];

/// Deepest nesting.
const MAX_DEPTH: usize = 64;
/// Longest text.
const MAX_LENGTH: usize = 4096;

fn truth(holds: bool) -> f64 {
    f64::from(u8::from(holds))
}

impl Expression {
    /// Parses a text; an error names the mistake and its character, from 1.
    pub fn parse(text: &str) -> Result<Self, String> {
        if text.len() > MAX_LENGTH {
            return Err(format!(
                "this expression is longer than {MAX_LENGTH} characters"
            ));
        }
        let tokens = tokens(text)?;
        let mut parser = Parser {
            tokens: &tokens,
            at: 0,
            columns: Vec::new(),
            end: text.chars().count() + 1,
        };
        let root = parser.terms(0, 0)?;
        match parser.tokens.get(parser.at) {
            None => Ok(Self {
                text: text.to_owned(),
                columns: parser.columns,
                root,
            }),
            Some((at, token)) => Err(format!(
                "{token:?} at character {at} is not expected; an operator is missing before it"
            )),
        }
    }

    /// A column by itself.
    pub fn column(name: &str) -> Self {
        Self {
            text: name.to_owned(),
            columns: vec![name.to_owned()],
            root: Node::Column(0),
        }
    }

    /// A number by itself.
    pub fn constant(x: f64) -> Self {
        Self {
            text: format!("{x}"),
            columns: Vec::new(),
            root: Node::Number(x),
        }
    }

    /// True if it is a column by itself.
    pub fn is_column(&self) -> bool {
        matches!(self.root, Node::Column(0))
    }

    /// Its value, given those of [`Expression::columns`].
    pub fn value(&self, columns: &[f64]) -> f64 {
        self.root.value(columns)
    }

    /// True if its value is a number that is not zero.
    pub fn holds(&self, columns: &[f64]) -> bool {
        let x = self.value(columns);
        !x.is_nan() && x != 0.0
    }
}

impl Node {
    fn value(&self, columns: &[f64]) -> f64 {
        match self {
            Self::Number(x) => *x,
            Self::Column(i) => columns.get(*i).copied().unwrap_or(f64::NAN),
            Self::Unary(operator, a) => match a.value(columns) {
                a if a.is_nan() => f64::NAN,
                a => operator(a),
            },
            Self::Binary(operator, a, b) => match (a.value(columns), b.value(columns)) {
                (a, b) if a.is_nan() || b.is_nan() => f64::NAN,
                (a, b) => operator(a, b),
            },
        }
    }
}

#[derive(Clone, PartialEq)]
enum Token {
    Number(f64),
    Name(String),
    Mark(&'static str),
}

impl std::fmt::Debug for Token {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(x) => write!(f, "`{x}`"),
            Self::Name(name) => write!(f, "`{name}`"),
            Self::Mark(mark) => write!(f, "`{mark}`"),
        }
    }
}

/// The tokens of a text, each with its character, from 1.
fn tokens(text: &str) -> Result<Vec<(usize, Token)>, String> {
    let chars: Vec<char> = text.chars().collect();
    let (mut all, mut i) = (Vec::new(), 0);
    // `/` begins a name (a topic) only where a value is expected
    let mut value_expected = true;
    while let Some(&c) = chars.get(i) {
        let at = i + 1;
        let word = |from: usize, ok: &dyn Fn(char) -> bool| -> String {
            chars.iter().skip(from).take_while(|c| ok(**c)).collect()
        };
        let topic = c == '/' && value_expected;
        let (token, length) = if c.is_whitespace() {
            i += 1;
            continue;
        } else if c == '`' {
            let name = word(i + 1, &|c| c != '`');
            let length = name.chars().count() + 2;
            if i + length > chars.len() || name.is_empty() {
                return Err(format!(
                    "the name in backquotes at character {at} has no end, or is empty"
                ));
            }
            (Token::Name(name), length)
        } else if c.is_ascii_digit() || c == '.' {
            let number = number(&chars, i);
            let x = number.parse::<f64>();
            let x = x.map_err(|_| format!("`{number}` at character {at} is not a number"))?;
            (Token::Number(x), number.len())
        } else if c.is_alphabetic() || c == '_' || topic {
            let name = word(i, &|c| {
                c.is_alphanumeric() || "_.:".contains(c) || (topic && c == '/')
            });
            let length = name.chars().count();
            (Token::Name(name), length)
        } else {
            let rest: String = chars.iter().skip(i).take(2).collect();
            let Some(mark) = MARKS.into_iter().find(|m| rest.starts_with(m)) else {
                return Err(format!(
                    "`{c}` at character {at} has no meaning here; write names with such characters in backquotes"
                ));
            };
            (Token::Mark(mark), mark.len())
        };
        i += length;
        value_expected = matches!(token, Token::Mark(mark) if mark != ")");
        all.push((at, token));
    }
    Ok(all)
}

/// The digits, points and exponent from a character on.
fn number(chars: &[char], from: usize) -> String {
    let word = |from: usize, ok: fn(char) -> bool| -> String {
        chars.iter().skip(from).take_while(|c| ok(**c)).collect()
    };
    let mut number = word(from, |c| c.is_ascii_digit() || c == '.');
    let after = from + number.len();
    if matches!(chars.get(after), Some('e' | 'E')) {
        let sign = usize::from(matches!(chars.get(after + 1), Some('+' | '-')));
        let digits = word(after + 1 + sign, |c| c.is_ascii_digit());
        if !digits.is_empty() {
            number.extend(chars.iter().skip(after).take(1 + sign));
            number += &digits;
        }
    }
    number
}

struct Parser<'a> {
    tokens: &'a [(usize, Token)],
    at: usize,
    columns: Vec<String>,
    end: usize,
}

impl Parser<'_> {
    /// Takes the next token if it is a mark of this table.
    fn take<'t, T>(
        &mut self,
        table: &'t [T],
        mark_of: impl Fn(&T) -> &'static str,
    ) -> Option<&'t T> {
        let Some((_, Token::Mark(next))) = self.tokens.get(self.at) else {
            return None;
        };
        let found = table.iter().find(|entry| mark_of(entry) == *next)?;
        self.at += 1;
        Some(found)
    }

    fn mark(&mut self, mark: &'static str) -> bool {
        self.take(&[mark], |m| *m).is_some()
    }

    /// Values with operators between them that bind at least so strongly.
    fn terms(&mut self, least: u8, depth: usize) -> Result<Node, String> {
        let mut left = self.value(depth)?;
        loop {
            let is_here = |o: &(&'static str, u8, Binary)| if o.1 >= least { o.0 } else { "" };
            let Some(&(_, strength, operator)) = self.take(&OPERATORS, is_here) else {
                return Ok(left);
            };
            let right = self.terms(strength + 1, depth)?;
            left = Node::Binary(operator, Box::new(left), Box::new(right));
        }
    }

    fn value(&mut self, depth: usize) -> Result<Node, String> {
        if depth > MAX_DEPTH {
            return Err(format!(
                "brackets or signs are nested more than {MAX_DEPTH} deep"
            ));
        }
        if let Some((_, operator)) = self.take(&SIGNS, |s| s.0) {
            return Ok(Node::Unary(*operator, Box::new(self.value(depth + 1)?)));
        }
        if self.mark("(") {
            let inner = self.terms(0, depth + 1)?;
            return self.closed(inner);
        }
        let Some((at, token)) = self.tokens.get(self.at).cloned() else {
            return Err(format!("a value is missing at character {}", self.end));
        };
        self.at += 1;
        match token {
            Token::Number(x) => Ok(Node::Number(x)),
            Token::Name(name) if self.mark("(") => self.call(&name, at, depth),
            Token::Name(name) => {
                let known = self.columns.iter().position(|c| *c == name);
                let index = known.unwrap_or_else(|| {
                    self.columns.push(name);
                    self.columns.len() - 1
                });
                Ok(Node::Column(index))
            }
            Token::Mark(mark) => Err(format!(
                "`{mark}` at character {at} is in the place of a value"
            )),
        }
    }

    fn call(&mut self, name: &str, at: usize, depth: usize) -> Result<Node, String> {
        let first = Box::new(self.terms(0, depth + 1)?);
        if let Some((_, function)) = OF_ONE.iter().find(|f| f.0 == name) {
            return self.closed(Node::Unary(*function, first));
        }
        let Some((_, function)) = OF_TWO.iter().find(|f| f.0 == name) else {
            return Err(format!(
                "the function `{name}` (character {at}) is unknown; known are abs, sqrt, min, max"
            ));
        };
        if !self.mark(",") {
            return Err(format!(
                "`{name}` at character {at} needs two values with a comma between them"
            ));
        }
        let second = Box::new(self.terms(0, depth + 1)?);
        self.closed(Node::Binary(*function, first, second))
    }

    fn closed(&mut self, inner: Node) -> Result<Node, String> {
        match self.mark(")") {
            true => Ok(inner),
            false => Err(format!(
                "a `)` is missing at character {}",
                self.tokens.get(self.at).map_or(self.end, |t| t.0)
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str, columns: &[(&str, f64)]) -> f64 {
        let e = Expression::parse(text).unwrap();
        let row: Vec<f64> = e
            .columns
            .iter()
            .map(|c| columns.iter().find(|(n, _)| n == c).unwrap().1)
            .collect();
        e.value(&row)
    }

    #[test]
    fn they_compute_what_arithmetic_says() {
        let c = [
            ("a", 6.0),
            ("b", 2.0),
            ("/imu.acc.x", 3.0),
            ("Acc X [g]", 0.5),
        ];
        for (text, expected) in [
            ("1+2*3", 7.0),
            ("(1+2)*3", 9.0),
            ("a/b/b", 1.5),
            ("a-b-1", 3.0),
            ("-a*b", -12.0),
            ("2--1", 3.0),
            ("a/b < 3.1 && !(a == b)", 1.0),
            ("a < b || b < 1", 0.0),
            ("max(abs(-a), b) + min(a, b)", 8.0),
            ("sqrt(a*a)", 6.0),
            ("/imu.acc.x * 2", 6.0),
            ("a//imu.acc.x", 2.0),
            ("`Acc X [g]` * 2", 1.0),
            ("1.5e1 + 2e-1", 15.2),
        ] {
            assert_eq!(value(text, &c), expected, "{text}");
        }
    }

    #[test]
    fn what_is_not_known_makes_nothing_true() {
        let e = Expression::parse("a / b < 1.1 || 1").unwrap();
        assert!(!e.holds(&[f64::NAN, 1.0]));
        assert!(
            Expression::parse("!(a < 1)")
                .unwrap()
                .value(&[f64::NAN])
                .is_nan()
        );
    }

    #[test]
    fn mistakes_are_told_with_their_place() {
        for (text, word) in [
            ("a +", "character 4"),
            ("(a", "`)` is missing"),
            ("a b", "operator is missing"),
            ("a % b", "`%` at character 3"),
            ("sin(a)", "the function `sin`"),
            ("min(a)", "two values"),
            ("`a", "no end"),
            ("1.2.3", "is not a number"),
            ("", "a value is missing"),
        ] {
            let told = Expression::parse(text).unwrap_err();
            assert!(told.contains(word), "{text}: {told}");
        }
        for many in [
            "(".repeat(1000),
            "-".repeat(1000),
            "!".repeat(1000),
            "a+".repeat(5000),
        ] {
            assert!(Expression::parse(&many).is_err());
        }
    }
}
