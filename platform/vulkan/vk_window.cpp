#include "platform/vulkan/vk_window.h"

#include "platform/vulkan/vk_device.h"
#include "platform/vulkan/vk_format.h"
#include "platform/vulkan/vk_result.h"
#include "platform/vulkan/vk_texture.h"

#include <glint/base/format_error.h>

#include <algorithm>

namespace glint::vulkan {

using namespace detail;

namespace {

/// A compositor may keep all pictures of a window that nobody sees: then the frame is skipped.
constexpr uint64_t acquire_timeout = 1'000'000'000;

constexpr VkImageUsageFlags picture_usage =
    VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;

Error unsupported(const VulkanDevice& device, std::string_view why) {
    return makeError(ErrorCode::Unsupported, "window.unsupported", "'{}' {}", device.adapter.info.name, why);
}

}  // namespace

Expected<std::unique_ptr<VulkanWindow>> VulkanWindow::create(VulkanDevice& device, const WindowDesc& desc) {
    Expected<std::unique_ptr<window::SystemWindow>> system = window::SystemWindow::create(desc);
    if (!system) return unexpected(system.error());
    std::unique_ptr<VulkanWindow> window(new VulkanWindow(device, desc, std::move(*system)));
    Expected<VkSurfaceKHR> surface = window->window_->createSurface(device.instance->handle);
    if (!surface) return unexpected(surface.error());
    window->surface_ = *surface;
    VkBool32 is_supported = VK_FALSE;
    const VkResult result = device.instance->vk.GetPhysicalDeviceSurfaceSupportKHR(
        device.adapter.handle, device.queue(Queue::Main).family(), *surface, &is_supported);
    if (result != VK_SUCCESS) return unexpected(resultError("vkGetPhysicalDeviceSurfaceSupportKHR", result));
    if (!is_supported) return unexpected(unsupported(device, "cannot present to windows of this display"));
    if (Status status = window->chooseFormat(); !status) return unexpected(status.error());
    if (Status status = window->chooseMode(); !status) return unexpected(status.error());
    return window;
}

VulkanWindow::~VulkanWindow() {
    if (swapchain_ || !retired_.empty()) device_.queue(Queue::Main).waitPresented();
    retired_.clear();
    swapchain_.reset();
    if (surface_) device_.instance->vk.DestroySurfaceKHR(device_.instance->handle, surface_, nullptr);
}

Status VulkanWindow::chooseFormat() {
    const auto list = device_.instance->vk.GetPhysicalDeviceSurfaceFormatsKHR;
    uint32_t count = 0;
    std::vector<VkSurfaceFormatKHR> formats;
    VkResult result = VK_INCOMPLETE;
    while (result == VK_INCOMPLETE) {
        result = list(device_.adapter.handle, surface_, &count, nullptr);
        if (result != VK_SUCCESS) break;
        formats.resize(count);
        result = list(device_.adapter.handle, surface_, &count, formats.data());
        formats.resize(count);
    }
    if (result != VK_SUCCESS) return resultError("vkGetPhysicalDeviceSurfaceFormatsKHR", result);
    const Format wanted[2] = {desc_.srgb ? FormatRGBAu8ns : FormatRGBAu8n, desc_.srgb ? FormatBGRAu8ns : FormatBGRAu8n};
    for (Format want : wanted) {
        for (const VkSurfaceFormatKHR& format : formats) {
            if (format.format != vulkanFormat(want) || format.colorSpace != VK_COLOR_SPACE_SRGB_NONLINEAR_KHR) continue;
            format_ = format;
            return {};
        }
    }
    return makeError(ErrorCode::Unsupported, "window.format",
                     "the window system takes neither {} nor {} of '{}', but {} other formats", toString(wanted[0]),
                     toString(wanted[1]), device_.adapter.info.name, formats.size());
}

Status VulkanWindow::chooseMode() {
    const auto list = device_.instance->vk.GetPhysicalDeviceSurfacePresentModesKHR;
    VkPresentModeKHR modes[16];
    uint32_t count = 16;
    const VkResult result = list(device_.adapter.handle, surface_, &count, modes);
    if (result < 0) return resultError("vkGetPhysicalDeviceSurfacePresentModesKHR", result);
    const auto has = [&](VkPresentModeKHR mode) { return std::find(modes, modes + count, mode) != modes + count; };
    mode_ = VK_PRESENT_MODE_FIFO_KHR;  // every surface has it
    if (desc_.sync == WindowDesc::Sync::Vertical) return {};
    if (desc_.sync == WindowDesc::Sync::Off && has(VK_PRESENT_MODE_IMMEDIATE_KHR))
        mode_ = VK_PRESENT_MODE_IMMEDIATE_KHR;
    else if (has(VK_PRESENT_MODE_MAILBOX_KHR))
        mode_ = VK_PRESENT_MODE_MAILBOX_KHR;
    return {};
}

Expected<NativeWindow::Pictures> VulkanWindow::createPictures() {
    VkSurfaceCapabilitiesKHR caps = {};
    VkResult result =
        device_.instance->vk.GetPhysicalDeviceSurfaceCapabilitiesKHR(device_.adapter.handle, surface_, &caps);
    if (result != VK_SUCCESS) return unexpected(resultError("vkGetPhysicalDeviceSurfaceCapabilitiesKHR", result));
    if ((caps.supportedUsageFlags & picture_usage) != picture_usage)
        return unexpected(unsupported(device_, "cannot draw to, and copy from and to, windows of this display"));

    VkExtent2D extent = caps.currentExtent;
    if (extent.width == ~0u) {  // the window takes whatever size its pictures have
        const Vector2u size = window_->size();
        extent.width = std::clamp(size.x, caps.minImageExtent.width, caps.maxImageExtent.width);
        extent.height = std::clamp(size.y, caps.minImageExtent.height, caps.maxImageExtent.height);
    }
    Pictures pictures;
    pictures.desc = {.type = Texture::Type2D,
                     .format = glintFormat(format_.format),
                     .width = extent.width,
                     .height = extent.height,
                     .flags = Texture::FlagTarget};
    pictures.sync = mode_ == VK_PRESENT_MODE_IMMEDIATE_KHR ? WindowDesc::Sync::Off
                    : mode_ == VK_PRESENT_MODE_MAILBOX_KHR ? WindowDesc::Sync::Mailbox
                                                           : WindowDesc::Sync::Vertical;
    outdated = true;
    if (!extent.width || !extent.height) return pictures;

    VkSwapchainCreateInfoKHR info = {VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR};
    info.surface = surface_;
    // One on the screen, one waiting for it, one being drawn.
    info.minImageCount = std::max(caps.minImageCount, 3u);
    if (caps.maxImageCount) info.minImageCount = std::min(info.minImageCount, caps.maxImageCount);
    info.imageFormat = format_.format;
    info.imageColorSpace = format_.colorSpace;
    info.imageExtent = extent;
    info.imageArrayLayers = 1;
    info.imageUsage = picture_usage;
    info.imageSharingMode = VK_SHARING_MODE_EXCLUSIVE;
    info.preTransform = caps.currentTransform;
    info.compositeAlpha = caps.supportedCompositeAlpha & VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR
                              ? VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR
                              : VK_COMPOSITE_ALPHA_INHERIT_BIT_KHR;
    info.presentMode = mode_;
    info.clipped = VK_TRUE;
    info.oldSwapchain = swapchain_ ? swapchain_->handle() : VK_NULL_HANDLE;
    Expected<std::unique_ptr<Swapchain>> made = Swapchain::create(device_, info);
    if (!made) return unexpected(made.error());
    // One that was never presented is not in use, unless a frame of it is: then it is the caller's who ends it first.
    if (swapchain_ && swapchain_->last_value) retired_.push_back({std::move(swapchain_)});
    swapchain_ = std::move(*made);
    if (extent.width != extent_.width || extent.height != extent_.height) is_suboptimal_ = false;
    extent_ = extent;
    outdated = false;
    for (VkImage image : swapchain_->images())
        pictures.textures.push_back(VulkanTexture::adopt(device_, image, pictures.desc, 1));
    return pictures;
}

void VulkanWindow::judge(VkResult result) {
    if (result == VK_ERROR_OUT_OF_DATE_KHR) outdated = true;
    // Some displays have no better pictures to offer: once is enough.
    if (result == VK_SUBOPTIMAL_KHR && !is_suboptimal_) outdated = is_suboptimal_ = true;
}

Expected<uint32_t> VulkanWindow::acquire() {
    releaseRetired();
    const VkResult result = swapchain_->acquire(acquire_timeout);
    judge(result);
    switch (result) {
        case VK_SUCCESS:
        case VK_SUBOPTIMAL_KHR: return swapchain_->index();
        case VK_TIMEOUT:
        case VK_NOT_READY:
        case VK_ERROR_OUT_OF_DATE_KHR: return no_picture;
        case VK_ERROR_DEVICE_LOST: return unexpected(device_.lost("vkAcquireNextImageKHR"));
        default: return unexpected(resultError("vkAcquireNextImageKHR", result));
    }
}

Status VulkanWindow::present() {
    const VkResult result = swapchain_->present();
    judge(result);
    switch (result) {
        case VK_SUCCESS:
        case VK_SUBOPTIMAL_KHR:
        case VK_ERROR_OUT_OF_DATE_KHR: return {};
        case VK_ERROR_DEVICE_LOST: return device_.lost("vkQueuePresentKHR");
        default: return resultError("vkQueuePresentKHR", result);
    }
}

void VulkanWindow::noteSubmission(uint64_t value) {
    swapchain_->last_value = value;
    for (Retired& retired : retired_)
        if (!retired.value) retired.value = value;
}

void VulkanWindow::releaseRetired() {
    if (retired_.empty()) return;
    const uint64_t done = device_.completed(Queue::Main);
    std::erase_if(retired_, [done](const Retired& retired) { return retired.value && retired.value <= done; });
}

}  // namespace glint::vulkan
