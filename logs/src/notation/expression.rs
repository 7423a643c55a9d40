//! Expressions of columns: `torque_nm * engine_rpm * 0.104720`, `engine_rpm / turbine_rpm < 1.1`.
//!
//! Numbers, names of columns (in backquotes where they are more than letters, digits, `_`, `.` and `/` at the front: `` `Acc X [g]` ``),
//! `+ - * /`, brackets, comparisons, `&&`, `||`, `!`, and `abs`, `sqrt`, `min`, `max`. A comparison is 1 or 0; whatever is not a number makes
//! all that is computed from it not a number.

/// A parsed expression over columns by index.
#[derive(Clone, Debug, PartialEq)]
pub struct Expression {
    /// What it was parsed from.
    pub text: String,
    /// The columns it names, each once, in the order in which they appear.
    pub columns: Vec<String>,
    root: Node,
}

#[derive(Clone, Debug, PartialEq)]
enum Node {
    Number(f64),
    Column(usize),
    Unary(Unary, Box<Node>),
    Binary(Binary, Box<Node>, Box<Node>),
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Unary {
    Minus,
    Not,
    Abs,
    Sqrt,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
    Equal,
    NotEqual,
    And,
    Or,
    Min,
    Max,
}

/// Deepest nesting.
const MAX_DEPTH: usize = 64;
/// Longest text.
const MAX_LENGTH: usize = 4096;

impl Expression {
    /// Parses; an error says what is wrong and at which character, from 1.
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
        let root = parser.or(0)?;
        match parser.tokens.get(parser.at) {
            None => Ok(Self {
                text: text.to_owned(),
                columns: parser.columns,
                root,
            }),
            Some((at, token)) => Err(format!(
                "{token:?} at character {at} is too much; an operator is missing before it"
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

    /// Whether it is a column by itself.
    pub fn is_column(&self) -> bool {
        self.root == Node::Column(0)
    }

    /// Its value, given those of [`Expression::columns`].
    pub fn value(&self, columns: &[f64]) -> f64 {
        evaluate(&self.root, columns)
    }

    /// Whether it is true: a number that is not zero.
    pub fn holds(&self, columns: &[f64]) -> bool {
        let x = self.value(columns);
        !x.is_nan() && x != 0.0
    }
}

fn evaluate(node: &Node, columns: &[f64]) -> f64 {
    match node {
        Node::Number(x) => *x,
        Node::Column(i) => columns.get(*i).copied().unwrap_or(f64::NAN),
        Node::Unary(op, a) => {
            let a = evaluate(a, columns);
            match op {
                Unary::Minus => -a,
                Unary::Abs => a.abs(),
                Unary::Sqrt => a.sqrt(),
                Unary::Not => truth(a, 0.0, a == 0.0),
            }
        }
        Node::Binary(op, a, b) => {
            let (a, b) = (evaluate(a, columns), evaluate(b, columns));
            match op {
                Binary::Add => a + b,
                Binary::Subtract => a - b,
                Binary::Multiply => a * b,
                Binary::Divide => a / b,
                Binary::Less => truth(a, b, a < b),
                Binary::LessOrEqual => truth(a, b, a <= b),
                Binary::Greater => truth(a, b, a > b),
                Binary::GreaterOrEqual => truth(a, b, a >= b),
                Binary::Equal => truth(a, b, a == b),
                Binary::NotEqual => truth(a, b, a != b),
                Binary::And => truth(a, b, a != 0.0 && b != 0.0),
                Binary::Or => truth(a, b, a != 0.0 || b != 0.0),
                Binary::Min => either(a, b, a.min(b)),
                Binary::Max => either(a, b, a.max(b)),
            }
        }
    }
}

/// 1 or 0, or not a number if one of the two is not.
fn truth(a: f64, b: f64, holds: bool) -> f64 {
    either(a, b, if holds { 1.0 } else { 0.0 })
}

fn either(a: f64, b: f64, x: f64) -> f64 {
    if a.is_nan() || b.is_nan() {
        f64::NAN
    } else {
        x
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

const MARKS: &[&str] = &[
    "<=", ">=", "==", "!=", "&&", "||", "<", ">", "+", "-", "*", "/", "(", ")", ",", "!",
];

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
        if c.is_whitespace() {
            i += 1;
            continue;
        }
        if c == '`' {
            let name = word(i + 1, &|c| c != '`');
            i += name.chars().count() + 2;
            if i > chars.len() || name.is_empty() {
                return Err(format!(
                    "the name in backquotes at character {at} has no end, or is empty"
                ));
            }
            all.push((at, Token::Name(name)));
            value_expected = false;
            continue;
        }
        if c.is_ascii_digit() || c == '.' {
            let mut number = word(i, &|c| c.is_ascii_digit() || c == '.');
            let after = i + number.len();
            if matches!(chars.get(after), Some('e' | 'E')) {
                let sign = usize::from(matches!(chars.get(after + 1), Some('+' | '-')));
                let digits = word(after + 1 + sign, &|c| c.is_ascii_digit());
                if !digits.is_empty() {
                    number.extend(chars.iter().skip(after).take(1 + sign));
                    number += &digits;
                }
            }
            let x = number
                .parse::<f64>()
                .map_err(|_| format!("`{number}` at character {at} is no number"))?;
            i += number.len();
            all.push((at, Token::Number(x)));
            value_expected = false;
            continue;
        }
        let topic = c == '/' && value_expected;
        if c.is_alphabetic() || c == '_' || topic {
            let name = word(i, &|c| {
                c.is_alphanumeric() || c == '_' || c == '.' || (topic && c == '/')
            });
            i += name.chars().count();
            all.push((at, Token::Name(name)));
            value_expected = false;
            continue;
        }
        let rest: String = chars.iter().skip(i).take(2).collect();
        let Some(mark) = MARKS.iter().find(|m| rest.starts_with(**m)) else {
            return Err(format!(
                "`{c}` at character {at} means nothing here; names with such characters go into backquotes"
            ));
        };
        i += mark.len();
        all.push((at, Token::Mark(mark)));
        value_expected = *mark != ")";
    }
    Ok(all)
}

struct Parser<'a> {
    tokens: &'a [(usize, Token)],
    at: usize,
    columns: Vec<String>,
    end: usize,
}

impl Parser<'_> {
    fn mark(&mut self, marks: &[&'static str]) -> Option<&'static str> {
        match self.tokens.get(self.at) {
            Some((_, Token::Mark(m))) if marks.contains(m) => {
                self.at += 1;
                Some(m)
            }
            _ => None,
        }
    }

    fn levels(
        &mut self,
        depth: usize,
        ops: &[(&'static str, Binary)],
        next: fn(&mut Self, usize) -> Result<Node, String>,
    ) -> Result<Node, String> {
        let mut left = next(self, depth)?;
        let marks: Vec<&'static str> = ops.iter().map(|o| o.0).collect();
        let mut height = 0;
        while let Some(mark) = self.mark(&marks) {
            height += 1;
            if height > MAX_LENGTH / 8 {
                return Err("this expression has too many terms".into());
            }
            let right = next(self, depth)?;
            let op = ops
                .iter()
                .find(|o| o.0 == mark)
                .map_or(Binary::Add, |o| o.1);
            left = Node::Binary(op, Box::new(left), Box::new(right));
        }
        Ok(left)
    }

    fn or(&mut self, depth: usize) -> Result<Node, String> {
        if depth > MAX_DEPTH {
            return Err(format!("brackets are nested more than {MAX_DEPTH} deep"));
        }
        self.levels(depth, &[("||", Binary::Or)], Self::and)
    }

    fn and(&mut self, depth: usize) -> Result<Node, String> {
        self.levels(depth, &[("&&", Binary::And)], Self::comparison)
    }

    fn comparison(&mut self, depth: usize) -> Result<Node, String> {
        let ops = [
            ("<=", Binary::LessOrEqual),
            (">=", Binary::GreaterOrEqual),
            ("==", Binary::Equal),
            ("!=", Binary::NotEqual),
            ("<", Binary::Less),
            (">", Binary::Greater),
        ];
        self.levels(depth, &ops, Self::sum)
    }

    fn sum(&mut self, depth: usize) -> Result<Node, String> {
        self.levels(
            depth,
            &[("+", Binary::Add), ("-", Binary::Subtract)],
            Self::product,
        )
    }

    fn product(&mut self, depth: usize) -> Result<Node, String> {
        self.levels(
            depth,
            &[("*", Binary::Multiply), ("/", Binary::Divide)],
            Self::value,
        )
    }

    fn value(&mut self, depth: usize) -> Result<Node, String> {
        if depth > MAX_DEPTH {
            return Err(format!("signs are nested more than {MAX_DEPTH} deep"));
        }
        for (mark, op) in [("-", Unary::Minus), ("!", Unary::Not)] {
            if self.mark(&[mark]).is_some() {
                return Ok(Node::Unary(op, Box::new(self.value(depth + 1)?)));
            }
        }
        if self.mark(&["("]).is_some() {
            let inner = self.or(depth + 1)?;
            return self.closed(inner);
        }
        let Some((at, token)) = self.tokens.get(self.at).cloned() else {
            return Err(format!("a value is missing at character {}", self.end));
        };
        self.at += 1;
        match token {
            Token::Number(x) => Ok(Node::Number(x)),
            Token::Name(name) if self.mark(&["("]).is_some() => self.call(&name, at, depth),
            Token::Name(name) => {
                let known = self.columns.iter().position(|c| *c == name);
                let index = known.unwrap_or_else(|| {
                    self.columns.push(name);
                    self.columns.len() - 1
                });
                Ok(Node::Column(index))
            }
            Token::Mark(mark) => Err(format!(
                "`{mark}` at character {at} stands where a value is expected"
            )),
        }
    }

    fn call(&mut self, name: &str, at: usize, depth: usize) -> Result<Node, String> {
        let first = self.or(depth + 1)?;
        let one = match name {
            "abs" => Some(Unary::Abs),
            "sqrt" => Some(Unary::Sqrt),
            _ => None,
        };
        if let Some(op) = one {
            return self.closed(Node::Unary(op, Box::new(first)));
        }
        let two = match name {
            "min" => Binary::Min,
            "max" => Binary::Max,
            _ => {
                return Err(format!(
                    "there is no function `{name}` (character {at}); there are abs, sqrt, min, max"
                ));
            }
        };
        if self.mark(&[","]).is_none() {
            return Err(format!(
                "`{name}` at character {at} takes two values with a comma between them"
            ));
        }
        let second = self.or(depth + 1)?;
        self.closed(Node::Binary(two, Box::new(first), Box::new(second)))
    }

    fn closed(&mut self, inner: Node) -> Result<Node, String> {
        match self.mark(&[")"]) {
            Some(_) => Ok(inner),
            None => Err(format!(
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
            ("sin(a)", "no function `sin`"),
            ("min(a)", "two values"),
            ("`a", "no end"),
            ("1.2.3", "no number"),
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
