//! Expressions within `${..}`: the part of Python's that robot files use, read into a tree.

use super::value::Value;

/// Deepest nesting of an expression.
const MAX_DEPTH: usize = 48;
/// Longest expression, bytes.
const MAX_LENGTH: usize = 1 << 16;
/// Most operators of an expression: each is a level of the tree, which is walked by recursion.
const MAX_OPERATORS: usize = 200;

/// An operator between two values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Operator {
    Add,
    Subtract,
    Multiply,
    Divide,
    FloorDivide,
    Remainder,
    Power,
}

/// A comparison of two values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Comparison {
    Equal,
    Unequal,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
    In,
    NotIn,
    Is,
    IsNot,
}

/// An expression.
#[derive(Clone, Debug)]
pub(super) enum Expression {
    Constant(Value),
    Name(String),
    List(Vec<Expression>),
    /// `each for names in list if condition`
    Comprehension {
        each: Box<Expression>,
        names: Vec<String>,
        list: Box<Expression>,
        condition: Option<Box<Expression>>,
    },
    Negative(Box<Expression>),
    Positive(Box<Expression>),
    Not(Box<Expression>),
    Binary(Operator, Box<Expression>, Box<Expression>),
    And(Box<Expression>, Box<Expression>),
    Or(Box<Expression>, Box<Expression>),
    /// `first < second <= third`
    Compared(Box<Expression>, Vec<(Comparison, Expression)>),
    /// `value if condition else other`
    Choice {
        condition: Box<Expression>,
        value: Box<Expression>,
        other: Box<Expression>,
    },
    Call(Box<Expression>, Vec<Expression>, Vec<(String, Expression)>),
    Index(Box<Expression>, Box<Expression>),
    /// `list[start:end]`
    Slice(Box<Expression>, Option<Box<Expression>>, Option<Box<Expression>>),
    Attribute(Box<Expression>, String),
}

/// Reads an expression.
///
/// # Errors
/// What was expected and found, in words.
pub(super) fn parse(text: &str) -> Result<Expression, String> {
    if text.len() > MAX_LENGTH {
        return Err(format!("expected at most {MAX_LENGTH} bytes"));
    }
    let mut parser = Parser { tokens: tokens(text)?, at: 0, depth: 0, operators: 0 };
    let first = parser.choice()?;
    // `a, b` is a tuple.
    let expression = match parser.takes(",") {
        false => first,
        true => {
            let mut entries = vec![first];
            entries.extend(parser.entries("")?);
            Expression::List(entries)
        }
    };
    match parser.tokens.get(parser.at) {
        None => Ok(expression),
        Some(token) => Err(format!("expected the end of the expression, found `{}`", token.shown())),
    }
}

#[derive(Clone, Debug)]
enum Token {
    Constant(Value),
    Name(String),
    Sign(&'static str),
}

impl Token {
    fn shown(&self) -> String {
        match self {
            Token::Constant(value) => value.to_string(),
            Token::Name(name) => name.clone(),
            Token::Sign(sign) => (*sign).to_owned(),
        }
    }
}

/// Signs, longer ones first. A brace cannot stand in `${..}`, which ends at the first one.
const SIGNS: [&str; 21] = [
    "**", "//", "==", "!=", "<=", ">=", "(", ")", "[", "]", ",", ":", ".", "+", "-", "*", "/", "%", "<", ">",
    "=",
];

fn tokens(text: &str) -> Result<Vec<Token>, String> {
    let mut tokens = Vec::new();
    let mut rest = text.trim_start();
    while let Some(first) = rest.chars().next() {
        let behind;
        let second = rest[first.len_utf8()..].chars().next();
        if first.is_ascii_digit() || first == '.' && second.is_some_and(|c| c.is_ascii_digit()) {
            let (number, left) = number(rest)?;
            tokens.push(Token::Constant(number));
            behind = left;
        } else if first == '\'' || first == '"' {
            let (text, left) = quoted(rest, first)?;
            behind = left;
            // Texts side by side are one.
            match tokens.last_mut() {
                Some(Token::Constant(Value::Text(before))) => {
                    *before = format!("{before}{text}").into();
                }
                _ => tokens.push(Token::Constant(Value::text(text))),
            }
        } else if first.is_alphabetic() || first == '_' {
            let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
            if rest[end..].starts_with(['\'', '"']) {
                return Err(format!("expected a text in plain quotes, found one marked `{}`", &rest[..end]));
            }
            tokens.push(Token::Name(rest[..end].to_owned()));
            behind = &rest[end..];
        } else {
            let sign = SIGNS.into_iter().find(|sign| rest.starts_with(sign));
            let sign = sign.ok_or_else(|| format!("expected a value or an operator, found `{first}`"))?;
            tokens.push(Token::Sign(sign));
            behind = &rest[sign.len()..];
        }
        rest = behind.trim_start();
    }
    Ok(tokens)
}

fn number(text: &str) -> Result<(Value, &str), String> {
    let end = text.find(|c: char| !(c.is_ascii_alphanumeric() || c == '.' || c == '_')).unwrap_or(text.len());
    // The sign of an exponent belongs to the number.
    let has_sign =
        text[..end].ends_with(['e', 'E']) && !text.starts_with("0x") && text[end..].starts_with(['+', '-']);
    let end = match has_sign {
        true => {
            let digits = text[end + 1..].find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len() - end - 1);
            end + 1 + digits
        }
        false => end,
    };
    let (own, rest) = text.split_at(end);
    let plain = own.replace('_', "");
    let hexadecimal = plain.strip_prefix("0x").map(|digits| i64::from_str_radix(digits, 16));
    let value = match hexadecimal {
        Some(Ok(number)) => Value::Int(number),
        Some(Err(_)) => return Err(format!("expected a number, found `{own}`")),
        None => match (plain.parse::<i64>(), plain.parse::<f64>()) {
            (Ok(number), _) => Value::Int(number),
            (_, Ok(number)) => Value::Float(number),
            _ => return Err(format!("expected a number, found `{own}`")),
        },
    };
    Ok((value, rest))
}

fn quoted(text: &str, quote: char) -> Result<(String, &str), String> {
    let mut own = String::new();
    let mut characters = text.char_indices().skip(1);
    while let Some((at, c)) = characters.next() {
        match c {
            _ if c == quote => return Ok((own, &text[at + 1..])),
            '\\' => match characters.next() {
                Some((_, 'n')) => own.push('\n'),
                Some((_, 't')) => own.push('\t'),
                Some((_, c @ ('\\' | '\'' | '"'))) => own.push(c),
                Some((_, c)) => own.extend(['\\', c]),
                None => break,
            },
            _ => own.push(c),
        }
    }
    Err(format!("expected a closing {quote}"))
}

/// Arguments of a call: by their places, then by their names.
type Arguments = (Vec<Expression>, Vec<(String, Expression)>);

struct Parser {
    tokens: Vec<Token>,
    at: usize,
    depth: usize,
    operators: usize,
}

impl Parser {
    fn is_at(&self, word: &str) -> bool {
        self.is_at_place(self.at, word)
    }

    fn is_at_place(&self, at: usize, word: &str) -> bool {
        match self.tokens.get(at) {
            Some(Token::Sign(sign)) => *sign == word,
            Some(Token::Name(name)) => name == word,
            _ => false,
        }
    }

    /// Steps over a sign or word if it is next.
    fn takes(&mut self, word: &str) -> bool {
        let is_next = self.is_at(word);
        self.at += usize::from(is_next);
        is_next
    }

    fn expects(&mut self, word: &str) -> Result<(), String> {
        match self.takes(word) {
            true => Ok(()),
            false => Err(format!("expected `{word}`, found {}", self.found())),
        }
    }

    fn found(&self) -> String {
        self.tokens.get(self.at).map_or("the end".to_owned(), |token| format!("`{}`", token.shown()))
    }

    /// Counts an operator.
    fn operator(&mut self) -> Result<(), String> {
        self.operators += 1;
        match self.operators > MAX_OPERATORS {
            true => Err(format!("expected at most {MAX_OPERATORS} operators")),
            false => Ok(()),
        }
    }

    fn deeper<T>(&mut self, of: impl FnOnce(&mut Self) -> Result<T, String>) -> Result<T, String> {
        if self.depth >= MAX_DEPTH {
            return Err(format!("expected at most {MAX_DEPTH} levels of nesting"));
        }
        self.depth += 1;
        let parsed = of(self);
        self.depth -= 1;
        parsed
    }

    /// `value if condition else other`
    fn choice(&mut self) -> Result<Expression, String> {
        self.deeper(|parser| {
            if parser.is_at("lambda") {
                return Err("expected a value, found `lambda`, which is not read".to_owned());
            }
            let value = parser.or()?;
            if !parser.takes("if") {
                return Ok(value);
            }
            let condition = parser.or()?;
            parser.expects("else")?;
            let other = parser.choice()?;
            Ok(Expression::Choice { condition: condition.into(), value: value.into(), other: other.into() })
        })
    }

    fn or(&mut self) -> Result<Expression, String> {
        let mut left = self.and()?;
        while self.takes("or") {
            self.operator()?;
            left = Expression::Or(left.into(), self.and()?.into());
        }
        Ok(left)
    }

    fn and(&mut self) -> Result<Expression, String> {
        let mut left = self.not()?;
        while self.takes("and") {
            self.operator()?;
            left = Expression::And(left.into(), self.not()?.into());
        }
        Ok(left)
    }

    fn not(&mut self) -> Result<Expression, String> {
        match self.takes("not") {
            true => self.deeper(|parser| Ok(Expression::Not(parser.not()?.into()))),
            false => self.comparison(),
        }
    }

    fn comparison(&mut self) -> Result<Expression, String> {
        let first = self.sum()?;
        let mut others = Vec::new();
        while let Some(comparison) = self.comparison_sign() {
            others.push((comparison, self.sum()?));
        }
        Ok(if others.is_empty() { first } else { Expression::Compared(first.into(), others) })
    }

    fn comparison_sign(&mut self) -> Option<Comparison> {
        let (comparison, tokens) = if self.is_at("not") && self.is_at_place(self.at + 1, "in") {
            (Comparison::NotIn, 2)
        } else if self.is_at("is") && self.is_at_place(self.at + 1, "not") {
            (Comparison::IsNot, 2)
        } else {
            let all = [
                ("==", Comparison::Equal),
                ("!=", Comparison::Unequal),
                ("<=", Comparison::LessOrEqual),
                (">=", Comparison::GreaterOrEqual),
                ("<", Comparison::Less),
                (">", Comparison::Greater),
                ("in", Comparison::In),
                ("is", Comparison::Is),
            ];
            (all.into_iter().find(|(sign, _)| self.is_at(sign))?.1, 1)
        };
        self.at += tokens;
        Some(comparison)
    }

    fn sum(&mut self) -> Result<Expression, String> {
        let mut left = self.product()?;
        loop {
            let operator = match () {
                () if self.takes("+") => Operator::Add,
                () if self.takes("-") => Operator::Subtract,
                () => return Ok(left),
            };
            self.operator()?;
            left = Expression::Binary(operator, left.into(), self.product()?.into());
        }
    }

    fn product(&mut self) -> Result<Expression, String> {
        let mut left = self.signed()?;
        loop {
            let operator = match () {
                () if self.takes("*") => Operator::Multiply,
                () if self.takes("/") => Operator::Divide,
                () if self.takes("//") => Operator::FloorDivide,
                () if self.takes("%") => Operator::Remainder,
                () => return Ok(left),
            };
            self.operator()?;
            left = Expression::Binary(operator, left.into(), self.signed()?.into());
        }
    }

    fn signed(&mut self) -> Result<Expression, String> {
        if self.takes("-") {
            return self.deeper(|parser| Ok(Expression::Negative(parser.signed()?.into())));
        }
        if self.takes("+") {
            return self.deeper(|parser| Ok(Expression::Positive(parser.signed()?.into())));
        }
        let base = self.postfix()?;
        // A power binds closer than a sign before it, and less than one behind it.
        match self.takes("**") {
            true => {
                let exponent = self.deeper(Self::signed)?;
                Ok(Expression::Binary(Operator::Power, base.into(), exponent.into()))
            }
            false => Ok(base),
        }
    }

    fn postfix(&mut self) -> Result<Expression, String> {
        let mut value = self.atom()?;
        let mut steps = 0;
        loop {
            value = if self.takes("(") {
                let (values, named) = self.arguments()?;
                Expression::Call(value.into(), values, named)
            } else if self.takes("[") {
                self.index(value)?
            } else if self.takes(".") {
                match self.tokens.get(self.at) {
                    Some(Token::Name(name)) => {
                        let name = name.clone();
                        self.at += 1;
                        Expression::Attribute(value.into(), name)
                    }
                    _ => return Err(format!("expected a name behind `.`, found {}", self.found())),
                }
            } else {
                return Ok(value);
            };
            // Each step is a level of the tree.
            steps += 1;
            if steps > MAX_DEPTH {
                return Err(format!("expected at most {MAX_DEPTH} calls and indices of one value"));
            }
        }
    }

    fn arguments(&mut self) -> Result<Arguments, String> {
        let (mut values, mut named) = (Vec::new(), Vec::new());
        while !self.takes(")") {
            match self.tokens.get(self.at) {
                Some(Token::Name(name)) if self.is_at_place(self.at + 1, "=") => {
                    let name = name.clone();
                    self.at += 2;
                    named.push((name, self.choice()?));
                }
                _ => {
                    let value = self.choice()?;
                    values.push(if self.is_at("for") { self.comprehension(value)? } else { value });
                }
            }
            if !self.takes(",") {
                self.expects(")")?;
                break;
            }
        }
        Ok((values, named))
    }

    fn index(&mut self, value: Expression) -> Result<Expression, String> {
        let start = if self.is_at(":") { None } else { Some(Box::new(self.choice()?)) };
        if !self.takes(":") {
            self.expects("]")?;
            return match start {
                Some(index) => Ok(Expression::Index(value.into(), index)),
                None => Err("expected an index, found none".to_owned()),
            };
        }
        let end = if self.is_at("]") { None } else { Some(Box::new(self.choice()?)) };
        self.expects("]")?;
        Ok(Expression::Slice(value.into(), start, end))
    }

    /// Values separated by commas up to a closing sign, or to the end where there is none.
    fn entries(&mut self, closing: &str) -> Result<Vec<Expression>, String> {
        let mut entries = Vec::new();
        loop {
            let is_end = if closing.is_empty() { self.at == self.tokens.len() } else { self.takes(closing) };
            if is_end {
                return Ok(entries);
            }
            entries.push(self.choice()?);
            if !self.takes(",") {
                if !closing.is_empty() {
                    self.expects(closing)?;
                }
                return Ok(entries);
            }
        }
    }

    /// Behind the value of each entry.
    fn comprehension(&mut self, each: Expression) -> Result<Expression, String> {
        self.expects("for")?;
        let mut names = Vec::new();
        loop {
            match self.tokens.get(self.at) {
                Some(Token::Name(name)) => names.push(name.clone()),
                _ => return Err(format!("expected a name behind `for`, found {}", self.found())),
            }
            self.at += 1;
            if !self.takes(",") {
                break;
            }
        }
        self.expects("in")?;
        let list = self.or()?.into();
        let condition = if self.takes("if") { Some(Box::new(self.or()?)) } else { None };
        if self.is_at("for") || self.is_at("if") {
            return Err("expected one `for` with one `if`, found more".to_owned());
        }
        Ok(Expression::Comprehension { each: each.into(), names, list, condition })
    }

    fn atom(&mut self) -> Result<Expression, String> {
        let found = self.found();
        let token = self.tokens.get(self.at).cloned();
        self.at += 1;
        match token {
            Some(Token::Constant(value)) => Ok(Expression::Constant(value)),
            Some(Token::Name(name)) => match name.as_str() {
                "and" | "or" | "not" | "if" | "else" | "for" | "in" | "is" | "lambda" => {
                    Err(format!("expected a value, found `{name}`"))
                }
                _ => Ok(Expression::Name(name)),
            },
            Some(Token::Sign("(")) => self.bracketed(")"),
            Some(Token::Sign("[")) => self.bracketed("]"),
            _ => Err(format!("expected a value, found {found}")),
        }
    }

    /// A list, a tuple, or a value in brackets.
    fn bracketed(&mut self, closing: &str) -> Result<Expression, String> {
        if self.takes(closing) {
            return Ok(Expression::List(Vec::new()));
        }
        let first = self.choice()?;
        if self.is_at("for") {
            let all = self.comprehension(first)?;
            self.expects(closing)?;
            return Ok(all);
        }
        if !self.takes(",") {
            self.expects(closing)?;
            return Ok(if closing == ")" { first } else { Expression::List(vec![first]) });
        }
        let mut entries = vec![first];
        entries.extend(self.entries(closing)?);
        Ok(Expression::List(entries))
    }
}
