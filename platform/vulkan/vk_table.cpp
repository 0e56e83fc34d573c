#include "platform/vulkan/vk_table.h"

#include "platform/vulkan/vk_buffer.h"
#include "platform/vulkan/vk_device.h"
#include "platform/vulkan/vk_format.h"
#include "platform/vulkan/vk_result.h"
#include "platform/vulkan/vk_texture.h"

#include <algorithm>

namespace glint::vulkan {

using namespace detail;

namespace {

/// As many as a few tables have that change with each frame while others are in flight.
constexpr size_t most_free = 8;

}  // namespace

TableSets::~TableSets() {
    for (const Set& set : free_) device_.vk.DestroyDescriptorPool(device_.handle, set.pool, nullptr);
}

Expected<TableSets::Set> TableSets::acquire(VkDescriptorSetLayout layout, VkDescriptorType type, uint32_t count) {
    {
        std::lock_guard lock(mutex_);
        const auto known = std::find_if(free_.rbegin(), free_.rend(),
                                        [&](const Set& set) { return set.layout == layout && set.count == count; });
        if (known != free_.rend()) {
            const Set set = *known;
            free_.erase(std::next(known).base());
            return set;
        }
    }
    Set set{layout, count};
    const VkDescriptorPoolSize size = {type, count};
    VkDescriptorPoolCreateInfo pool_info = {VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
    pool_info.maxSets = 1;
    pool_info.poolSizeCount = 1;
    pool_info.pPoolSizes = &size;
    VkResult result = device_.vk.CreateDescriptorPool(device_.handle, &pool_info, nullptr, &set.pool);
    if (result != VK_SUCCESS) return unexpected(resultError("vkCreateDescriptorPool", result));
    VkDescriptorSetVariableDescriptorCountAllocateInfo variable = {
        VK_STRUCTURE_TYPE_DESCRIPTOR_SET_VARIABLE_DESCRIPTOR_COUNT_ALLOCATE_INFO};
    variable.descriptorSetCount = 1;
    variable.pDescriptorCounts = &count;
    VkDescriptorSetAllocateInfo info = {VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO};
    info.pNext = &variable;
    info.descriptorPool = set.pool;
    info.descriptorSetCount = 1;
    info.pSetLayouts = &layout;
    result = device_.vk.AllocateDescriptorSets(device_.handle, &info, &set.handle);
    if (result != VK_SUCCESS) {
        device_.vk.DestroyDescriptorPool(device_.handle, set.pool, nullptr);
        return unexpected(resultError("vkAllocateDescriptorSets", result));
    }
    device_.memory.objects_created += 2;
    return set;
}

void TableSets::release(const Set& set) {
    VkDescriptorPool oldest = VK_NULL_HANDLE;
    {
        std::lock_guard lock(mutex_);
        if (free_.size() == most_free) {
            oldest = free_.front().pool;
            free_.erase(free_.begin());
        }
        free_.push_back(set);
    }
    if (oldest) device_.vk.DestroyDescriptorPool(device_.handle, oldest, nullptr);
}

VulkanTable::~VulkanTable() {
    for (const Set& each : sets_) device_.tables.release(each.set);
}

Expected<VkDescriptorSet> VulkanTable::set(const SetLayout& layout, const LayoutElement& element,
                                           const TableContents& contents) {
    for (const Set& known : sets_) {
        if (known.set.layout == layout.handle && known.dimension == element.dimension) return known.set.handle;
    }
    const Expected<TableSets::Set> made =
        device_.tables.acquire(layout.handle, element.type, static_cast<uint32_t>(contents.entries.size()));
    if (!made) return unexpected(made.error().named(name_));
    if (Status status = write(made->handle, layout.bindings[0].binding, element, contents); !status) {
        device_.tables.release(*made);
        return unexpected(status.error().named(name_));
    }
    sets_.push_back({*made, element.dimension});
    return made->handle;
}

Status VulkanTable::write(VkDescriptorSet set, uint32_t binding, const LayoutElement& element,
                          const TableContents& contents) {
    // Without an object it is a null descriptor, which reads as 0.
    const size_t count = contents.entries.size();
    const bool is_buffer = contents.element == SlotKind::Storage;
    std::vector<VkDescriptorBufferInfo> buffers(is_buffer ? count : 0, {VK_NULL_HANDLE, 0, VK_WHOLE_SIZE});
    std::vector<VkDescriptorImageInfo> images(
        is_buffer ? 0 : count, {VK_NULL_HANDLE, VK_NULL_HANDLE, VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL});
    for (size_t i = 0; i < count; i++) {
        const TableContents::Entry& entry = contents.entries[i];
        if (!entry.object) continue;
        if (is_buffer) {
            buffers[i] = {static_cast<VulkanBuffer*>(entry.object->native.get())->handle(), entry.offset, entry.size};
            continue;
        }
        auto& texture = *static_cast<VulkanTexture*>(entry.object->native.get());
        Slice slice = entry.slice;
        const VkImageViewType type = viewType(element.dimension, texture, slice);
        Expected<VkImageView> view = texture.view(slice, type, mainAspect(texture.desc().format));
        if (!view) return view.error();
        images[i].imageView = *view;
    }
    VkWriteDescriptorSet write = {VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
    write.dstSet = set;
    write.dstBinding = binding;
    write.descriptorCount = static_cast<uint32_t>(count);
    write.descriptorType = element.type;
    write.pImageInfo = images.data();
    write.pBufferInfo = buffers.data();
    device_.vk.UpdateDescriptorSets(device_.handle, 1, &write, 0, nullptr);
    return {};
}

}  // namespace glint::vulkan
