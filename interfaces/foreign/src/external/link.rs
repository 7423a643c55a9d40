//! A way to an estimator outside of the program.

use monorig_wire::frame::Frame;

/// A way to an estimator: frames there and back. The errors say what is wrong at the other end, in words that follow
/// its name.
pub(super) trait Link: Send {
    /// Returns the address of the other end for messages.
    fn at(&self) -> &str;

    /// Begins to put frames together.
    fn begin(&mut self);

    /// Adds a frame of this time, ns.
    fn put(&mut self, frame: &Frame, ns: i64);

    /// Sends the frames that were put together, at once; they can be sent again.
    fn send(&mut self) -> Result<(), String>;

    /// Waits no more, neither for frames nor for the other end to take them.
    fn never_wait(&mut self) -> Result<(), String>;

    /// Waits for frames, for half a second at most; hands them over. False if none came.
    fn receive(&mut self, each: &mut dyn FnMut(&Frame)) -> Result<bool, String>;
}
