//! monorig-tests
