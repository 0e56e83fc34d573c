#include "platform/vulkan/vk_table.h"

#include "platform/vulkan/vk_buffer.h"
#include "platform/vulkan/vk_device.h"
#include "platform/vulkan/vk_format.h"
#include "platform/vulkan/vk_result.h"
#include "platform/vulkan/vk_texture.h"

namespace glint::vulkan {

using namespace detail;

VulkanTable::~VulkanTable() {
    for (const Set& set : sets_) device_.vk.DestroyDescriptorPool(device_.handle, set.pool, nullptr);
}

Expected<VkDescriptorSet> VulkanTable::set(const SetLayout& layout, const LayoutElement& element,
                                           const TableContents& contents) {
    for (const Set& known : sets_) {
        if (known.layout == layout.handle && known.dimension == element.dimension) return known.handle;
    }
    Expected<Set> made = allocate(layout, element, static_cast<uint32_t>(contents.entries.size()));
    if (!made) return unexpected(made.error().named(name_));
    sets_.push_back(*made);
    if (contents.element == SlotKind::Storage) {
        writeBuffers(made->handle, layout, contents);
    } else if (Status status = writeTextures(made->handle, layout, element.dimension, contents); !status) {
        return unexpected(status.error().named(name_));
    }
    return made->handle;
}

Expected<VulkanTable::Set> VulkanTable::allocate(const SetLayout& layout, const LayoutElement& element,
                                                 uint32_t count) {
    Set set{layout.handle, element.dimension};
    const VkDescriptorPoolSize size = {element.type, count};
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
    info.pSetLayouts = &layout.handle;
    result = device_.vk.AllocateDescriptorSets(device_.handle, &info, &set.handle);
    if (result != VK_SUCCESS) {
        device_.vk.DestroyDescriptorPool(device_.handle, set.pool, nullptr);
        return unexpected(resultError("vkAllocateDescriptorSets", result));
    }
    device_.memory.objects_created += 2;
    return set;
}

Status VulkanTable::writeTextures(VkDescriptorSet set, const SetLayout& layout, ImageDimension dimension,
                                  const TableContents& contents) {
    // Without a view it is a null descriptor, which reads as 0.
    std::vector<VkDescriptorImageInfo> infos(
        contents.entries.size(), {VK_NULL_HANDLE, VK_NULL_HANDLE, VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL});
    for (size_t i = 0; i < infos.size(); i++) {
        const TableContents::Entry& entry = contents.entries[i];
        if (!entry.object) continue;
        auto& texture = *static_cast<VulkanTexture*>(entry.object->native.get());
        Slice slice = entry.slice;
        const VkImageViewType type = viewType(dimension, texture, slice);
        Expected<VkImageView> view = texture.view(slice, type, mainAspect(texture.desc().format));
        if (!view) return view.error();
        infos[i].imageView = *view;
    }
    VkWriteDescriptorSet write = {VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
    write.dstSet = set;
    write.dstBinding = layout.bindings[0].binding;
    write.descriptorCount = static_cast<uint32_t>(infos.size());
    write.descriptorType = VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE;
    write.pImageInfo = infos.data();
    device_.vk.UpdateDescriptorSets(device_.handle, 1, &write, 0, nullptr);
    return {};
}

void VulkanTable::writeBuffers(VkDescriptorSet set, const SetLayout& layout, const TableContents& contents) {
    std::vector<VkDescriptorBufferInfo> infos(contents.entries.size(), {VK_NULL_HANDLE, 0, VK_WHOLE_SIZE});
    for (size_t i = 0; i < infos.size(); i++) {
        const TableContents::Entry& entry = contents.entries[i];
        if (!entry.object) continue;
        infos[i] = {static_cast<VulkanBuffer*>(entry.object->native.get())->handle(), entry.offset, entry.size};
    }
    VkWriteDescriptorSet write = {VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
    write.dstSet = set;
    write.dstBinding = layout.bindings[0].binding;
    write.descriptorCount = static_cast<uint32_t>(infos.size());
    write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    write.pBufferInfo = infos.data();
    device_.vk.UpdateDescriptorSets(device_.handle, 1, &write, 0, nullptr);
}

}  // namespace glint::vulkan
