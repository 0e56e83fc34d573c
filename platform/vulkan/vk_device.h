#pragma once

#include "platform/vulkan/vk_adapter.h"
#include "platform/vulkan/vk_layout.h"
#include "platform/vulkan/vk_memory.h"
#include "platform/vulkan/vk_queue.h"
#include "platform/vulkan/vk_table.h"
#include "platform/vulkan/vk_upload.h"

#include <glint/device/detail/backend.h>

#include <bit>
#include <memory>
#include <mutex>
#include <vector>

namespace glint::vulkan {

/// A device of the caller's, who keeps it alive and leaves its queue to Glint.
struct ForeignDevice {
    VkInstance instance = VK_NULL_HANDLE;
    PFN_vkGetInstanceProcAddr get = nullptr;
    VkPhysicalDevice adapter = VK_NULL_HANDLE;
    VkDevice device = VK_NULL_HANDLE;
    VkQueue queue = VK_NULL_HANDLE;
    uint32_t family = 0;
    FeatureMask features = 0;
};

/// A VkDevice, destroyed after all that is made from it and before the messenger, which hears what was left behind.
struct RawDevice {
    RawDevice(std::shared_ptr<Instance> shared, const Messenger::Receive& receive)
        : instance(std::move(shared)), messenger(instance, receive) {}
    ~RawDevice();
    RawDevice(const RawDevice&) = delete;
    RawDevice& operator=(const RawDevice&) = delete;

    const std::shared_ptr<Instance> instance;
    const Messenger messenger;
    DeviceFunctions vk;
    VkDevice handle = VK_NULL_HANDLE;
    bool owned = true;
};

/// The back end: a device, its queues and what its objects share.
class VulkanDevice final : public detail::Backend, public RawDevice {
public:
    static Expected<std::unique_ptr<detail::Backend>> create(const detail::BackendDesc& desc);
    static Expected<std::unique_ptr<detail::Backend>> adopt(const ForeignDevice& foreign);

    const DeviceInfo& info() const override { return adapter.info; }
    const Features& features() const override { return features_; }
    bool hasQueue(Queue queue) const override { return queues_[static_cast<size_t>(queue)] != nullptr; }
    uint32_t formatSupport(Format format, Texture::Type type) const override;
    bool vertexFormatSupport(Format format) const override;

    Expected<std::unique_ptr<detail::NativeBuffer>> createBuffer(const detail::NativeBufferDesc& desc) override;
    Expected<std::unique_ptr<detail::NativeTexture>> createTexture(const detail::NativeTextureDesc& desc) override;
    Expected<std::unique_ptr<detail::NativeSampler>> createSampler(const SamplerDesc& desc) override;
    Expected<std::unique_ptr<detail::NativeTable>> createTable(const std::string& name) override;
    Expected<std::unique_ptr<detail::NativeKernel>> createKernel(const detail::KernelDesc& desc) override;
    Expected<std::unique_ptr<detail::NativePipeline>> createPipeline(const detail::PipelineDesc& desc) override;
    Expected<std::unique_ptr<detail::NativeTraversal>> createTraversal(const detail::TraversalDesc& desc) override;
    Expected<std::unique_ptr<detail::NativeTracing>> createTracing(const detail::NativeTracingDesc& desc) override;
    Expected<std::unique_ptr<detail::NativeQuery>> createQuery(Query::Type type) override;
    Expected<std::unique_ptr<detail::NativeWindow>> createWindow(const WindowDesc& desc) override;

    uint32_t instanceSize() const override;
    void writeInstances(std::span<const Tracing::Instance> instances,
                        std::span<const detail::NativeTracing* const> tracings, void* records) const override;
    Expected<uint64_t> tracingSize(detail::NativeTracing& tracing) override;
    Expected<std::array<uint64_t, 7>> queryResult(detail::NativeQuery& query) override;

    Status submit(const detail::Submission& submission) override;
    uint64_t completed(Queue queue) override;
    Status wait(std::span<const detail::TimelinePoint> points, uint64_t nanoseconds) override;
    detail::MemoryUse memoryUse() const override;

    /// The error of a lost device, with what is known of its queues.
    Error lost(const char* call) const;

    /// Debug name, where the instance takes them.
    template <class T>
    void setName(VkObjectType type, T object, const std::string& name) const {
        setName(type, std::bit_cast<uint64_t>(object), name);
    }

    const VulkanQueue& queue(Queue queue) const { return *queues_[static_cast<size_t>(queue)]; }
    VulkanQueue& queue(Queue queue) { return *queues_[static_cast<size_t>(queue)]; }

    // What the objects of this back end use. Constant once the device is there, but for what locks by itself.
    const Adapter adapter;
    const Enabled enabled;
    std::vector<uint32_t> families;  ///< of the queues, each once
    Memory memory;
    LayoutCache layouts;
    TableSets tables;
    Upload upload;

private:
    VulkanDevice(std::shared_ptr<Instance> instance, const Adapter& adapter, const Enabled& enabled,
                 const Messenger::Receive& receive);
    Status createDevice();
    Status createQueues(VkQueue foreign);
    void setName(VkObjectType type, uint64_t object, const std::string& name) const;

    Features features_;
    std::array<std::unique_ptr<VulkanQueue>, detail::queue_count> queues_;
    std::vector<VkSemaphoreSubmitInfo> waits_;
    mutable std::mutex submit_mutex_;  // lost() looks at the queues while another thread submits
};

}  // namespace glint::vulkan
