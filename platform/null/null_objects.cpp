#include <platform/null/null_objects.h>

#include <glint/device/detail/texture_layout.h>

#include <algorithm>
#include <cstring>
#include <memory>

namespace glint::null {

using namespace detail;

namespace {

uint64_t alignUp(uint64_t value) { return (value + 255) / 256 * 256; }

uint64_t primitives(const NativeTracingDesc& desc) {
    uint64_t count = desc.type == Tracing::TypeInstance ? desc.instances : 0;
    for (const TracingGeometry& geometry : desc.geometries)
        count += desc.type == Tracing::TypeBound ? geometry.bounds
                                                 : (geometry.index_buffer ? geometry.indices : geometry.vertices) / 3;
    return count;
}

}  // namespace

HostMemory::HostMemory(uint64_t size) {
    size_t room = static_cast<size_t>(size) + alignment;
    block_.reset(std::calloc(room, 1));
    void* position = block_.get();
    if (position) data_ = static_cast<std::byte*>(std::align(alignment, static_cast<size_t>(size), position, room));
}

uint64_t NullTexture::size(const NativeTextureDesc& native) {
    uint64_t layer = 0;
    for (uint32_t mip = 0; mip < native.desc.mipmaps; mip++)
        layer += dataSize(native.desc.format, mipRegion(native.desc, mip)) * native.samples;
    return layer * native.desc.layers;
}

NullTexture::NullTexture(std::shared_ptr<NullControl> control, const NativeTextureDesc& native)
    : NullMemory(std::move(control), size(native), native.name),
      desc(native.desc),
      samples(native.samples),
      bytes(size(native)) {
    memory = size(native);
    mips = desc.mipmaps;
    layers = desc.layers;
    for (uint32_t mip = 0; mip < desc.mipmaps; mip++) {
        mip_offsets.push_back(layer_size);
        layer_size += dataSize(desc.format, mipRegion(desc, mip)) * samples;
    }
}

uint64_t NullTracing::size(const NativeTracingDesc& desc) {
    return desc.compacted_size ? desc.compacted_size : alignUp(512 + 64 * primitives(desc));
}

NullTracing::NullTracing(std::shared_ptr<NullControl> control, const NativeTracingDesc& desc)
    : NullMemory(std::move(control), size(desc), desc.name), type(desc.type), is_compacted(desc.compacted_size != 0) {
    memory = size(desc);
    address = (life.id() + 1) << 20;
    if (desc.compacted_size == 0) {
        build_size = alignUp(256 + 32 * primitives(desc));
        update_size = desc.flags & Tracing::FlagUpdate ? alignUp(build_size / 2) : 0;
        compacted_size = desc.flags & Tracing::FlagCompact ? alignUp(memory / 2) : 0;
    }
    for (const TracingGeometry& geometry : desc.geometries)
        for (const Object* input : {geometry.vertex_buffer, geometry.index_buffer, geometry.bound_buffer})
            if (input && std::ranges::find(inputs, input) == inputs.end()) inputs.push_back(input);
}

std::vector<uint64_t> referencesOf(std::span<const std::byte> records) {
    std::vector<uint64_t> addresses;
    for (size_t i = 0; i < records.size(); i += sizeof(InstanceRecord)) {
        InstanceRecord record;
        std::memcpy(&record, records.data() + i, sizeof(record));
        if (record.address && (addresses.empty() || addresses.back() != record.address))
            addresses.push_back(record.address);
    }
    std::ranges::sort(addresses);
    const auto rest = std::ranges::unique(addresses);
    addresses.erase(rest.begin(), rest.end());
    return addresses;
}

}  // namespace glint::null
