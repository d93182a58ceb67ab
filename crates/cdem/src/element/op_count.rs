//! How many operations a kernel takes: it runs on numbers that know nothing but how they are
//! worked out.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use crate::element::element_set::Formulation;
use crate::element::geometry::{IntegrationPoints, Lame, NodalValues};
use crate::element::simd::Real;

/// Additions, subtractions, multiplications and divisions that the forces of an element take, from
/// displacements relative to its first node on, to the forces themselves: what is done at nodes is
/// not in them.
///
/// As compilers do: what is the same is worked out once, what nothing comes of is left out, and so
/// is what has no effect, as adding −0, and what is the same of all elements. To change a sign is
/// not counted.
pub(super) fn operations<F, const D: usize, const N: usize, const Q: usize>() -> usize
where
    F: Formulation<D, N, Q>,
{
    let trace = RefCell::new(Trace::default());
    let given = || Traced::new(&trace, NumberOrigin::Element);
    let vectors = || [0; N].map(|_| [0; D].map(|_| given()));
    let element = UnknownElement {
        gradients: [0; Q].map(|_| vectors()),
        volumes: [0; Q].map(|_| given()),
        lame: Lame {
            lambda: Traced::new(&trace, NumberOrigin::Material),
            mu: Traced::new(&trace, NumberOrigin::Material),
        },
    };
    let mut record: Vec<Traced> = (0..F::RECORD).map(|_| given()).collect();
    let force = F::respond(&element, &vectors(), &mut record[..]);
    let results = force.as_flattened().iter().chain(&record);
    let results: Vec<usize> = results.map(|number| number.place).collect();
    trace.borrow().needed(&results)
}

/// An element of which nothing is known.
struct UnknownElement<'a, const D: usize, const N: usize, const Q: usize> {
    gradients: [NodalValues<D, N, Traced<'a>>; Q],
    volumes: [Traced<'a>; Q],
    lame: Lame<Traced<'a>>,
}

impl<'a, const D: usize, const N: usize, const Q: usize> IntegrationPoints<D, N, Q, Traced<'a>>
    for UnknownElement<'a, D, N, Q>
{
    fn lame(&self) -> Lame<Traced<'a>> {
        self.lame
    }

    fn point(&self, q: usize) -> (NodalValues<D, N, Traced<'a>>, Traced<'a>) {
        (self.gradients[q], self.volumes[q])
    }
}

/// Where a number comes from; other numbers by their places in the trace.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum NumberOrigin {
    /// Is known of each element.
    Element,
    /// Is the same of all elements of a material.
    Material,
    /// Bits of a constant.
    Constant(u64),
    Negative(usize),
    Result(Operation, [usize; 2]),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Operation {
    Add,
    Subtract,
    Multiply,
    Divide,
}

/// All numbers so far, those that others come from first.
#[derive(Debug, Default)]
struct Trace {
    numbers: Vec<TracedNumber>,
    /// Places of what was worked out.
    worked_out: BTreeMap<NumberOrigin, usize>,
}

#[derive(Clone, Copy, Debug)]
struct TracedNumber {
    origin: NumberOrigin,
    /// From element to element.
    varies: bool,
}

impl Trace {
    /// The place of a number; what comes from the same is the same.
    fn place(&mut self, origin: NumberOrigin) -> usize {
        let varies = match origin {
            NumberOrigin::Element => true,
            NumberOrigin::Material | NumberOrigin::Constant(_) => false,
            NumberOrigin::Negative(of) => self.numbers[of].varies,
            NumberOrigin::Result(_, of) => of.iter().any(|&of| self.numbers[of].varies),
        };
        let place = self.numbers.len();
        if !matches!(origin, NumberOrigin::Element | NumberOrigin::Material) {
            if let Some(&known) = self.worked_out.get(&origin) {
                return known;
            }
            self.worked_out.insert(origin, place);
        }
        self.numbers.push(TracedNumber { origin, varies });
        place
    }

    fn is(&self, place: usize, constant: f64) -> bool {
        self.numbers[place].origin == NumberOrigin::Constant(constant.to_bits())
    }

    /// The place of what comes of two numbers.
    fn result(&mut self, operator: Operation, [left, right]: [usize; 2]) -> usize {
        if matches!(operator, Operation::Subtract | Operation::Divide) {
            return self.place(NumberOrigin::Result(operator, [left, right]));
        }
        // In either order the same.
        for [one, other] in [[left, right], [right, left]] {
            match operator {
                Operation::Add if self.is(one, -0.0) => return other,
                Operation::Multiply if self.is(one, 1.0) => return other,
                Operation::Multiply if self.is(one, -1.0) => {
                    return self.place(NumberOrigin::Negative(other));
                }
                _ => {}
            }
        }
        let ordered = [left.min(right), left.max(right)];
        self.place(NumberOrigin::Result(operator, ordered))
    }

    /// Operations on what varies that `results` come from.
    fn needed(&self, results: &[usize]) -> usize {
        let mut is_needed = vec![false; self.numbers.len()];
        results.iter().for_each(|&place| is_needed[place] = true);
        let mut operations = 0;
        for place in (0..self.numbers.len()).rev() {
            let number = self.numbers[place];
            if !(is_needed[place] && number.varies) {
                continue;
            }
            match number.origin {
                NumberOrigin::Result(_, of) => {
                    operations += 1;
                    of.iter().for_each(|&of| is_needed[of] = true);
                }
                NumberOrigin::Negative(of) => is_needed[of] = true,
                NumberOrigin::Element | NumberOrigin::Material | NumberOrigin::Constant(_) => {}
            }
        }
        operations
    }
}

/// A number, by its place in a trace.
#[derive(Clone, Copy)]
struct Traced<'a> {
    trace: &'a RefCell<Trace>,
    place: usize,
}

impl<'a> Traced<'a> {
    fn new(trace: &'a RefCell<Trace>, origin: NumberOrigin) -> Self {
        let place = trace.borrow_mut().place(origin);
        Self { trace, place }
    }

    fn with(self, operator: Operation, other: Self) -> Self {
        let of = [self.place, other.place];
        Self {
            place: self.trace.borrow_mut().result(operator, of),
            ..self
        }
    }
}

impl Real for Traced<'_> {
    fn constant(self, value: f64) -> Self {
        Self::new(self.trace, NumberOrigin::Constant(value.to_bits()))
    }
}

macro_rules! operator {
    ($trait:ident, $function:ident, $operator:ident) => {
        impl $trait for Traced<'_> {
            type Output = Self;

            fn $function(self, other: Self) -> Self {
                self.with(Operation::$operator, other)
            }
        }
    };
}

operator!(Add, add, Add);
operator!(Sub, sub, Subtract);
operator!(Mul, mul, Multiply);
operator!(Div, div, Divide);

impl Neg for Traced<'_> {
    type Output = Self;

    fn neg(self) -> Self {
        Self::new(self.trace, NumberOrigin::Negative(self.place))
    }
}

impl AddAssign for Traced<'_> {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Traced<'_> {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::hypoelastic::Hypoelastic;
    use crate::element::total_lagrangian::TotalLagrangian;

    fn total<const D: usize, const N: usize, const Q: usize>() -> [usize; 2] {
        // Of what is symmetric one half.
        let half = D * (D + 1) / 2;
        let gradient = D * D * (2 * (N - 1) - 1);
        let strain = half * (2 * D - 1) + 3 * half;
        let stress = D - 1 + 1 + half + D;
        let first_piola = D * D * 2 * D;
        let divergence = D * D + (N - 1) * D * 2 * D;
        // The first addition to what is nothing yet takes none.
        let first = (N - 1) * D;
        let balance = (N - 2) * D;
        let points = Q * (gradient + strain + stress + first_piola + divergence);
        [
            operations::<TotalLagrangian, D, N, Q>(),
            points - first + balance,
        ]
    }

    #[test]
    fn strain_from_the_start_takes_what_is_on_paper() {
        for [traced, on_paper] in [
            total::<2, 3, 1>(),
            total::<2, 4, 4>(),
            total::<3, 4, 1>(),
            total::<3, 6, 6>(),
            total::<3, 8, 8>(),
        ] {
            assert_eq!(traced, on_paper);
        }
    }

    /// Simplices, line by line of its kernel.
    #[test]
    fn increments_take_what_is_on_paper() {
        let plane = [
            12,                // gradient now
            2 + 12,            // P before: 1 + H, product with its cofactors
            4,                 // step
            2 + 4 + 3 + 1 + 4, // twice the middle, its determinant and inverse
            12,                // half of the increment
            1 + 1 + 3 * 2 + 2, // stress of it
            3,                 // added
            2 + 1,             // skew part, its square
            1 + 3,             // 2/(1 + w·w)
            3 + 1,             // rotation, whose diagonal is one number
            12 - 1 + 3 * 3,    // turned from both sides: one product is there twice
            3,                 // the other half added
            12,                // P now
            4 + 7 + 1 + 2,     // work
            4 + 12 + 2,        // forces
        ];
        let space = [
            45,
            3 + 27 + 45,
            9,
            3 + 9 + 27 + 5 + 1 + 9,
            45,
            2 + 1 + 6 * 2 + 3,
            6,
            6 + 9, // the products on the diagonal are three
            2 + 3,
            6 + 9 + 3, // skew and symmetric part added
            45 + 6 * 5,
            6,
            27 + 45,
            9 + 17 + 1 + 2,
            9 + 45 + 6,
        ];
        let traced = [
            operations::<Hypoelastic, 2, 3, 1>(),
            operations::<Hypoelastic, 3, 4, 1>(),
        ];
        let on_paper = [plane, space].map(|lines| lines.iter().sum::<usize>());
        assert_eq!(traced, on_paper);
    }
}
