#pragma once

#include "platform/vulkan/vk_layout.h"
#include "platform/vulkan/vk_upload.h"

#include <glint/device/detail/backend.h>

#include <array>
#include <string>
#include <vector>

namespace glint::vulkan {

class VulkanBuffer;
class VulkanDevice;
class VulkanKernel;
class VulkanPipeline;
class VulkanQuery;
class VulkanQueue;
class VulkanTexture;
class VulkanTracing;
struct Frame;

/// Replays resolved lists into a command buffer. One for each queue, so that what it needs for it is allocated once.
class Player {
public:
    Player(VulkanDevice& device, const VulkanQueue& queue);

    /// Records all lists into the frame's command buffer, which takes descriptor sets and chunks to recycle.
    Status play(Frame& frame, std::span<const detail::ResolvedList> lists);

private:
    /// What is bound for dispatches or for draws. Pointers are into the list being played.
    struct BindPoint {
        VkPipelineBindPoint point = VK_PIPELINE_BIND_POINT_COMPUTE;
        VkPipeline pipeline = VK_NULL_HANDLE;
        const PipelineLayout* layout = nullptr;
        const detail::BoundResource* bound = nullptr;  ///< nullptr: no set is bound
        const uint32_t* uniforms = nullptr;
        const std::byte* push = nullptr;
        std::vector<VkDescriptorSet> sets;

        void forget();
    };
    struct StageScope {
        VkPipelineStageFlags2 stages = 0;
        VkAccessFlags2 reads = 0;
        VkAccessFlags2 writes = 0;
    };
    struct ActiveQuery {
        VulkanQuery* query = nullptr;
        bool in_target = false;
    };

    // vk_player.cpp
    void playList(const detail::ResolvedList& resolved);
    void playCommand(const detail::CommandHeader& header);
    void fail(Error error);
    StageScope scope(detail::StageMask mask) const;
    void barrier(const detail::Barrier& barrier);
    void pushRegion(const char* name);
    void popRegion();
    void resetQueries();
    void beginQuery(VulkanQuery& query);
    void endQuery(VulkanQuery& query);
    void beginSlot(VulkanQuery& query);

    // vk_player_bindings.cpp
    void bindPipeline(BindPoint& point, VkPipeline pipeline);
    bool bind(BindPoint& point, const PipelineLayout& layout, const detail::Bindings& bindings);
    VkDescriptorSet writeSet(const PipelineLayout& layout, const PipelineLayout::Set& set,
                             const detail::BoundResource* elements, const uint32_t* uniforms);
    VkDescriptorSet tableSet(const SetLayout& layout, const LayoutElement& element, uint32_t resource);
    VkDescriptorBufferInfo wholeBuffer(const detail::BoundResource& bound);
    bool writeElement(const LayoutElement& element, const detail::BoundResource& bound, uint64_t uniform_offset,
                      DescriptorData& data);

    // vk_player_copy.cpp
    void play(const detail::CopyInlineCommand& command);
    void play(const detail::CopyBufferCommand& command);
    void play(const detail::FillBufferCommand& command);
    void play(const detail::CopyBufferTextureCommand& command);
    void play(const detail::CopyTextureCommand& command);
    void play(const detail::ClearTextureCommand& command);
    void play(const detail::BuildTracingsCommand& command);
    void play(const detail::CopyTracingCommand& command);
    void play(const detail::WriteTracingSizeCommand& command);

    // vk_player_graphics.cpp
    void play(const detail::BeginTargetCommand& command);
    void play(const detail::EndTargetCommand& command);
    void play(const detail::DrawCommand& command);
    void play(const detail::DrawMeshCommand& command);
    void play(const detail::DrawIndirectCommand& command);
    void beginPart(bool is_first);
    bool attach(const detail::Attachment& attachment, bool is_depth, bool is_first, VkRenderingAttachmentInfo& info);
    uint32_t countSplits() const;
    bool bindDraw(const detail::DrawState& state);
    void setDynamicState(const detail::DynamicState& state);

    // vk_player.cpp
    void play(const detail::DispatchCommand& command);
    void play(const detail::DispatchIndirectCommand& command);
    void play(const detail::SideDispatchesCommand& command);
    void play(const detail::TraceRaysCommand& command);
    void play(const detail::TraceRaysIndirectCommand& command);

    VulkanBuffer& buffer(uint32_t resource) const;
    VulkanTexture& texture(uint32_t resource) const;
    VulkanTracing& tracing(uint32_t resource) const;
    template <class T>
    T& native(uint32_t resource) const;

    VulkanDevice& device_;
    const VulkanQueue& queue_;
    const DeviceFunctions& vk_;
    std::array<StageScope, detail::stage_count> scopes_;

    // Of the submission and the list being played.
    Frame* frame_ = nullptr;
    VkCommandBuffer commands_ = VK_NULL_HANDLE;
    Error error_;
    const detail::ResolvedList* resolved_ = nullptr;
    const detail::CommandList* list_ = nullptr;
    const detail::CommandHeader* command_ = nullptr;
    uint32_t index_ = 0;  ///< of the command
    size_t next_barrier_ = 0;
    Upload::Region inline_;
    uint32_t region_depth_ = 0;

    BindPoint compute_{VK_PIPELINE_BIND_POINT_COMPUTE};
    BindPoint graphics_{VK_PIPELINE_BIND_POINT_GRAPHICS};
    BindPoint rays_{VK_PIPELINE_BIND_POINT_RAY_TRACING_KHR};
    const BindPoint* pushed_ = nullptr;  ///< whose push constants the command buffer has
    const detail::BeginTargetCommand* target_ = nullptr;
    uint32_t splits_left_ = 0;
    const detail::VertexBinding* vertices_ = nullptr;
    uint32_t index_buffer_ = 0;
    uint64_t index_offset_ = 0;
    uint32_t index_size_ = 0;  ///< 0: no index buffer is bound
    const detail::DynamicState* dynamic_ = nullptr;

    std::vector<DescriptorData> descriptors_;
    std::vector<VkImageMemoryBarrier2> image_barriers_;
    std::vector<VkAccelerationStructureBuildGeometryInfoKHR> build_infos_;
    std::vector<const VkAccelerationStructureBuildRangeInfoKHR*> build_ranges_;
    std::vector<ActiveQuery> active_queries_;
};

}  // namespace glint::vulkan
