//! monorig-lab
