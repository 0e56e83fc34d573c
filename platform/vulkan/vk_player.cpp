#include "platform/vulkan/vk_player.h"

#include "platform/vulkan/vk_buffer.h"
#include "platform/vulkan/vk_device.h"
#include "platform/vulkan/vk_format.h"
#include "platform/vulkan/vk_kernel.h"
#include "platform/vulkan/vk_query.h"
#include "platform/vulkan/vk_result.h"
#include "platform/vulkan/vk_texture.h"
#include "platform/vulkan/vk_traversal.h"

#include <glint/device/detail/object.h>

namespace glint::vulkan {

using namespace detail;

namespace {

/// Longest text about a submission's regions that is kept for the message of a lost device.
constexpr size_t regions_length = 256;

template <class T>
const T& as(const CommandHeader& header) {
    return reinterpret_cast<const T&>(header);
}

/// All that the stages of a queue with `flags` can be, with the accesses that happen in them.
template <class Scopes>
void fillScopes(Scopes& scopes, VkQueueFlags flags, const FeatureChain& features) {
    const auto set = [&scopes](Stage stage, VkPipelineStageFlags2 stages, VkAccessFlags2 reads, VkAccessFlags2 writes) {
        scopes[static_cast<size_t>(stage)] = {stages, reads, writes};
    };
    const bool has_structures = features.structures.accelerationStructure;
    VkAccessFlags2 shader_reads =
        VK_ACCESS_2_UNIFORM_READ_BIT | VK_ACCESS_2_SHADER_SAMPLED_READ_BIT | VK_ACCESS_2_SHADER_STORAGE_READ_BIT;
    if (has_structures) shader_reads |= VK_ACCESS_2_ACCELERATION_STRUCTURE_READ_BIT_KHR;
    constexpr VkAccessFlags2 shader_writes = VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT;

    set(Stage::Copy, VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT, VK_ACCESS_2_TRANSFER_READ_BIT,
        VK_ACCESS_2_TRANSFER_WRITE_BIT);
    set(Stage::Host, VK_PIPELINE_STAGE_2_HOST_BIT, VK_ACCESS_2_HOST_READ_BIT, VK_ACCESS_2_HOST_WRITE_BIT);
    if (flags & VK_QUEUE_COMPUTE_BIT) {
        set(Stage::Indirect, VK_PIPELINE_STAGE_2_DRAW_INDIRECT_BIT, VK_ACCESS_2_INDIRECT_COMMAND_READ_BIT, 0);
        set(Stage::Compute, VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, shader_reads, shader_writes);
        if (features.ray_pipeline.rayTracingPipeline) {
            set(Stage::RayTracing, VK_PIPELINE_STAGE_2_RAY_TRACING_SHADER_BIT_KHR, shader_reads, shader_writes);
        }
        if (has_structures) {
            // Vertices, indices and instances are shader reads of the build stage; scratch memory is accessed as a
            // structure is. Copies of structures and queries of their size run in the build stage, too.
            set(Stage::Build, VK_PIPELINE_STAGE_2_ACCELERATION_STRUCTURE_BUILD_BIT_KHR,
                VK_ACCESS_2_ACCELERATION_STRUCTURE_READ_BIT_KHR | VK_ACCESS_2_SHADER_READ_BIT,
                VK_ACCESS_2_ACCELERATION_STRUCTURE_WRITE_BIT_KHR);
        }
    }
    if (flags & VK_QUEUE_GRAPHICS_BIT) {
        constexpr VkAccessFlags2 color_reads = VK_ACCESS_2_COLOR_ATTACHMENT_READ_BIT;
        constexpr VkAccessFlags2 color_writes = VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT;
        set(Stage::VertexInput, VK_PIPELINE_STAGE_2_VERTEX_INPUT_BIT,
            VK_ACCESS_2_INDEX_READ_BIT | VK_ACCESS_2_VERTEX_ATTRIBUTE_READ_BIT, 0);
        set(Stage::VertexShader, VK_PIPELINE_STAGE_2_PRE_RASTERIZATION_SHADERS_BIT, shader_reads, shader_writes);
        set(Stage::Fragment, VK_PIPELINE_STAGE_2_FRAGMENT_SHADER_BIT, shader_reads, shader_writes);
        set(Stage::ColorTarget, VK_PIPELINE_STAGE_2_COLOR_ATTACHMENT_OUTPUT_BIT, color_reads, color_writes);
        // Depth is resolved in the stage of colour output, as an access to colour (Vulkan 1.3, 8.1 "Render Pass
        // Objects", on VkRenderingAttachmentInfo::resolveMode).
        set(Stage::DepthTarget,
            VK_PIPELINE_STAGE_2_EARLY_FRAGMENT_TESTS_BIT | VK_PIPELINE_STAGE_2_LATE_FRAGMENT_TESTS_BIT |
                VK_PIPELINE_STAGE_2_COLOR_ATTACHMENT_OUTPUT_BIT,
            VK_ACCESS_2_DEPTH_STENCIL_ATTACHMENT_READ_BIT | color_reads,
            VK_ACCESS_2_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT | color_writes);
    }
}

}  // namespace

void Player::BindPoint::forget() {
    pipeline = VK_NULL_HANDLE;
    layout = nullptr;
    bound = nullptr;
    uniforms = nullptr;
    push = nullptr;
}

Player::Player(VulkanDevice& device, const VulkanQueue& queue) : device_(device), queue_(queue), vk_(device.vk) {
    fillScopes(scopes_, queue.flags(), device.enabled.features);
}

void Player::fail(Error error) {
    if (!error_) error_ = std::move(error);
}

template <class T>
T& Player::native(uint32_t resource) const {
    return *static_cast<T*>(list_->resources[resource]->native.get());
}

Status Player::play(Frame& frame, std::span<const ResolvedList> lists) {
    frame_ = &frame;
    commands_ = frame.commands;
    error_ = {};
    frame.regions.clear();
    VkCommandBufferBeginInfo info = {VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
    info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    VkResult result = vk_.BeginCommandBuffer(commands_, &info);
    if (result != VK_SUCCESS) return resultError("vkBeginCommandBuffer", result);
    for (const ResolvedList& list : lists) playList(list);
    result = vk_.EndCommandBuffer(commands_);
    if (result != VK_SUCCESS) fail(resultError("vkEndCommandBuffer", result));
    return error_;
}

void Player::playList(const ResolvedList& resolved) {
    resolved_ = &resolved;
    list_ = resolved.list;
    next_barrier_ = 0;
    region_depth_ = 0;
    compute_.forget();
    graphics_.forget();
    rays_.forget();
    pushed_ = nullptr;
    vertices_ = nullptr;
    dynamic_ = nullptr;
    index_size_ = 0;
    inline_ = {};
    if (!list_->inline_data.empty()) {
        Expected<Upload::Region> region = device_.upload.write(frame_->chunks, list_->inline_data);
        if (!region) return fail(region.error());
        inline_ = *region;
    }
    resetQueries();
    if (!list_->label.empty()) pushRegion(list_->label.c_str());

    const std::span<const Barrier> barriers = resolved.barriers;
    forEachCommand(*list_, [&](uint32_t index, const CommandHeader& header) {
        index_ = index;
        command_ = &header;
        while (next_barrier_ < barriers.size() && barriers[next_barrier_].command == index) {
            barrier(barriers[next_barrier_++]);
        }
        playCommand(header);
    });
    while (next_barrier_ < barriers.size()) barrier(barriers[next_barrier_++]);
    while (region_depth_) popRegion();
}

void Player::playCommand(const CommandHeader& header) {
    switch (header.type) {
        case CommandType::Dispatch: return play(as<DispatchCommand>(header));
        case CommandType::DispatchIndirect: return play(as<DispatchIndirectCommand>(header));
        case CommandType::SideDispatches: return play(as<SideDispatchesCommand>(header));
        case CommandType::TraceRays: return play(as<TraceRaysCommand>(header));
        case CommandType::TraceRaysIndirect: return play(as<TraceRaysIndirectCommand>(header));
        case CommandType::BeginTarget: return play(as<BeginTargetCommand>(header));
        case CommandType::EndTarget: return play(as<EndTargetCommand>(header));
        case CommandType::Draw:
        case CommandType::DrawIndexed: return play(as<DrawCommand>(header));
        case CommandType::DrawIndirect:
        case CommandType::DrawIndexedIndirect:
        case CommandType::DrawMeshIndirect: return play(as<DrawIndirectCommand>(header));
        case CommandType::DrawMesh: return play(as<DrawMeshCommand>(header));
        case CommandType::CopyInline: return play(as<CopyInlineCommand>(header));
        case CommandType::CopyBuffer: return play(as<CopyBufferCommand>(header));
        case CommandType::FillBuffer: return play(as<FillBufferCommand>(header));
        case CommandType::CopyBufferToTexture:
        case CommandType::CopyTextureToBuffer: return play(as<CopyBufferTextureCommand>(header));
        case CommandType::CopyTexture: return play(as<CopyTextureCommand>(header));
        case CommandType::ClearTexture: return play(as<ClearTextureCommand>(header));
        case CommandType::BuildTracings: return play(as<BuildTracingsCommand>(header));
        case CommandType::CopyTracing: return play(as<CopyTracingCommand>(header));
        case CommandType::WriteTracingSize: return play(as<WriteTracingSizeCommand>(header));
        case CommandType::BeginQuery: return beginQuery(native<VulkanQuery>(as<QueryCommand>(header).query));
        case CommandType::EndQuery: return endQuery(native<VulkanQuery>(as<QueryCommand>(header).query));
        case CommandType::PushRegion: return pushRegion(list_->at<char>(as<RegionCommand>(header).name));
        case CommandType::PopRegion: return popRegion();
        case CommandType::HostRead:
        case CommandType::Present:
        case CommandType::Barrier:  // the tracker has placed their barriers
        case CommandType::Count: return;
    }
}

void Player::play(const DispatchCommand& command) {
    const auto& kernel = native<VulkanKernel>(command.kernel);
    bindPipeline(compute_, kernel.handle());
    if (!bind(compute_, kernel.layout(), command.bindings)) return;
    vk_.CmdDispatch(commands_, command.groups[0], command.groups[1], command.groups[2]);
}

void Player::play(const DispatchIndirectCommand& command) {
    const auto& kernel = native<VulkanKernel>(command.kernel);
    bindPipeline(compute_, kernel.handle());
    if (!bind(compute_, kernel.layout(), command.bindings)) return;
    vk_.CmdDispatchIndirect(commands_, native<VulkanBuffer>(command.buffer).handle(), command.offset);
}

void Player::play(const SideDispatchesCommand& command) {
    for (uint32_t i = 0; i < command.count; i++) {
        const SideDispatch& dispatch = list_->at<SideDispatch>(command.dispatches)[i];
        const auto& kernel = native<VulkanKernel>(dispatch.kernel);
        bindPipeline(compute_, kernel.handle());
        if (!bind(compute_, kernel.layout(), dispatch.bindings)) return;
        vk_.CmdDispatch(commands_, dispatch.groups, 1, 1);
    }
}

void Player::play(const TraceRaysCommand& command) {
    const auto& traversal = native<VulkanTraversal>(command.traversal);
    bindPipeline(rays_, traversal.handle());
    if (!bind(rays_, traversal.layout(), command.bindings)) return;
    if (traversal.stackSize()) vk_.CmdSetRayTracingPipelineStackSizeKHR(commands_, traversal.stackSize());
    const VkStridedDeviceAddressRegionKHR generation = traversal.generation(command.generation);
    vk_.CmdTraceRaysKHR(commands_, &generation, &traversal.table(RayTable::Miss), &traversal.table(RayTable::Hit),
                        &traversal.table(RayTable::Callable), command.rays[0], command.rays[1], command.rays[2]);
}

void Player::play(const TraceRaysIndirectCommand& command) {
    const auto& traversal = native<VulkanTraversal>(command.traversal);
    bindPipeline(rays_, traversal.handle());
    if (!bind(rays_, traversal.layout(), command.bindings)) return;
    if (traversal.stackSize()) vk_.CmdSetRayTracingPipelineStackSizeKHR(commands_, traversal.stackSize());
    const VkStridedDeviceAddressRegionKHR generation = traversal.generation(command.generation);
    vk_.CmdTraceRaysIndirectKHR(commands_, &generation, &traversal.table(RayTable::Miss),
                                &traversal.table(RayTable::Hit), &traversal.table(RayTable::Callable),
                                buffer(command.buffer).address + command.offset);
}

Player::StageScope Player::scope(StageMask mask) const {
    if (mask & stage_all) {
        return {VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, VK_ACCESS_2_MEMORY_READ_BIT, VK_ACCESS_2_MEMORY_WRITE_BIT};
    }
    StageScope all;
    for (unsigned bits = mask; bits; bits &= bits - 1) {
        const StageScope& one = scopes_[static_cast<size_t>(std::countr_zero(bits))];
        all.stages |= one.stages;
        all.reads |= one.reads;
        all.writes |= one.writes;
    }
    return all;
}

void Player::barrier(const Barrier& barrier) {
    VkMemoryBarrier2 memory = {VK_STRUCTURE_TYPE_MEMORY_BARRIER_2};
    const StageScope source = scope(barrier.source), destination = scope(barrier.destination);
    memory.srcStageMask = source.stages;
    memory.srcAccessMask = source.writes;
    memory.dstStageMask = destination.stages;
    memory.dstAccessMask = destination.reads | destination.writes;
    const bool has_memory = memory.srcStageMask && memory.dstStageMask;
    if (!has_memory && !barrier.image_count) return;

    image_barriers_.clear();
    for (const ImageBarrier& image : resolved_->images.subspan(barrier.first_image, barrier.image_count)) {
        const VulkanTexture& target = native<VulkanTexture>(image.resource);
        const StageScope from = scope(image.source), to = scope(image.destination);
        VkImageMemoryBarrier2 native = {VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2};
        native.srcStageMask = from.stages;
        native.srcAccessMask = from.writes;
        native.dstStageMask = to.stages;
        native.dstAccessMask = to.reads | to.writes;
        native.oldLayout = vulkanLayout(image.from);
        native.newLayout = vulkanLayout(image.to);
        native.srcQueueFamilyIndex = native.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
        native.image = target.handle();
        native.subresourceRange = {target.aspects(), image.slice.mip, image.slice.mips, image.slice.layer,
                                   image.slice.layers};
        image_barriers_.push_back(native);
    }
    VkDependencyInfo info = {VK_STRUCTURE_TYPE_DEPENDENCY_INFO};
    info.memoryBarrierCount = has_memory ? 1 : 0;
    info.pMemoryBarriers = &memory;
    info.imageMemoryBarrierCount = static_cast<uint32_t>(image_barriers_.size());
    info.pImageMemoryBarriers = image_barriers_.data();

    const bool splits = barrier.split && target_;
    if (splits) {
        for (const ActiveQuery& active : active_queries_) {
            if (active.in_target && active.query->used <= active.query->slots()) {
                vk_.CmdEndQuery(commands_, active.query->pool(), active.query->used - 1);
            }
        }
        vk_.CmdEndRendering(commands_);
    }
    vk_.CmdPipelineBarrier2(commands_, &info);
    if (splits) {
        splits_left_--;
        beginPart(false);
        for (const ActiveQuery& active : active_queries_) {
            if (active.in_target) beginSlot(*active.query);
        }
    }
}

void Player::pushRegion(const char* name) {
    std::string& regions = frame_->regions;
    if (region_depth_++ < 2 && regions.size() < regions_length) {
        if (!regions.empty()) regions += ", ";
        regions += name;
    }
    if (!device_.instance->debug_utils) return;
    VkDebugUtilsLabelEXT label = {VK_STRUCTURE_TYPE_DEBUG_UTILS_LABEL_EXT};
    label.pLabelName = name;
    device_.instance->vk.CmdBeginDebugUtilsLabelEXT(commands_, &label);
}

void Player::popRegion() {
    if (region_depth_ == 0) return;
    region_depth_--;
    if (device_.instance->debug_utils) device_.instance->vk.CmdEndDebugUtilsLabelEXT(commands_);
}

void Player::resetQueries() {
    active_queries_.clear();
    for (Object* object : list_->resources) {
        if (object->type() != ObjectType::Query) continue;
        auto& query = *static_cast<VulkanQuery*>(object->native.get());
        query.used = 0;
        query.timestamp_bits = queue_.timestampBits();
        // A queue for copies alone cannot reset.
        if (queue_.flags() & VK_QUEUE_COMPUTE_BIT) {
            vk_.CmdResetQueryPool(commands_, query.pool(), 0, query.slots());
        } else if (device_.enabled.features.v12.hostQueryReset) {
            vk_.ResetQueryPool(device_.handle, query.pool(), 0, query.slots());
        }
    }
}

void Player::beginSlot(VulkanQuery& query) {
    query.used++;
    if (query.used > query.slots()) return;  // the result will say so
    const bool is_precise =
        query.type() == Query::TypeSamples && device_.enabled.features.core.features.occlusionQueryPrecise;
    vk_.CmdBeginQuery(commands_, query.pool(), query.used - 1, is_precise ? VK_QUERY_CONTROL_PRECISE_BIT : 0);
}

void Player::beginQuery(VulkanQuery& query) {
    if (query.type() != Query::TypeTime) {
        beginSlot(query);
        active_queries_.push_back({&query, target_ != nullptr});
        return;
    }
    if (query.used) return;
    // Once all earlier work is done, so that the time is that of the work in between.
    vk_.CmdWriteTimestamp2(commands_, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, query.pool(), 0);
    query.used = 1;
}

void Player::endQuery(VulkanQuery& query) {
    if (query.type() == Query::TypeTime) {
        if (query.used != 1) return;
        vk_.CmdWriteTimestamp2(commands_, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, query.pool(), 1);
        query.used = 2;
        return;
    }
    std::erase_if(active_queries_, [&query](const ActiveQuery& active) { return active.query == &query; });
    if (query.used <= query.slots()) vk_.CmdEndQuery(commands_, query.pool(), query.used - 1);
}

VulkanBuffer& Player::buffer(uint32_t resource) const { return native<VulkanBuffer>(resource); }
VulkanTexture& Player::texture(uint32_t resource) const { return native<VulkanTexture>(resource); }

}  // namespace glint::vulkan
