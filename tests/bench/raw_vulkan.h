#pragma once

// Vulkan as a program without an SDK writes it: what Glint is measured against. Entry points come from the driver
// itself, memory is allocated once a resource, and everything lives until the device goes. Failures throw
// std::runtime_error.

#ifndef VK_NO_PROTOTYPES
#define VK_NO_PROTOTYPES
#endif
#include <vulkan/vulkan.h>

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace glint::bench {

#define GLINT_RAW_INSTANCE_FUNCTIONS(X)       \
    X(DestroyInstance)                        \
    X(EnumeratePhysicalDevices)               \
    X(GetPhysicalDeviceProperties)            \
    X(GetPhysicalDeviceProperties2)           \
    X(GetPhysicalDeviceQueueFamilyProperties) \
    X(GetPhysicalDeviceMemoryProperties)      \
    X(CreateDevice)                           \
    X(GetDeviceProcAddr)

#define GLINT_RAW_DEVICE_FUNCTIONS(X) \
    X(DestroyDevice)                  \
    X(DeviceWaitIdle)                 \
    X(GetDeviceQueue)                 \
    X(QueueSubmit2)                   \
    X(CreateSemaphore)                \
    X(DestroySemaphore)               \
    X(WaitSemaphores)                 \
    X(AllocateMemory)                 \
    X(FreeMemory)                     \
    X(MapMemory)                      \
    X(CreateBuffer)                   \
    X(DestroyBuffer)                  \
    X(GetBufferMemoryRequirements)    \
    X(BindBufferMemory)               \
    X(GetBufferDeviceAddress)         \
    X(CreateImage)                    \
    X(DestroyImage)                   \
    X(GetImageMemoryRequirements)     \
    X(BindImageMemory)                \
    X(CreateImageView)                \
    X(DestroyImageView)               \
    X(CreateSampler)                  \
    X(DestroySampler)                 \
    X(CreateDescriptorSetLayout)      \
    X(DestroyDescriptorSetLayout)     \
    X(CreateDescriptorPool)           \
    X(DestroyDescriptorPool)          \
    X(AllocateDescriptorSets)         \
    X(UpdateDescriptorSets)           \
    X(CreatePipelineLayout)           \
    X(DestroyPipelineLayout)          \
    X(CreateShaderModule)             \
    X(DestroyShaderModule)            \
    X(CreateComputePipelines)         \
    X(CreateGraphicsPipelines)        \
    X(DestroyPipeline)                \
    X(CreateCommandPool)              \
    X(DestroyCommandPool)             \
    X(ResetCommandPool)               \
    X(AllocateCommandBuffers)         \
    X(BeginCommandBuffer)             \
    X(EndCommandBuffer)               \
    X(CmdPipelineBarrier2)            \
    X(CmdBindPipeline)                \
    X(CmdBindDescriptorSets)          \
    X(CmdDispatch)                    \
    X(CmdBeginRendering)              \
    X(CmdEndRendering)                \
    X(CmdSetViewport)                 \
    X(CmdSetScissor)                  \
    X(CmdBindVertexBuffers)           \
    X(CmdDraw)                        \
    X(CmdClearColorImage)             \
    X(CmdBlitImage)                   \
    X(CmdCopyBufferToImage)           \
    X(CmdCopyImageToBuffer)           \
    X(CmdCopyBuffer)                  \
    X(CreateQueryPool)                \
    X(DestroyQueryPool)               \
    X(CmdResetQueryPool)              \
    X(CmdWriteTimestamp2)             \
    X(GetQueryPoolResults)

#define GLINT_RAW_TRACING_FUNCTIONS(X)          \
    X(CreateAccelerationStructureKHR)           \
    X(DestroyAccelerationStructureKHR)          \
    X(GetAccelerationStructureBuildSizesKHR)    \
    X(GetAccelerationStructureDeviceAddressKHR) \
    X(CmdBuildAccelerationStructuresKHR)

#define GLINT_RAW_PIPELINE_FUNCTIONS(X)   \
    X(CreateRayTracingPipelinesKHR)       \
    X(GetRayTracingShaderGroupHandlesKHR) \
    X(CmdTraceRaysKHR)

/// Entry points without their prefix: vk.CmdDispatch(...).
struct RawFunctions {
#define GLINT_RAW_DECLARE(name) PFN_vk##name name = nullptr;
    GLINT_RAW_INSTANCE_FUNCTIONS(GLINT_RAW_DECLARE)
    GLINT_RAW_DEVICE_FUNCTIONS(GLINT_RAW_DECLARE)
    GLINT_RAW_TRACING_FUNCTIONS(GLINT_RAW_DECLARE)
    GLINT_RAW_PIPELINE_FUNCTIONS(GLINT_RAW_DECLARE)
#undef GLINT_RAW_DECLARE
};

struct RawBuffer {
    VkBuffer buffer = VK_NULL_HANDLE;
    VkDeviceSize size = 0;
    std::byte* mapped = nullptr;  ///< host memory only
    VkDeviceAddress address = 0;  ///< if the usage asks for it
};

struct RawImage {
    VkImage image = VK_NULL_HANDLE;
    VkImageView view = VK_NULL_HANDLE;
    VkFormat format = VK_FORMAT_UNDEFINED;
    uint32_t width = 0;
    uint32_t height = 0;
};

struct RawAcceleration {
    VkAccelerationStructureKHR structure = VK_NULL_HANDLE;
    VkDeviceAddress address = 0;
    VkDeviceSize scratch_size = 0;
};

/// A pipeline and what binding to it needs.
struct RawProgram {
    VkPipeline pipeline = VK_NULL_HANDLE;
    VkPipelineLayout layout = VK_NULL_HANDLE;
    VkDescriptorSetLayout set_layout = VK_NULL_HANDLE;
};

struct RawGraphics {
    std::span<const uint32_t> vertex;
    std::span<const uint32_t> fragment;
    std::span<const VkDescriptorSetLayoutBinding> bindings;
    std::span<const VkVertexInputAttributeDescription> attributes;
    uint32_t stride = 0;
    VkFormat color_format = VK_FORMAT_UNDEFINED;
};

/// A ray-tracing pipeline of one shader a kind, and its shader binding table.
struct RawRays {
    RawProgram program;
    VkStridedDeviceAddressRegionKHR generation = {};
    VkStridedDeviceAddressRegionKHR miss = {};
    VkStridedDeviceAddressRegionKHR hit = {};
};

class RawDevice {
public:
    enum class Tracing { Off, On, Pipelines };

    /// Opens the first adapter with this name, any if it is empty.
    explicit RawDevice(std::string_view adapter, Tracing tracing = Tracing::Off);
    ~RawDevice();
    RawDevice(const RawDevice&) = delete;
    RawDevice& operator=(const RawDevice&) = delete;

    VkDevice handle() const { return device_; }
    const VkPhysicalDeviceLimits& limits() const { return properties_.limits; }

    RawBuffer createBuffer(VkDeviceSize size, VkBufferUsageFlags usage, bool host);
    /// The view is of the first mip level.
    RawImage createImage(VkFormat format, uint32_t width, uint32_t height, VkImageUsageFlags usage, uint32_t mips = 1);
    VkSampler createSampler();
    RawProgram createKernel(std::span<const uint32_t> words, std::span<const VkDescriptorSetLayoutBinding> bindings);
    RawProgram createPipeline(const RawGraphics& desc);
    RawRays createRays(std::span<const uint32_t> generation, std::span<const uint32_t> miss,
                       std::span<const uint32_t> hit, std::span<const VkDescriptorSetLayoutBinding> bindings);
    std::vector<VkDescriptorSet> createSets(const RawProgram& program,
                                            std::span<const VkDescriptorSetLayoutBinding> bindings, uint32_t count);
    VkQueryPool createTimestamps(uint32_t count);
    /// A structure with storage for `primitives` of a geometry.
    RawAcceleration createAcceleration(VkAccelerationStructureTypeKHR type,
                                       const VkAccelerationStructureGeometryKHR& geometry, uint32_t primitives);

    /// Begins the one command buffer; what was recorded before has to be done.
    VkCommandBuffer begin();
    /// Ends and submits it.
    void submit();
    void wait();

    RawFunctions vk;

private:
    VkDeviceMemory allocate(const VkMemoryRequirements& requirements, VkMemoryPropertyFlags wanted, bool address);
    RawProgram createLayout(std::span<const VkDescriptorSetLayoutBinding> bindings);
    VkShaderModule createModule(std::span<const uint32_t> words);
    void own(std::function<void()> release) { releases_.push_back(std::move(release)); }

    void* library_ = nullptr;
    VkInstance instance_ = VK_NULL_HANDLE;
    VkPhysicalDevice adapter_ = VK_NULL_HANDLE;
    VkPhysicalDeviceProperties properties_ = {};
    VkPhysicalDeviceMemoryProperties memory_ = {};
    uint32_t family_ = 0;
    VkDevice device_ = VK_NULL_HANDLE;
    VkQueue queue_ = VK_NULL_HANDLE;
    VkSemaphore timeline_ = VK_NULL_HANDLE;
    uint64_t value_ = 0;
    VkCommandPool pool_ = VK_NULL_HANDLE;
    VkCommandBuffer commands_ = VK_NULL_HANDLE;
    std::vector<std::function<void()>> releases_;
};

/// Throws, saying what failed with which result.
void require(VkResult result, const char* what);

/// One memory barrier over everything.
void memoryBarrier(const RawFunctions& vk, VkCommandBuffer commands, VkPipelineStageFlags2 source_stage,
                   VkAccessFlags2 source_access, VkPipelineStageFlags2 destination_stage,
                   VkAccessFlags2 destination_access);

struct ImageState {
    VkImageLayout layout = VK_IMAGE_LAYOUT_UNDEFINED;
    VkPipelineStageFlags2 stage = VK_PIPELINE_STAGE_2_NONE;
    VkAccessFlags2 access = VK_ACCESS_2_NONE;
};

void imageBarrier(const RawFunctions& vk, VkCommandBuffer commands, VkImage image, const ImageState& from,
                  const ImageState& to);

}  // namespace glint::bench
