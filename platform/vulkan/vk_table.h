#pragma once

#include "platform/vulkan/vk_layout.h"

#include <glint/device/detail/table_object.h>

#include <mutex>
#include <vector>

namespace glint::vulkan {

/// Descriptor sets of tables that are not in use. lavapipe makes a set as large as its layout, whatever the table's
/// count, and clears it: that takes milliseconds, writing an old one anew tens of microseconds.
class TableSets {
public:
    struct Set {
        VkDescriptorSetLayout layout = VK_NULL_HANDLE;
        uint32_t count = 0;  ///< descriptors
        VkDescriptorPool pool = VK_NULL_HANDLE;
        VkDescriptorSet handle = VK_NULL_HANDLE;
    };

    explicit TableSets(VulkanDevice& device) : device_(device) {}
    ~TableSets();
    TableSets(const TableSets&) = delete;
    TableSets& operator=(const TableSets&) = delete;

    /// A set that nobody uses, with whatever in it. From any thread.
    Expected<Set> acquire(VkDescriptorSetLayout layout, VkDescriptorType type, uint32_t count);
    /// The GPU is done with it. From any thread.
    void release(const Set& set);

private:
    VulkanDevice& device_;
    std::mutex mutex_;
    std::vector<Set> free_;  ///< the last one was released last
};

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
        TableSets::Set set;
        ImageDimension dimension = ImageDimension::None;
    };

    Status write(VkDescriptorSet set, uint32_t binding, const LayoutElement& element,
                 const detail::TableContents& contents);

    VulkanDevice& device_;
    std::string name_;
    std::vector<Set> sets_;
};

}  // namespace glint::vulkan
