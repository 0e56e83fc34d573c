#include "platform/vulkan/vk_buffer.h"
#include "platform/vulkan/vk_device.h"
#include "platform/vulkan/vk_format.h"
#include "platform/vulkan/vk_player.h"
#include "platform/vulkan/vk_texture.h"
#include "platform/vulkan/vk_tracing.h"

#include <glint/device/detail/object.h>

#include <algorithm>

namespace glint::vulkan {

using namespace detail;

namespace {

/// A slice of one mip level.
VkImageSubresourceLayers layers(VkImageAspectFlags aspects, const Slice& slice) {
    return {aspects, slice.mip, slice.layer, slice.layers};
}

VkOffset3D offset(uint32_t x, uint32_t y, uint32_t z) {
    return {static_cast<int32_t>(x), static_cast<int32_t>(y), static_cast<int32_t>(z)};
}

}  // namespace

VulkanTracing& Player::tracing(uint32_t resource) const {
    return *static_cast<VulkanTracing*>(list_->resources[resource]->native.get());
}

void Player::play(const CopyInlineCommand& command) {
    const VkBufferCopy region = {inline_.offset + command.data, command.offset, command.size};
    vk_.CmdCopyBuffer(commands_, inline_.buffer, buffer(command.buffer).handle(), 1, &region);
}

void Player::play(const CopyBufferCommand& command) {
    const VkBufferCopy region = {command.source_offset, command.destination_offset, command.size};
    vk_.CmdCopyBuffer(commands_, buffer(command.source).handle(), buffer(command.destination).handle(), 1, &region);
}

void Player::play(const FillBufferCommand& command) {
    vk_.CmdFillBuffer(commands_, buffer(command.buffer).handle(), command.offset, command.size, command.value);
}

void Player::play(const CopyBufferTextureCommand& command) {
    const VulkanTexture& image = texture(command.texture);
    VkBufferImageCopy copy = {};
    copy.bufferOffset = command.offset;
    copy.imageSubresource = layers(mainAspect(image.desc().format), command.slice);
    copy.imageOffset = offset(command.region.x, command.region.y, command.region.z);
    copy.imageExtent = {command.region.width, command.region.height, command.region.depth};
    const VkBuffer memory = buffer(command.buffer).handle();
    if (command.header.type == CommandType::CopyBufferToTexture) {
        vk_.CmdCopyBufferToImage(commands_, memory, image.handle(), VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &copy);
    } else {
        vk_.CmdCopyImageToBuffer(commands_, image.handle(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, memory, 1, &copy);
    }
}

void Player::play(const CopyTextureCommand& command) {
    const VulkanTexture& source = texture(command.source);
    const VulkanTexture& destination = texture(command.destination);
    const bool is_same = source.format() == destination.format();
    VkImageCopy copy = {};
    copy.srcSubresource = layers(is_same ? source.aspects() : mainAspect(source.desc().format), command.source_slice);
    copy.srcOffset = offset(command.source_region.x, command.source_region.y, command.source_region.z);
    copy.dstSubresource =
        layers(is_same ? destination.aspects() : mainAspect(destination.desc().format), command.destination_slice);
    copy.dstOffset = offset(command.x, command.y, command.z);
    copy.extent = {command.source_region.width, command.source_region.height, command.source_region.depth};
    vk_.CmdCopyImage(commands_, source.handle(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, destination.handle(),
                     VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &copy);
}

void Player::play(const ClearTextureCommand& command) {
    const VulkanTexture& image = texture(command.texture);
    const VkImageSubresourceRange range = {image.aspects(), command.slice.mip, command.slice.mips, command.slice.layer,
                                           command.slice.layers};
    if (formatInfo(image.desc().format).depth) {
        const VkClearDepthStencilValue value = {command.value.f[0], command.value.u[1]};
        vk_.CmdClearDepthStencilImage(commands_, image.handle(), VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, &value, 1,
                                      &range);
        return;
    }
    VkClearColorValue value = {};
    std::copy(std::begin(command.value.u), std::end(command.value.u), value.uint32);
    vk_.CmdClearColorImage(commands_, image.handle(), VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, &value, 1, &range);
}

void Player::play(const BuildTracingsCommand& command) {
    const auto* builds = list_->at<TracingBuild>(command.builds);
    build_infos_.resize(command.count);
    build_ranges_.resize(command.count);
    for (uint32_t i = 0; i < command.count; i++) {
        const TracingBuild& build = builds[i];
        const uint64_t scratch = buffer(build.scratch).address + build.scratch_offset;
        const uint64_t instances =
            build.instances == none ? 0 : buffer(build.instances).address + build.instances_offset;
        tracing(build.tracing).prepareBuild(build, scratch, instances, build_infos_[i], build_ranges_[i]);
    }
    vk_.CmdBuildAccelerationStructuresKHR(commands_, command.count, build_infos_.data(), build_ranges_.data());
}

void Player::play(const CopyTracingCommand& command) {
    VkCopyAccelerationStructureInfoKHR info = {VK_STRUCTURE_TYPE_COPY_ACCELERATION_STRUCTURE_INFO_KHR};
    info.src = tracing(command.source).handle();
    info.dst = tracing(command.destination).handle();
    info.mode = command.compact ? VK_COPY_ACCELERATION_STRUCTURE_MODE_COMPACT_KHR
                                : VK_COPY_ACCELERATION_STRUCTURE_MODE_CLONE_KHR;
    vk_.CmdCopyAccelerationStructureKHR(commands_, &info);
}

void Player::play(const WriteTracingSizeCommand& command) {
    const VulkanTracing& structure = tracing(command.tracing);
    const VkAccelerationStructureKHR handle = structure.handle();
    vk_.CmdResetQueryPool(commands_, structure.sizePool(), 0, 1);
    vk_.CmdWriteAccelerationStructuresPropertiesKHR(
        commands_, 1, &handle, VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR, structure.sizePool(), 0);
}

}  // namespace glint::vulkan
