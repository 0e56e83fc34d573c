#pragma once

#include "platform/vulkan/vk_layout.h"
#include "platform/vulkan/vk_player.h"
#include "platform/vulkan/vk_upload.h"

#include <glint/device/detail/backend.h>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace glint::vulkan {

/// What one submission needs until it is done, and the next one can have again.
struct Frame {
    VkCommandPool pool = VK_NULL_HANDLE;
    VkCommandBuffer commands = VK_NULL_HANDLE;
    VkFence fence = VK_NULL_HANDLE;  ///< with validation only: its synchronisation checks follow no time lines
    uint64_t value = 0;
    std::vector<std::pair<SetLayout*, VkDescriptorSet>> sets;
    std::vector<std::unique_ptr<Chunk>> chunks;
    std::string regions;  ///< names of the lists and outer regions, for the message of a lost device
};

/// A queue with its time line. All but what says so under the submit lock.
class VulkanQueue {
public:
    VulkanQueue(VulkanDevice& device, VkQueue handle, uint32_t family, VkQueueFlags flags, uint32_t timestamp_bits);
    ~VulkanQueue();
    VulkanQueue(const VulkanQueue&) = delete;
    VulkanQueue& operator=(const VulkanQueue&) = delete;

    Status create(const char* name);
    /// `signal`: a binary semaphore to be signaled besides the time line, or none.
    Status submit(const detail::Submission& submission, std::span<const VkSemaphoreSubmitInfo> waits,
                  VkSemaphore signal);
    /// vkQueuePresentKHR, and a wait for all that it and submissions were asked for. From any thread, without the
    /// submit lock: others submit to other queues meanwhile.
    VkResult present(const VkPresentInfoKHR& info);
    void waitPresented();
    /// With validation only: waits for the fences of what was submitted up to `value`.
    void settle(uint64_t value) const;
    /// From any thread.
    uint64_t completed() const;
    /// What ran last and what did not finish, for the message of a lost device.
    std::string progress() const;

    VkQueue handle() const { return handle_; }
    uint32_t family() const { return family_; }
    VkSemaphore timeline() const { return timeline_; }
    uint32_t timestampBits() const { return timestamp_bits_; }
    /// Graphics, compute and transfer bits, each implying the next.
    VkQueueFlags flags() const { return flags_; }

private:
    Expected<std::unique_ptr<Frame>> acquire();
    void recycle(std::unique_ptr<Frame> frame);
    void finish(std::unique_ptr<Frame> frame);
    void destroy(Frame& frame);
    void recycleCompleted();

    VulkanDevice& device_;
    std::mutex handle_mutex_;  // of the queue itself; taken after the submit lock
    const VkQueue handle_;
    const uint32_t family_;
    const VkQueueFlags flags_;
    const uint32_t timestamp_bits_;
    VkSemaphore timeline_ = VK_NULL_HANDLE;
    Player player_;
    std::vector<std::unique_ptr<Frame>> pending_;  ///< in order of their values
    std::vector<std::unique_ptr<Frame>> free_;
    std::string last_regions_;  ///< of the submission that finished last
    mutable std::atomic<uint64_t> last_completed_ = 0;
};

}  // namespace glint::vulkan
