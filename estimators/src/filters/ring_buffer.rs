//! Ring buffer without a heap.

use crate::api::snapshot::{Blank, State, state};

/// Ring buffer of at most `N` items, first in, first out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RingBuffer<T, const N: usize> {
    places: [Option<T>; N],
    first: usize,
    count: usize,
}

impl<T: Copy, const N: usize> RingBuffer<T, N> {
    /// An empty one.
    pub fn new() -> Self {
        Self {
            places: [None; N],
            first: 0,
            count: 0,
        }
    }

    /// The oldest item.
    pub fn first(&self) -> Option<T> {
        if self.count == 0 {
            return None;
        }
        self.places.get(self.first).copied().flatten()
    }

    /// Removes the oldest item.
    pub fn pop(&mut self) -> Option<T> {
        let first = self.first()?;
        self.first = (self.first + 1) % N;
        self.count -= 1;
        Some(first)
    }

    /// Adds an item; if there is no room, the oldest item is removed and returned.
    pub fn push(&mut self, item: T) -> Option<T> {
        let out = if self.count == N { self.pop() } else { None };
        let place = (self.first + self.count) % N.max(1);
        if let Some(place) = self.places.get_mut(place) {
            *place = Some(item);
            self.count += 1;
        }
        out
    }
}

impl<T: Copy, const N: usize> Default for RingBuffer<T, N> {
    fn default() -> Self {
        Self::new()
    }
}

state!(@[T: State + Blank, const N: usize] RingBuffer<T, N> { places, first, count; }
    where |this| this.first < N.max(1) && this.count <= N);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_in_first_out_and_nothing_is_lost() {
        let mut queue = RingBuffer::<u32, 3>::new();
        assert_eq!(queue.pop(), None);
        let out: std::vec::Vec<u32> = (0..10).filter_map(|k| queue.push(k)).collect();
        assert_eq!(out, [0, 1, 2, 3, 4, 5, 6]);
        assert_eq!((queue.first(), queue.pop()), (Some(7), Some(7)));
        assert_eq!(queue.push(10), None);
        assert_eq!(
            [queue.pop(), queue.pop(), queue.pop(), queue.pop()],
            [Some(8), Some(9), Some(10), None]
        );
    }
}
