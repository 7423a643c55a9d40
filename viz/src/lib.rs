//! monorig-viz
