// Random numbers by hashing: the same on every device, in whatever order they are asked for. #include <glint/random.h>.
#pragma once

// Mixes all bits; one to one (the finaliser of MurmurHash3).
uint glintHash(uint x) {
    x ^= x >> 16;
    x *= 0x85ebca6bu;
    x ^= x >> 13;
    x *= 0xc2b2ae35u;
    return x ^ (x >> 16);
}

// A hash of two numbers, so of any number of them: glintHash(glintHash(a, b), c).
uint glintHash(uint a, uint b) { return glintHash(a * 0x9e3779b9u + glintHash(b + 0x7f4a7c15u)); }

// In [0, 1), in steps of 2^-24.
float glintUniform(uint hash) { return float(hash >> 8) * 5.9604644775390625e-8; }
