//! Operation counts of the kernels. A kernel runs on traced numbers, which record only their
//! origin.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use crate::element::element_set::Formulation;
use crate::element::geometry::{IntegrationPoints, Lame, NodalValues};
use crate::element::simd::Real;

/// Returns the number of additions, subtractions, multiplications and divisions for the forces of
/// an element. It counts from displacements relative to the first node to the forces; operations at
/// nodes are not counted.
///
/// It counts as compilers do: equal results are computed once. Unused results, operations without
/// effect, such as adding −0, and results that are the same for all elements do not count. A change
/// of sign does not count either.
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

/// An element whose numbers are all unknown.
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

/// Origin of a number; other numbers are given by their indices in the trace.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum NumberOrigin {
    /// Known for each element.
    Element,
    /// The same for all elements of a material.
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

/// All numbers so far. The operands of a number come before it.
#[derive(Debug, Default)]
struct Trace {
    numbers: Vec<TracedNumber>,
    /// Indices of computed numbers.
    worked_out: BTreeMap<NumberOrigin, usize>,
}

#[derive(Clone, Copy, Debug)]
struct TracedNumber {
    origin: NumberOrigin,
    /// True if the number varies from element to element.
    varies: bool,
}

impl Trace {
    /// Returns the index of a number. Numbers of the same computed origin are the same number.
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

    /// Returns the index of the result of an operation on two numbers.
    fn result(&mut self, operator: Operation, [left, right]: [usize; 2]) -> usize {
        if matches!(operator, Operation::Subtract | Operation::Divide) {
            return self.place(NumberOrigin::Result(operator, [left, right]));
        }
        // Both orders give the same result.
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

    /// Returns the number of operations on varying numbers that `results` depend on.
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

/// A number, by its index in a trace.
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
        // One half of a symmetric tensor.
        let half = D * (D + 1) / 2;
        let gradient = D * D * (2 * (N - 1) - 1);
        let strain = half * (2 * D - 1) + 3 * half;
        let stress = D - 1 + 1 + half + D;
        let first_piola = D * D * 2 * D;
        let divergence = D * D + (N - 1) * D * 2 * D;
        // The first addition to zero takes no operation.
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

    /// Counts for simplices, line by line of the kernel.
    #[test]
    fn increments_take_what_is_on_paper() {
        let plane = [
            12,                // gradient now
            2 + 12,            // P before: 1 + H, product with its cofactors
            4,                 // step
            2 + 4 + 3 + 1 + 4, // twice the middle, its determinant and inverse
            12,                // half of the increment
            1 + 1 + 3 * 2 + 2, // its stress
            3,                 // sum with the old stress
            2 + 1,             // skew part, its square
            1 + 3,             // 2/(1 + w·w)
            3 + 1,             // rotation, whose diagonal is one number
            12 - 1 + 3 * 3,    // rotation from both sides: one product occurs twice
            3,                 // sum with the other half
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
            6 + 9, // the diagonal has three products
            2 + 3,
            6 + 9 + 3, // sum of skew and symmetric part
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
