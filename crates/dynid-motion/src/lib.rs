//! Motion and effort signals: logs, clocks, filters, kernels, trajectories
