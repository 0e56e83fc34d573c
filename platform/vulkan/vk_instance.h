#pragma once

#include "platform/vulkan/vk_functions.h"

#include <glint/base/expected.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace glint::vulkan {

/// A VkInstance with its functions. The devices of a process share one, or two: with and without validation.
class Instance {
public:
    /// The process's instance, made when the first device asks and destroyed with the last one.
    /// Errors: "device.no_driver", "vulkan.result".
    static Expected<std::shared_ptr<Instance>> shared(bool validation);
    /// An instance of the caller's, who enabled VK_EXT_debug_utils or not; it is not destroyed.
    static std::shared_ptr<Instance> adopt(VkInstance instance, PFN_vkGetInstanceProcAddr get);
    ~Instance();

    Instance(const Instance&) = delete;
    Instance& operator=(const Instance&) = delete;

    std::vector<VkPhysicalDevice> adapters() const;

    VkInstance handle = VK_NULL_HANDLE;
    InstanceFunctions vk;
    bool debug_utils = false;  ///< names, regions and messages
    bool surfaces = false;     ///< of the window systems that drivers here know: devices may present
    bool validation = false;   ///< the Khronos layer is there, or may be
    bool owned = false;

private:
    Instance() = default;
};

/// Passes what the validation layers say to `receive` for as long as it lives.
class Messenger {
public:
    using Receive = std::function<void(const Error& error, bool warning)>;

    Messenger(std::shared_ptr<Instance> instance, Receive receive);
    ~Messenger();
    Messenger(const Messenger&) = delete;
    Messenger& operator=(const Messenger&) = delete;

private:
    std::shared_ptr<Instance> instance_;
    const Receive receive_;
    VkDebugUtilsMessengerEXT handle_ = VK_NULL_HANDLE;
};

}  // namespace glint::vulkan
