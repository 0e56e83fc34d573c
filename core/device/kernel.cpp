#include <glint/device/kernel.h>

#include <glint/base/format_error.h>
#include <glint/device/detail/device_object.h>

namespace glint {

namespace detail {

Expected<std::unique_ptr<Native>> KernelObject::createNative(const Stages& stages, Where where) {
    if (!stages.find(ShaderStage::Compute))
        return unexpected(problem(where, ErrorCode::InvalidArgument, "program.stage", "there is no compute shader"));

    const std::array<uint32_t, 3> size = stages.groupSize(0);
    const Features& limits = device()->features();
    const uint64_t threads = static_cast<uint64_t>(size[0]) * size[1] * size[2];
    const bool within = size[0] <= limits.maxGroupSizeX && size[1] <= limits.maxGroupSizeY &&
                        size[2] <= limits.maxGroupSizeZ && threads <= limits.maxGroupThreads;
    if (!within || threads == 0)
        return unexpected(
            problem(where, ErrorCode::OutOfRange, "kernel.group_size",
                    fmt::format("groups of {} x {} x {} threads, the device takes {} x {} x {} and {} in all", size[0],
                                size[1], size[2], limits.maxGroupSizeX, limits.maxGroupSizeY, limits.maxGroupSizeZ,
                                limits.maxGroupThreads)));

    auto made = device()->backend->createKernel({.stage = stages.desc(0), .layout = &layout, .name = name()});
    if (!made) return unexpected(made.error().at(where).named(name()));
    group_size = size;
    return std::move(*made);
}

}  // namespace detail

Kernel& Kernel::setUniforms(uint32_t count, Where where) {
    declareSlots(SlotKind::Uniform, 0, count, Shader::MaskCompute, where);
    return *this;
}
Kernel& Kernel::setStorages(uint32_t count, Where where) {
    declareSlots(SlotKind::Storage, 0, count, Shader::MaskCompute, where);
    return *this;
}
Kernel& Kernel::setTextures(uint32_t count, Where where) {
    declareSlots(SlotKind::Texture, 0, count, Shader::MaskCompute, where);
    return *this;
}
Kernel& Kernel::setSurfaces(uint32_t count, Where where) {
    declareSlots(SlotKind::Surface, 0, count, Shader::MaskCompute, where);
    return *this;
}
Kernel& Kernel::setSamplers(uint32_t count, Where where) {
    declareSlots(SlotKind::Sampler, 0, count, Shader::MaskCompute, where);
    return *this;
}
Kernel& Kernel::setTracings(uint32_t count, Where where) {
    declareSlots(SlotKind::Tracing, 0, count, Shader::MaskCompute, where);
    return *this;
}
Kernel& Kernel::setTexels(uint32_t count, Where where) {
    declareSlots(SlotKind::Texel, 0, count, Shader::MaskCompute, where);
    return *this;
}

namespace {

uint32_t groupSize(const Kernel& kernel, size_t axis) {
    return kernel ? static_cast<const detail::KernelObject*>(kernel.object())->group_size[axis] : 1;
}

}  // namespace

uint32_t Kernel::getGroupSizeX() const { return groupSize(*this, 0); }
uint32_t Kernel::getGroupSizeY() const { return groupSize(*this, 1); }
uint32_t Kernel::getGroupSizeZ() const { return groupSize(*this, 2); }

}  // namespace glint
