#pragma once

#include "platform/vulkan/vk_functions.h"

#include <glint/base/expected.h>
#include <glint/base/status.h>
#include <glint/shader/reflection.h>

#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace glint::vulkan {

class VulkanDevice;

/// What one descriptor is written from; an update template's stride.
union DescriptorData {
    VkDescriptorBufferInfo buffer;
    VkDescriptorImageInfo image;
    VkBufferView texel;
    VkAccelerationStructureKHR structure;
};

/// A descriptor set layout, the template that writes its sets, and the sets that no submission uses.
struct SetLayout {
    struct Binding {
        uint32_t binding = 0;
        uint32_t count = 1;
        VkDescriptorType type = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
        VkShaderStageFlags stages = 0;
        bool table = false;  ///< alone in its set, `count` at most
        bool operator==(const Binding&) const = default;
    };

    std::vector<Binding> bindings;  ///< in order
    VkDescriptorSetLayout handle = VK_NULL_HANDLE;
    VkDescriptorUpdateTemplate update = VK_NULL_HANDLE;  ///< DescriptorData of all elements, in order
    std::vector<VkDescriptorPool> pools;
    std::vector<VkDescriptorSet> free;
    uint32_t next_count = 8;  ///< sets of the next pool
    size_t count = 0;         ///< sets, free or in use
};

/// How one element of a binding block becomes a descriptor.
struct LayoutElement {
    VkDescriptorType type = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
    ImageDimension dimension = ImageDimension::None;
    bool uniform = false;
    uint32_t size = 0;  ///< uniforms: bytes of the block
    bool table = false;
    bool operator==(const LayoutElement&) const = default;
};

/// A pipeline layout. Programs with equal bindings share it, so that changing between them keeps the descriptors.
struct PipelineLayout {
    struct Set {
        SetLayout* layout = nullptr;
        uint32_t first_element = 0;  ///< in a binding block
        uint32_t element_count = 0;  ///< 0: nothing to bind
        uint32_t first_uniform = 0;  ///< in Bindings::uniform_offsets
        uint32_t uniform_count = 0;
    };

    std::vector<Set> sets;
    std::vector<LayoutElement> elements;
    bool dynamic = true;  ///< uniforms have dynamic offsets
    VkShaderStageFlags push_stages = 0;
    uint32_t push_size = 0;
    VkPipelineLayout handle = VK_NULL_HANDLE;
};

/// All layouts of a device, each once, for the device's life.
class LayoutCache {
public:
    explicit LayoutCache(VulkanDevice& device) : device_(device) {}
    ~LayoutCache();
    LayoutCache(const LayoutCache&) = delete;
    LayoutCache& operator=(const LayoutCache&) = delete;

    /// From any thread. Errors: "layout.sets", "vulkan.result", ...
    Expected<PipelineLayout*> get(const BindingLayout& layout);

    /// Makes more free sets. Under the submit lock.
    Status refill(SetLayout& layout);

private:
    Expected<SetLayout*> getSet(std::vector<SetLayout::Binding> bindings);
    Status fill(SetLayout& set);

    VulkanDevice& device_;
    std::mutex mutex_;
    std::vector<std::unique_ptr<SetLayout>> sets_;
    std::vector<std::unique_ptr<PipelineLayout>> layouts_;
};

}  // namespace glint::vulkan
