#pragma once

#include "common/device.h"

#include <filesystem>

/// What `--ids FILE.npy` asks for: the instance that each pixel of the last frame shows, as an array of uint32 of the
/// shape (height, width), 0xffffffff where there is none. Made before Example::parse.
class InstanceIds {
public:
    explicit InstanceIds(Example& example) {
        example.add("--ids", path_, "Write the instance that each pixel shows to this file (.npy)");
    }

    bool isWanted() const { return !path_.empty(); }
    /// To append to a shader's macros: INSTANCE_IDS where they are wanted.
    const char* macro() const { return isWanted() ? ";INSTANCE_IDS=1" : ""; }

    /// Makes room for a frame and fills it with 0xffffffff; does nothing unless they are wanted.
    void begin(glint::Device& device, uint32_t width, uint32_t height);
    /// A storage buffer, row after row. Null unless they are wanted.
    const glint::Buffer& buffer() const { return buffer_; }

    /// Waits for the device and writes the file; does nothing unless they are wanted. Errors: those of NpyWriter and of
    /// reading a buffer.
    glint::Status save(glint::Device& device) const;

private:
    std::filesystem::path path_;
    glint::Buffer buffer_;
    uint32_t width_ = 0;
    uint32_t height_ = 0;
};
