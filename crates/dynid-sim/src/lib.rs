//! Virtual experiments: controlled robots in motion, with sensors and all their faults.
