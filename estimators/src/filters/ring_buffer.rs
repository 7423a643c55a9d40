//! A short queue without a heap: samples that wait for what is not known yet.

use crate::api::snapshot::{Blank, State, state};

/// First in, first out; at most `N` wait.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RingBuffer<T, const N: usize> {
    places: [Option<T>; N],
    first: usize,
    count: usize,
}

impl<T: Copy, const N: usize> RingBuffer<T, N> {
    /// Nobody waits.
    pub fn new() -> Self {
        Self {
            places: [None; N],
            first: 0,
            count: 0,
        }
    }

    /// The one that has waited longest.
    pub fn first(&self) -> Option<T> {
        if self.count == 0 {
            return None;
        }
        self.places.get(self.first).copied().flatten()
    }

    /// Takes that one out.
    pub fn take(&mut self) -> Option<T> {
        let first = self.first()?;
        self.first = (self.first + 1) % N;
        self.count -= 1;
        Some(first)
    }

    /// Another one joins; if there is no room, the one that has waited longest is returned.
    pub fn join(&mut self, item: T) -> Option<T> {
        let out = if self.count == N { self.take() } else { None };
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
    fn first_come_first_served_and_nobody_is_lost() {
        let mut queue = RingBuffer::<u32, 3>::new();
        assert_eq!(queue.take(), None);
        let out: std::vec::Vec<u32> = (0..10).filter_map(|k| queue.join(k)).collect();
        assert_eq!(out, [0, 1, 2, 3, 4, 5, 6]);
        assert_eq!((queue.first(), queue.take()), (Some(7), Some(7)));
        assert_eq!(queue.join(10), None);
        assert_eq!(
            [queue.take(), queue.take(), queue.take(), queue.take()],
            [Some(8), Some(9), Some(10), None]
        );
    }
}
