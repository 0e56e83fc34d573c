#include "platform/vulkan/vk_layout.h"

#include "platform/vulkan/vk_device.h"
#include "platform/vulkan/vk_format.h"
#include "platform/vulkan/vk_result.h"

#include <glint/base/format_error.h>

#include <algorithm>

namespace glint::vulkan {

namespace {

VkDescriptorType descriptorType(const ShaderResource& resource, bool dynamic) {
    switch (resource.descriptor) {
        case SlotKind::Uniform:
            return dynamic ? VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER_DYNAMIC : VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
        case SlotKind::Storage: return VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
        case SlotKind::Texture:
            return resource.combined ? VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER : VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE;
        case SlotKind::Surface: return VK_DESCRIPTOR_TYPE_STORAGE_IMAGE;
        case SlotKind::Sampler: return VK_DESCRIPTOR_TYPE_SAMPLER;
        case SlotKind::Tracing: return VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_KHR;
        case SlotKind::Texel:
            return resource.texel_storage ? VK_DESCRIPTOR_TYPE_STORAGE_TEXEL_BUFFER
                                          : VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
        case SlotKind::Table:
        case SlotKind::Count: break;
    }
    return VK_DESCRIPTOR_TYPE_MAX_ENUM;
}

}  // namespace

LayoutCache::~LayoutCache() {
    const DeviceFunctions& vk = device_.vk;
    for (const auto& layout : layouts_) vk.DestroyPipelineLayout(device_.handle, layout->handle, nullptr);
    for (const auto& set : sets_) {
        for (VkDescriptorPool pool : set->pools) vk.DestroyDescriptorPool(device_.handle, pool, nullptr);
        if (set->update) vk.DestroyDescriptorUpdateTemplate(device_.handle, set->update, nullptr);
        vk.DestroyDescriptorSetLayout(device_.handle, set->handle, nullptr);
    }
}

Expected<PipelineLayout*> LayoutCache::get(const BindingLayout& source) {
    uint32_t uniforms = 0;
    const auto forEachResource = [&source](auto visit) {
        for (const auto* resources : {&source.resources, &source.hidden})
            for (const ShaderResource& resource : *resources) visit(resource, resource.descriptorCount());
    };
    forEachResource([&](const ShaderResource& resource, uint32_t count) {
        if (resource.descriptor == SlotKind::Uniform) uniforms += count;
    });
    const VkPhysicalDeviceLimits& limits = device_.adapter.properties.limits;
    if (source.set_count > limits.maxBoundDescriptorSets) {
        return unexpected(makeError(ErrorCode::OutOfRange, "layout.sets", "set {} is used, the adapter has {} sets",
                                    source.set_count - 1, limits.maxBoundDescriptorSets));
    }

    auto layout = std::make_unique<PipelineLayout>();
    layout->dynamic = uniforms <= limits.maxDescriptorSetUniformBuffersDynamic;
    layout->push_size = (source.push_size + 3) / 4 * 4;
    layout->push_stages = vulkanStages(source.push_stages);
    layout->sets.resize(source.set_count);
    std::vector<std::vector<SetLayout::Binding>> bindings(source.set_count);
    uint32_t uniform = 0;
    forEachResource([&](const ShaderResource& resource, uint32_t count) {
        const VkDescriptorType type = descriptorType(resource, layout->dynamic);
        const bool is_table = resource.kind == SlotKind::Table;
        const uint32_t most = resource.element == SlotKind::Texture ? device_.features().maxTableTextures
                                                                    : device_.features().maxTableBuffers;
        bindings[resource.set].push_back(
            {resource.binding, is_table ? most : count, type, vulkanStages(resource.stages), is_table});
        const bool is_uniform = resource.descriptor == SlotKind::Uniform;
        PipelineLayout::Set& set = layout->sets[resource.set];
        if (set.element_count == 0) {
            set.first_element = static_cast<uint32_t>(layout->elements.size());
            set.first_uniform = uniform;
        }
        set.element_count += count;
        if (is_uniform) set.uniform_count += count;
        if (is_uniform) uniform += count;
        // A block of references has no size of its own: the structures' number gives it.
        const uint32_t size = resource.isRewritten() ? resource.count * 16 : resource.size;
        layout->elements.insert(layout->elements.end(), count,
                                {type, resource.dimension, is_uniform, is_uniform ? size : 0, is_table});
    });

    const std::lock_guard lock(mutex_);
    for (size_t i = 0; i < layout->sets.size(); i++) {
        Expected<SetLayout*> set = getSet(std::move(bindings[i]));
        if (!set) return unexpected(set.error());
        layout->sets[i].layout = *set;
    }
    for (const auto& known : layouts_) {
        const bool same = known->elements == layout->elements && known->push_size == layout->push_size &&
                          known->push_stages == layout->push_stages &&
                          std::equal(known->sets.begin(), known->sets.end(), layout->sets.begin(), layout->sets.end(),
                                     [](const auto& a, const auto& b) { return a.layout == b.layout; });
        if (same) return known.get();
    }

    std::vector<VkDescriptorSetLayout> handles;
    for (const PipelineLayout::Set& set : layout->sets) handles.push_back(set.layout->handle);
    const VkPushConstantRange range = {layout->push_stages, 0, layout->push_size};
    VkPipelineLayoutCreateInfo info = {VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO};
    info.setLayoutCount = static_cast<uint32_t>(handles.size());
    info.pSetLayouts = handles.data();
    info.pushConstantRangeCount = layout->push_size ? 1 : 0;
    info.pPushConstantRanges = &range;
    const VkResult result = device_.vk.CreatePipelineLayout(device_.handle, &info, nullptr, &layout->handle);
    if (result != VK_SUCCESS) return unexpected(resultError("vkCreatePipelineLayout", result));
    device_.memory.objects_created++;
    layouts_.push_back(std::move(layout));
    return layouts_.back().get();
}

Expected<SetLayout*> LayoutCache::getSet(std::vector<SetLayout::Binding> bindings) {
    for (const auto& known : sets_) {
        if (known->bindings == bindings) return known.get();
    }
    auto set = std::make_unique<SetLayout>();
    set->bindings = std::move(bindings);
    if (Status status = fill(*set); !status) {
        device_.vk.DestroyDescriptorSetLayout(device_.handle, set->handle, nullptr);
        return unexpected(status.error());
    }
    sets_.push_back(std::move(set));
    return sets_.back().get();
}

Status LayoutCache::fill(SetLayout& set) {
    std::vector<VkDescriptorSetLayoutBinding> bindings;
    std::vector<VkDescriptorUpdateTemplateEntry> entries;
    size_t element = 0;
    for (const SetLayout::Binding& binding : set.bindings) {
        bindings.push_back({binding.binding, binding.type, binding.count, binding.stages, nullptr});
        entries.push_back({binding.binding, 0, binding.count, binding.type, element * sizeof(DescriptorData),
                           sizeof(DescriptorData)});
        element += binding.count;
    }
    VkDescriptorSetLayoutCreateInfo info = {VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
    info.bindingCount = static_cast<uint32_t>(bindings.size());
    info.pBindings = bindings.data();
    // Tables are as long as each of them is, and write themselves (vk_table.h).
    const bool is_table = set.bindings.size() == 1 && set.bindings[0].table;
    constexpr VkDescriptorBindingFlags variable = VK_DESCRIPTOR_BINDING_VARIABLE_DESCRIPTOR_COUNT_BIT;
    VkDescriptorSetLayoutBindingFlagsCreateInfo flags = {
        VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_BINDING_FLAGS_CREATE_INFO};
    flags.bindingCount = 1;
    flags.pBindingFlags = &variable;
    if (is_table) info.pNext = &flags;
    VkResult result = device_.vk.CreateDescriptorSetLayout(device_.handle, &info, nullptr, &set.handle);
    if (result != VK_SUCCESS) return resultError("vkCreateDescriptorSetLayout", result);
    device_.memory.objects_created++;
    if (entries.empty() || is_table) return {};

    VkDescriptorUpdateTemplateCreateInfo update = {VK_STRUCTURE_TYPE_DESCRIPTOR_UPDATE_TEMPLATE_CREATE_INFO};
    update.descriptorUpdateEntryCount = static_cast<uint32_t>(entries.size());
    update.pDescriptorUpdateEntries = entries.data();
    update.templateType = VK_DESCRIPTOR_UPDATE_TEMPLATE_TYPE_DESCRIPTOR_SET;
    update.descriptorSetLayout = set.handle;
    result = device_.vk.CreateDescriptorUpdateTemplate(device_.handle, &update, nullptr, &set.update);
    if (result != VK_SUCCESS) return resultError("vkCreateDescriptorUpdateTemplate", result);
    device_.memory.objects_created++;
    return {};
}

Status LayoutCache::refill(SetLayout& layout) {
    const uint32_t count = layout.next_count;
    std::vector<VkDescriptorPoolSize> sizes;
    sizes.reserve(layout.bindings.size());
    for (const SetLayout::Binding& binding : layout.bindings) sizes.push_back({binding.type, binding.count * count});
    VkDescriptorPoolCreateInfo pool_info = {VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
    pool_info.maxSets = count;
    pool_info.poolSizeCount = static_cast<uint32_t>(sizes.size());
    pool_info.pPoolSizes = sizes.data();
    VkDescriptorPool pool = VK_NULL_HANDLE;
    VkResult result = device_.vk.CreateDescriptorPool(device_.handle, &pool_info, nullptr, &pool);
    if (result != VK_SUCCESS) return resultError("vkCreateDescriptorPool", result);
    const std::vector<VkDescriptorSetLayout> layouts(count, layout.handle);
    std::vector<VkDescriptorSet> sets(count);
    VkDescriptorSetAllocateInfo info = {VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO};
    info.descriptorPool = pool;
    info.descriptorSetCount = count;
    info.pSetLayouts = layouts.data();
    result = device_.vk.AllocateDescriptorSets(device_.handle, &info, sets.data());
    if (result != VK_SUCCESS) {
        device_.vk.DestroyDescriptorPool(device_.handle, pool, nullptr);
        return resultError("vkAllocateDescriptorSets", result);
    }
    layout.pools.push_back(pool);
    layout.next_count = std::min(count * 2, 1024u);
    layout.count += count;
    layout.free.reserve(layout.count);  // all may be free at once one day; recycling allocates nothing
    layout.free.insert(layout.free.end(), sets.begin(), sets.end());
    device_.memory.objects_created += 1 + count;
    return {};
}

}  // namespace glint::vulkan
