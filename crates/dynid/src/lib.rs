//! Dynamic identification of robots and mechanisms: the pipeline from a robot file and a log to a model
