//! One number of each drive unit, in rising order.

use crate::Real;
use crate::api::signals::MAX_DRIVES;

/// At most [`MAX_DRIVES`] numbers in rising order.
#[derive(Clone, Copy, Debug)]
pub struct Sorted {
    room: [Real; MAX_DRIVES],
    count: usize,
}

impl Sorted {
    /// Sorts the numbers; none may be NaN.
    #[inline]
    pub fn of(numbers: impl IntoIterator<Item = Real>) -> Self {
        let (mut room, mut count) = ([Real::INFINITY; MAX_DRIVES], 0);
        for (place, number) in room.iter_mut().zip(numbers) {
            *place = number;
            count += 1;
        }
        match room.first_chunk_mut::<8>() {
            Some(eight) if count <= 8 => sort_eight(eight),
            _ => room.sort_unstable_by(Real::total_cmp),
        }
        let mut sorted = Self { room, count };
        // Zeros of either sign pass for equal above; which one wins must not depend on the order of the units.
        if sorted.middle().is_some_and(|middle| middle.contains(&0.0)) {
            sorted.numbers_mut().sort_unstable_by(Real::total_cmp);
        }
        sorted
    }

    /// The two middle numbers, which are equal for an odd count; `None` without a number.
    #[inline]
    pub fn middle(&self) -> Option<[Real; 2]> {
        let last = self.count.checked_sub(1)?;
        Some([*self.room.get(last / 2)?, *self.room.get(self.count / 2)?])
    }

    /// The numbers.
    #[inline]
    pub fn numbers_mut(&mut self) -> &mut [Real] {
        self.room.get_mut(..self.count).unwrap_or_default()
    }
}

/// Sorts eight numbers by a network of 19 comparisons in 6 layers (Knuth, The Art of Computer Programming 3, 5.3.4): no
/// branch, and four comparisons side by side.
fn sort_eight(numbers: &mut [Real; 8]) {
    let [a, b, c, d, e, f, g, h] = *numbers;
    let ((a, c), (b, d), (e, g), (f, h)) = (pair(a, c), pair(b, d), pair(e, g), pair(f, h));
    let ((a, e), (b, f), (c, g), (d, h)) = (pair(a, e), pair(b, f), pair(c, g), pair(d, h));
    let ((a, b), (c, d), (e, f), (g, h)) = (pair(a, b), pair(c, d), pair(e, f), pair(g, h));
    let ((c, e), (d, f)) = (pair(c, e), pair(d, f));
    let ((b, e), (d, g)) = (pair(b, e), pair(d, g));
    let ((b, c), (d, e), (f, g)) = (pair(b, c), pair(d, e), pair(f, g));
    *numbers = [a, b, c, d, e, f, g, h];
}

/// Sorts two numbers, the smaller first.
fn pair(a: Real, b: Real) -> (Real, Real) {
    if a < b { (a, b) } else { (b, a) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A network sorts all numbers if it sorts all of zeros and ones (Knuth).
    #[test]
    fn eight_numbers_are_sorted() {
        for bits in 0..256_u32 {
            let mut numbers = core::array::from_fn(|i| Real::from((bits >> i) as u8 & 1));
            sort_eight(&mut numbers);
            assert!(numbers.is_sorted(), "{bits:b}");
            assert_eq!(numbers.iter().sum::<Real>(), bits.count_ones() as Real);
        }
    }

    #[test]
    fn the_middle_of_any_count_is_that_of_a_full_sort() {
        for count in 0..=MAX_DRIVES {
            let mut numbers: [Real; MAX_DRIVES] = core::array::from_fn(|i| {
                let number = (7 * i % 5) as Real - 2.0;
                if i % 2 == 0 { number } else { -number }
            });
            let numbers = &mut numbers[..count];
            let found = Sorted::of(numbers.iter().copied()).middle();
            numbers.sort_unstable_by(Real::total_cmp);
            let last = count.checked_sub(1);
            let expected = last.map(|last| [numbers[last / 2], numbers[count / 2]]);
            let bits = |middle: Option<[Real; 2]>| middle.map(|pair| pair.map(Real::to_bits));
            assert_eq!(bits(found), bits(expected), "{count}");
        }
    }
}
