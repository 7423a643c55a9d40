//! A connection to an estimator outside the program.

use monorig_wire::frame::Frame;

/// A connection to an estimator: frames there and back. The errors say what is wrong at the other end, in words that
/// follow its name.
pub(super) trait Link: Send {
    /// Returns the address of the other end for messages.
    fn at(&self) -> &str;

    /// Begins a group of frames.
    fn begin(&mut self);

    /// Adds a frame of this time, ns.
    fn put(&mut self, frame: &Frame, ns: i64);

    /// Sends the group of frames at once; the group can be sent again.
    fn send(&mut self) -> Result<(), String>;

    /// Stops every wait for frames or for the other end.
    fn never_wait(&mut self) -> Result<(), String>;

    /// Waits for frames for at most half a second; passes them on. False if none came.
    fn receive(&mut self, each: &mut dyn FnMut(&Frame)) -> Result<bool, String>;
}
