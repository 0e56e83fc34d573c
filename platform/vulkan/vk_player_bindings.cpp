#include "platform/vulkan/vk_buffer.h"
#include "platform/vulkan/vk_device.h"
#include "platform/vulkan/vk_format.h"
#include "platform/vulkan/vk_player.h"
#include "platform/vulkan/vk_sampler.h"
#include "platform/vulkan/vk_table.h"
#include "platform/vulkan/vk_texture.h"
#include "platform/vulkan/vk_tracing.h"

#include <glint/device/detail/object.h>

#include <cstring>

namespace glint::vulkan {

using namespace detail;

namespace {

bool sameBytes(const void* a, const void* b, size_t size) { return a == b || (a && b && !std::memcmp(a, b, size)); }

}  // namespace

void Player::bindPipeline(BindPoint& point, VkPipeline pipeline) {
    if (point.pipeline == pipeline) return;
    vk_.CmdBindPipeline(commands_, point.point, pipeline);
    point.pipeline = pipeline;
}

bool Player::bind(BindPoint& point, const PipelineLayout& layout, const Bindings& bindings) {
    if (point.layout != &layout) {
        point.layout = &layout;
        point.bound = nullptr;
        point.push = nullptr;
        if (point.sets.size() < layout.sets.size()) point.sets.resize(layout.sets.size());
    }
    if (layout.push_size) {
        const std::byte* push = list_->at<std::byte>(bindings.push);
        const uint32_t size = std::min(layout.push_size, bindings.push_size);
        // Dispatches and rays of one list share the command buffer's push constants.
        if (pushed_ != &point || !sameBytes(push, point.push, size)) {
            vk_.CmdPushConstants(commands_, layout.handle, layout.push_stages, 0, size, push);
        }
        point.push = push;
        pushed_ = &point;
    }
    if (layout.elements.empty()) return true;

    const auto* bound = list_->at<BoundResource>(bindings.bound);
    const auto* uniforms = bindings.uniform_count ? list_->at<uint32_t>(bindings.uniform_offsets) : nullptr;
    if (bound == point.bound && uniforms == point.uniforms) return true;
    for (uint32_t i = 0; i < layout.sets.size(); i++) {
        const PipelineLayout::Set& set = layout.sets[i];
        if (set.element_count == 0) continue;
        const bool same_offsets =
            point.bound &&
            (set.uniform_count == 0 || sameBytes(uniforms + set.first_uniform, point.uniforms + set.first_uniform,
                                                 set.uniform_count * sizeof(uint32_t)));
        // Unchanged parts of a block that was recorded anew keep their sets.
        const bool same_resources = point.bound && sameBytes(bound + set.first_element, point.bound + set.first_element,
                                                             set.element_count * sizeof(BoundResource));
        if (same_resources && same_offsets) continue;
        if (!same_resources || !layout.dynamic) {
            const LayoutElement& first = layout.elements[set.first_element];
            const VkDescriptorSet written = first.table
                                                ? tableSet(*set.layout, first, bound[set.first_element].resource)
                                                : writeSet(layout, set, bound, uniforms);
            if (!written) {
                point.bound = nullptr;
                return false;
            }
            point.sets[i] = written;
        }
        const uint32_t offsets = layout.dynamic ? set.uniform_count : 0;
        vk_.CmdBindDescriptorSets(commands_, point.point, layout.handle, i, 1, &point.sets[i], offsets,
                                  offsets ? uniforms + set.first_uniform : nullptr);
    }
    point.bound = bound;
    point.uniforms = uniforms;
    return true;
}

VkDescriptorSet Player::writeSet(const PipelineLayout& layout, const PipelineLayout::Set& set,
                                 const BoundResource* elements, const uint32_t* uniforms) {
    if (set.layout->free.empty()) {
        if (Status status = device_.layouts.refill(*set.layout); !status) {
            fail(status.error());
            return VK_NULL_HANDLE;
        }
    }
    const VkDescriptorSet written = set.layout->free.back();
    set.layout->free.pop_back();
    frame_->sets.emplace_back(set.layout, written);
    if (descriptors_.size() < set.element_count) descriptors_.resize(set.element_count);
    uint32_t uniform = set.first_uniform;
    for (uint32_t i = 0; i < set.element_count; i++) {
        const LayoutElement& element = layout.elements[set.first_element + i];
        uint64_t offset = 0;
        if (element.uniform && !layout.dynamic && uniforms) offset = uniforms[uniform++];
        if (!writeElement(element, elements[set.first_element + i], offset, descriptors_[i])) return VK_NULL_HANDLE;
    }
    vk_.UpdateDescriptorSetWithTemplate(device_.handle, written, set.layout->update, descriptors_.data());
    return written;
}

VkDescriptorSet Player::tableSet(const SetLayout& layout, const LayoutElement& element, uint32_t resource) {
    const auto& contents = static_cast<const TableContents&>(*list_->resources[resource]);
    Expected<VkDescriptorSet> set = static_cast<VulkanTable&>(*contents.native).set(layout, element, contents);
    if (set) return *set;
    fail(set.error());
    return VK_NULL_HANDLE;
}

VkDescriptorBufferInfo Player::wholeBuffer(const BoundResource& bound) {
    const uint64_t size = static_cast<const BufferObject*>(list_->resources[bound.resource])->size;
    // Beyond the end, what comes first stands in: shaders do not go there.
    const uint64_t offset = bound.offset < size ? bound.offset : 0;
    return {buffer(bound.resource).handle(), offset, std::min(size - offset, device_.features().maxStorageSize)};
}

bool Player::writeElement(const LayoutElement& element, const BoundResource& bound, uint64_t uniform_offset,
                          DescriptorData& data) {
    switch (element.type) {
        case VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER:
        case VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER_DYNAMIC:
            if (bound.resource == none) {
                data.buffer = {inline_.buffer, inline_.offset + uniform_offset, bound.size};
            } else {
                data.buffer = {buffer(bound.resource).handle(), uniform_offset, bound.size};
            }
            return true;
        case VK_DESCRIPTOR_TYPE_STORAGE_BUFFER:
            data.buffer = {buffer(bound.resource).handle(), bound.offset, bound.size};
            if (bound.size == whole_buffer) data.buffer = wholeBuffer(bound);
            return true;
        case VK_DESCRIPTOR_TYPE_SAMPLER:
            data.image = {static_cast<VulkanSampler*>(list_->resources[bound.resource]->native.get())->handle(),
                          VK_NULL_HANDLE, VK_IMAGE_LAYOUT_UNDEFINED};
            return true;
        case VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_KHR:
            data.structure = static_cast<VulkanTracing*>(list_->resources[bound.resource]->native.get())->handle();
            return true;
        case VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER:
        case VK_DESCRIPTOR_TYPE_STORAGE_TEXEL_BUFFER: {
            Expected<VkBufferView> view =
                buffer(bound.resource)
                    .texels(bound.format, bound.offset, bound.size == whole_buffer ? VK_WHOLE_SIZE : bound.size);
            if (!view) {
                fail(view.error());
                return false;
            }
            data.texel = *view;
            return true;
        }
        default: break;
    }
    const bool is_storage = element.type == VK_DESCRIPTOR_TYPE_STORAGE_IMAGE;
    VulkanTexture& image = texture(bound.resource);
    Slice slice = bound.slice;
    const VkImageViewType type = viewType(element.dimension, image, slice);
    Expected<VkImageView> view = image.view(slice, type, mainAspect(image.desc().format));
    if (!view) {
        fail(view.error());
        return false;
    }
    VkSampler sampler = VK_NULL_HANDLE;
    if (element.type == VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER) {
        sampler = static_cast<VulkanSampler*>(list_->resources[bound.second]->native.get())->handle();
    }
    data.image = {sampler, *view, is_storage ? VK_IMAGE_LAYOUT_GENERAL : VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL};
    return true;
}

}  // namespace glint::vulkan
