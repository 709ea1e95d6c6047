//! Optimal excitation trajectories within all limits.
