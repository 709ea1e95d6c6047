//! Values of expressions.

use std::cmp::Ordering;

use super::expression::{Comparison, Expression, Operator};
use super::functions;
use super::names::{Failure, Names};
use super::value::{MAX_LIST, MAX_TEXT, MAX_WEIGHT, Value, bounded_list, bounded_text, entries};
use crate::xacro_fault::XacroFault;

/// An evaluation with its own names of comprehensions.
pub(super) struct Evaluation<'a, N: Names> {
    pub(super) names: &'a mut N,
    own: Vec<(String, Value)>,
}

impl<'a, N: Names> Evaluation<'a, N> {
    pub(super) fn new(names: &'a mut N) -> Self {
        Evaluation { names, own: Vec::new() }
    }

    pub(super) fn value(&mut self, expression: &Expression) -> Result<Value, Failure> {
        self.names.enter()?;
        let value = self.value_here(expression);
        self.names.leave();
        let value = value?;
        // What an expression makes is weighed; what it only names was weighed where it was made.
        if let Expression::List(_)
        | Expression::Comprehension { .. }
        | Expression::Binary(..)
        | Expression::Call(..)
        | Expression::Slice(..) = expression
        {
            self.weigh(&value)?;
        }
        Ok(value)
    }

    fn weigh(&mut self, value: &Value) -> Result<(), Failure> {
        let weight = value.weight();
        let weight =
            weight.ok_or(XacroFault::TooMuch { what: "values in one another", limit: MAX_WEIGHT })?;
        Ok(self.names.spend(weight)?)
    }

    /// Counts what an operation goes through.
    fn look_at(&mut self, values: &[&Value]) -> Result<(), Failure> {
        Ok(self.names.spend(values.iter().map(|value| value.length()).sum())?)
    }

    fn value_here(&mut self, expression: &Expression) -> Result<Value, Failure> {
        Ok(match expression {
            Expression::Constant(value) => value.clone(),
            Expression::Name(name) => self.name(name)?,
            Expression::List(entries) => Value::list(self.values(entries)?),
            Expression::Comprehension { each, names, list, condition } => {
                self.comprehension(each, names, list, condition.as_deref())?
            }
            Expression::Negative(of) => negative(&self.value(of)?)?,
            Expression::Positive(of) => match self.value(of)? {
                value @ (Value::Int(_) | Value::Float(_)) => value,
                other => return Err(unfit("+", &other).into()),
            },
            Expression::Not(of) => Value::Bool(!self.value(of)?.is_true()),
            Expression::Binary(operator, left, right) => {
                let (left, right) = (self.value(left)?, self.value(right)?);
                self.look_at(&[&left, &right])?;
                binary(*operator, &left, &right)?
            }
            Expression::And(left, right) => match self.value(left)? {
                left if left.is_true() => self.value(right)?,
                left => left,
            },
            Expression::Or(left, right) => match self.value(left)? {
                left if left.is_true() => left,
                _ => self.value(right)?,
            },
            Expression::Compared(first, others) => {
                let mut left = self.value(first)?;
                for (comparison, other) in others {
                    let right = self.value(other)?;
                    // All that lists hold may be compared.
                    self.weigh(&left)?;
                    self.weigh(&right)?;
                    if !compare(*comparison, &left, &right)? {
                        return Ok(Value::Bool(false));
                    }
                    left = right;
                }
                Value::Bool(true)
            }
            Expression::Choice { condition, value, other } => {
                let holds = self.value(condition)?.is_true();
                self.value(if holds { value } else { other })?
            }
            Expression::Call(function, values, named) => self.call(function, values, named)?,
            Expression::Index(of, index) => {
                let (of, index) = (self.value(of)?, self.value(index)?);
                self.look_at(&[&of])?;
                entry_at(&of, &index)?
            }
            Expression::Slice(of, start, end) => {
                let of = self.value(of)?;
                self.look_at(&[&of])?;
                let bound = |end: Option<&Expression>, own: &mut Self| match end {
                    Some(end) => own.value(end).map(Some),
                    None => Ok(None),
                };
                let (start, end) = (bound(start.as_deref(), self)?, bound(end.as_deref(), self)?);
                slice(&of, start.as_ref(), end.as_ref())?
            }
            Expression::Attribute(of, name) => {
                let of = self.value(of)?;
                self.look_at(&[&of])?;
                self.attribute(of, name)?
            }
        })
    }

    fn values(&mut self, entries: &[Expression]) -> Result<Vec<Value>, Failure> {
        entries.iter().map(|entry| self.value(entry)).collect()
    }

    fn name(&mut self, name: &str) -> Result<Value, Failure> {
        if let Some((_, value)) = self.own.iter().rev().find(|(own, _)| own == name) {
            return Ok(value.clone());
        }
        if let Some(value) = self.names.value(name)? {
            return Ok(value);
        }
        functions::global(name).ok_or_else(|| format!("`{name}` is not defined").into())
    }

    fn attribute(&mut self, of: Value, name: &str) -> Result<Value, Failure> {
        let found = match &of {
            Value::Library => functions::global(name),
            Value::Scope(scope) => self.names.value_in(*scope, name)?,
            Value::Map(_) => of.entry(&Value::text(name)).cloned(),
            _ => None,
        };
        match found {
            Some(value) => Ok(value),
            None if functions::is_method(&of, name) => Ok(Value::Method(of.into(), name.into())),
            None => Err(format!("`{name}` is not defined in a {}", of.kind()).into()),
        }
    }

    fn comprehension(
        &mut self,
        each: &Expression,
        names: &[String],
        list: &Expression,
        condition: Option<&Expression>,
    ) -> Result<Value, Failure> {
        let list = entries(&self.value(list)?)?;
        let (before, mut all) = (self.own.len(), Vec::new());
        for entry in list {
            match names {
                [name] => self.own.push((name.clone(), entry)),
                _ => {
                    let parts = entries(&entry)?;
                    if parts.len() != names.len() {
                        return Err(format!("expected {} values, found {}", names.len(), parts.len()).into());
                    }
                    self.own.extend(names.iter().cloned().zip(parts));
                }
            }
            let is_taken = match condition {
                Some(condition) => self.value(condition)?.is_true(),
                None => true,
            };
            if is_taken {
                all.push(self.value(each)?);
            }
            self.own.truncate(before);
        }
        Ok(Value::list(all))
    }

    fn call(
        &mut self,
        function: &Expression,
        values: &[Expression],
        named: &[(String, Expression)],
    ) -> Result<Value, Failure> {
        let function = self.value(function)?;
        let values = self.values(values)?;
        // Texts of lists, orders of lists: a function may go through all that they hold.
        for value in &values {
            self.weigh(value)?;
        }
        let mut by_name = Vec::with_capacity(named.len());
        for (name, value) in named {
            by_name.push((name.clone(), self.value(value)?));
        }
        match function {
            Value::Function("dict") if values.is_empty() => Ok(Value::Map(
                by_name.into_iter().map(|(k, v)| (Value::text(k), v)).collect::<Vec<_>>().into(),
            )),
            Value::Function(name) => {
                if let Some((argument, _)) = by_name.first() {
                    return Err(format!("`{name}` takes no argument `{argument}`").into());
                }
                functions::call(name, &values, self.names)
            }
            Value::Method(of, name) => match by_name.first() {
                Some((argument, _)) => Err(format!("`{name}` takes no argument `{argument}`").into()),
                None => Ok(functions::call_method(&of, &name, &values)?),
            },
            other => Err(format!("expected a function, found a {}", other.kind()).into()),
        }
    }
}

fn unfit(sign: &str, value: &Value) -> String {
    format!("`{sign}` does not take a {}", value.kind())
}

fn negative(value: &Value) -> Result<Value, String> {
    match (value.whole(), value.number()) {
        (Some(n), _) => n.checked_neg().map(Value::Int).ok_or_else(too_large),
        (_, Some(x)) => Ok(Value::Float(-x)),
        _ => Err(unfit("-", value)),
    }
}

fn too_large() -> String {
    "expected a whole number of 64 bits, found a larger one".to_owned()
}

fn binary(operator: Operator, left: &Value, right: &Value) -> Result<Value, String> {
    match (operator, left, right) {
        (Operator::Add, Value::Text(a), Value::Text(b)) => return bounded_text(format!("{a}{b}")),
        (Operator::Add, Value::List(a), Value::List(b)) => {
            return bounded_list(a.iter().chain(b.iter()).cloned());
        }
        (Operator::Multiply, Value::Text(text), times) | (Operator::Multiply, times, Value::Text(text)) => {
            let times = repeats(times)?;
            return match text.len().checked_mul(times) {
                Some(length) if length <= MAX_TEXT => Ok(Value::text(text.repeat(times))),
                _ => Err(format!("expected a text of at most {MAX_TEXT} bytes")),
            };
        }
        (Operator::Multiply, Value::List(list), times) | (Operator::Multiply, times, Value::List(list)) => {
            return match list.len().checked_mul(repeats(times)?) {
                Some(length) if length <= MAX_LIST => bounded_list(list.iter().cycle().take(length).cloned()),
                _ => Err(format!("expected a list of at most {MAX_LIST} entries")),
            };
        }
        (Operator::Remainder, Value::Text(text), values) => return functions::percent(text, values),
        _ => {}
    }
    let sign = match operator {
        Operator::Add => "+",
        Operator::Subtract => "-",
        Operator::Multiply => "*",
        Operator::Divide => "/",
        Operator::FloorDivide => "//",
        Operator::Remainder => "%",
        Operator::Power => "**",
    };
    let (Some(x), Some(y)) = (left.number(), right.number()) else {
        return Err(format!("`{sign}` does not take a {} and a {}", left.kind(), right.kind()));
    };
    if matches!(operator, Operator::Divide | Operator::FloorDivide | Operator::Remainder) && y == 0.0 {
        return Err("a division by zero".to_owned());
    }
    if let (Some(a), Some(b)) = (left.whole(), right.whole()) {
        let whole = match operator {
            Operator::Add => a.checked_add(b),
            Operator::Subtract => a.checked_sub(b),
            Operator::Multiply => a.checked_mul(b),
            Operator::FloorDivide => a.checked_div_euclid(b).map(|q| floor_of(q, a, b)),
            Operator::Remainder => {
                a.checked_rem(b).map(|r| if r != 0 && (r < 0) != (b < 0) { r + b } else { r })
            }
            Operator::Power if b >= 0 => u32::try_from(b).ok().and_then(|b| a.checked_pow(b)),
            Operator::Divide | Operator::Power => return float_of(operator, x, y),
        };
        return whole.map(Value::Int).ok_or_else(too_large);
    }
    float_of(operator, x, y)
}

/// Euclid's quotient rounds towards a remainder that is not negative; Python's is the floor.
fn floor_of(quotient: i64, a: i64, b: i64) -> i64 {
    if b < 0 && a.rem_euclid(b) != 0 { quotient - 1 } else { quotient }
}

fn float_of(operator: Operator, x: f64, y: f64) -> Result<Value, String> {
    let value = match operator {
        Operator::Add => x + y,
        Operator::Subtract => x - y,
        Operator::Multiply => x * y,
        Operator::Divide => x / y,
        Operator::FloorDivide => floor_and_rest(x, y).0,
        Operator::Remainder => floor_and_rest(x, y).1,
        Operator::Power => x.powf(y),
    };
    if value.is_nan() && !x.is_nan() && !y.is_nan() {
        return Err(format!("expected a real number, found none for {x} and {y}"));
    }
    Ok(Value::Float(value))
}

/// Python's `divmod` of floats. The quotient follows from the exact remainder: that of `x / y` may be rounded up to a whole number.
fn floor_and_rest(x: f64, y: f64) -> (f64, f64) {
    let mut rest = x % y;
    let mut quotient = (x - rest) / y;
    if rest == 0.0 {
        rest = 0.0_f64.copysign(y);
    } else if (rest < 0.0) != (y < 0.0) {
        rest += y;
        quotient -= 1.0;
    }
    let floor = quotient.floor();
    let floor = match quotient == 0.0 {
        true => 0.0_f64.copysign(x / y),
        false if quotient - floor > 0.5 => floor + 1.0,
        false => floor,
    };
    (floor, rest)
}

fn repeats(times: &Value) -> Result<usize, String> {
    let times = times.whole().ok_or_else(|| unfit("*", times))?;
    Ok(usize::try_from(times).unwrap_or(0))
}

fn compare(comparison: Comparison, left: &Value, right: &Value) -> Result<bool, String> {
    let ordered = |holds: fn(Ordering) -> bool| match left.order(right) {
        Some(order) => Ok(holds(order)),
        None if left.number().is_some() && right.number().is_some() => Ok(false),
        None => Err(format!("a {} and a {} have no order", left.kind(), right.kind())),
    };
    match comparison {
        Comparison::Equal => Ok(left.equals(right)),
        Comparison::Unequal => Ok(!left.equals(right)),
        Comparison::Less => ordered(Ordering::is_lt),
        Comparison::LessOrEqual => ordered(Ordering::is_le),
        Comparison::Greater => ordered(Ordering::is_gt),
        Comparison::GreaterOrEqual => ordered(Ordering::is_ge),
        Comparison::In => is_in(left, right),
        Comparison::NotIn => is_in(left, right).map(|is| !is),
        Comparison::Is => Ok(left.kind() == right.kind() && left.equals(right)),
        Comparison::IsNot => Ok(left.kind() != right.kind() || !left.equals(right)),
    }
}

fn is_in(value: &Value, all: &Value) -> Result<bool, String> {
    match (value, all) {
        (Value::Text(part), Value::Text(text)) => Ok(text.contains(part.as_ref())),
        (_, Value::Map(_)) => Ok(all.entry(value).is_some()),
        (_, Value::List(list)) => Ok(list.iter().any(|entry| entry.equals(value))),
        _ => Err(unfit("in", all)),
    }
}

fn entry_at(of: &Value, index: &Value) -> Result<Value, String> {
    if let Value::Map(_) = of {
        return of.entry(index).cloned().ok_or_else(|| format!("the dictionary has no key `{index}`"));
    }
    let (length, text) = match of {
        Value::List(list) => (list.len(), None),
        Value::Text(text) => (text.chars().count(), Some(text)),
        other => return Err(format!("a {} has no entries", other.kind())),
    };
    let place = index.whole().ok_or_else(|| format!("expected a whole number, found a {}", index.kind()))?;
    let place = if place < 0 { place.saturating_add(length as i64) } else { place };
    let place = usize::try_from(place).ok().filter(|place| *place < length);
    let place = place.ok_or_else(|| format!("expected an index below {length}, found {index}"))?;
    let entry = match (of, text) {
        (Value::List(list), _) => list.get(place).cloned(),
        (_, text) => text.and_then(|text| text.chars().nth(place)).map(|c| Value::text(c.to_string())),
    };
    entry.ok_or_else(|| format!("expected an index below {length}, found {index}"))
}

fn slice(of: &Value, start: Option<&Value>, end: Option<&Value>) -> Result<Value, String> {
    let list = entries(of)?;
    let place = |bound: Option<&Value>, otherwise: usize| match bound {
        None | Some(Value::None) => Ok(otherwise),
        Some(bound) => {
            let place =
                bound.whole().ok_or_else(|| format!("expected a whole number, found a {}", bound.kind()))?;
            let length = list.len() as i64;
            let place = if place < 0 { place.saturating_add(length) } else { place };
            Ok::<usize, String>(place.clamp(0, length) as usize)
        }
    };
    let (start, end) = (place(start, 0)?, place(end, list.len())?);
    let part = list[start.min(end)..end].iter();
    Ok(match of {
        Value::Text(_) => Value::text(part.map(ToString::to_string).collect::<String>()),
        _ => Value::list(part.cloned().collect()),
    })
}
