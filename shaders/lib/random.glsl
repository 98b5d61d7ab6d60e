// SPDX-License-Identifier: MIT
// Counter-based random numbers (pcg hash, Jarzynski and Olano 2020): the same on every device.
uint random_hash(uint v) {
    const uint state = v * 747796405u + 2891336453u;
    const uint word = ((state >> ((state >> 28) + 4u)) ^ state) * 277803737u;
    return (word >> 22) ^ word;
}
uint random_seed(uint seed, uint index) {
    return random_hash(seed ^ random_hash(index));
}
// Uniform in [0, 1), 24 bits.
float random_uniform(inout uint state) {
    state = random_hash(state);
    return float(state >> 8) * (1.0 / 16777216.0);
}
