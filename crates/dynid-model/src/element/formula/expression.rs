//! Formulas of the motion of one joint: text to a program, run on any [`Scalar`].

use dynid_algebra::scalar::Scalar;

use crate::element::Velocity;

/// Longest formula, bytes.
const LONGEST: usize = 1000;
/// Most numbers that wait for their operation: what a formula is deep.
const DEEPEST: usize = 16;
/// Largest whole exponent that is a product.
const PRODUCT: f64 = 16.0;

/// Names that a formula gives a meaning to, which no parameter can have.
pub const RESERVED: [&str; 14] =
    ["v", "q", "T", "pi", "sign", "abs", "sqrt", "exp", "ln", "sin", "cos", "tanh", "atan", "logistic"];
/// How many of them are no functions.
const VALUES: usize = 4;

/// Why a formula cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{formula}`, character {place}: expected {expected}, found {found}")]
pub struct FormulaFault {
    /// The formula.
    pub formula: String,
    /// Where, characters from 1.
    pub place: usize,
    /// What was expected there.
    pub expected: String,
    /// What was found.
    pub found: String,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Step {
    Number(f64),
    /// `v`.
    Velocity,
    /// `q`.
    Position,
    /// `sign(v)`.
    Sign,
    /// `T`.
    Temperature,
    Shape(usize),
    Add,
    Subtract,
    Multiply,
    Divide,
    Negate,
    /// A whole power, as a product.
    Whole(i32),
    Power,
    Call(Function),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Function {
    Abs,
    Sqrt,
    Exp,
    Ln,
    Sin,
    Cos,
    Tanh,
    Atan,
    Logistic,
}

impl Function {
    fn named(name: &str) -> Option<Function> {
        Some(match name {
            "abs" => Function::Abs,
            "sqrt" => Function::Sqrt,
            "exp" => Function::Exp,
            "ln" => Function::Ln,
            "sin" => Function::Sin,
            "cos" => Function::Cos,
            "tanh" => Function::Tanh,
            "atan" => Function::Atan,
            "logistic" => Function::Logistic,
            _ => return None,
        })
    }

    #[inline(always)]
    fn of<S: Scalar>(self, values: &mut [S]) {
        match self {
            Function::Abs => each(values, S::magnitude),
            Function::Sqrt => each(values, S::root),
            Function::Exp => each(values, S::exponential),
            Function::Ln => each(values, S::logarithm),
            Function::Sin => each(values, |x| x.sin_cos().0),
            Function::Cos => each(values, |x| x.sin_cos().1),
            Function::Tanh => each(values, S::hyperbolic_tangent),
            Function::Atan => each(values, S::arctangent),
            Function::Logistic => each(values, S::logistic),
        }
    }
}

/// What a formula reads at one instant.
#[derive(Debug, Clone, Copy)]
pub(super) struct Instant<S> {
    pub(super) q: S,
    pub(super) v: Velocity<S>,
}

/// A formula in the velocity `v`, the position `q`, the temperature `T` and shape parameters.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Formula {
    steps: Vec<Step>,
}

impl Formula {
    /// Reads a formula; `shape`: symbols of the shape parameters.
    pub(super) fn parse(text: &str, shape: &[&str]) -> Result<Formula, FormulaFault> {
        let mut reader = Reader { text, at: 0, shape, steps: Vec::new(), depth: 0 };
        if text.len() > LONGEST {
            return Err(reader.fault(&format!("at most {LONGEST} characters")));
        }
        reader.sum(0)?;
        reader.space();
        match reader.rest().is_empty() {
            true => Ok(Formula { steps: reader.steps }),
            false => Err(reader.fault("an operator or the end")),
        }
    }

    /// Whether it reads the temperature.
    pub(super) fn is_thermal(&self) -> bool {
        self.steps.contains(&Step::Temperature)
    }

    /// Whether it reads the position.
    pub(super) fn is_positional(&self) -> bool {
        self.steps.contains(&Step::Position)
    }

    /// Whether it reads the velocity or its sign.
    pub(super) fn is_of_velocity(&self) -> bool {
        self.steps.contains(&Step::Velocity) || self.steps.contains(&Step::Sign)
    }

    /// Whether it reads a shape parameter.
    pub(super) fn reads(&self, parameter: usize) -> bool {
        self.steps.contains(&Step::Shape(parameter))
    }

    /// Its value.
    pub(super) fn at<S: Scalar>(&self, instant: Instant<S>, shape: &[S]) -> S {
        self.alone(instant, shape, S::power)
    }

    /// Its value, not a number where a number below 0 is raised to a power that is not whole: [`Scalar::power`] takes none.
    pub(super) fn tried(&self, instant: Instant<f64>, shape: &[f64]) -> f64 {
        self.alone(instant, shape, |x, p| if x < 0.0 { f64::NAN } else { x.power(p) })
    }

    fn alone<S: Scalar>(&self, Instant { q, v }: Instant<S>, shape: &[S], power: impl Fn(S, S) -> S) -> S {
        let inputs = Inputs { q: [q], v: [v.value()], sign: [v.sign()], temperature: [v.temperature()] };
        let mut stack = [[S::zero()]; DEEPEST];
        self.run(&inputs, shape, &mut stack, power);
        stack[0][0]
    }

    /// Room for the numbers that wait, for [`Formula::run`].
    pub(super) fn stack<S: Scalar, const N: usize>() -> Vec<[S; N]> {
        vec![[S::zero(); N]; DEEPEST]
    }

    /// Its values at `N` samples at once, left in the first place of the stack: a step of the program is chosen once for all of them.
    #[inline(always)]
    pub(super) fn run<S: Scalar, const N: usize>(
        &self,
        at: &Inputs<S, N>,
        shape: &[S],
        stack: &mut [[S; N]],
        power: impl Fn(S, S) -> S,
    ) {
        let mut top = 0;
        for step in &self.steps {
            match *step {
                Step::Number(x) => push(stack, &mut top, &[S::from_f64(x); N]),
                Step::Velocity => push(stack, &mut top, &at.v),
                Step::Position => push(stack, &mut top, &at.q),
                Step::Sign => push(stack, &mut top, &at.sign),
                Step::Temperature => push(stack, &mut top, &at.temperature),
                Step::Shape(k) => push(stack, &mut top, &[shape[k]; N]),
                Step::Negate => each(&mut stack[top - 1], |x| -x),
                Step::Whole(exponent) => each(&mut stack[top - 1], |x| whole(x, exponent)),
                Step::Call(function) => function.of(&mut stack[top - 1]),
                Step::Add => pair(stack, &mut top, |a, b| a + b),
                Step::Subtract => pair(stack, &mut top, |a, b| a - b),
                Step::Multiply => pair(stack, &mut top, |a, b| a * b),
                Step::Divide => pair(stack, &mut top, |a, b| a / b),
                Step::Power => pair(stack, &mut top, &power),
            }
        }
    }
}

/// What a formula reads at `N` samples.
pub(super) struct Inputs<S, const N: usize> {
    pub(super) q: [S; N],
    pub(super) v: [S; N],
    pub(super) sign: [S; N],
    pub(super) temperature: [S; N],
}

#[inline(always)]
fn push<S: Scalar, const N: usize>(stack: &mut [[S; N]], top: &mut usize, values: &[S; N]) {
    stack[*top] = *values;
    *top += 1;
}

#[inline(always)]
fn each<S: Scalar>(values: &mut [S], f: impl Fn(S) -> S) {
    for x in values {
        *x = f(*x);
    }
}

#[inline(always)]
fn pair<S: Scalar, const N: usize>(stack: &mut [[S; N]], top: &mut usize, f: impl Fn(S, S) -> S) {
    *top -= 1;
    let (below, above) = stack.split_at_mut(*top);
    for (a, b) in below[*top - 1].iter_mut().zip(&above[0]) {
        *a = f(*a, *b);
    }
}

#[inline(always)]
fn whole<S: Scalar>(x: S, exponent: i32) -> S {
    let power = (0..exponent.unsigned_abs()).fold(S::one(), |product, _| product * x);
    if exponent < 0 { power.recip() } else { power }
}

/// Recursive descent; what it has read is on the stack of the program it writes, `depth` numbers of it.
struct Reader<'a> {
    text: &'a str,
    at: usize,
    shape: &'a [&'a str],
    steps: Vec<Step>,
    depth: usize,
}

impl<'a> Reader<'a> {
    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    fn space(&mut self) {
        self.at += self.rest().len() - self.rest().trim_start().len();
    }

    fn fault(&self, expected: &str) -> FormulaFault {
        let found = self.rest().trim_start().chars().take(12).collect::<String>();
        FormulaFault {
            formula: self.text.chars().take(80).collect(),
            place: self.text[..self.at].chars().count() + 1,
            expected: expected.to_owned(),
            found: if found.is_empty() { "the end".to_owned() } else { format!("`{found}`") },
        }
    }

    fn take(&mut self, token: &str) -> bool {
        self.space();
        let there = self.rest().starts_with(token);
        if there {
            self.at += token.len();
        }
        there
    }

    fn value(&mut self, step: Step) -> Result<(), FormulaFault> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(self.fault("a formula that is less deep"));
        }
        self.steps.push(step);
        Ok(())
    }

    fn pair(&mut self, step: Step) {
        self.depth -= 1;
        self.steps.push(step);
    }

    fn sum(&mut self, nested: usize) -> Result<(), FormulaFault> {
        // Parentheses and signs nest without a number that waits.
        if nested > 4 * DEEPEST {
            return Err(self.fault("a formula that is less deep"));
        }
        self.product(nested)?;
        loop {
            let step = match () {
                () if self.take("+") => Step::Add,
                () if self.take("-") => Step::Subtract,
                () => return Ok(()),
            };
            self.product(nested)?;
            self.pair(step);
        }
    }

    fn product(&mut self, nested: usize) -> Result<(), FormulaFault> {
        self.signed(nested)?;
        loop {
            self.space();
            let step = match () {
                () if self.rest().starts_with("**") => return Ok(()),
                () if self.take("*") => Step::Multiply,
                () if self.take("/") => Step::Divide,
                () => return Ok(()),
            };
            self.signed(nested)?;
            self.pair(step);
        }
    }

    /// `-x^2` is `-(x^2)`, as everywhere.
    fn signed(&mut self, nested: usize) -> Result<(), FormulaFault> {
        if nested > 4 * DEEPEST {
            return Err(self.fault("a formula that is less deep"));
        }
        if self.take("-") {
            self.signed(nested + 1)?;
            self.steps.push(Step::Negate);
            return Ok(());
        }
        if self.take("+") {
            return self.signed(nested + 1);
        }
        self.power(nested)
    }

    fn power(&mut self, nested: usize) -> Result<(), FormulaFault> {
        self.atom(nested)?;
        if !(self.take("^") || self.take("**")) {
            return Ok(());
        }
        let before = self.steps.len();
        self.signed(nested + 1)?;
        let exponent = match self.steps[before..] {
            [Step::Number(x)] => Some(x),
            [Step::Number(x), Step::Negate] => Some(-x),
            _ => None,
        };
        match exponent.filter(|x| x.fract() == 0.0 && x.abs() <= PRODUCT) {
            Some(x) => {
                self.steps.truncate(before);
                self.pair(Step::Whole(x as i32));
            }
            None => self.pair(Step::Power),
        }
        Ok(())
    }

    fn atom(&mut self, nested: usize) -> Result<(), FormulaFault> {
        self.space();
        if self.take("(") {
            self.sum(nested + 1)?;
            return self.close();
        }
        let rest = self.rest();
        let word: usize =
            rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').map(char::len_utf8).sum();
        if rest.starts_with(|c: char| c.is_ascii_digit() || c == '.') {
            return self.number();
        }
        match &rest[..word] {
            "v" => self.named(word, Step::Velocity),
            "q" => self.named(word, Step::Position),
            "T" => self.named(word, Step::Temperature),
            "pi" => self.named(word, Step::Number(std::f64::consts::PI)),
            "sign" => {
                self.at += word;
                if !(self.take("(") && self.take("v")) {
                    return Err(self.fault("`(v)`: no other sign is smooth where designs ask for it"));
                }
                self.value(Step::Sign)?;
                self.close()
            }
            name => {
                if let Some(k) = self.shape.iter().position(|symbol| symbol == &name) {
                    return self.named(word, Step::Shape(k));
                }
                let Some(function) = Function::named(name) else { return Err(self.unknown()) };
                self.at += word;
                if !self.take("(") {
                    return Err(self.fault("`(`"));
                }
                self.sum(nested + 1)?;
                self.close()?;
                self.steps.push(Step::Call(function));
                Ok(())
            }
        }
    }

    fn unknown(&self) -> FormulaFault {
        let functions = RESERVED[VALUES..].join(", ");
        let parameters = match self.shape {
            [] => "no shape parameter (there is none under `shape`)".to_owned(),
            names => format!("a shape parameter ({})", names.join(", ")),
        };
        self.fault(&format!("a number, v, q, T, pi, {parameters} or a function ({functions})"))
    }

    fn close(&mut self) -> Result<(), FormulaFault> {
        if self.take(")") { Ok(()) } else { Err(self.fault("`)`")) }
    }

    fn named(&mut self, length: usize, step: Step) -> Result<(), FormulaFault> {
        self.value(step)?;
        self.at += length;
        Ok(())
    }

    fn number(&mut self) -> Result<(), FormulaFault> {
        let rest = self.rest().as_bytes();
        let digits = |from: usize| rest[from..].iter().take_while(|b| b.is_ascii_digit()).count();
        let mut end = digits(0);
        if rest.get(end) == Some(&b'.') {
            end += 1 + digits(end + 1);
        }
        if matches!(rest.get(end), Some(b'e' | b'E')) {
            let sign = usize::from(matches!(rest.get(end + 1), Some(b'+' | b'-')));
            let exponent = digits(end + 1 + sign);
            end += if exponent > 0 { 1 + sign + exponent } else { 0 };
        }
        match self.rest()[..end].parse::<f64>().ok().filter(|x| x.is_finite()) {
            Some(x) => self.named(end, Step::Number(x)),
            None => Err(self.fault("a finite number")),
        }
    }
}
