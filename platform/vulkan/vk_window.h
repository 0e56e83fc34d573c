#pragma once

#include "platform/vulkan/vk_swapchain.h"
#include "platform/window/system_window.h"

#include <glint/device/detail/backend.h>

#include <memory>
#include <vector>

namespace glint::vulkan {

/// A window of the system with a surface and the swapchain of its present size.
class VulkanWindow final : public detail::NativeWindow {
public:
    /// Errors: "window.no_display", "window.create", "window.unsupported", "window.format", "window.thread".
    static Expected<std::unique_ptr<VulkanWindow>> create(VulkanDevice& device, const WindowDesc& desc);
    /// Waits for the main queue: nothing else tells that the last presentation is done with its semaphore.
    ~VulkanWindow() override;

    void poll(uint64_t nanoseconds) override { window::SystemWindow::poll(nanoseconds); }
    detail::WindowEvents takeEvents() override { return window_->takeEvents(); }
    void setTitle(const std::string& title) override { window_->setTitle(title); }
    void setSize(uint32_t width, uint32_t height) override { window_->setSize(width, height); }
    void setHidden(bool hidden) override { window_->setHidden(hidden); }

    Expected<Pictures> createPictures() override;
    Expected<uint32_t> acquire() override;
    Status present() override;

    VkSemaphore acquired() const { return swapchain_->acquired(); }
    VkSemaphore drawn() const { return swapchain_->drawn(); }
    /// The submission that signals drawn() has this value on the main queue's time line.
    void noteSubmission(uint64_t value);

private:
    /// A swapchain that another one has replaced. The presentation of its last picture comes before any later
    /// submission of the queue, so once one of those is done, `value`, nothing uses it any more.
    struct Retired {
        std::unique_ptr<Swapchain> swapchain;
        uint64_t value = 0;  ///< 0: not known yet
    };

    VulkanWindow(VulkanDevice& device, const WindowDesc& desc, std::unique_ptr<window::SystemWindow> window)
        : device_(device), desc_(desc), window_(std::move(window)) {}
    Status chooseFormat();
    Status chooseMode();
    void judge(VkResult result);
    void releaseRetired();

    VulkanDevice& device_;
    const WindowDesc desc_;
    const std::unique_ptr<window::SystemWindow> window_;
    VkSurfaceKHR surface_ = VK_NULL_HANDLE;
    VkSurfaceFormatKHR format_ = {};
    VkPresentModeKHR mode_ = VK_PRESENT_MODE_FIFO_KHR;
    std::unique_ptr<Swapchain> swapchain_;
    std::vector<Retired> retired_;
    VkExtent2D extent_ = {0, 0};
    bool is_suboptimal_ = false;  ///< at this size, also after it was made anew
};

}  // namespace glint::vulkan
