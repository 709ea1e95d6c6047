//! Time per sample: `cargo bench -p dynid-online --bench update`.

fn main() {
    divan::main();
}
