#include <platform/null/null.h>

#include <platform/null/null_access.h>
#include <platform/null/null_objects.h>
#include <platform/null/null_player.h>
#include <platform/null/null_window.h>

#include <glint/base/format_error.h>
#include <glint/device/detail/object.h>

#include <algorithm>
#include <cstring>

namespace glint::null {

using namespace detail;

namespace {

DeviceInfo describeAdapter(const NullSettings& settings) {
    DeviceInfo info;
    info.name = "null";
    info.api = "null";
    info.version = "1.0.0";
    info.driver = "Glint";
    info.features = FeatureAll & ~settings.missing;
    return info;
}

// As small as Vulkan allows, where that does not stand in a test's way: alignments above all.
Features describeFeatures(FeatureMask mask, const NullSettings& settings) {
    Features features;
    features.mask = mask;
    features.computeTracing = mask & FeatureComputeTracing;
    features.fragmentTracing = mask & FeatureFragmentTracing;
    features.rayTracing = mask & FeatureRayTracing;
    features.meshShader = mask & FeatureMeshShader;
    features.bufferAddress = mask & FeatureBufferAddress;
    features.textureTable = mask & FeatureTextureTable;
    features.bufferTable = mask & FeatureBufferTable;
    features.maxTableTextures = features.textureTable ? 65536 : 0;
    features.maxTableBuffers = features.bufferTable ? 65536 : 0;
    features.shaderf16 = mask & FeatureShaderf16;
    features.shaderf64 = mask & FeatureShaderf64;
    features.shaderu8 = mask & FeatureShaderu8;
    features.shaderu16 = mask & FeatureShaderu16;
    features.shaderu64 = mask & FeatureShaderu64;
    features.atomicBufferu64 = mask & FeatureAtomicBufferu64;
    if (features.rayTracing) {
        features.recursionDepth = 31;
        features.maxRays = 1ull << 30;
        features.maxRecordSize = 4096 - 32;
        features.maxAttributeSize = 32;
        features.indirectRays = true;
    }
    features.subgroupSize = 32;
    features.minSubgroupSize = 4;
    features.maxSubgroupSize = 64;
    features.maxTexture2DSize = 4096;
    features.maxTexture3DSize = 256;
    features.maxTextureCubeSize = 4096;
    features.maxTextureLayers = 256;
    features.maxTextureSamples = 8;
    features.maxTargets = max_targets;
    features.maxTargetLayers = 128;  // fewer than a texture has
    features.maxViewports = mask & FeatureMultiViewport ? max_viewports : 1;
    features.maxIndirectDraws = mask & FeatureMultiDrawIndirect ? 65536 : 1;
    if (features.meshShader) {
        features.maxMeshGroupCountX = features.maxMeshGroupCountY = features.maxMeshGroupCountZ = 65535;
        features.maxMeshGroupCount = 1u << 22;
        features.maxTaskThreads = features.maxMeshThreads = 128;
        features.maxTaskPayload = 16384;
        features.maxMeshVertices = features.maxMeshPrimitives = 256;
    }
    features.maxGroupSizeX = 1024;
    features.maxGroupSizeY = 1024;
    features.maxGroupSizeZ = 64;
    features.maxGroupThreads = 1024;
    features.maxGroupCountX = features.maxGroupCountY = features.maxGroupCountZ = 65535;
    features.groupMemory = 32768;
    features.maxPushSize = 128;
    features.maxAnisotropy = mask & FeatureAnisotropy ? 16 : 1;
    features.maxUniformSize = 65536;
    features.maxStorageSize = 128ull << 20;
    features.maxTexels = 1ull << 26;
    features.maxSets = 8;
    features.maxBufferSize = 1ull << 30;
    features.maxTracingInstances = 1ull << 20;
    features.maxTracingPrimitives = 1ull << 24;
    features.videoMemory = settings.memory;
    features.uniformAlignment = 256;
    features.storageAlignment = 64;
    features.texelAlignment = 64;
    features.scratchAlignment = 256;
    features.timestampPeriod = 1.0;
    return features;
}

class NullBackend final : public Backend {
public:
    NullBackend(std::shared_ptr<NullControl> control, const BackendDesc& desc)
        : control_(std::move(control)),
          info_(describeAdapter(control_->settings())),
          features_(describeFeatures((desc.required | desc.optional) & info_.features, control_->settings())),
          player_(*control_) {
        control_->open(desc.message);
    }
    ~NullBackend() override { control_->close(); }

    const DeviceInfo& info() const override { return info_; }
    const Features& features() const override { return features_; }
    bool hasQueue(Queue queue) const override {
        return queue == Queue::Main || control_->settings().queues[static_cast<size_t>(queue)];
    }

    uint32_t formatSupport(Format format, Texture::Type type) const override {
        const FormatInfo& info = formatInfo(format);
        constexpr uint32_t sampling = 1u << 31;
        constexpr uint32_t multisample =
            Texture::FlagMultisample2 | Texture::FlagMultisample4 | Texture::FlagMultisample8;
        if (info.type == FormatType::None || info.components == 3) {
            const bool packed = format == FormatRGBf11f11f10 || format == FormatRGBEu9e5 || format == FormatBC6HRGBf16;
            if (!packed) return 0;
        }
        if (info.compressed) {
            const bool there = features_.has(FeatureTextureBC) && type != Texture::Type3D;
            return there ? sampling | Texture::FlagMipmaps : 0;
        }
        if (info.depth)
            return type == Texture::Type3D ? 0 : sampling | Texture::FlagTarget | Texture::FlagMipmaps | multisample;
        if (format == FormatRGBEu9e5) return sampling | Texture::FlagMipmaps;
        uint32_t support = sampling | Texture::FlagTarget | Texture::FlagMipmaps;
        if (!info.srgb) support |= Texture::FlagSurface;
        if (type == Texture::Type2D) support |= multisample;
        return support;
    }
    bool vertexFormatSupport(Format format) const override {
        const FormatInfo& info = formatInfo(format);
        return info.type != FormatType::None && !info.compressed && !info.depth && !info.srgb &&
               format != FormatRGBEu9e5 && format != FormatRu64;
    }

    Expected<std::unique_ptr<NativeBuffer>> createBuffer(const NativeBufferDesc& desc) override {
        auto made = create<NullBuffer>(desc.size, control_, desc);
        if (!made) return unexpected(made.error());
        NullBuffer& buffer = **made;
        if (!buffer.bytes.isAllocated()) return unexpected(hostMemory(desc.size));
        if (desc.staging || desc.readback || (desc.flags & Buffer::FlagMapped) || control_->settings().mapped)
            buffer.mapped = buffer.bytes.data();
        if (desc.flags & (Buffer::FlagAddress | Buffer::FlagTracing | Buffer::FlagScratch))
            buffer.address = reinterpret_cast<uintptr_t>(buffer.bytes.data());
        return made;
    }
    Expected<std::unique_ptr<NativeTexture>> createTexture(const NativeTextureDesc& desc) override {
        auto made = create<NullTexture>(NullTexture::size(desc), control_, desc);
        if (made && !(*made)->bytes.isAllocated()) return unexpected(hostMemory(NullTexture::size(desc)));
        return made;
    }
    Expected<std::unique_ptr<NativeSampler>> createSampler(const SamplerDesc&) override {
        return create<NullSampler>(0, control_, 0, "sampler");
    }
    Expected<std::unique_ptr<NativeTable>> createTable(const std::string& name) override {
        return create<NullTable>(0, control_, 0, name);
    }
    Expected<std::unique_ptr<NativeKernel>> createKernel(const KernelDesc& desc) override {
        auto made = create<NullKernel>(0, control_, 0, desc.name);
        if (made && desc.layout) (*made)->layout = *desc.layout;
        return made;
    }
    Expected<std::unique_ptr<NativePipeline>> createPipeline(const PipelineDesc& desc) override {
        auto made = create<NullPipeline>(0, control_, 0, desc.name);
        if (made && desc.layout) (*made)->layout = *desc.layout;
        return made;
    }
    Expected<std::unique_ptr<NativeTraversal>> createTraversal(const TraversalDesc& desc) override {
        auto made = create<NullTraversal>(0, control_, 0, desc.name);
        if (made && desc.layout) (*made)->layout = *desc.layout;
        return made;
    }
    Expected<std::unique_ptr<NativeTracing>> createTracing(const NativeTracingDesc& desc) override {
        return create<NullTracing>(NullTracing::size(desc), control_, desc);
    }
    Expected<std::unique_ptr<NativeQuery>> createQuery(Query::Type type) override {
        auto made = create<NullQuery>(0, control_, 0, "query");
        if (made) (*made)->type = type;
        return made;
    }

    Expected<std::unique_ptr<NativeWindow>> createWindow(const WindowDesc& desc) override {
        return create<NullWindow>(0, control_, desc);
    }

    uint32_t instanceSize() const override { return sizeof(InstanceRecord); }
    void writeInstances(std::span<const Tracing::Instance> instances, std::span<const NativeTracing* const> tracings,
                        void* records) const override {
        for (size_t i = 0; i < instances.size(); i++) {
            const Tracing::Instance& instance = instances[i];
            InstanceRecord record;
            std::memcpy(record.transform, instance.transform, sizeof(record.transform));
            record.data_and_mask = (instance.data & 0xffffffu) | instance.mask << 24;
            record.offset_and_flags = (instance.offset & 0xffffffu) | instance.flags << 24;
            record.address = tracings[i] ? tracings[i]->address : 0;
            std::memcpy(static_cast<std::byte*>(records) + i * sizeof(record), &record, sizeof(record));
        }
    }
    Expected<uint64_t> tracingSize(NativeTracing& tracing) override {
        const uint64_t size = static_cast<NullTracing&>(tracing).written_size;
        if (size == 0) return unexpected(makeError(ErrorCode::Internal, "null.tracing_size", "no size was written"));
        return size;
    }
    Expected<std::array<uint64_t, 7>> queryResult(NativeQuery& query) override {
        const auto& null_query = static_cast<NullQuery&>(query);
        if (!null_query.ended)
            return unexpected(makeError(ErrorCode::Internal, "null.query", "the query was not ended"));
        return null_query.result;
    }

    Status submit(const Submission& submission) override {
        if (Status status = control_->beginSubmit(submission); !status) return status;
        for (const ResolvedList& list : submission.lists) {
            for (Object* object : list.list->resources)
                if (auto* native = dynamic_cast<NullObject*>(object->native.get()))
                    native->life.last_use[static_cast<size_t>(submission.queue)] = submission.value;
        }
        control_->judge(submission);
        NullCounters barriers;
        barriers.waits = submission.waits.size();
        for (const ResolvedList& list : submission.lists) {
            player_.play(*list.list);
            if (control_->settings().judge) checkAccesses(*list.list, *control_);
            for (const Barrier& barrier : list.barriers) {
                barriers.barriers += barrier.source && barrier.destination;
                barriers.image_barriers += barrier.image_count;
                barriers.splits += barrier.split;
            }
        }
        control_->count(player_.takeCounters());
        control_->count(barriers);
        control_->endSubmit(submission);
        return {};
    }
    uint64_t completed(Queue queue) override { return control_->completed(queue); }
    Status wait(std::span<const TimelinePoint> points, uint64_t nanoseconds) override {
        return control_->wait(points, nanoseconds);
    }
    MemoryUse memoryUse() const override {
        const NullCounters counters = control_->counters();
        return {counters.bytes, counters.objects, counters.creations};
    }

private:
    template <class T, class... Args>
    Expected<std::unique_ptr<T>> create(uint64_t bytes, Args&&... args) {
        if (Status status = control_->create(bytes); !status) return unexpected(status.error());
        return std::make_unique<T>(std::forward<Args>(args)...);
    }
    static Error hostMemory(uint64_t size) {
        return makeError(ErrorCode::OutOfMemory, "device.out_of_memory", "the host has no {} bytes", size);
    }

    const std::shared_ptr<NullControl> control_;
    const DeviceInfo info_;
    const Features features_;
    NullPlayer player_;
};

}  // namespace

Expected<std::unique_ptr<Backend>> createNullBackend(const BackendDesc& desc) {
    const DeviceInfo info = describeAdapter(currentSettings());
    if (desc.adapter != "0" && info.name.find(desc.adapter) == std::string::npos) {
        return unexpected(makeError(ErrorCode::InvalidArgument, "device.no_adapter",
                                    "no adapter is called '{}': there is 0 'null'", desc.adapter));
    }
    if (const FeatureMask missing = desc.required & ~info.features) {
        return unexpected(makeError(ErrorCode::Unsupported, "device.unsupported",
                                    "no adapter offers all that is needed: 'null' lacks {}", featureNames(missing)));
    }
    return std::make_unique<NullBackend>(makeControl(), desc);
}

Expected<std::vector<DeviceInfo>> nullAdapters() { return std::vector<DeviceInfo>{describeAdapter(currentSettings())}; }

}  // namespace glint::null
