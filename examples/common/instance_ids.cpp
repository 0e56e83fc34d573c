#include "common/instance_ids.h"

#include <glint/format/npy.h>

using namespace glint;

void InstanceIds::begin(Device& device, uint32_t width, uint32_t height) {
    if (!isWanted()) return;
    if (width != width_ || height != height_)
        buffer_ = device.createBuffer(Buffer::FlagStorage, 4ull * width * height, "instance ids");
    width_ = width;
    height_ = height;
    device.clearBuffer(buffer_, UINT32_MAX);
}

Status InstanceIds::save(Device& device) const {
    if (!isWanted()) return {};
    const Expected<std::vector<uint32_t>> ids = device.read<uint32_t>(buffer_);
    if (!ids) return ids.error();
    Expected<NpyWriter> writer = NpyWriter::create(path_, {{NpyField::of<uint32_t>()}, {height_, width_}});
    if (!writer) return writer.error();
    if (Status status = writer->write(std::as_bytes(std::span(*ids))); !status) return status;
    return writer->close();
}
