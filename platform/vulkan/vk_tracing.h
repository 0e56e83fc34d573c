#pragma once

#include "platform/vulkan/vk_memory.h"

#include <glint/device/detail/backend.h>

#include <vector>

namespace glint::vulkan {

class VulkanDevice;

class VulkanTracing final : public detail::NativeTracing {
public:
    static Expected<std::unique_ptr<VulkanTracing>> create(VulkanDevice& device, const detail::NativeTracingDesc& desc);
    ~VulkanTracing() override;

    void setName(const std::string& name) override;
    VkAccelerationStructureKHR handle() const { return handle_; }
    /// Slot 0 takes the compacted size; VK_NULL_HANDLE unless made with FlagCompact.
    VkQueryPool sizePool() const { return size_pool_; }

    /// Fills what vkCmdBuildAccelerationStructuresKHR takes for a build, or an update in place; valid until the next
    /// call. `scratch` and `instances` are addresses.
    void prepareBuild(const detail::TracingBuild& build, uint64_t scratch, uint64_t instances,
                      VkAccelerationStructureBuildGeometryInfoKHR& info,
                      const VkAccelerationStructureBuildRangeInfoKHR*& ranges);

    Expected<uint64_t> compactedSize() const;

private:
    explicit VulkanTracing(VulkanDevice& device) : device_(device) {}
    Status allocate(uint64_t size, const std::string& name);
    VkAccelerationStructureBuildGeometryInfoKHR buildInfo() const;

    VulkanDevice& device_;
    Tracing::Type type_ = Tracing::TypeTriangle;
    Tracing::Flags flags_ = 0;
    std::vector<detail::TracingGeometry> geometries_;
    std::vector<VkAccelerationStructureGeometryKHR> native_;  ///< addresses are filled in for a build
    std::vector<VkAccelerationStructureBuildRangeInfoKHR> ranges_;
    RawBuffer storage_;
    VkAccelerationStructureKHR handle_ = VK_NULL_HANDLE;
    VkQueryPool size_pool_ = VK_NULL_HANDLE;
};

constexpr uint32_t instance_size = sizeof(VkAccelerationStructureInstanceKHR);

/// As Backend::writeInstances.
void writeInstanceRecords(std::span<const Tracing::Instance> instances,
                          std::span<const detail::NativeTracing* const> tracings, void* records);

}  // namespace glint::vulkan
