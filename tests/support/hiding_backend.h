#pragma once

// A device of an adapter that offers less than it does: its driver's device is made without what is hidden.

#include <glint/device/detail/backends.h>
#include <glint/device/detail/device_object.h>

#include <memory>
#include <utility>

namespace glint::test {

/// Hands everything on, but says that the adapter is no CPU and lacks some features.
class HidingBackend final : public detail::Backend {
public:
    /// `inner` was made without the features that are hidden.
    HidingBackend(std::unique_ptr<detail::Backend> inner, FeatureMask hidden) : inner_(std::move(inner)) {
        info_ = inner_->info();
        info_.features &= ~hidden;
        info_.cpu = false;
    }

    const DeviceInfo& info() const override { return info_; }
    const Features& features() const override { return inner_->features(); }
    bool hasQueue(Queue queue) const override { return inner_->hasQueue(queue); }
    uint32_t formatSupport(Format format, Texture::Type type) const override {
        return inner_->formatSupport(format, type);
    }
    bool vertexFormatSupport(Format format) const override { return inner_->vertexFormatSupport(format); }
    Expected<std::unique_ptr<detail::NativeBuffer>> createBuffer(const detail::NativeBufferDesc& desc) override {
        return inner_->createBuffer(desc);
    }
    Expected<std::unique_ptr<detail::NativeTexture>> createTexture(const detail::NativeTextureDesc& desc) override {
        return inner_->createTexture(desc);
    }
    Expected<std::unique_ptr<detail::NativeSampler>> createSampler(const SamplerDesc& desc) override {
        return inner_->createSampler(desc);
    }
    Expected<std::unique_ptr<detail::NativeTable>> createTable(const std::string& name) override {
        return inner_->createTable(name);
    }
    Expected<std::unique_ptr<detail::NativeKernel>> createKernel(const detail::KernelDesc& desc) override {
        return inner_->createKernel(desc);
    }
    Expected<std::unique_ptr<detail::NativePipeline>> createPipeline(const detail::PipelineDesc& desc) override {
        return inner_->createPipeline(desc);
    }
    Expected<std::unique_ptr<detail::NativeTraversal>> createTraversal(const detail::TraversalDesc& desc) override {
        return inner_->createTraversal(desc);
    }
    Expected<std::unique_ptr<detail::NativeTracing>> createTracing(const detail::NativeTracingDesc& desc) override {
        return inner_->createTracing(desc);
    }
    Expected<std::unique_ptr<detail::NativeQuery>> createQuery(Query::Type type) override {
        return inner_->createQuery(type);
    }
    Expected<std::unique_ptr<detail::NativeWindow>> createWindow(const WindowDesc& desc) override {
        return inner_->createWindow(desc);
    }
    uint32_t instanceSize() const override { return inner_->instanceSize(); }
    void writeInstances(std::span<const Tracing::Instance> instances,
                        std::span<const detail::NativeTracing* const> tracings, void* records) const override {
        inner_->writeInstances(instances, tracings, records);
    }
    Expected<uint64_t> tracingSize(detail::NativeTracing& tracing) override { return inner_->tracingSize(tracing); }
    Expected<std::array<uint64_t, 7>> queryResult(detail::NativeQuery& query) override {
        return inner_->queryResult(query);
    }
    Status submit(const detail::Submission& submission) override { return inner_->submit(submission); }
    uint64_t completed(Queue queue) override { return inner_->completed(queue); }
    Status wait(std::span<const detail::TimelinePoint> points, uint64_t nanoseconds) override {
        return inner_->wait(points, nanoseconds);
    }
    detail::MemoryUse memoryUse() const override { return inner_->memoryUse(); }

private:
    const std::unique_ptr<detail::Backend> inner_;
    DeviceInfo info_;
};

/// The first Vulkan adapter without these features, and with the validation layers.
inline Device createHiding(FeatureMask hidden, const MessageCallback& message) {
    detail::BackendDesc desc;
    desc.optional = FeatureAll & ~hidden;
    desc.validation = true;
    desc.message = [message](const Error& error, bool warning) {
        message({warning ? Message::Severity::Warning : Message::Severity::Error, error});
    };
    Expected<std::unique_ptr<detail::Backend>> made = detail::createBackend("vulkan", desc);
    if (!made) return {};
    auto* const object = new detail::DeviceObject();
    object->adopt(std::make_unique<HidingBackend>(std::move(*made), hidden), message);
    return Device(object);
}

}  // namespace glint::test
