//! Robot files and logs: URDF, DH tables in TOML, CSV
