#pragma once

#include "platform/vulkan/vk_layout.h"

#include <glint/device/detail/table_object.h>

#include <vector>

namespace glint::vulkan {

/// Descriptor sets of a table's contents: one for each layout that they are bound with, made when first asked for.
class VulkanTable final : public detail::NativeTable {
public:
    explicit VulkanTable(VulkanDevice& device) : device_(device) {}
    ~VulkanTable() override;

    void setName(const std::string& name) override { name_ = name; }
    /// `element` says the type and the dimension of the descriptors. Under the submit lock.
    Expected<VkDescriptorSet> set(const SetLayout& layout, const LayoutElement& element,
                                  const detail::TableContents& contents);

private:
    struct Set {
        VkDescriptorSetLayout layout = VK_NULL_HANDLE;
        ImageDimension dimension = ImageDimension::None;
        VkDescriptorPool pool = VK_NULL_HANDLE;
        VkDescriptorSet handle = VK_NULL_HANDLE;
    };

    Expected<Set> allocate(const SetLayout& layout, const LayoutElement& element, uint32_t count);
    Status writeTextures(VkDescriptorSet set, const SetLayout& layout, ImageDimension dimension,
                         const detail::TableContents& contents);
    void writeBuffers(VkDescriptorSet set, const SetLayout& layout, const detail::TableContents& contents);

    VulkanDevice& device_;
    std::string name_;
    std::vector<Set> sets_;
};

}  // namespace glint::vulkan
