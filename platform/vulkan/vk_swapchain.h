#pragma once

#include "platform/vulkan/vk_functions.h"

#include <glint/base/expected.h>
#include <glint/device/detail/backend.h>

#include <array>
#include <memory>
#include <vector>

namespace glint::vulkan {

class VulkanDevice;

/// The stages that wait for a picture to be free: those that can write it (DeviceObject::setAcquired).
constexpr VkPipelineStageFlags2 picture_stages =
    VK_PIPELINE_STAGE_2_COLOR_ATTACHMENT_OUTPUT_BIT | VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT;

/// A VkSwapchainKHR, its images, and the semaphores that pass them to and fro. From one thread, but for what is called
/// within a submission.
class Swapchain {
public:
    /// `info` is complete but for its surface's queue families; its oldSwapchain becomes useless, whatever happens.
    static Expected<std::unique_ptr<Swapchain>> create(VulkanDevice& device, const VkSwapchainCreateInfoKHR& info);
    /// No submission that uses an image may be under way, nor its presentation.
    ~Swapchain();
    Swapchain(const Swapchain&) = delete;
    Swapchain& operator=(const Swapchain&) = delete;

    VkSwapchainKHR handle() const { return handle_; }
    const std::vector<VkImage>& images() const { return images_; }

    /// The image that index() names from here on is free once acquired() is signaled.
    VkResult acquire(uint64_t nanoseconds);
    uint32_t index() const { return index_; }
    /// At most frames_in_flight acquired images may not have been waited for.
    VkSemaphore acquired() const { return acquired_[acquire_]; }
    /// To be signaled by what draws last to the image, and waited for by its presentation: one for each image, because
    /// only when the image comes back is it known that its presentation has waited.
    VkSemaphore drawn() const { return drawn_[index_]; }
    VkResult present();

    /// Time-line value, of the main queue, of the last submission that drew for presentation; 0 for none.
    uint64_t last_value = 0;

private:
    explicit Swapchain(VulkanDevice& device) : device_(device) {}
    Status createSemaphores();

    VulkanDevice& device_;
    VkSwapchainKHR handle_ = VK_NULL_HANDLE;
    std::vector<VkImage> images_;
    std::array<VkSemaphore, detail::frames_in_flight> acquired_ = {};
    std::vector<VkSemaphore> drawn_;
    size_t acquire_ = 0;
    uint32_t index_ = 0;
};

}  // namespace glint::vulkan
