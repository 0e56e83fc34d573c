#include <glint/base/format_error.h>
#include <glint/shader/reflection.h>

#include <algorithm>

namespace glint {

namespace {

/// A merged resource and the stage that brought it in.
struct Merged {
    ShaderResource resource;
    ShaderStage stage = ShaderStage::Compute;
};

std::string describe(const ShaderResource& resource) {
    std::string text = resource.combined ? "combined texture and sampler" : toString(resource.element);
    if (resource.element == SlotKind::Texel) text = resource.texel_storage ? "storage texel" : "uniform texel";
    if (resource.kind == SlotKind::Table) text = fmt::format("table of {}", text);
    static constexpr const char* dimensions[] = {
        "", " 2D", " 3D", " cube", " 2D array", " cube array", " 2D multisampled"};
    text += dimensions[static_cast<size_t>(resource.dimension)];
    if (resource.descriptor != resource.element) text += " of the software engine";
    text += fmt::format(" '{}'", resource.name);
    if (resource.count > 1) text += fmt::format(" of {} elements", resource.count);
    return text;
}

bool agree(const ShaderResource& a, const ShaderResource& b) {
    return a.kind == b.kind && a.element == b.element && a.descriptor == b.descriptor && a.combined == b.combined &&
           a.texel_storage == b.texel_storage && a.count == b.count &&
           (a.dimension == b.dimension || a.kind == SlotKind::Table);
}

bool isKnown(const ShaderResource& resource, std::string_view name) {
    return resource.name == name || resource.instance == name ||
           std::find(resource.aliases.begin(), resource.aliases.end(), name) != resource.aliases.end();
}

void addName(ShaderResource& resource, const std::string& name) {
    if (!name.empty() && !isKnown(resource, name)) resource.aliases.push_back(name);
}

void merge(ShaderResource& into, const ShaderResource& from) {
    into.size = std::max(into.size, from.size);
    if (into.stride == 0) into.stride = from.stride;
    into.read = into.read || from.read;
    into.write = into.write || from.write;
    into.has_lone_matrix = into.has_lone_matrix && from.has_lone_matrix;
    into.has_row_major = into.has_row_major || from.has_row_major;
    if (into.dimension != from.dimension) into.dimension = ImageDimension::None;
    into.stages |= from.stages;
    addName(into, from.name);
    addName(into, from.instance);
    for (const std::string& alias : from.aliases) addName(into, alias);
}

/// One list of the stages' resources, merged, in (set, binding) order.
Expected<std::vector<ShaderResource>> mergeResources(std::span<const Reflection* const> stages,
                                                     std::vector<ShaderResource> Reflection::*list) {
    std::vector<Merged> merged;
    for (const Reflection* reflection : stages) {
        for (const ShaderResource& resource : reflection->*list) {
            const auto same = std::find_if(merged.begin(), merged.end(), [&](const Merged& other) {
                return other.resource.set == resource.set && other.resource.binding == resource.binding;
            });
            if (same == merged.end()) {
                merged.push_back({resource, reflection->stage});
            } else if (agree(same->resource, resource)) {
                merge(same->resource, resource);
            } else {
                return unexpected(makeError(ErrorCode::ShaderCompile, "shader.binding_conflict",
                                            "set {}, binding {} is {} in the {} stage, but {} in the {} stage",
                                            resource.set, resource.binding, describe(same->resource),
                                            toString(same->stage), describe(resource), toString(reflection->stage)));
            }
        }
    }
    std::sort(merged.begin(), merged.end(), [](const Merged& a, const Merged& b) {
        return a.resource.set != b.resource.set ? a.resource.set < b.resource.set
                                                : a.resource.binding < b.resource.binding;
    });
    std::vector<ShaderResource> result;
    result.reserve(merged.size());
    for (Merged& entry : merged) result.push_back(std::move(entry.resource));
    return result;
}

}  // namespace

const char* toString(ShaderStage stage) {
    static constexpr const char* names[] = {"Vertex",  "Control",  "Evaluate",     "Geometry", "Fragment",
                                            "Compute", "Task",     "Mesh",         "RayGen",   "RayMiss",
                                            "Closest", "FirstHit", "Intersection", "Callable"};
    return stage < ShaderStage::Count ? names[static_cast<size_t>(stage)] : "Unknown";
}

const char* toString(SlotKind kind) {
    static constexpr const char* names[] = {"uniform", "storage", "texture", "surface",
                                            "sampler", "tracing", "texel",   "table"};
    return kind < SlotKind::Count ? names[static_cast<size_t>(kind)] : "unknown";
}

Expected<BindingLayout> mergeLayouts(std::span<const Reflection* const> stages) {
    BindingLayout layout;
    for (const Reflection* reflection : stages) {
        layout.stages |= stageBit(reflection->stage);
        if (reflection->push_size) layout.push_stages |= stageBit(reflection->stage);
        layout.push_size = std::max(layout.push_size, reflection->push_size);
    }
    Expected<std::vector<ShaderResource>> resources = mergeResources(stages, &Reflection::resources);
    if (!resources) return unexpected(resources.error());
    layout.resources = std::move(*resources);
    resources = mergeResources(stages, &Reflection::hidden);
    if (!resources) return unexpected(resources.error());
    layout.hidden = std::move(*resources);
    for (const ShaderResource& resource : layout.hidden)
        layout.set_count = std::max(layout.set_count, resource.set + 1);
    for (uint32_t i = 0; i < layout.resources.size(); i++) {
        const ShaderResource& resource = layout.resources[i];
        layout.slots[static_cast<size_t>(resource.kind)].push_back(i);
        if (resource.combined && resource.kind == SlotKind::Texture)
            layout.slots[static_cast<size_t>(SlotKind::Sampler)].push_back(i);
        layout.set_count = std::max(layout.set_count, resource.set + 1);
    }
    return layout;
}

const ShaderResource* BindingLayout::find(SlotKind kind, uint32_t slot) const {
    const std::vector<uint32_t>& list = slots[static_cast<size_t>(kind)];
    return slot < list.size() ? &resources[list[slot]] : nullptr;
}

int32_t BindingLayout::findSlot(SlotKind kind, std::string_view name) const {
    const std::vector<uint32_t>& list = slots[static_cast<size_t>(kind)];
    const auto found = std::find_if(list.begin(), list.end(),
                                    [&](uint32_t index) { return !name.empty() && isKnown(resources[index], name); });
    return found == list.end() ? -1 : static_cast<int32_t>(found - list.begin());
}

int32_t BindingLayout::findSlot(SlotKind kind, uint32_t set, uint32_t binding) const {
    const std::vector<uint32_t>& list = slots[static_cast<size_t>(kind)];
    const auto found = std::find_if(list.begin(), list.end(), [&](uint32_t index) {
        return resources[index].set == set && resources[index].binding == binding;
    });
    return found == list.end() ? -1 : static_cast<int32_t>(found - list.begin());
}

}  // namespace glint
