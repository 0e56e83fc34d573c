#include "platform/vulkan/vk_instance.h"

#include "platform/vulkan/vk_result.h"

#include <glint/base/format_error.h>
#include <glint/base/log.h>

#include <cstdlib>
#include <cstring>
#include <mutex>

namespace glint::vulkan {

namespace {

constexpr const char* validation_layer = "VK_LAYER_KHRONOS_validation";

bool hasLayer(const LoaderFunctions& vk, const char* name) {
    uint32_t count = 0;
    vk.EnumerateInstanceLayerProperties(&count, nullptr);
    std::vector<VkLayerProperties> layers(count);
    vk.EnumerateInstanceLayerProperties(&count, layers.data());
    layers.resize(count);
    for (const VkLayerProperties& layer : layers) {
        if (!std::strcmp(layer.layerName, name)) return true;
    }
    return false;
}

std::vector<VkExtensionProperties> listExtensions(const LoaderFunctions& vk, const char* layer) {
    uint32_t count = 0;
    vk.EnumerateInstanceExtensionProperties(layer, &count, nullptr);
    std::vector<VkExtensionProperties> extensions(count);
    vk.EnumerateInstanceExtensionProperties(layer, &count, extensions.data());
    extensions.resize(count);
    return extensions;
}

bool contains(const std::vector<VkExtensionProperties>& extensions, const char* name) {
    for (const VkExtensionProperties& extension : extensions) {
        if (!std::strcmp(extension.extensionName, name)) return true;
    }
    return false;
}

/// Surfaces of every window system, by name: their headers include the system's own.
constexpr const char* surface_extensions[] = {
    "VK_KHR_xcb_surface",   "VK_KHR_xlib_surface",  "VK_KHR_wayland_surface",
    "VK_KHR_win32_surface", "VK_EXT_metal_surface",
};

Error messageError(const VkDebugUtilsMessengerCallbackDataEXT& data) {
    return Error::inFile(ErrorCode::Internal, "vulkan.validation", data.pMessage ? data.pMessage : "", {}, 0,
                         data.pMessageIdName ? data.pMessageIdName : "");
}

VKAPI_ATTR VkBool32 VKAPI_CALL sendToReceiver(VkDebugUtilsMessageSeverityFlagBitsEXT severity,
                                              VkDebugUtilsMessageTypeFlagsEXT,
                                              const VkDebugUtilsMessengerCallbackDataEXT* data, void* receiver) {
    (*static_cast<const Messenger::Receive*>(receiver))(messageError(*data),
                                                        severity < VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT);
    return VK_FALSE;
}

/// For messages about the instance itself, which no device hears: objects left behind at its end.
VKAPI_ATTR VkBool32 VKAPI_CALL sendToLog(VkDebugUtilsMessageSeverityFlagBitsEXT severity,
                                         VkDebugUtilsMessageTypeFlagsEXT,
                                         const VkDebugUtilsMessengerCallbackDataEXT* data, void*) {
    const bool error = severity >= VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
    log(error ? LogLevel::Error : LogLevel::Warning, "vulkan.validation", messageError(*data).summary());
    return VK_FALSE;
}

/// Validation messages alone: the loader's complaints about drivers and layers that nobody asked for are of the general
/// type.
VkDebugUtilsMessengerCreateInfoEXT messengerInfo(PFN_vkDebugUtilsMessengerCallbackEXT callback, const void* receiver) {
    VkDebugUtilsMessengerCreateInfoEXT info = {VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT};
    info.messageSeverity =
        VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
    info.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
    info.pfnUserCallback = callback;
    info.pUserData = const_cast<void*>(receiver);
    return info;
}

Error noDriver(std::string why) { return makeError(ErrorCode::Unsupported, "device.no_driver", "{}", why); }

}  // namespace

Expected<std::shared_ptr<Instance>> Instance::shared(bool validation) {
    static std::mutex mutex;
    static std::weak_ptr<Instance> instances[2];
    const std::lock_guard lock(mutex);
    if (std::shared_ptr<Instance> instance = instances[validation].lock()) return instance;

    const LoaderFunctions* loader = loaderFunctions();
    if (!loader) return unexpected(noDriver("no Vulkan here: libvulkan.so.1 cannot be loaded"));
    uint32_t version = VK_API_VERSION_1_0;
    if (loader->EnumerateInstanceVersion) loader->EnumerateInstanceVersion(&version);
    if (version < VK_API_VERSION_1_3) {
        return unexpected(noDriver(fmt::format("the Vulkan loader is of version {}.{}, 1.3 is needed",
                                               VK_API_VERSION_MAJOR(version), VK_API_VERSION_MINOR(version))));
    }

    std::shared_ptr<Instance> instance(new Instance);
    instance->owned = true;
    instance->validation = validation && hasLayer(*loader, validation_layer);
    const std::vector<VkExtensionProperties> offered = listExtensions(*loader, nullptr);
    instance->debug_utils = contains(offered, VK_EXT_DEBUG_UTILS_EXTENSION_NAME);

    std::vector<const char*> layers, extensions;
    if (instance->debug_utils) extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
    // Enabled whether there is a display or not: it costs nothing, and any device can then have a window later.
    if (contains(offered, VK_KHR_SURFACE_EXTENSION_NAME)) {
        extensions.push_back(VK_KHR_SURFACE_EXTENSION_NAME);
        for (const char* extension : surface_extensions) {
            if (!contains(offered, extension)) continue;
            extensions.push_back(extension);
            instance->surfaces = true;
        }
    }
    VkDebugUtilsMessengerCreateInfoEXT messenger = messengerInfo(sendToLog, nullptr);
    VkValidationFeaturesEXT features = {VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT};
    const VkValidationFeatureEnableEXT enables[] = {VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT};
    features.enabledValidationFeatureCount = 1;
    features.pEnabledValidationFeatures = enables;
    const void* next = nullptr;
    if (instance->validation) {
        layers.push_back(validation_layer);
        // Hazards between submissions. Layers of 1.3.239 can be asked for it by the environment alone, later ones do it
        // by default. What the user has set there stays.
        setenv("VK_LAYER_ENABLES", "VALIDATION_CHECK_ENABLE_SYNCHRONIZATION_VALIDATION_QUEUE_SUBMIT", 0);
        if (contains(listExtensions(*loader, validation_layer), VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME)) {
            extensions.push_back(VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME);
            next = &features;
        }
        if (instance->debug_utils) {
            messenger.pNext = next;
            next = &messenger;
        }
    }

    VkApplicationInfo application = {VK_STRUCTURE_TYPE_APPLICATION_INFO};
    application.pEngineName = "Glint";
    application.apiVersion = VK_API_VERSION_1_3;
    VkInstanceCreateInfo info = {VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO};
    info.pNext = next;
    info.pApplicationInfo = &application;
    info.enabledLayerCount = static_cast<uint32_t>(layers.size());
    info.ppEnabledLayerNames = layers.data();
    info.enabledExtensionCount = static_cast<uint32_t>(extensions.size());
    info.ppEnabledExtensionNames = extensions.data();
    const VkResult result = loader->CreateInstance(&info, nullptr, &instance->handle);
    if (result == VK_ERROR_INCOMPATIBLE_DRIVER) return unexpected(noDriver("no Vulkan driver is installed"));
    if (result != VK_SUCCESS) return unexpected(resultError("vkCreateInstance", result));
    instance->vk.load(loader->GetInstanceProcAddr, instance->handle);
    instances[validation] = instance;
    return instance;
}

std::shared_ptr<Instance> Instance::adopt(VkInstance handle, PFN_vkGetInstanceProcAddr get) {
    std::shared_ptr<Instance> instance(new Instance);
    instance->handle = handle;
    instance->vk.load(get, handle);
    instance->debug_utils = instance->vk.SetDebugUtilsObjectNameEXT != nullptr;
    instance->validation = true;
    return instance;
}

Instance::~Instance() {
    if (owned && handle) vk.DestroyInstance(handle, nullptr);
}

std::vector<VkPhysicalDevice> Instance::adapters() const {
    uint32_t count = 0;
    vk.EnumeratePhysicalDevices(handle, &count, nullptr);
    std::vector<VkPhysicalDevice> adapters(count);
    vk.EnumeratePhysicalDevices(handle, &count, adapters.data());
    adapters.resize(count);
    return adapters;
}

Messenger::Messenger(std::shared_ptr<Instance> instance, Receive receive)
    : instance_(std::move(instance)), receive_(std::move(receive)) {
    if (!instance_->debug_utils || !receive_) return;
    const VkDebugUtilsMessengerCreateInfoEXT info = messengerInfo(sendToReceiver, &receive_);
    instance_->vk.CreateDebugUtilsMessengerEXT(instance_->handle, &info, nullptr, &handle_);
}

Messenger::~Messenger() {
    if (handle_) instance_->vk.DestroyDebugUtilsMessengerEXT(instance_->handle, handle_, nullptr);
}

}  // namespace glint::vulkan
