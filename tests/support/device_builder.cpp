#include "support/device_builder.h"

#include <glint/tracing/detail/header.h>

#include <fmt/format.h>

#include <cstring>
#include <stdexcept>

namespace glint::test {

namespace {

using namespace detail;

void check(const Status& status) {
    if (!status) throw std::runtime_error(status.error().text());
}

}  // namespace

Buffer DeviceBuilder::createHeap(uint64_t texels) {
    Buffer::Flags flags = Buffer::FlagTexel | Buffer::FlagStorage;
    if (heap_ == HeapForm::Address) flags |= Buffer::FlagAddress;
    return device_.createBuffer(flags, texels * sizeof(Texel), "heap");
}

Buffer DeviceBuilder::createStorage(std::span<const std::byte> bytes) {
    std::vector<std::byte> padded(std::max<size_t>((bytes.size() + 3) / 4 * 4, 4));
    std::copy(bytes.begin(), bytes.end(), padded.begin());
    return device_.createBuffer(Buffer::FlagStorage, std::span(padded));
}

const Kernel& DeviceBuilder::kernel(BuildKernel kernel) {
    Kernel& result = kernels_[static_cast<uint32_t>(kernel)];
    if (!result) {
        result = device_.createKernel(fmt::format("build {}", static_cast<uint32_t>(kernel)));
        result.createShaderGLSL(kernelSource(kernel), fmt::format("GLINT_TRACING_MEMORY={};GLINT_TRACING_NODES={}",
                                                                  static_cast<int>(heap_), static_cast<int>(nodes_)));
        check(result.create());
    }
    return result;
}

void DeviceBuilder::record(Compute& compute, const BuildPlan& plan, const Buffer& heap, const Buffer& scratch,
                           std::span<const GeometryBuffers> geometries) {
    if (heap_ == HeapForm::Address) compute.useBuffer(heap, true);
    for (const BuildPass& pass : plan.passes) {
        compute.setKernel(kernel(pass.kernel));
        uint32_t slot = 0;
        if (usesHeap(pass.kernel)) {
            if (heap_ == HeapForm::Texels) compute.setTexelBuffer(0, heap, FormatRGBAu32);
            if (heap_ == HeapForm::Storage) compute.setStorageBuffer(slot++, heap);
        }
        compute.setStorageBuffer(slot++, scratch);
        for (uint32_t i = 0; i < pass.input_count; i++) {
            const BuildBinding& input = pass.inputs[i];
            const Buffer& buffer = input.buffer == BuildBinding::Buffer::Scratch ? scratch
                                   : input.buffer == BuildBinding::Buffer::Data  ? geometries[input.geometry].data
                                                                                 : geometries[input.geometry].indices;
            compute.setStorageBuffer(slot++, buffer, input.offset, input.size);
        }
        BuildConstants constants = pass.constants;
        constants.heap_address[0] = static_cast<uint32_t>(heap.getAddress());
        constants.heap_address[1] = static_cast<uint32_t>(heap.getAddress() >> 32);
        compute.setPushConstants(constants);
        compute.dispatch(pass.threads);
    }
}

void DeviceBuilder::play(const BuildPlan& plan, const Buffer& heap, std::span<const GeometryBuffers> geometries) {
    const Buffer scratch = device_.createBuffer(Buffer::FlagStorage, plan.scratch, "scratch");
    // What is read before it is written would be seen.
    device_.clearBuffer(scratch, 0xdeadbeefu);
    Compute compute = device_.createCompute();
    record(compute, plan, heap, scratch, geometries);
    check(device_.submit(compute));
}

Hierarchy DeviceBuilder::read(const Buffer& heap, uint32_t texel) {
    Header header;
    check(device_.getBuffer(heap, texel * sizeof(Texel), &header, sizeof(header)));
    Hierarchy hierarchy;
    hierarchy.kind = static_cast<Hierarchy::Kind>(header.kind);
    hierarchy.form = nodes_;
    hierarchy.nodes = header.nodes;
    hierarchy.records = header.records;
    size_t texels = hierarchy.firstRecord() + 3 * size_t(header.records);
    if (hierarchy.kind == Hierarchy::Kind::Instances) texels = heap.getSize() / sizeof(Texel) - texel;
    if ((texel + texels) * sizeof(Texel) > heap.getSize()) throw std::runtime_error("a header of nonsense");
    hierarchy.texels = Array<Texel>(texels);
    check(device_.getBuffer(heap, texel * sizeof(Texel), hierarchy.texels.data(), hierarchy.bytes()));
    return hierarchy;
}

}  // namespace glint::test
