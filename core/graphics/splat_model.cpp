#include <glint/graphics/splat_model.h>

#include <glint/base/format_error.h>

#include <glm/geometric.hpp>
#include <glm/gtc/packing.hpp>

#include <algorithm>
#include <bit>
#include <new>

namespace glint {

namespace {

constexpr float largest_half = 65504.0f;
constexpr uint32_t fixed_words = 7;  ///< position, scale, opacity

uint32_t halfOf(float value) { return glm::packHalf1x16(std::clamp(value, -largest_half, largest_half)); }
uint32_t normalisedOf(float value) { return glm::packSnorm1x16(value); }

uint32_t wordsOf(uint32_t coefficients, SplatModel::Storage storage) {
    const uint32_t harmonics = 3 * coefficients;
    return storage == SplatModel::StorageHalf ? fixed_words + 2 + (harmonics + 1) / 2 : fixed_words + 4 + harmonics;
}

/// A splat's words, `stride` words from one to the next.
void encode(const Splats& splats, size_t splat, SplatModel::Storage storage, uint32_t* words, size_t stride) {
    const auto put = [&](uint32_t word) {
        *words = word;
        words += stride;
    };
    for (int i = 0; i < 3; i++) put(std::bit_cast<uint32_t>(splats.positions[splat][i]));
    for (int i = 0; i < 3; i++) put(std::bit_cast<uint32_t>(splats.scales[splat][i]));
    put(std::bit_cast<uint32_t>(splats.opacities[splat]));
    const Vector4f& rotation = splats.rotations[splat];
    const uint32_t coefficients = splats.coefficientCount();
    const Vector3f* harmonics = splats.harmonics.data() + splat * coefficients;
    const auto harmonic = [&](uint32_t i) { return harmonics[i / 3][static_cast<int>(i % 3)]; };
    if (storage == SplatModel::StorageFloat) {
        for (int i = 0; i < 4; i++) put(std::bit_cast<uint32_t>(rotation[i]));
        for (uint32_t i = 0; i < 3 * coefficients; i++) put(std::bit_cast<uint32_t>(harmonic(i)));
        return;
    }
    for (int i = 0; i < 4; i += 2) put(normalisedOf(rotation[i]) | normalisedOf(rotation[i + 1]) << 16);
    for (uint32_t i = 0; i < 3 * coefficients; i += 2) {
        const uint32_t high = i + 1 < 3 * coefficients ? halfOf(harmonic(i + 1)) : 0;
        put(halfOf(harmonic(i)) | high << 16);
    }
}

}  // namespace

SplatModel::SplatModel(const Device& device, const Splats& splats, Storage storage, Where where) {
    // Carried.
    (void)create(device, splats, storage, where);
}

Error SplatModel::error() const {
    if (error_ || device_) return error_;
    return makeError(ErrorCode::InvalidArgument, "handle.null", "the splat model was not created");
}

Status SplatModel::create(const Device& device, const Splats& splats, Storage storage, Where where) {
    *this = SplatModel();
    if (!device) return Status(error_ = device.error().at(where));
    device_ = device;
    Status status;
    try {
        status = build(device, splats, storage, where);
    } catch (const std::bad_alloc&) {
        status = makeError(where, ErrorCode::OutOfMemory, "splats.out_of_memory",
                           "the host has no memory to encode {} splats", splats.size());
    }
    if (status) return {};
    chunks_.clear();
    error_ = status.error().at(where);
    device_.report(error_);
    return error_;
}

Status SplatModel::build(const Device& device, const Splats& splats, Storage storage, Where where) {
    if (Status status = splats.validate(); !status) return status;
    if (splats.size() >= UINT32_MAX)
        return makeError(ErrorCode::OutOfRange, "splats.too_many", "a model of {} splats; one has at most {}",
                         splats.size(), UINT32_MAX - 1);
    storage_ = storage;
    degree_ = splats.degree;
    size_ = static_cast<uint32_t>(splats.size());
    bounds_ = splats.bounds();

    const uint32_t words = wordsOf(splats.coefficientCount(), storage);
    const Features& features = device.getFeatures();
    const uint64_t room = std::min(features.maxStorageSize, features.maxBufferSize) / (uint64_t{words} * 4);
    std::vector<uint32_t> data;
    for (uint32_t first = 0; first < size_;) {
        const auto count = static_cast<uint32_t>(std::min<uint64_t>(size_ - first, room));
        data.resize(size_t{count} * words);
        for (uint32_t i = 0; i < count; i++) encode(splats, first + i, storage, data.data() + i, count);
        const Buffer buffer =
            Device(device).createBuffer(Buffer::FlagStorage, std::span<const uint32_t>(data), "splats", where);
        if (!buffer) return buffer.error();
        chunks_.push_back({buffer, first, count});
        first += count;
    }
    return {};
}

uint64_t SplatModel::getMemory() const {
    uint64_t bytes = 0;
    for (const Chunk& chunk : chunks_) bytes += chunk.buffer.getSize();
    return bytes;
}

uint32_t SplatModel::splatSize(uint32_t degree, Storage storage) {
    return wordsOf((degree + 1) * (degree + 1), storage) * 4;
}

Splats SplatModel::decoded(const Splats& splats, Storage storage) {
    Splats result = splats;
    for (Vector4f& rotation : result.rotations) {
        Vector4d q(rotation);
        if (storage == StorageHalf)
            for (int i = 0; i < 4; i++)
                q[i] = static_cast<double>(static_cast<int16_t>(normalisedOf(rotation[i]))) / 32767.0;
        rotation = Vector4f(q / glm::length(q));
    }
    if (storage == StorageHalf)
        for (Vector3f& harmonic : result.harmonics)
            for (int i = 0; i < 3; i++) harmonic[i] = glm::unpackHalf1x16(static_cast<uint16_t>(halfOf(harmonic[i])));
    return result;
}

}  // namespace glint
