//! All tests of the crate from outside, in one program: each program would be linked against everything again.

mod accuracy;
mod backlash;
mod bristles;
mod clearance;
mod closed_robots;
mod compare;
mod design;
mod elastic;
mod elements;
mod export;
mod friction_experiments;
mod friction_laws;
mod friction_recorded;
mod friction_report;
mod identifiability;
mod instruments;
mod least_squares;
mod online;
mod payload;
mod periodic;
mod preflight;
mod recorded_logs;
mod support;
mod trust;
mod two_step;
mod virtual_experiment;
