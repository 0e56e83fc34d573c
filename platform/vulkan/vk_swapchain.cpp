#include "platform/vulkan/vk_swapchain.h"

#include "platform/vulkan/vk_device.h"
#include "platform/vulkan/vk_result.h"

namespace glint::vulkan {

Expected<std::unique_ptr<Swapchain>> Swapchain::create(VulkanDevice& device, const VkSwapchainCreateInfoKHR& info) {
    std::unique_ptr<Swapchain> swapchain(new Swapchain(device));
    const DeviceFunctions& vk = device.vk;
    VkResult result = vk.CreateSwapchainKHR(device.handle, &info, nullptr, &swapchain->handle_);
    if (result != VK_SUCCESS) return unexpected(resultError("vkCreateSwapchainKHR", result));
    uint32_t count = 0;
    do {
        result = vk.GetSwapchainImagesKHR(device.handle, swapchain->handle_, &count, nullptr);
        if (result != VK_SUCCESS) break;
        swapchain->images_.resize(count);
        result = vk.GetSwapchainImagesKHR(device.handle, swapchain->handle_, &count, swapchain->images_.data());
    } while (result == VK_INCOMPLETE);
    if (result != VK_SUCCESS) return unexpected(resultError("vkGetSwapchainImagesKHR", result));
    if (Status status = swapchain->createSemaphores(); !status) return unexpected(status.error());
    return swapchain;
}

Status Swapchain::createSemaphores() {
    const auto make = [this](VkSemaphore& semaphore, const char* name) -> Status {
        const VkSemaphoreCreateInfo info = {VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO, nullptr, 0};
        const VkResult result = device_.vk.CreateSemaphore(device_.handle, &info, nullptr, &semaphore);
        if (result != VK_SUCCESS) return resultError("vkCreateSemaphore", result);
        device_.memory.objects_created++;
        device_.setName(VK_OBJECT_TYPE_SEMAPHORE, semaphore, name);
        return {};
    };
    drawn_.resize(images_.size());
    for (VkSemaphore& semaphore : acquired_)
        if (Status status = make(semaphore, "picture acquired"); !status) return status;
    for (VkSemaphore& semaphore : drawn_)
        if (Status status = make(semaphore, "picture drawn"); !status) return status;
    return {};
}

Swapchain::~Swapchain() {
    for (VkSemaphore semaphore : acquired_) device_.vk.DestroySemaphore(device_.handle, semaphore, nullptr);
    for (VkSemaphore semaphore : drawn_) device_.vk.DestroySemaphore(device_.handle, semaphore, nullptr);
    if (handle_) device_.vk.DestroySwapchainKHR(device_.handle, handle_, nullptr);
}

VkResult Swapchain::acquire(uint64_t nanoseconds) {
    const size_t next = (acquire_ + 1) % acquired_.size();
    const VkResult result =
        device_.vk.AcquireNextImageKHR(device_.handle, handle_, nanoseconds, acquired_[next], VK_NULL_HANDLE, &index_);
    if (result == VK_SUCCESS || result == VK_SUBOPTIMAL_KHR) acquire_ = next;
    return result;
}

VkResult Swapchain::present() {
    VkPresentInfoKHR info = {VK_STRUCTURE_TYPE_PRESENT_INFO_KHR};
    info.waitSemaphoreCount = 1;
    info.pWaitSemaphores = &drawn_[index_];
    info.swapchainCount = 1;
    info.pSwapchains = &handle_;
    info.pImageIndices = &index_;
    return device_.queue(Queue::Main).present(info);
}

}  // namespace glint::vulkan
