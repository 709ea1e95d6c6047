//! Poses, and residuals off them.
