#include "platform/vulkan/vk_buffer.h"
#include "platform/vulkan/vk_device.h"
#include "platform/vulkan/vk_format.h"
#include "platform/vulkan/vk_pipeline.h"
#include "platform/vulkan/vk_player.h"
#include "platform/vulkan/vk_texture.h"

#include <glint/device/detail/object.h>
#include <glint/device/detail/texture_layout.h>

#include <algorithm>

namespace glint::vulkan {

using namespace detail;

namespace {

constexpr uint32_t most_vertex_buffers = 32;

VkClearValue clearValue(const Attachment& attachment, Format format, bool is_depth) {
    VkClearValue value = {};
    if (is_depth) {
        value.depthStencil = {attachment.clear[0], attachment.clear_stencil};
        return value;
    }
    const FormatType type = formatInfo(format).type;
    for (size_t i = 0; i < 4; i++) value.color.uint32[i] = clearBits(type, attachment.clear[i]);
    return value;
}

Slice oneMip(Slice slice, uint32_t layers) {
    slice.mips = 1;
    slice.layers = static_cast<uint16_t>(layers);
    return slice;
}

}  // namespace

uint32_t Player::countSplits() const {
    const auto first = std::find_if(resolved_->barriers.begin() + static_cast<std::ptrdiff_t>(next_barrier_),
                                    resolved_->barriers.end(), [](const Barrier& barrier) { return barrier.split; });
    if (first == resolved_->barriers.end()) return 0;
    uint32_t end = index_;
    for (const CommandHeader* header = command_; header->type != CommandType::EndTarget; end++) {
        header = reinterpret_cast<const CommandHeader*>(reinterpret_cast<const std::byte*>(header) + header->size);
    }
    return static_cast<uint32_t>(std::count_if(first, resolved_->barriers.end(), [end](const Barrier& barrier) {
        return barrier.split && barrier.command <= end;
    }));
}

void Player::play(const BeginTargetCommand& command) {
    target_ = &command;
    splits_left_ = countSplits();
    beginPart(true);
}

void Player::play(const EndTargetCommand&) {
    if (!target_) return;
    vk_.CmdEndRendering(commands_);
    target_ = nullptr;
}

void Player::beginPart(bool is_first) {
    VkRenderingAttachmentInfo colors[max_targets], depth;
    VkRenderingInfo info = {VK_STRUCTURE_TYPE_RENDERING_INFO};
    info.renderArea.extent = {target_->width, target_->height};
    info.layerCount = target_->layers;
    info.colorAttachmentCount = target_->color_count;
    info.pColorAttachments = colors;
    bool complete = true;
    for (uint32_t i = 0; i < target_->color_count; i++) {
        complete = attach(target_->colors[i], false, is_first, colors[i]) && complete;
    }
    if (target_->depth.texture != none) {
        complete = attach(target_->depth, true, is_first, depth) && complete;
        const VkImageAspectFlags aspects = texture(target_->depth.texture).aspects();
        info.pDepthAttachment = &depth;
        if (aspects & VK_IMAGE_ASPECT_STENCIL_BIT) info.pStencilAttachment = &depth;
    }
    // Without a view the submission has failed already; an empty target keeps the recording well-formed.
    if (!complete) {
        info.colorAttachmentCount = 0;
        info.pDepthAttachment = info.pStencilAttachment = nullptr;
    }
    vk_.CmdBeginRendering(commands_, &info);
}

bool Player::attach(const Attachment& attachment, bool is_depth, bool is_first, VkRenderingAttachmentInfo& info) {
    info = {VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO};
    if (attachment.texture == none) return true;
    const bool is_last = splits_left_ == 0;
    VulkanTexture& image = texture(attachment.texture);
    const VkImageLayout layout =
        is_depth ? VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL : VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
    const VkImageViewType type = target_->layers > 1 ? VK_IMAGE_VIEW_TYPE_2D_ARRAY : VK_IMAGE_VIEW_TYPE_2D;
    Expected<VkImageView> view = image.view(oneMip(attachment.slice, target_->layers), type, image.aspects());
    if (!view) {
        fail(view.error());
        return false;
    }
    info.imageView = *view;
    info.imageLayout = layout;
    if (attachment.resolve != none && is_last) {
        VulkanTexture& resolve = texture(attachment.resolve);
        view = resolve.view(oneMip(attachment.resolve_slice, target_->layers), type, resolve.aspects());
        if (!view) {
            fail(view.error());
            return false;
        }
        const FormatType format_type = formatInfo(image.desc().format).type;
        const bool is_average = !is_depth && format_type == FormatType::Float;
        info.resolveMode = is_average ? VK_RESOLVE_MODE_AVERAGE_BIT : VK_RESOLVE_MODE_SAMPLE_ZERO_BIT;
        info.resolveImageView = *view;
        info.resolveImageLayout = layout;
    }
    info.loadOp = VK_ATTACHMENT_LOAD_OP_LOAD;
    if (is_first && attachment.load == LoadOperation::Clear) info.loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR;
    if (is_first && attachment.load == LoadOperation::Discard) info.loadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE;
    const bool is_kept = !is_last || attachment.store == StoreOperation::Store;
    info.storeOp = is_kept ? VK_ATTACHMENT_STORE_OP_STORE : VK_ATTACHMENT_STORE_OP_DONT_CARE;
    info.clearValue = clearValue(attachment, image.desc().format, is_depth);
    return true;
}

void Player::setDynamicState(const DynamicState& state) {
    // Negative height turns clip space's +Y up; see vk_pipeline.cpp.
    const auto* from = state.viewport_count > 1 ? list_->at<Viewport>(state.viewports) : &state.viewport;
    const auto* scissor = state.scissor_count > 1 ? list_->at<Scissor>(state.scissors) : &state.scissor;
    VkViewport viewports[max_viewports];
    VkRect2D scissors[max_viewports];
    for (uint32_t i = 0; i < state.viewport_count; i++, from++) {
        viewports[i] = {from->x,       from->y + from->height, from->width,
                        -from->height, from->minimum_depth,    from->maximum_depth};
        scissors[i] = {{scissor->x, scissor->y}, {scissor->width, scissor->height}};
        if (state.scissor_count > 1) scissor++;
    }
    vk_.CmdSetViewportWithCount(commands_, state.viewport_count, viewports);
    vk_.CmdSetScissorWithCount(commands_, state.viewport_count, scissors);
    vk_.CmdSetBlendConstants(commands_, state.blend);
    vk_.CmdSetStencilReference(commands_, VK_STENCIL_FACE_FRONT_AND_BACK, state.stencil_reference);
}

bool Player::bindDraw(const DrawState& state) {
    const auto& pipeline = *static_cast<const VulkanPipeline*>(list_->resources[state.pipeline]->native.get());
    bindPipeline(graphics_, pipeline.handle());
    if (!bind(graphics_, pipeline.layout(), state.bindings)) return false;

    const auto* vertices = state.vertex_count ? list_->at<VertexBinding>(state.vertices) : nullptr;
    if (vertices && vertices != vertices_) {
        VkBuffer handles[most_vertex_buffers];
        VkDeviceSize offsets[most_vertex_buffers];
        const uint32_t count = std::min(state.vertex_count, most_vertex_buffers);
        for (uint32_t i = 0; i < count; i++) {
            const bool is_inline = vertices[i].buffer == none;
            handles[i] = is_inline ? inline_.buffer : buffer(vertices[i].buffer).handle();
            offsets[i] = vertices[i].offset + (is_inline ? inline_.offset : 0);
        }
        vk_.CmdBindVertexBuffers(commands_, 0, count, handles, offsets);
        vertices_ = vertices;
    }
    const bool same_indices =
        index_size_ == state.index_size && index_buffer_ == state.index_buffer && index_offset_ == state.index_offset;
    if (state.index_size && !same_indices) {
        const bool is_inline = state.index_buffer == none;
        vk_.CmdBindIndexBuffer(commands_, is_inline ? inline_.buffer : buffer(state.index_buffer).handle(),
                               state.index_offset + (is_inline ? inline_.offset : 0),
                               state.index_size == 2 ? VK_INDEX_TYPE_UINT16 : VK_INDEX_TYPE_UINT32);
        index_size_ = state.index_size;
        index_buffer_ = state.index_buffer;
        index_offset_ = state.index_offset;
    }
    const auto* dynamic = list_->at<DynamicState>(state.dynamic);
    if (dynamic != dynamic_) setDynamicState(*dynamic);
    dynamic_ = dynamic;
    return true;
}

void Player::play(const DrawCommand& command) {
    if (!bindDraw(command.state)) return;
    if (command.header.type == CommandType::Draw) {
        vk_.CmdDraw(commands_, command.count, command.instances, command.first, command.first_instance);
    } else {
        vk_.CmdDrawIndexed(commands_, command.count, command.instances, command.first, command.base_vertex,
                           command.first_instance);
    }
}

void Player::play(const DrawMeshCommand& command) {
    if (!bindDraw(command.state)) return;
    vk_.CmdDrawMeshTasksEXT(commands_, command.groups[0], command.groups[1], command.groups[2]);
}

void Player::play(const DrawIndirectCommand& command) {
    if (!bindDraw(command.state)) return;
    const VkBuffer arguments = buffer(command.buffer).handle();
    const CommandType type = command.header.type;
    if (command.count_buffer == none) {
        const auto draw = type == CommandType::DrawIndirect          ? vk_.CmdDrawIndirect
                          : type == CommandType::DrawIndexedIndirect ? vk_.CmdDrawIndexedIndirect
                                                                     : vk_.CmdDrawMeshTasksIndirectEXT;
        return draw(commands_, arguments, command.offset, command.draws, command.stride);
    }
    const auto draw = type == CommandType::DrawIndirect          ? vk_.CmdDrawIndirectCount
                      : type == CommandType::DrawIndexedIndirect ? vk_.CmdDrawIndexedIndirectCount
                                                                 : vk_.CmdDrawMeshTasksIndirectCountEXT;
    draw(commands_, arguments, command.offset, buffer(command.count_buffer).handle(), command.count_offset,
         command.draws, command.stride);
}

}  // namespace glint::vulkan
