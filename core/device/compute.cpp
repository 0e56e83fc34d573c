#include <glint/device/compute.h>

#include <glint/device/detail/recorder_core.h>

namespace glint {

using detail::CommandType;

void Compute::setKernel(const Kernel& kernel, Where where) {
    if (core_) core_->setKernel(kernel, where);
}

void Compute::setTraversal(const Traversal& traversal, uint32_t generation, Where where) {
    if (core_) core_->setTraversal(traversal, generation, where);
}

void Compute::dispatch(uint64_t width, uint64_t height, uint64_t depth, Where where) {
    if (core_) core_->dispatch(width, height, depth, where);
}

void Compute::dispatch(const Texture& texture, Where where) {
    if (core_ && core_->check(texture, "dispatch", where))
        core_->dispatch(texture.getWidth(), texture.getHeight(), texture.getDepth(), where);
}

void Compute::dispatchIndirect(const Buffer& buffer, uint64_t offset, Where where) {
    if (core_) core_->dispatchIndirect(buffer, offset, where);
}

void Compute::setBuffer(const Buffer& buffer, uint64_t offset, const void* data, uint64_t size, Where where) {
    if (core_) core_->setBufferData(buffer, offset, data, size, where);
}

void Compute::copyBuffer(const Buffer& destination, uint64_t destination_offset, const Buffer& source,
                         uint64_t source_offset, uint64_t size, Where where) {
    if (core_) core_->copyBuffer(destination, destination_offset, source, source_offset, size, where);
}

void Compute::clearBuffer(const Buffer& buffer, uint32_t value, uint64_t offset, uint64_t size, Where where) {
    if (core_) core_->clearBuffer(buffer, value, offset, size, where);
}

void Compute::setTexture(const Texture& texture, const void* data, uint64_t size, const Slice& slice,
                         const Region& region, Where where) {
    if (core_) core_->setTextureData(texture, data, size, slice, region, where);
}

void Compute::copyTexture(const Texture& destination, const Slice& destination_slice, const Texture& source,
                          const Slice& source_slice, const Region& source_region, uint32_t x, uint32_t y, uint32_t z,
                          Where where) {
    if (core_) core_->copyTexture(destination, destination_slice, source, source_slice, source_region, x, y, z, where);
}

void Compute::copyTextureToBuffer(const Buffer& destination, uint64_t offset, const Texture& source, const Slice& slice,
                                  const Region& region, Where where) {
    if (core_)
        core_->copyBufferTexture(CommandType::CopyTextureToBuffer, source, destination, offset, slice, region, where);
}

void Compute::copyBufferToTexture(const Texture& destination, const Buffer& source, uint64_t offset, const Slice& slice,
                                  const Region& region, Where where) {
    if (core_)
        core_->copyBufferTexture(CommandType::CopyBufferToTexture, destination, source, offset, slice, region, where);
}

void Compute::clearTexture(const Texture& texture, const Color& color, const Slice& slice, Where where) {
    if (core_) core_->clearTexture(texture, color, slice, where);
}

void Compute::createMipmaps(const Texture& texture, Where where) {
    if (core_) core_->createMipmaps(texture, where);
}

void Compute::setInstances(const Tracing& tracing, std::span<const Tracing::Instance> instances, Where where) {
    if (core_) core_->setInstances(tracing, instances, where);
}

void Compute::buildTracing(const Tracing& tracing, Where where) {
    if (core_) core_->buildTracing(tracing, Buffer(), 0, false, where);
}

void Compute::buildTracing(const Tracing& tracing, const Buffer& scratch, uint64_t offset, Where where) {
    if (core_ && core_->check(scratch, "buildTracing", where))
        core_->buildTracing(tracing, scratch, offset, false, where);
}

void Compute::updateTracing(const Tracing& tracing, Where where) {
    if (core_) core_->buildTracing(tracing, Buffer(), 0, true, where);
}

void Compute::updateTracing(const Tracing& tracing, const Buffer& scratch, uint64_t offset, Where where) {
    if (core_ && core_->check(scratch, "updateTracing", where))
        core_->buildTracing(tracing, scratch, offset, true, where);
}

}  // namespace glint
