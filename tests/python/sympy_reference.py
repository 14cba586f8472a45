#!/usr/bin/env python3
"""Reference values of every reviewed law by SymPy, from the law file's own text.

The text is read by the small parser below, which shares nothing with the generator's; SymPy differentiates the energy
along lines through exact rational states, and mpmath evaluates to 40 digits, of which 25 are written. `cargo test`
compares the kernels with the committed values and needs no Python; CI runs this script with --check.

    python3 tests/python/sympy_reference.py [--check] [NAME ..]      (needs sympy, tested with 1.14)

writes tests/reference/sympy/NAME.json, and of laws in the principal stretches tests/reference/stretches/NAME.json, at
states with nearly equal ones; or with --check compares and exits with status 1 where a file differs.
"""

import json
import re
import sys
from fractions import Fraction
from pathlib import Path

import mpmath
import sympy as sp

ROOT = Path(__file__).resolve().parents[2]
TOKEN = re.compile(
    r"\s*(?:(\d+\.(?!\.)\d*(?:[eE][+-]?\d+)?|\d+[eE][+-]?\d+)|(\d+)|([A-Za-z_]\w*)|(\.\.|->|<=|>=|.))", re.S
)
S, H = sp.symbols("s h")


class Law:
    """A law file: parameters, domain, functions and constants, evaluated over SymPy values."""

    def __init__(self, text):
        text = re.sub(r"//[^\n]*", "", text)
        self.tokens = [next((k, t) for k, t in enumerate(m.groups()) if t) for m in TOKEN.finditer(text.rstrip())]
        self.at = 0
        self.parameters, self.functions, self.constants, self.domain = [], {}, {}, None
        self.defaults = {}
        while self.at < len(self.tokens):
            self.item()

    def peek(self, ahead=0):
        at = self.at + ahead
        return self.tokens[at][1] if at < len(self.tokens) else None

    def next(self, expected=None):
        token = self.peek()
        if expected is not None and token != expected:
            raise SyntaxError(f"expected {expected!r}, found {token!r} (token {self.at})")
        self.at += 1
        return token

    def accept(self, token):
        if self.peek() == token:
            self.at += 1
            return True
        return False

    # ---- items ----

    def attribute(self):
        """#[name(..)]: the name, and the place of what is in the parentheses."""
        self.next("#"), self.next("[")
        name, start = self.next(), self.at + 1
        depth = 1
        while depth:
            depth += {"[": 1, "]": -1}.get(self.next(), 0)
        return name, start

    def at_place(self, place, read):
        here, self.at = self.at, place
        value = read()
        self.at = here
        return value

    def item(self):
        while self.peek() == "#":
            name, place = self.attribute()
            if name == "domain":
                self.domain = place
        word = self.next()
        if word == "struct":
            self.struct()
        elif word == "const":
            name = self.next()
            self.next(":"), self.next(), self.next("=")
            self.constants[name] = self.expression({})
            self.next(";")
        elif word == "fn":
            self.function()
        else:
            raise SyntaxError(f"unexpected {word!r}")

    def struct(self):
        self.next(), self.next("{")
        while not self.accept("}"):
            unit, bounds, length, default = "1", None, None, None
            while self.peek() == "#":
                name, place = self.attribute()
                if name == "unit":
                    unit = self.at_place(place, self.string)
                elif name == "range":
                    bounds = self.at_place(place, lambda: self.arguments({}, ")"))
                elif name == "default":
                    default = self.at_place(place, lambda: self.arguments({}, ")"))
            name = self.next()
            self.next(":")
            if self.accept("["):
                self.next("f64"), self.next(";")
                length = int(self.next())
                self.next("]")
            elif self.next() == "Direction":
                bounds, length = (-1, 1), 3
                unit = "direction"
            self.accept(",")
            self.parameters.append((name, unit, bounds, length))
            self.defaults[name] = default if length or not default else default[0]

    def string(self):
        self.next('"')
        text = ""
        while self.peek() != '"':
            text += self.next()
        return text

    def function(self):
        name = self.next()
        self.next("(")
        arguments = []
        while not self.accept(")"):
            arguments.append(self.next())
            self.next(":"), self.next(), self.accept(",")
        self.next("->"), self.next("f64"), self.next("{")
        self.functions[name] = (arguments, self.at)
        depth = 1
        while depth:
            depth += {"{": 1, "}": -1}.get(self.next(), 0)

    def call(self, name, values):
        names, place = self.functions[name]
        return self.at_place(place, lambda: self.body(dict(zip(names, values))))

    def body(self, scope):
        while self.accept("let"):
            name = self.next()
            if self.accept(":"):
                self.next()
            self.next("=")
            scope[name] = self.expression(scope)
            self.next(";")
        return self.expression(scope)

    # ---- expressions: evaluated as they are read ----

    def arguments(self, scope, end):
        values = []
        while not self.accept(end):
            values.append(self.condition(scope))
            self.accept(",")
        return values

    def condition(self, scope):
        left = self.expression(scope)
        comparison = self.peek()
        if comparison in ("<", ">", "<=", ">="):
            self.next()
            return comparison, left, self.expression(scope)
        return left

    def expression(self, scope):
        value = self.term(scope)
        while self.peek() in ("+", "-"):
            sign = 1 if self.next() == "+" else -1
            value = value + sign * self.term(scope)
        return value

    def term(self, scope):
        value = self.cast(scope)
        while self.peek() in ("*", "/"):
            divide = self.next() == "/"
            factor = self.cast(scope)
            value = value / factor if divide else value * factor
        return value

    def cast(self, scope):
        value = self.unary(scope)
        while self.accept("as"):
            value = sp.Integer(value) if self.next() == "f64" else int(value)
        return value

    def unary(self, scope):
        return -self.unary(scope) if self.accept("-") else self.postfix(scope)

    def postfix(self, scope):
        value = self.primary(scope)
        while True:
            if self.peek() == ".":
                self.next()
                name = self.next()
                if self.accept("("):
                    arguments = self.arguments(scope, ")")
                    if name in FIBRES and "along" in value:
                        value = sp.diff(FIBRES[name](value["along"], *arguments), T).subs(T, 0)
                    elif name == "stretch_sum" and "along" in value:
                        raise NotImplementedError("rates of sums of stretches")
                    else:
                        value = (FIBRES[name] if name in FIBRES else FUNCTIONS[name])(value, *arguments)
                else:
                    value = value[name]
            elif self.accept("["):
                value = value[int(self.expression(scope))]
                self.next("]")
            else:
                return value

    def primary(self, scope):
        kind, token = self.tokens[self.at]
        self.at += 1
        if kind == 0:
            return sp.Rational(token)
        if kind == 1:
            return int(token)
        if token == "(":
            value = self.expression(scope)
            self.next(")")
            return value
        if token == "sum" and self.peek() == "(":
            return self.sum(scope)
        if self.accept("("):
            values = self.arguments(scope, ")")
            return self.call(token, values) if token in self.functions else FUNCTIONS[token](*values)
        return scope[token] if token in scope else self.constants[token]

    def sum(self, scope):
        self.next("(")
        low = self.expression(scope)
        self.next("..")
        high = self.expression(scope)
        self.next(","), self.next("|")
        name = self.next()
        self.next("|")
        place = self.at
        total = 0
        for i in range(low, high):
            self.at = place
            total = total + self.expression({**scope, name: i})
        self.accept(","), self.next(")")
        return total

    def energy(self, strain, parameters):
        parts = [name for name in self.functions if name.startswith("energy_density")]
        return sum(self.call(name, [strain, parameters]) for name in parts)

    def dissipation(self, strain, rate, parameters):
        parts = [name for name in self.functions if name.startswith("dissipation_density")]
        return sum(self.call(name, [strain, rate, parameters]) for name in parts)

    def is_dissipative(self):
        return any(name.startswith("dissipation_density") for name in self.functions)

    def inside(self, strain, parameters):
        if self.domain is None:
            return True
        condition = self.at_place(self.domain, lambda: self.condition({**strain, **parameters}))
        return holds(condition)


def holds(condition):
    comparison, left, right = condition
    difference = sp.sympify(left - right).subs({S: 0, H: 0}).evalf(40)
    return bool({"<": difference < 0, ">": difference > 0, "<=": difference <= 0, ">=": difference >= 0}[comparison])


def ddot(a, b):
    return sum(x * y for x, y in zip(a, b))


def stretch_sum(strain, exponent):
    """The sum of lambda^exponent over the principal stretches by its series 1, s, h, s h about s = h = 0: differences of
    values at steps of 1e-40, with 160 digits, so that the stretches need not be distinct."""
    with mpmath.workdps(160):
        step = mpmath.mpf(10) ** -40
        power = mpmath.mpf(sp.Rational(exponent).p) / sp.Rational(exponent).q / 2

        def at(s, h):
            squares = principal_squares(strain["C"], s * step, h * step)
            return mpmath.fsum(x**power for x in squares)

        middle, right, left, up, down = at(0, 0), at(1, 0), at(-1, 0), at(0, 1), at(0, -1)
        corners = at(1, 1) - at(1, -1) - at(-1, 1) + at(-1, -1)
        series = [middle, (right - left) / (2 * step), (up - down) / (2 * step), corners / (4 * step**2)]
        middle, by_s, by_h, by_both = [sp.Float(x, 120) for x in series]
    return middle + by_s * S + by_h * H + by_both * S * H


SQUARES = {}


def principal_squares(c, s, h):
    """The eigenvalues of C at a point of the line; those of the last lines are kept, for further exponents."""
    key = (sp.ImmutableMatrix(c), s, h)
    if key not in SQUARES:
        if len(SQUARES) > 100:
            SQUARES.clear()
        entries = [[sp.Poly(x, S, H).terms() for x in c.row(i)] for i in range(3)]
        number = lambda q: mpmath.mpf(sp.Rational(q).p) / sp.Rational(q).q
        value = lambda terms: mpmath.fsum(number(q) * s**i * h**j for (i, j), q in terms)
        SQUARES[key] = list(mpmath.eigsy(mpmath.matrix([[value(t) for t in row] for row in entries]), eigvals_only=True))
    return SQUARES[key]


FUNCTIONS = {
    "stretch_sum": stretch_sum,
    "ln": sp.log,
    "exp": sp.exp,
    "sqrt": sp.sqrt,
    "powi": lambda x, n: x**n,
    "powf": lambda x, a: x**a,
    "pos": lambda x: x if holds((">", x, 0)) else sp.Integer(0),
    "select": lambda c, a, b: a if holds(c) else b,
    "tr": lambda a: a.trace(),
    "ddot": ddot,
    "det": lambda a: a.det(),
    "identity": lambda: sp.eye(3),
    "shear_modulus": lambda e, nu: e / (2 * (1 + nu)),
    "lame_lambda": lambda e, nu: e * nu / ((1 + nu) * (1 - 2 * nu)),
    "bulk_modulus": lambda e, nu: e / (3 * (1 - 2 * nu)),
}


def between(a, c, b):
    """a . c . b"""
    return (sp.Matrix([a]) * c * sp.Matrix(b))[0]


# The strain's methods.
FIBRES = {
    "I4": lambda s, a: between(a, s["C"], a),
    "I5": lambda s, a: between(a, s["C"] ** 2, a),
    "I8": lambda s, a, b: between(a, s["C"], b),
    "I4bar": lambda s, a: between(a, s["C"], a) * s["J"] ** sp.Rational(-2, 3),
    "I5bar": lambda s, a: between(a, s["C"] ** 2, a) * s["J"] ** sp.Rational(-4, 3),
}


def strain(g):
    f = sp.eye(3) + g
    c = f.T * f
    i1, j = c.trace(), f.det()
    i2 = (i1**2 - ddot(c, c)) / 2
    return {
        "eps": (g + g.T) / 2,
        "E": (c - sp.eye(3)) / 2,
        "C": c,
        "I1": i1,
        "I2": i2,
        "I3": j**2,
        "J": j,
        "I1bar": i1 * j ** sp.Rational(-2, 3),
        "I2bar": i2 * j ** sp.Rational(-4, 3),
    }


T = sp.symbols("t")


def strain_rate(g, rate):
    """The rates of the strain where G changes by `rate`, as derivatives along a line in time."""
    along = strain(g + T * rate)
    rates = {name: sp.diff(value, T).subs(T, 0) for name, value in along.items()}
    # For the invariants with fibres, which are functions of the strain and not among its values.
    return {**rates, "along": along}


def matrix(numerators, denominator):
    return sp.Matrix(3, 3, [sp.Rational(n, denominator) for n in numerators])


# G, exact in f32: ordinary, large, small, compressed, turned by 90 degrees and stretched, at rest, inverted.
STATES = [
    matrix([7, -3, 2, 5, -9, 4, -1, 6, 11], 64),
    matrix([96, 40, -32, -24, 64, 16, 48, -8, 20], 64),
    matrix([9, -4, 3, 2, -7, 5, 1, -6, 8], 65536),
    matrix([-26, 3, 1, -2, -20, 4, 5, 1, -14], 64),
    matrix([-60, -80, 6, 72, -68, -4, 2, 3, 8], 64),
    sp.zeros(3, 3),
    matrix([-160, 3, 1, -2, 5, 4, 5, 1, -9], 64),
]
DIRECTION = matrix([3, -5, 2, 7, 1, -4, -2, 6, 5], 8)
RATE = matrix([-2, 7, 4, 1, 3, -6, 5, -1, 8], 16)


def near_equal():
    """G where two or all three principal stretches differ by a part of them, 1e-2 to 1e-8, or not at all: those with
    small numbers are exact in f32, those turned are exact in f64."""
    double = lambda m: m.applyfunc(lambda x: sp.Rational(*float(x).as_integer_ratio()))
    turn, axes = rotation(1, -2, 3, 5), rotation(4, 1, -3, 2)
    for digits in [2, 4, 6, 8, None]:
        for three in [False, True]:
            gap = sp.Rational(1, 10**digits) if digits else sp.Integer(0)
            first = sp.Rational(13, 10)
            last = first * (1 - gap / 2) if three else sp.Rational(7, 10)
            stretch = axes.T * sp.diag(first, first * (1 + gap), last) * axes
            yield double(turn * stretch - sp.eye(3))
            # Off the diagonal f32 has every gap.
            gap = sp.Rational(1, 2 ** round(digits * 3.3219)) if digits else sp.Integer(0)
            shear = sp.Matrix(3, 3, [1, 2, 3, 2, -1, 1, 3, 1, 2] if three else [1, 2, 0, 2, -1, 0, 0, 0, 0]) / 4
            yield sp.diag(1, 1, 1 if three else -1) / 4 + gap * (shear - sp.diag(*shear.diagonal()))


def rotation(w, x, y, z):
    n = sp.Integer(w * w + x * x + y * y + z * z)
    vector = sp.Matrix([x, y, z])
    cross = sp.Matrix(3, 3, [0, -z, y, z, 0, -x, -y, x, 0])
    return ((2 * w * w - n) * sp.eye(3) + 2 * vector * vector.T + 2 * w * cross) / n
# Unit vectors with rational components.
DIRECTIONS = [[sp.Rational(n, d) for n in v] for *v, d in [(2, -1, 2, 3), (3, 6, -2, 7), (-6, 2, 9, 11), (1, 8, 4, 9)]]


def materials(law):
    """Two materials within the declared ranges: numbers that are exact in f32, and unit vectors."""
    for which in range(2):
        values, position, directions = {}, 0, 0
        for name, unit, (low, high), length in law.parameters:
            if unit == "direction":
                values[name] = DIRECTIONS[(2 * which + directions) % len(DIRECTIONS)]
                directions += 1
                continue
            row = []
            for _ in range(length or 1):
                position += 1
                wanted = {
                    "Pa": [sp.Integer(2) ** 20 * (8 + 3 * which + position) / 8],
                    "1": [sp.Rational(5, 16), sp.Rational(31, 64)][which:],
                }.get(unit, [sp.Integer(1 + which)])
                if unit == "1":
                    # Components of an array apart, so that none could take another's place.
                    wanted = [w + len(row) for w in wanted]
                wanted = [-w for w in wanted] if high <= 0 else wanted
                # Nothing usual allowed: near the lower end, in eighths of the range or of one.
                step = min(high - low, sp.Integer(1)) / 8
                fallback = sp.Rational(*Fraction(float(low + step * (2 + which + position % 3))).as_integer_ratio())
                row.append(next((w for w in wanted if low <= w <= high), fallback))
            values[name] = row if length else row[0]
        yield values


def decimal(x, scale):
    """25 digits; an exact zero as 0, also where logarithms cancel."""
    x = sp.sympify(x).evalf(45)
    return "0" if abs(x) <= sp.Float("1e-33", 45) * scale else str(sp.Float(x, 25))


def exact(x):
    """A dyadic rational in decimal digits, all of them; of other rationals forty."""
    return str(sp.Float(x, 40).n(40)).rstrip("0").rstrip(".") if sp.Rational(x).q != 1 else str(sp.Rational(x).p)


def values(law, parameters, g):
    """W, P, dP and the Cauchy stress at one state, or None outside the domain."""
    if not law.inside(strain(g), parameters):
        return None
    p, dp = [], []
    rest = law.energy(strain(sp.zeros(3, 3)), parameters)
    for k in range(9):
        line = g + H * DIRECTION
        line[k] += S
        w = law.energy(strain(line), parameters)
        first = sp.diff(w, S)
        p.append(first.subs({S: 0, H: 0}).evalf(45))
        dp.append(sp.diff(first, H).subs({S: 0, H: 0}).evalf(45))
    f = sp.eye(3) + g
    w = sp.sympify(law.energy(strain(g), parameters) - rest).evalf(45)
    cauchy = [sum(p[3 * i + m] * f[k, m] for m in range(3)) / f.det() for i in range(3) for k in range(3)]
    scale = max([abs(x) for x in dp])
    components = [x for v in parameters.values() for x in (v if isinstance(v, list) else [v])]
    return {
        "parameters": [exact(x) for x in components],
        "G": [exact(x) for x in g],
        "dG": [exact(x) for x in DIRECTION],
        "W": decimal(w, scale),
        "P": [decimal(x, scale) for x in p],
        "dP": [decimal(x, scale) for x in dp],
        "cauchy": [decimal(x, scale) for x in cauchy],
        **damping(law, parameters, g),
    }


def damping(law, parameters, g):
    """D, P_v and dP_v at one state and the rate RATE, by derivatives in the rate; nothing of a law without damping."""
    if not law.is_dissipative():
        return {}
    still = strain(g)
    at_rest = law.dissipation(still, strain_rate(g, sp.zeros(3, 3)), parameters)
    p, dp = [], []
    for k in range(9):
        line = RATE + H * DIRECTION
        line[k] += S
        first = sp.diff(law.dissipation(still, strain_rate(g, line), parameters), S)
        p.append(first.subs({S: 0, H: 0}).evalf(45))
        dp.append(sp.diff(first, H).subs({S: 0, H: 0}).evalf(45))
    scale = max([abs(x) for x in dp])
    density = law.dissipation(still, strain_rate(g, RATE), parameters) - at_rest
    return {
        "rate": [exact(x) for x in RATE],
        "D": decimal(sp.sympify(density).evalf(45), scale),
        "P_v": [decimal(x, scale) for x in p],
        "dP_v": [decimal(x, scale) for x in dp],
    }


def main(arguments):
    check = "--check" in arguments
    names = [a for a in arguments if not a.startswith("-")]
    laws = [ROOT / "laws" / f"{n}.rs" for n in names] or sorted((ROOT / "laws").glob("*.rs"))
    different = []

    def write(kind, name, states):
        states = [s for s in states if s is not None]
        text = json.dumps({"law": name, "states": states}, indent=1) + "\n"
        target = ROOT / "tests/reference" / kind / f"{name}.json"
        if check:
            same = target.exists() and target.read_text() == text
            print(f"{kind} {name}: {len(states)} states, {'the same' if same else 'DIFFERENT from ' + str(target)}")
            different.extend([] if same else [name])
        else:
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(text)
            print(f"{kind} {name}: {len(states)} states written")

    for path in laws:
        if not names and not (ROOT / "laws/derived" / f"{path.stem}.ir").exists():
            print(f"{path.stem}: not reviewed, skipped")
            continue
        law = Law(path.read_text())
        write("sympy", path.stem, [values(law, m, g) for m in materials(law) for g in STATES])
        if any(token == "stretch_sum" for _, token in law.tokens):
            source = {name: law.defaults[name] or usual for name, usual in next(materials(law)).items()}
            write("stretches", path.stem, [values(law, source, g) for g in near_equal()])
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
