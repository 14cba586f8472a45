//! Powers: integer ones by factoring a^n - b^n, roots and reciprocals by their conjugates, others by expm1 and log1p.

use num_traits::{One, Signed};

use crate::expr::{Expr, Rational};

use super::{Order, Second, Split, SplitError, Splitter};

impl Splitter<'_> {
    pub(super) fn power(&mut self, e: &Expr, base: &Expr, exponent: &Expr) -> Result<Split, SplitError> {
        let split = self.power_of(e, base, exponent)?;
        if !split.rest.is_zero() {
            self.note_split(e, &split);
        }
        Ok(split)
    }

    fn power_of(&mut self, e: &Expr, base: &Expr, exponent: &Expr) -> Result<Split, SplitError> {
        // J^r = (1 + p)^(r/2).
        if let (Some((j, p)), Expr::Symbol(s)) = (self.jacobian, base)
            && *s == j
        {
            let half = match exponent {
                Expr::Number(q) => Expr::Number(q / Rational::from_integer(2)),
                r => Expr::ratio(1, 2) * r.clone(),
            };
            let base = Expr::int(1) + p.into();
            return match half {
                Expr::Number(q) if q.is_one() => self.part(&base),
                half => self.power_of(e, &base, &half),
            };
        }
        let a = self.part(base)?;
        if let Some(jump) = a.jump {
            return Ok(self.jumping(Expr::Power(Box::new(a.value), Box::new(exponent.clone())), jump));
        }
        let half = Rational::new(1, 2);
        match exponent {
            Expr::Number(q) if q.is_integer() => self.integer_power(e, &a, q.to_integer()),
            Expr::Number(q) if q.fract().abs() == half => {
                self.require_positive(e, &a.rest)?;
                let root = self.root(&a)?;
                let root = if q.is_positive() { root } else { self.reciprocal(&root)? };
                let whole = q.trunc().to_integer();
                if whole == 0 {
                    return Ok(root);
                }
                let power = self.integer_power(e, &a, whole)?;
                self.times(&power, &root)
            }
            // To first order the fraction is shared: J^(-5/3) = J^(-1) J^(-2/3).
            Expr::Number(q) if self.order == Order::First && !q.trunc().to_integer().eq(&0) => {
                self.require_positive(e, &a.rest)?;
                let fraction = self.real_power(&a, &Expr::Number(q.fract()))?;
                let power = self.integer_power(e, &a, q.trunc().to_integer())?;
                self.times(&power, &fraction)
            }
            _ => {
                self.require_positive(e, &a.rest)?;
                self.real_power(&a, exponent)
            }
        }
    }

    fn integer_power(&mut self, e: &Expr, a: &Split, n: i128) -> Result<Split, SplitError> {
        if n < 0 {
            self.require_nonzero(e, a)?;
            let positive = self.integer_power(e, a, -n)?;
            return self.reciprocal(&positive);
        }
        let int = |k: i128| Rational::from_integer(k);
        let power = |x: &Expr, k: i128| match k {
            0 => Expr::int(1),
            1 => x.clone(),
            k => x.clone().pow(int(k)),
        };
        if n == 1 {
            return Ok(a.clone());
        }
        if a.rest.is_zero() {
            let change = power(&a.change, n);
            let second = self.second(|| Second::whole(change.clone()));
            return Ok(Split {
                rest: Expr::int(0),
                value: change.clone(),
                change,
                rewritten: (a.rewritten.0, a.rewritten.0),
                second,
                jump: None,
            });
        }
        let rest = self.simplify(power(&a.rest, n))?;
        // v^n - c^n = (v - c) (v^(n-1) + v^(n-2) c + .. + c^(n-1)), and by differences again
        // v^n - c^n - n c^(n-1) (v - c) = (v - c)^2 sum (k + 1) c^k v^(n-2-k).
        let horner = |splitter: &mut Self, degree: i128, coefficient: &dyn Fn(i128) -> i128| {
            let mut sum = Expr::int(1);
            for k in 1..=degree {
                let c = Expr::int(coefficient(k)) * power(&a.rest, k);
                let c = splitter.simplify(c)?;
                sum = sum * a.value.clone() + c;
            }
            Ok::<_, SplitError>(sum)
        };
        let change = a.change.clone() * horner(self, n - 1, &|_| 1)?;
        let value = power(&a.value, n);
        let second = match self.order {
            Order::First => None,
            Order::Second => {
                let slope = self.simplify(Expr::int(n) * power(&a.rest, n - 1))?;
                let curved = power(&a.change, 2) * horner(self, n - 2, &|k| k + 1)?;
                Some(self.second_of_function(a, &slope, curved, &change)?)
            }
        };
        Ok(Split { rest, change, value, rewritten: (true, a.rewritten.1), second, jump: None })
    }

    /// What is divided by may not be 0 at rest, for any material.
    fn require_nonzero(&mut self, e: &Expr, a: &Split) -> Result<(), SplitError> {
        if a.rest.is_zero() {
            return self.refuse(
                e,
                "is not bounded at rest: it divides by what is 0 there",
                "write the law so that the term is smooth at rest",
            );
        }
        if self.sign(&a.rest)?.is_none() {
            self.require_sign(e, "divides by", &a.rest)?;
        }
        Ok(())
    }

    /// 1 / (c + y) = 1/c - y / (c (c + y)).
    fn reciprocal(&mut self, a: &Split) -> Result<Split, SplitError> {
        let rest = self.reciprocal_of(&a.rest)?;
        let over = |x: Expr| x / a.value.clone();
        let change = over(Expr::int(-1) * rest.clone() * a.change.clone());
        let second = match self.order {
            Order::First => None,
            Order::Second => {
                let square = self.simplify(rest.clone() * rest.clone())?;
                let slope = self.simplify(Expr::int(-1) * square.clone())?;
                let curved = over(square * a.change.clone().pow(Rational::from_integer(2)));
                Some(self.second_of_function(a, &slope, curved, &change)?)
            }
        };
        Ok(Split { rest, change, value: over(Expr::int(1)), rewritten: (true, a.rewritten.1), second, jump: None })
    }

    /// sqrt(c + y) = r + y / (s + r), with r = sqrt(c) and s = sqrt(c + y).
    fn root(&mut self, a: &Split) -> Result<Split, SplitError> {
        let half = Rational::new(1, 2);
        let rest = if a.rest.is_one() { Expr::int(1) } else { self.simplify(a.rest.clone().pow(half))? };
        let value = a.value.clone().pow(half);
        let sum = value.clone() + rest.clone();
        let change = a.change.clone() / sum.clone();
        let second = match self.order {
            Order::First => None,
            Order::Second => {
                let slope = self.simplify(Expr::ratio(1, 2) / rest.clone())?;
                let ratio = (a.change.clone() / sum).pow(Rational::from_integer(2));
                let curved = Expr::int(-1) * slope.clone() * ratio;
                Some(self.second_of_function(a, &slope, curved, &change)?)
            }
        };
        Ok(Split { rest, change, value, rewritten: (true, a.rewritten.1), second, jump: None })
    }

    /// (c + y)^r = c^r + c^r expm1(r log1p(y / c)).
    fn real_power(&mut self, a: &Split, r: &Expr) -> Result<Split, SplitError> {
        let z = self.ratio(a);
        let power = Expr::Power(Box::new(a.rest.clone()), Box::new(r.clone()));
        let rest = if a.rest.is_one() { Expr::int(1) } else { self.simplify(power)? };
        let logarithm = r.clone() * Expr::Log1p(Box::new(z.clone()));
        let change = rest.clone() * Expr::Expm1(Box::new(logarithm.clone()));
        let second = match self.order {
            Order::First => None,
            Order::Second => {
                let inverse = self.reciprocal_of(&a.rest)?;
                let slope = self.simplify(rest.clone() * r.clone() * inverse)?;
                let curved =
                    rest.clone() * (Expr::Expm1mx(Box::new(logarithm)) - r.clone() * Expr::Log1pmx(Box::new(z)));
                Some(self.second_of_function(a, &slope, curved, &change)?)
            }
        };
        let value = rest.clone() + change.clone();
        Ok(Split { rest, change, value, rewritten: (true, true), second, jump: None })
    }
}
