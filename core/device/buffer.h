#pragma once

#include <glint/device/handle.h>

#include <cstdint>

namespace glint {

/// A range of device memory. Created by Device::createBuffer.
class Buffer : public Handle {
public:
    /// What the buffer is used for; a use that its flags do not name fails with "buffer.flag".
    /// Copies to and from it (setBuffer, getBuffer, copyBuffer, clearBuffer) need no flag.
    enum Flag : uint32_t {
        FlagNone = 0,
        FlagUniform = 1u << 0,
        FlagStorage = 1u << 1,
        FlagVertex = 1u << 2,
        FlagIndex = 1u << 3,
        FlagIndirect = 1u << 4,
        FlagTexel = 1u << 5,
        FlagAddress = 1u << 6,  ///< shaders reach it by address; needs FeatureBufferAddress
        FlagTracing = 1u << 7,  ///< input of an acceleration structure build
        FlagScratch = 1u << 8,  ///< scratch memory of builds
        FlagMapped = 1u << 9,   ///< in host memory, at map() for its whole life
    };
    using Flags = uint32_t;

    Buffer() = default;
    explicit Buffer(detail::Object* object) : Handle(object) {}

    /// Bytes; 0 unless ready.
    uint64_t getSize() const;
    Flags getFlags() const;
    /// Device address. 0 unless ready and made with FlagAddress, FlagTracing or FlagScratch.
    /// A list that reaches the buffer by its address alone has to be told so: Recorder::useBuffer.
    uint64_t getAddress() const;
    /// Host address of a buffer with FlagMapped, else nullptr. Reading what the GPU wrote needs Device::finish() or a
    /// Fence first; writing needs that the GPU is done with it.
    void* map() const;
};

/// Both flags.
constexpr Buffer::Flags operator|(Buffer::Flag a, Buffer::Flag b) {
    return static_cast<Buffer::Flags>(a) | static_cast<Buffer::Flags>(b);
}

}  // namespace glint
