#include <glint/base/hash.h>

#include <fmt/format.h>
#define XXH_INLINE_ALL
#include <xxhash.h>

namespace glint {

std::string Hash::hex() const { return fmt::format("{:016x}{:016x}", high, low); }

Hash hashBytes(const void* data, size_t size, const Hash& seed) {
    // XXH3 takes 64 bits of seed; the other half of a chained hash goes in after the data has been hashed.
    const XXH128_hash_t hash = XXH3_128bits_withSeed(data, size, seed.low ^ (seed.high * 0x9e3779b97f4a7c15ull));
    return {hash.low64, hash.high64};
}

}  // namespace glint
