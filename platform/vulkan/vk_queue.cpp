#include "platform/vulkan/vk_queue.h"

#include "platform/vulkan/vk_device.h"
#include "platform/vulkan/vk_result.h"

#include <glint/base/format_error.h>

namespace glint::vulkan {

VulkanQueue::VulkanQueue(VulkanDevice& device, VkQueue handle, uint32_t family, VkQueueFlags flags,
                         uint32_t timestamp_bits)
    : device_(device),
      handle_(handle),
      family_(family),
      flags_(flags),
      timestamp_bits_(timestamp_bits),
      player_(device, *this) {}

VulkanQueue::~VulkanQueue() {
    if (!pending_.empty()) {
        VkSemaphoreWaitInfo info = {VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO};
        info.semaphoreCount = 1;
        info.pSemaphores = &timeline_;
        info.pValues = &pending_.back()->value;
        device_.vk.WaitSemaphores(device_.handle, &info, UINT64_MAX);
    }
    for (std::unique_ptr<Frame>& frame : pending_) finish(std::move(frame));
    for (std::unique_ptr<Frame>& frame : free_) destroy(*frame);
    device_.vk.DestroySemaphore(device_.handle, timeline_, nullptr);
}

Status VulkanQueue::create(const char* name) {
    VkSemaphoreTypeCreateInfo type = {VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO};
    type.semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE;
    const VkSemaphoreCreateInfo info = {VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO, &type, 0};
    const VkResult result = device_.vk.CreateSemaphore(device_.handle, &info, nullptr, &timeline_);
    if (result != VK_SUCCESS) return resultError("vkCreateSemaphore", result);
    device_.memory.objects_created++;
    device_.setName(VK_OBJECT_TYPE_SEMAPHORE, timeline_, name);
    return {};
}

Expected<std::unique_ptr<Frame>> VulkanQueue::acquire() {
    if (!free_.empty()) {
        std::unique_ptr<Frame> frame = std::move(free_.back());
        free_.pop_back();
        const VkResult result = device_.vk.ResetCommandPool(device_.handle, frame->pool, 0);
        if (result == VK_SUCCESS) return frame;
        free_.push_back(std::move(frame));
        return unexpected(resultError("vkResetCommandPool", result));
    }
    auto frame = std::make_unique<Frame>();
    VkCommandPoolCreateInfo pool_info = {VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO};
    pool_info.flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT;
    pool_info.queueFamilyIndex = family_;
    VkResult result = device_.vk.CreateCommandPool(device_.handle, &pool_info, nullptr, &frame->pool);
    if (result != VK_SUCCESS) return unexpected(resultError("vkCreateCommandPool", result));
    VkCommandBufferAllocateInfo info = {VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO};
    info.commandPool = frame->pool;
    info.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
    info.commandBufferCount = 1;
    result = device_.vk.AllocateCommandBuffers(device_.handle, &info, &frame->commands);
    if (result != VK_SUCCESS) {
        device_.vk.DestroyCommandPool(device_.handle, frame->pool, nullptr);
        return unexpected(resultError("vkAllocateCommandBuffers", result));
    }
    device_.memory.objects_created += 2;
    // All may be pending, or free, at once one day: room for that now, so that a warm frame never allocates it.
    pending_.reserve(pending_.size() + 1);
    free_.reserve(pending_.size() + 1);
    if (device_.instance->validation) {
        const VkFenceCreateInfo fence_info = {VK_STRUCTURE_TYPE_FENCE_CREATE_INFO, nullptr, 0};
        result = device_.vk.CreateFence(device_.handle, &fence_info, nullptr, &frame->fence);
        if (result != VK_SUCCESS) {
            destroy(*frame);
            return unexpected(resultError("vkCreateFence", result));
        }
    }
    return frame;
}

void VulkanQueue::destroy(Frame& frame) {
    device_.vk.DestroyFence(device_.handle, frame.fence, nullptr);
    device_.vk.DestroyCommandPool(device_.handle, frame.pool, nullptr);
}

void VulkanQueue::recycle(std::unique_ptr<Frame> frame) {
    for (const auto& [layout, set] : frame->sets) layout->free.push_back(set);
    frame->sets.clear();
    device_.upload.recycle(frame->chunks);
    free_.push_back(std::move(frame));
}

void VulkanQueue::finish(std::unique_ptr<Frame> frame) {
    if (const VkFence fence = frame->fence) {
        device_.vk.WaitForFences(device_.handle, 1, &fence, VK_TRUE, UINT64_MAX);
        device_.vk.ResetFences(device_.handle, 1, &fence);
    }
    recycle(std::move(frame));
}

void VulkanQueue::recycleCompleted() {
    const uint64_t value = completed();
    size_t done = 0;
    for (; done < pending_.size() && pending_[done]->value <= value; done++) {
        last_regions_.swap(pending_[done]->regions);
        finish(std::move(pending_[done]));
    }
    pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(done));
}

Status VulkanQueue::submit(const detail::Submission& submission, std::span<const VkSemaphoreSubmitInfo> waits,
                           VkSemaphore signal) {
    recycleCompleted();
    Expected<std::unique_ptr<Frame>> acquired = acquire();
    if (!acquired) return acquired.error();
    std::unique_ptr<Frame> frame = std::move(*acquired);
    frame->value = submission.value;
    if (Status status = player_.play(*frame, submission.lists); !status) {
        recycle(std::move(frame));
        return status;
    }

    VkCommandBufferSubmitInfo commands = {VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO};
    commands.commandBuffer = frame->commands;
    VkSemaphoreSubmitInfo signals[2] = {{VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO},
                                        {VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO}};
    signals[0].semaphore = timeline_;
    signals[0].value = submission.value;
    signals[1].semaphore = signal;
    signals[0].stageMask = signals[1].stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT;
    VkSubmitInfo2 info = {VK_STRUCTURE_TYPE_SUBMIT_INFO_2};
    info.waitSemaphoreInfoCount = static_cast<uint32_t>(waits.size());
    info.pWaitSemaphoreInfos = waits.data();
    info.commandBufferInfoCount = 1;
    info.pCommandBufferInfos = &commands;
    info.signalSemaphoreInfoCount = signal ? 2 : 1;
    info.pSignalSemaphoreInfos = signals;
    VkResult result = VK_SUCCESS;
    {
        const std::lock_guard lock(handle_mutex_);
        result = device_.vk.QueueSubmit2(handle_, 1, &info, frame->fence);
    }
    if (result != VK_SUCCESS) {
        recycle(std::move(frame));
        return resultError("vkQueueSubmit2", result);
    }
    pending_.push_back(std::move(frame));
    return {};
}

VkResult VulkanQueue::present(const VkPresentInfoKHR& info) {
    const std::lock_guard lock(handle_mutex_);
    return device_.vk.QueuePresentKHR(handle_, &info);
}

void VulkanQueue::waitPresented() {
    const std::lock_guard lock(handle_mutex_);
    device_.vk.QueueWaitIdle(handle_);
}

void VulkanQueue::settle(uint64_t value) const {
    for (const std::unique_ptr<Frame>& frame : pending_) {
        if (frame->value > value || !frame->fence) return;
        device_.vk.WaitForFences(device_.handle, 1, &frame->fence, VK_TRUE, UINT64_MAX);
    }
}

uint64_t VulkanQueue::completed() const {
    uint64_t value = 0;
    // A lost device may not answer: then nothing more is known to have finished. Some answer with the largest value.
    if (device_.vk.GetSemaphoreCounterValue(device_.handle, timeline_, &value) != VK_SUCCESS || value == UINT64_MAX) {
        return last_completed_;
    }
    last_completed_ = value;
    return value;
}

std::string VulkanQueue::progress() const {
    const uint64_t value = completed();
    const std::string* last = last_regions_.empty() ? nullptr : &last_regions_;
    const std::string* unfinished = nullptr;
    for (const std::unique_ptr<Frame>& frame : pending_) {
        if (frame->value <= value) {
            last = &frame->regions;
        } else {
            unfinished = &frame->regions;
            break;
        }
    }
    const auto quoted = [](const std::string* regions) {
        return regions ? regions->empty() ? std::string("work without a name") : "'" + *regions + "'" : "nothing";
    };
    return fmt::format("{} finished last, {} did not finish", quoted(last), quoted(unfinished));
}

}  // namespace glint::vulkan
