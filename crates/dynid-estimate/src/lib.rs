//! Estimators and statistics on triangular factors
