// The Vulkan back end by itself: hand-made command lists with hand-made barriers.

#include "support/allocations.h"
#include "support/matchers.h"

#include "platform/vulkan/vulkan.h"

#include <glint/device/detail/object.h>
#include <glint/shader/shader_compiler.h>

#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <mutex>

namespace glint::test {

namespace {

using namespace detail;

/// A list written by hand. Accesses are left out: the barriers are, too.
class List {
public:
    List() { list_.label = "list"; }
    ~List() {
        for (Object* object : list_.resources) object->unhold();
    }
    List(const List&) = delete;
    List& operator=(const List&) = delete;

    uint32_t use(Object* object) {
        for (uint32_t i = 0; i < list_.resources.size(); i++)
            if (list_.resources[i] == object) return i;
        object->hold();
        list_.resources.push_back(object);
        return static_cast<uint32_t>(list_.resources.size() - 1);
    }

    template <class T>
    uint32_t bytes(const std::vector<T>& values) {
        const size_t offset = (list_.bytes.size() + 7) / 8 * 8;
        list_.bytes.resize(offset + values.size() * sizeof(T));
        std::memcpy(list_.bytes.data() + offset, values.data(), values.size() * sizeof(T));
        return static_cast<uint32_t>(offset);
    }

    template <class T>
    uint32_t inlined(const std::vector<T>& values) {
        const size_t offset = (list_.inline_data.size() + 255) / 256 * 256;
        list_.inline_data.resize(offset + (values.size() * sizeof(T) + 15) / 16 * 16);
        std::memcpy(list_.inline_data.data() + offset, values.data(), values.size() * sizeof(T));
        return static_cast<uint32_t>(offset);
    }

    /// Adds the command, with a memory barrier before it if stages are given.
    template <class T>
    void add(CommandType type, T command, StageMask source = 0, StageMask destination = 0) {
        static_assert(sizeof(T) % 8 == 0 || alignof(T) == 4);
        if (source) barriers_.push_back({list_.command_count, source, destination});
        command.header.type = type;
        command.header.size = static_cast<uint32_t>((sizeof(T) + 7) / 8 * 8);
        const size_t offset = list_.commands.size();
        list_.commands.resize(offset + command.header.size);
        std::memcpy(list_.commands.data() + offset, &command, sizeof(T));
        list_.command_count++;
    }

    /// A transition before the next command.
    void transition(Object* texture, Slice slice, Layout from, Layout to, StageMask source, StageMask destination,
                    bool split = false) {
        Barrier barrier;
        barrier.command = list_.command_count;
        barrier.first_image = static_cast<uint32_t>(images_.size());
        barrier.image_count = 1;
        barrier.split = split;
        images_.push_back({use(texture), slice, from, to, source, destination});
        barriers_.push_back(barrier);
    }

    /// Splits the target before the next command.
    void split() {
        Barrier barrier;
        barrier.command = list_.command_count;
        barrier.source = barrier.destination = bit(Stage::ColorTarget) | bit(Stage::DepthTarget);
        barrier.split = true;
        barriers_.push_back(barrier);
    }

    ResolvedList resolved() const { return {&list_, barriers_, images_}; }

private:
    CommandList list_;
    std::vector<Barrier> barriers_;
    std::vector<ImageBarrier> images_;
};

template <class T>
Ref<T> wrap(T* object, std::unique_ptr<Native> native) {
    object->native = std::move(native);
    object->setReady();
    return Ref<T>::adopt(object);
}

constexpr Slice first_slice = {0, 1, 0, 1};

class VulkanBackendTest : public ::testing::Test {
protected:
    /// Opens a device; what the layers say is an error of the test.
    void open(bool validation) {
        BackendDesc desc;
        desc.optional = FeatureAll;
        desc.validation = validation;
        desc.message = [this](const Error& error, bool) {
            const std::lock_guard lock(mutex_);
            messages.push_back(error);
        };
        Expected<std::unique_ptr<Backend>> made = vulkan::createVulkanBackend(desc);
        ASSERT_THAT(made, IsOk());
        backend = std::move(*made);
    }

    void TearDown() override {
        backend.reset();
        for (const Error& message : messages) ADD_FAILURE() << message.text();
    }

    Ref<BufferObject> makeBuffer(uint64_t size, Buffer::Flags flags) {
        Expected<std::unique_ptr<NativeBuffer>> native =
            backend->createBuffer({size, flags | Buffer::FlagMapped, false, false, "buffer"});
        EXPECT_THAT(native, IsOk());
        auto buffer = wrap(new BufferObject(nullptr), std::move(*native));
        std::memset(buffer->nativeBuffer()->mapped, 0, size);
        return buffer;
    }

    template <class T>
    static T* data(const Ref<BufferObject>& buffer) {
        return static_cast<T*>(buffer->nativeBuffer()->mapped);
    }

    Ref<TextureObject> makeTexture(uint32_t size, Texture::Flags flags, uint32_t samples = 1,
                                   Format format = FormatRGBAu8n) {
        NativeTextureDesc desc;
        desc.desc = {Texture::Type2D, format, size, size, 1, 1, 1, flags};
        desc.samples = samples;
        desc.name = "texture";
        Expected<std::unique_ptr<NativeTexture>> native = backend->createTexture(desc);
        EXPECT_THAT(native, IsOk());
        return wrap(new TextureObject(nullptr), std::move(*native));
    }

    static CompiledShader compile(ShaderStage stage, std::string text) {
        ShaderSource source;
        source.stage = stage;
        source.name = "test.shader";
        source.text = std::move(text);
        Expected<CompiledShader> compiled = compileShader(source);
        EXPECT_THAT(compiled, IsOk());
        return *compiled;
    }

    Ref<KernelObject> makeKernel(std::string text) {
        const CompiledShader shader = compile(ShaderStage::Compute, std::move(text));
        const Reflection* stages[] = {&shader.reflection};
        const Expected<BindingLayout> layout = mergeLayouts(stages);
        EXPECT_THAT(layout, IsOk());
        KernelDesc desc;
        desc.stage.words = shader.words;
        desc.layout = &*layout;
        desc.name = "kernel";
        Expected<std::unique_ptr<NativeKernel>> native = backend->createKernel(desc);
        EXPECT_THAT(native, IsOk());
        return wrap(new KernelObject(nullptr), std::move(*native));
    }

    /// A pipeline that covers the target with the colour of the push constants.
    Ref<PipelineObject> makePipeline(uint32_t samples) {
        const CompiledShader vertex = compile(ShaderStage::Vertex, R"(
            void main() { gl_Position = vec4(vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 4.0 - 1.0, 0.5, 1.0); })");
        const CompiledShader fragment = compile(ShaderStage::Fragment, R"(
            layout(push_constant) uniform Push { vec4 value; };
            layout(location = 0) out vec4 color;
            void main() { color = value; })");
        const Reflection* stages[] = {&vertex.reflection, &fragment.reflection};
        const Expected<BindingLayout> layout = mergeLayouts(stages);
        EXPECT_THAT(layout, IsOk());
        PipelineDesc desc;
        desc.stages = {{ShaderStage::Vertex, vertex.words, "main", {}},
                       {ShaderStage::Fragment, fragment.words, "main", {}}};
        desc.layout = &*layout;
        desc.color_formats = {FormatRGBAu8n};
        BlendDesc add;
        add.enabled = true;
        add.color_destination = add.alpha_destination = BlendFactor::One;
        desc.blends = {add};
        desc.samples = samples;
        Expected<std::unique_ptr<NativePipeline>> native = backend->createPipeline(desc);
        EXPECT_THAT(native, IsOk());
        return wrap(new PipelineObject(nullptr), std::move(*native));
    }

    Status submit(const List& list) {
        const ResolvedList lists[] = {list.resolved()};
        return backend->submit({Queue::Main, lists, {}, ++value});
    }

    void run(const List& list) {
        ASSERT_THAT(submit(list), IsOk());
        wait();
    }

    void wait() {
        const TimelinePoint point = {Queue::Main, value};
        ASSERT_THAT(backend->wait({&point, 1}, UINT64_MAX), IsOk());
        EXPECT_GE(backend->completed(Queue::Main), value);
    }

    struct SplitPass;

    std::unique_ptr<Backend> backend;
    uint64_t value = 0;
    std::vector<Error> messages;

private:
    std::mutex mutex_;
};

constexpr StageMask compute = bit(Stage::Compute);
constexpr StageMask copy = bit(Stage::Copy);
constexpr StageMask host = bit(Stage::Host);
constexpr StageMask color_target = bit(Stage::ColorTarget);

/// Adds a uniform to one element of a buffer that the push constants name.
constexpr const char* add_kernel = R"(
layout(local_size_x = 1) in;
layout(set = 0, binding = 0) uniform Add { uint amount; };
layout(set = 1, binding = 0) buffer Values { uint values[]; };
layout(push_constant) uniform Push { uint index; };
void main() { values[index] += amount; }
)";

DispatchCommand addCommand(List& list, const Ref<KernelObject>& kernel, const Ref<BufferObject>& values, uint32_t bound,
                           uint32_t amount, uint32_t index) {
    DispatchCommand command;
    command.kernel = list.use(kernel.get());
    (void)list.use(values.get());
    command.bindings.bound = bound;
    command.bindings.bound_count = 2;
    command.bindings.uniform_offsets = list.bytes<uint32_t>({list.inlined<uint32_t>({amount})});
    command.bindings.uniform_count = 1;
    command.bindings.push = list.bytes<uint32_t>({index});
    command.bindings.push_size = 4;
    return command;
}

std::vector<BoundResource> addBindings(List& list, const Ref<BufferObject>& values) {
    BoundResource uniform, storage;
    uniform.size = 4;
    storage.resource = list.use(values.get());
    storage.size = 64;
    return {uniform, storage};
}

/// A pass with two draws into four samples, split between them, resolved at its end; and what it needs.
struct VulkanBackendTest::SplitPass {
    static constexpr uint32_t size = 8, samples = 4;
    Ref<PipelineObject> pipeline;
    Ref<TextureObject> color, resolve;
    Ref<BufferObject> pixels;
    Ref<QueryObject> query;  ///< counts samples
    List list;

    explicit SplitPass(VulkanBackendTest& test)
        : pipeline(test.makePipeline(samples)),
          color(test.makeTexture(size, Texture::FlagTarget | Texture::FlagMultisample4, samples)),
          resolve(test.makeTexture(size, Texture::FlagTarget)),
          pixels(test.makeBuffer(size * size * 4, 0)) {
        Expected<std::unique_ptr<NativeQuery>> native = test.backend->createQuery(Query::TypeSamples);
        EXPECT_THAT(native, IsOk());
        query = wrap(new QueryObject(nullptr, Query::TypeSamples), std::move(*native));
        constexpr StageMask undefined = 0;
        list.transition(color.get(), first_slice, Layout::Undefined, Layout::ColorTarget, undefined, color_target);
        list.transition(resolve.get(), first_slice, Layout::Undefined, Layout::ColorTarget, undefined, color_target);
        BeginTargetCommand begin;
        begin.color_count = 1;
        begin.width = begin.height = size;
        Attachment& attachment = begin.colors[0];
        attachment.texture = list.use(color.get());
        attachment.resolve = list.use(resolve.get());
        attachment.slice = attachment.resolve_slice = first_slice;
        attachment.store = StoreOperation::Discard;
        list.add(CommandType::BeginTarget, begin);
        QueryCommand counted;
        counted.query = list.use(query.get());
        list.add(CommandType::BeginQuery, counted);

        DynamicState state;
        state.viewport = {0, 0, static_cast<float>(size), static_cast<float>(size), 0, 1};
        state.scissor = {0, 0, size, size / 2};
        DrawCommand draw;
        draw.state.pipeline = list.use(pipeline.get());
        draw.state.dynamic = list.bytes<DynamicState>({state});
        draw.state.bindings.push_size = 16;
        draw.count = 3;
        draw.state.bindings.push = list.bytes<float>({1, 0, 0, 0});
        list.add(CommandType::Draw, draw);
        list.split();
        draw.state.bindings.push = list.bytes<float>({0, 1, 0, 0});
        list.add(CommandType::Draw, draw);
        list.add(CommandType::EndQuery, counted);
        list.add(CommandType::EndTarget, EndTargetCommand());

        list.transition(resolve.get(), first_slice, Layout::ColorTarget, Layout::CopySource, color_target, copy);
        CopyBufferTextureCommand read;
        read.buffer = list.use(pixels.get());
        read.texture = list.use(resolve.get());
        read.slice = first_slice;
        read.region = {0, 0, 0, size, size, 1};
        list.add(CommandType::CopyTextureToBuffer, read);
        list.add(CommandType::HostRead, HostReadCommand(), copy, host);
    }
};

}  // namespace

TEST_F(VulkanBackendTest, AdapterChoice) {
    const Expected<std::vector<DeviceInfo>> adapters = vulkan::vulkanAdapters();
    ASSERT_THAT(adapters, IsOk());
    BackendDesc desc;
    desc.adapter = "no such adapter";
    const auto unknown = vulkan::createVulkanBackend(desc);
    EXPECT_THAT(unknown, HasErrorId("device.no_adapter"));
    for (const DeviceInfo& info : *adapters)
        EXPECT_NE(unknown.error().message().find(info.name), std::string::npos) << unknown.error().text();
    desc.adapter = std::to_string(adapters->size());
    EXPECT_THAT(vulkan::createVulkanBackend(desc), HasErrorId("device.no_adapter"));

    for (const DeviceInfo& info : *adapters) {
        desc.adapter = std::to_string(info.index);
        desc.required = FeatureAll & ~info.features;
        if (desc.required == 0) continue;
        const auto lacking = vulkan::createVulkanBackend(desc);
        EXPECT_THAT(lacking, HasErrorId("device.unsupported"));
        EXPECT_NE(lacking.error().message().find(featureNames(desc.required)), std::string::npos);
    }
}

TEST_F(VulkanBackendTest, OnlyWhatWasAskedForIsEnabled) {
    BackendDesc desc;
    const auto plain = vulkan::createVulkanBackend(desc);
    ASSERT_THAT(plain, IsOk());
    EXPECT_EQ((*plain)->features().mask, FeatureNone);
    EXPECT_FALSE((*plain)->features().computeTracing);
    desc.optional = FeatureAnisotropy | FeatureShaderf64;
    const auto some = vulkan::createVulkanBackend(desc);
    ASSERT_THAT(some, IsOk());
    EXPECT_EQ((*some)->features().mask, desc.optional & (*some)->info().features);
}

TEST_F(VulkanBackendTest, NoDriver) {
    // The loader reads its environment anew for each instance; a child keeps the change to itself.
    EXPECT_EXIT(
        {
            setenv("VK_DRIVER_FILES", "/nonexistent", 1);
            setenv("VK_ICD_FILENAMES", "/nonexistent", 1);
            const auto made = vulkan::createVulkanBackend({});
            std::_Exit(!made && made.error().id() == "device.no_driver" ? 0 : 1);
        },
        ::testing::ExitedWithCode(0), "");
}

TEST_F(VulkanBackendTest, UniformsAndPushConstantsChange) {
    open(true);
    const Ref<KernelObject> kernel = makeKernel(add_kernel);
    const Ref<BufferObject> values = makeBuffer(64, Buffer::FlagStorage);
    List list;
    const uint32_t bound = list.bytes(addBindings(list, values));
    const uint32_t again = list.bytes(addBindings(list, values));
    const StageMask both = compute;
    for (uint32_t i = 0; i < 8; i++) {
        const DispatchCommand command = addCommand(list, kernel, values, i % 3 ? bound : again, 10 + i, i / 2);
        list.add(CommandType::Dispatch, command, i ? both : StageMask(0), both);
    }
    list.add(CommandType::HostRead, HostReadCommand(), compute, host);
    run(list);
    for (uint32_t i = 0; i < 4; i++) EXPECT_EQ(data<uint32_t>(values)[i], 21 + 4 * i);
}

TEST_F(VulkanBackendTest, SplitTargetsResolveOnceAndCountAllSamples) {
    open(true);
    constexpr uint32_t size = SplitPass::size;
    const SplitPass pass(*this);
    run(pass.list);
    for (uint32_t y = 0; y < size; y++)
        EXPECT_EQ(data<uint32_t>(pass.pixels)[y * size], y < size / 2 ? 0x0000ffffu : 0u) << "row " << y;
    const auto result = backend->queryResult(*pass.query->nativeQuery());
    ASSERT_THAT(result, IsOk());
    EXPECT_EQ((*result)[0], 2u * size * size / 2 * SplitPass::samples);
}

TEST_F(VulkanBackendTest, WarmFramesMakeNothing) {
    open(false);
    const Ref<KernelObject> kernel = makeKernel(add_kernel);
    const Ref<BufferObject> values = makeBuffer(64, Buffer::FlagStorage);
    List dispatches;
    for (uint32_t i = 0; i < 100; i++) {
        std::vector<BoundResource> bindings = addBindings(dispatches, values);
        bindings[1].size = 32 + 16 * (i % 2);
        const uint32_t bound = dispatches.bytes(bindings);
        const DispatchCommand command = addCommand(dispatches, kernel, values, bound, 1, i % 8);
        dispatches.add(CommandType::Dispatch, command, compute, compute);
    }
    const SplitPass pass(*this);

    bool good = true;
    const auto frame = [&] {  // no matchers: they allocate
        good = submit(dispatches) && submit(pass.list) && good;
        const TimelinePoint point = {Queue::Main, value};
        good = backend->wait({&point, 1}, UINT64_MAX) && good;
    };
    for (int i = 0; i < 4; i++) frame();
    const uint64_t objects = backend->memoryUse().objects_created;
    const uint64_t made = allocations().made;
    for (int i = 0; i < 8; i++) frame();
    EXPECT_EQ(allocations().made, made);
    EXPECT_TRUE(good);
    EXPECT_EQ(backend->memoryUse().objects_created, objects);
    EXPECT_EQ(data<uint32_t>(values)[0], 13u * 12u);
}

TEST_F(VulkanBackendTest, WaitsEnd) {
    open(true);
    const TimelinePoint never = {Queue::Main, 1};
    EXPECT_THAT(backend->wait({&never, 1}, 1000000), HasErrorId("fence.timeout"));
    EXPECT_THAT(backend->submit({Queue::Main, {}, {}, ++value}), IsOk());
    wait();
}

TEST_F(VulkanBackendTest, LayersAreHeard) {
    open(true);
    const Ref<BufferObject> values = makeBuffer(64, 0);
    // Two fills of the same bytes with nothing between them.
    List list;
    FillBufferCommand fill;
    fill.buffer = list.use(values.get());
    fill.size = 64;
    for (uint32_t i = 0; i < 2; i++) list.add(CommandType::FillBuffer, fill);
    run(list);
    ASSERT_FALSE(messages.empty());
    for (const Error& message : messages) EXPECT_EQ(message.id(), "vulkan.validation");
    messages.clear();
}

TEST_F(VulkanBackendTest, OutOfMemory) {
    open(true);
    const uint64_t size = std::min<uint64_t>(backend->features().maxBufferSize, 1ull << 46);
    if (size > backend->features().videoMemory) {
        EXPECT_THAT(backend->createBuffer({size, Buffer::FlagStorage, false, false, "huge"}),
                    HasErrorId("device.out_of_memory"));
    }
}

}  // namespace glint::test
