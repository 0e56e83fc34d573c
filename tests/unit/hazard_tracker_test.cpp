// The tracker under the eye of the hazard checker: random lists through the public interface must be judged clean, and
// hardly any of the barriers may be left out.

#include "support/matchers.h"
#include "support/reference.h"

#include <glint/device/device.h>
#include <platform/null/null_control.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace glint::test {
namespace {

using detail::Barrier;
using detail::ImageBarrier;
using detail::StageMask;
using detail::Submission;
using detail::TimelinePoint;
using null::HazardChecker;
using null::NullControl;

// Programs.

constexpr const char* copy_kernel = R"(
layout(local_size_x = 8) in;
layout(binding = 0) readonly buffer From { uint from[]; };
layout(binding = 1) writeonly buffer To { uint to[]; };
void main() { to[gl_GlobalInvocationID.x] = from[gl_GlobalInvocationID.x]; })";

constexpr const char* change_kernel = R"(
layout(local_size_x = 8) in;
layout(binding = 0) buffer Values { uint values[]; };
void main() { values[gl_GlobalInvocationID.x] += 1u; })";

constexpr const char* sample_kernel = R"(
layout(local_size_x = 8) in;
layout(binding = 0) uniform sampler2DArray image;
layout(binding = 1) writeonly buffer To { vec4 to[]; };
void main() { to[gl_GlobalInvocationID.x] = texelFetch(image, ivec3(0), 0); })";

constexpr const char* store_kernel = R"(
layout(local_size_x = 8) in;
layout(binding = 0, rgba8) writeonly uniform image2D surface;
layout(binding = 1) readonly buffer From { uint from[]; };
void main() { imageStore(surface, ivec2(gl_GlobalInvocationID.x, 0), vec4(float(from[0]))); })";

constexpr const char* paint_kernel = R"(
layout(local_size_x = 8) in;
layout(binding = 0, rgba8) uniform image2D surface;
void main() { imageStore(surface, ivec2(0), imageLoad(surface, ivec2(1)) * 2.0); })";

constexpr const char* address_kernel = R"(
layout(local_size_x = 8) in;
layout(buffer_reference, std430) buffer Values { uint values[]; };
layout(push_constant) uniform Push { Values source; Values target; };
void main() { target.values[gl_GlobalInvocationID.x] = source.values[0]; })";

constexpr const char* trace_kernel = R"(
layout(local_size_x = 8) in;
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 1) buffer To { uint to[]; };
void main() {
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, 0u, 0xffu, vec3(0.0), 0.0, vec3(1.0), 1.0);
    to[gl_GlobalInvocationID.x] = rayQueryProceedEXT(query) ? 1u : 0u;
})";

constexpr const char* plain_vertex = R"(
layout(location = 0) in vec4 position;
void main() { gl_Position = position; })";

constexpr const char* reading_vertex = R"(
layout(binding = 0) readonly buffer Positions { vec4 positions[]; };
void main() { gl_Position = positions[gl_VertexIndex]; })";

constexpr const char* plain_fragment = R"(
layout(location = 0) out vec4 color;
void main() { color = vec4(1.0); })";

constexpr const char* sampling_fragment = R"(
layout(binding = 1) uniform sampler2DArray image;
layout(location = 0) out vec4 color;
void main() { color = texelFetch(image, ivec3(0), 0); })";

constexpr const char* storing_fragment = R"(
layout(binding = 1) buffer Values { uint values[]; };
layout(location = 0) out vec4 color;
void main() { atomicAdd(values[0], 1u); color = vec4(1.0); })";

/// What lives for the whole test.
struct Programs {
    explicit Programs(Device& device) {
        const auto kernel = [&](const char* text) {
            Kernel made = device.createKernel();
            made.createShaderGLSL(text);
            EXPECT_THAT(made.create(), IsOk());
            return made;
        };
        copy = kernel(copy_kernel);
        change = kernel(change_kernel);
        sample = kernel(sample_kernel);
        store = kernel(store_kernel);
        paint = kernel(paint_kernel);
        address = kernel(address_kernel);
        trace = kernel(trace_kernel);
        sampler = device.createSampler();
        for (const char* vertex : {plain_vertex, reading_vertex}) {
            for (const char* fragment : {plain_fragment, sampling_fragment, storing_fragment}) {
                for (const bool depth : {false, true}) {
                    Pipeline pipeline = device.createPipeline();
                    pipeline.createShaderGLSL(Shader::TypeVertex, vertex);
                    pipeline.createShaderGLSL(Shader::TypeFragment, fragment);
                    pipeline.setColorFormat(FormatRGBAu8n);
                    if (depth) {
                        pipeline.setDepthFormat(FormatDf32);
                        pipeline.setDepthFunc(Pipeline::DepthFuncLess);
                    }
                    if (vertex == plain_vertex)
                        pipeline.addAttribute(Pipeline::AttributePosition, FormatRGBAf32, 0, 0, 16);
                    EXPECT_THAT(pipeline.create(), IsOk());
                    draws.push_back({pipeline, vertex == plain_vertex, fragment == sampling_fragment,
                                     fragment == storing_fragment, depth});
                }
            }
        }
    }

    struct DrawProgram {
        Pipeline pipeline;
        bool fetches, samples, stores, has_depth;
    };
    Kernel copy, change, sample, store, paint, address, trace;
    Sampler sampler;
    std::vector<DrawProgram> draws;
};

// A random program: resources, and submissions to the three queues that use them.

class RandomProgram {
public:
    RandomProgram(Device& device, const Programs& programs, uint64_t seed)
        : device_(device), programs_(programs), random_(seed) {
        for (size_t i = 0; i < buffers_.size(); i++) {
            constexpr Buffer::Flags flags = Buffer::FlagStorage | Buffer::FlagVertex | Buffer::FlagIndex |
                                            Buffer::FlagIndirect | Buffer::FlagAddress;
            buffers_[i] = device.createBuffer(flags, buffer_size, "buffer " + std::to_string(i));
        }
        TextureDesc desc;
        desc.format = FormatRGBAu8n;
        desc.width = desc.height = 8;
        desc.layers = 2;
        desc.flags = Texture::FlagTarget | Texture::FlagSurface | Texture::FlagMipmaps;
        textures_[0] = device.createTexture(desc, "atlas");
        desc.layers = 1;
        desc.flags = Texture::FlagTarget | Texture::FlagSurface;
        textures_[1] = device.createTexture(desc, "picture");
        depth_ = device.createTexture2D(FormatDf32, 8, 8, Texture::FlagTarget, "depth");
        vertices_ = device.createBuffer(Buffer::FlagTracing | Buffer::FlagStorage, 36 * 4, "vertices");
        for (size_t i = 0; i < bottoms_.size(); i++) {
            bottoms_[i] = device.createTracing("bottom " + std::to_string(i));
            bottoms_[i].addVertexBuffer(12, FormatRGBf32, 12, vertices_);
            EXPECT_THAT(bottoms_[i].create(Tracing::TypeTriangle, Tracing::FlagUpdate), IsOk());
        }
        top_ = device.createTracing("top");
        top_.setInstances(4);
        EXPECT_THAT(top_.create(Tracing::TypeInstance), IsOk());
    }

    void run() {
        EXPECT_THAT(device_.buildTracings({bottoms_[0], bottoms_[1]}), IsOk());
        buildTop();
        for (size_t i = 2 + below(4); i > 0; i--) submit();
        // Whatever was written is read in the end: a barrier that is missing shows.
        Compute last = device_.createCompute(Queue::Main, "last");
        const Buffer sink = device_.createBuffer(Buffer::FlagNone, 1024, "sink");
        for (const Buffer& buffer : buffers_) last.copyBuffer(sink, 0, buffer, 0, 16);
        for (const Texture& texture : textures_)
            for (uint16_t mip = 0; mip < texture.getMipmaps(); mip++)
                last.copyTextureToBuffer(sink, 0, texture, {mip, 1, 0, 0});
        last.setKernel(programs_.trace);
        last.setTracing(0, top_);
        last.setStorageBuffer(1 - 1, buffers_[0]);
        last.dispatch(8);
        EXPECT_THAT(device_.submit(last), IsOk());
    }

private:
    static constexpr uint64_t buffer_size = 1024;

    uint64_t below(uint64_t count) { return random_.below(count); }
    const Buffer& buffer() { return buffers_[below(buffers_.size())]; }
    const Texture& texture() { return textures_[below(textures_.size())]; }
    Slice level(const Texture& texture) {
        return {static_cast<uint16_t>(below(texture.getMipmaps())), 1,
                static_cast<uint16_t>(below(texture.getLayers())), 1};
    }
    Slice range(const Texture& texture) {
        const auto mip = static_cast<uint16_t>(below(texture.getMipmaps()));
        const auto layer = static_cast<uint16_t>(below(texture.getLayers()));
        return {mip, static_cast<uint16_t>(1 + below(texture.getMipmaps() - mip)), layer,
                static_cast<uint16_t>(1 + below(texture.getLayers() - layer))};
    }

    void buildTop() {
        const Tracing::Instance all[] = {{.tracing = &bottoms_[below(2)]}, {.tracing = &bottoms_[below(2)]}, {}};
        device_.setTracing(top_, std::span(all).first(1 + below(3)));
        device_.buildTracing(top_);
        EXPECT_THAT(device_.flush(), IsOk());
    }

    void submit() {
        if (below(4) == 0) transfer();
        if (below(6) == 0) buildTop();
        const auto queue = static_cast<Queue>(below(5) < 3 ? 0 : 1 + below(2));
        std::vector<Compute> computes;
        std::vector<Command> commands;
        std::vector<size_t> order;
        computes.reserve(3);
        commands.reserve(3);
        for (size_t i = 1 + below(3); i > 0; i--) {
            if (queue == Queue::Main && below(2) == 0) {
                if (record(commands)) order.push_back(10 + commands.size() - 1);
            } else {
                record(computes, queue);
                order.push_back(computes.size() - 1);
            }
        }
        const auto item = [&](size_t i) {
            return order[i] < 10 ? SubmitItem(computes[order[i]]) : SubmitItem(commands[order[i] - 10]);
        };
        Status status;
        if (order.size() == 1) status = device_.submit({item(0)});
        if (order.size() == 2) status = device_.submit({item(0), item(1)});
        if (order.size() == 3) status = device_.submit({item(0), item(1), item(2)});
        EXPECT_THAT(status, IsOk());
    }

    void transfer() {
        const uint32_t data[4] = {1, 2, 3, 4};
        switch (below(4)) {
            case 0: device_.setBuffer(buffer(), 0, data, 16); break;
            case 1: device_.clearBuffer(buffer()); break;
            case 2: device_.createMipmaps(textures_[0]); break;
            default: device_.clearTexture(texture(), Color::white()); break;
        }
    }

    void record(std::vector<Compute>& computes, Queue queue) {
        computes.push_back(device_.createCompute(queue, "list"));
        Compute& list = computes.back();
        const bool tracked = below(8) != 0;
        if (!tracked) list.setTracking(false);
        for (size_t i = 1 + below(6); i > 0; i--) {
            // Who looks after hazards himself puts a barrier everywhere.
            if (!tracked) list.barrier();
            if (below(8) == 0) list.pushRegion("region");
            else list.pushRegion("work");
            if (queue == Queue::Copy || below(3) == 0) copy(list, queue);
            else if (below(8) == 0) build(list);
            else dispatch(list);
            list.popRegion();
        }
        if (!tracked) list.barrier();
    }

    void copy(Compute& list, Queue queue) {
        const uint32_t data[4] = {1, 2, 3, 4};
        const std::array<uint32_t, 64> texels = {};
        const Texture& image = texture();
        const Slice slice = level(image);
        switch (below(queue == Queue::Main ? 9 : 7)) {
            case 0: list.setBuffer(buffer(), 16 * below(4), data, 16); break;
            case 1: list.clearBuffer(buffer(), 1, 0, 64); break;
            case 2: list.copyBuffer(buffer(), 0, buffer(), 512, 64); break;
            case 3: list.copyTextureToBuffer(buffer(), 0, image, slice); break;
            case 4: list.copyBufferToTexture(image, buffer(), 0, slice); break;
            case 5: {
                const Texture& other = texture();
                Slice to = level(other);
                to.mip = std::min(to.mip, slice.mip);
                if (!(other == image) || to.mip != slice.mip || to.layer != slice.layer)
                    list.copyTexture(other, to, image, slice);
                break;
            }
            case 6: {
                const uint64_t size = image.getDataSize(slice.mip);
                if (below(2)) list.setTexture(image, texels.data(), size, slice);
                else list.setTexture(image, texels.data(), 4, slice, {0, 0, 0, 1, 1, 1});
                break;
            }
            case 7: list.clearTexture(image, Color::gray(), range(image)); break;
            default: list.createMipmaps(textures_[0]); break;
        }
    }

    void dispatch(Compute& list) {
        switch (below(8)) {
            case 0:
            case 1: {
                const Buffer& from = buffer();
                list.setKernel(programs_.copy);
                list.setStorageBuffer(0, from, 64 * below(2), 64);
                list.setStorageBuffer(1, buffer(), 512);
                break;
            }
            case 2:
                list.setKernel(programs_.change);
                list.setStorageBuffer(0, buffer());
                break;
            case 3:
                list.setKernel(programs_.sample);
                bindImage(list, {});
                list.setStorageBuffer(0, buffer());
                break;
            case 4: {
                const Texture& image = texture();
                list.setKernel(programs_.store);
                list.setSurfaceTexture(0, image, level(image));
                list.setStorageBuffer(0, buffer());
                break;
            }
            case 5: {
                const Texture& image = texture();
                list.setKernel(programs_.paint);
                list.setSurfaceTexture(0, image, level(image));
                break;
            }
            case 6: {
                const Buffer &from = buffer(), &to = buffer();
                list.setKernel(programs_.address);
                list.setPushConstants(std::array<uint64_t, 2>{from.getAddress(), to.getAddress()});
                list.useBuffer(from, false);
                list.useBuffer(to, true);
                break;
            }
            default:
                list.setKernel(programs_.trace);
                list.setTracing(0, top_);
                list.setStorageBuffer(0, buffer());
                break;
        }
        if (below(5) == 0) list.dispatchIndirect(buffer(), 16);
        else list.dispatch(8);
        list.clearUses();
    }

    /// Binds a sampled image that is none of the attachments.
    template <class List>
    bool bindImage(List& list, const std::vector<std::pair<Texture, Slice>>& attached) {
        for (int attempt = 0; attempt < 8; attempt++) {
            const Texture& image = texture();
            const Slice slice = range(image);
            const bool free = std::ranges::none_of(attached, [&](const auto& one) {
                return one.first == image && slice.mip <= one.second.mip &&
                       one.second.mip < slice.mip + slice.mips && slice.layer < one.second.layer + one.second.layers &&
                       one.second.layer < slice.layer + slice.layers;
            });
            if (!free) continue;
            list.setTexture(0, image, slice);
            list.setSampler(0, programs_.sampler);
            return true;
        }
        return false;
    }

    void build(Compute& list) {
        if (below(3) == 0) {
            list.setKernel(programs_.change);
            list.setStorageBuffer(0, vertices_);
            list.dispatch(8);
        }
        const Tracing& bottom = bottoms_[below(2)];
        if (below(2)) list.updateTracing(bottom);
        else list.buildTracing(bottom);
        list.buildTracing(top_);
    }

    bool record(std::vector<Command>& commands) {
        const Texture& color = texture();
        const Slice slice = level(color);
        const bool has_depth = slice.mip == 0 && below(2) == 0;
        constexpr uint8_t begins[] = {Target::BeginLoad, Target::BeginClear, Target::BeginDiscard};
        constexpr uint8_t ends[] = {Target::EndStore, Target::EndStore, Target::EndStore, Target::EndDiscard};
        Target target = device_.createTarget();
        target.setColorTexture(0, color, slice);
        target.setColorOperation(0, static_cast<uint8_t>(begins[below(3)] | ends[below(4)]));
        if (has_depth) {
            target.setDepthTexture(depth_);
            target.setDepthOperation(static_cast<uint8_t>(begins[below(3)] | ends[below(4)]));
        }
        commands.push_back(device_.createCommand(target, "draws"));
        Command& list = commands.back();
        for (size_t i = below(5); i > 0; i--) {
            const auto& program = programs_.draws[below(programs_.draws.size() / 2) * 2 + (has_depth ? 1 : 0)];
            list.setPipeline(program.pipeline);
            if (program.fetches) list.setVertexBuffer(0, buffer());
            else list.setStorageBuffer(0, buffer());
            if (program.samples && !bindImage(list, {{color, slice}})) continue;
            if (program.stores) list.setStorageBuffer(program.fetches ? 0 : 1, buffer());
            switch (below(4)) {
                case 0:
                    list.setIndexBuffer(FormatRu16, buffer());
                    list.drawElements(6);
                    break;
                case 1: list.drawArraysIndirect(buffer()); break;
                default: list.drawArrays(3); break;
            }
        }
        return true;
    }

    Device& device_;
    const Programs& programs_;
    Random random_;
    std::array<Buffer, 4> buffers_;
    std::array<Texture, 2> textures_;
    Texture depth_;
    Buffer vertices_;
    std::array<Tracing, 2> bottoms_;
    Tracing top_;
};

// Mutations: a submission with something left out, judged beside the true one, and all that follows it.

struct Mutant {
    std::vector<std::vector<Barrier>> barriers;
    std::vector<ImageBarrier> images;
    std::vector<TimelinePoint> waits;

    explicit Mutant(const Submission& submission) : waits(submission.waits.begin(), submission.waits.end()) {
        for (const detail::ResolvedList& list : submission.lists) {
            barriers.emplace_back(list.barriers.begin(), list.barriers.end());
            images.assign(list.images.begin(), list.images.end());
        }
    }
    std::vector<Error> judge(const Submission& submission, HazardChecker& checker) const {
        std::vector<detail::ResolvedList> lists;
        for (size_t i = 0; i < submission.lists.size(); i++)
            lists.push_back({submission.lists[i].list, barriers[i], images});
        return checker.judge({submission.queue, lists, waits, submission.value});
    }
};

enum Mutation { DropMemory, DropSource, DropDestination, DropTransition, DropTransitionSource, DropWait, MutationCount };
constexpr const char* mutation_names[] = {"memory barriers",         "source stages",
                                          "destination stages",      "transitions",
                                          "sources of transitions",  "waits"};

/// Takes one thing away at random; false if there is nothing of the kind.
bool mutate(Mutant& mutant, Mutation mutation, Random& random) {
    const auto takeBit = [&](StageMask& mask) {
        std::vector<StageMask> bits;
        for (uint32_t i = 0; i < 16; i++)
            if (mask >> i & 1) bits.push_back(static_cast<StageMask>(1u << i));
        if (bits.empty()) return false;
        mask = static_cast<StageMask>(mask & ~bits[random.below(bits.size())]);
        return true;
    };
    if (mutation == DropWait) {
        if (mutant.waits.empty()) return false;
        mutant.waits.erase(mutant.waits.begin() + static_cast<std::ptrdiff_t>(random.below(mutant.waits.size())));
        return true;
    }
    std::vector<Barrier*> memory, transitions;
    for (auto& list : mutant.barriers) {
        for (Barrier& barrier : list) {
            if (barrier.source && barrier.destination) memory.push_back(&barrier);
            if (barrier.image_count) transitions.push_back(&barrier);
        }
    }
    if (mutation == DropTransition || mutation == DropTransitionSource) {
        if (transitions.empty()) return false;
        Barrier& barrier = *transitions[random.below(transitions.size())];
        ImageBarrier& image = mutant.images[barrier.first_image + random.below(barrier.image_count)];
        if (mutation == DropTransitionSource) return takeBit(image.source);
        // Images stay where they are; an empty slice is no transition.
        image.slice.layers = 0;
        return true;
    }
    if (memory.empty()) return false;
    Barrier& barrier = *memory[random.below(memory.size())];
    if (mutation == DropSource) return takeBit(barrier.source);
    if (mutation == DropDestination) return takeBit(barrier.destination);
    barrier.source = barrier.destination = 0;
    return true;
}

/// True if two commands of the list conflict over a buffer or a structure.
bool hasConflict(const detail::CommandList& list) {
    std::map<uint32_t, std::set<uint32_t>> readers, writers;
    detail::forEachCommand(list, [&](uint32_t index, const detail::CommandHeader& header) {
        const auto add = [&](uint32_t first, uint32_t count) {
            for (uint32_t i = first; i < first + count; i++) {
                const detail::Access& access = list.accesses[i];
                if (access.layout != detail::Layout::None) continue;
                ((access.flags & detail::AccessWrite) ? writers : readers)[access.resource].insert(index);
            }
        };
        add(header.first_access, header.access_count);
        add(header.first_shared, header.shared_count);
    });
    return std::ranges::any_of(writers, [&](const auto& entry) {
        std::set<uint32_t> all = readers[entry.first];
        all.insert(entry.second.begin(), entry.second.end());
        return all.size() > 1;
    });
}

class HazardTracker : public testing::Test {
protected:
    void SetUp() override {
        device = Device::create({.api = "null", .message = [this](const Message& message) {
                                     if (messages++ < 10) ADD_FAILURE() << "seed " << seed << ": " << message.error.text();
                                 }});
        ASSERT_TRUE(device);
        control = NullControl::last();
    }

    Device device;
    std::shared_ptr<NullControl> control;
    uint64_t seed = 0;
    uint64_t messages = 0;
};

TEST_F(HazardTracker, RandomProgramsAreClean) {
    const Programs programs(device);
    for (seed = 0; seed < 3000 && messages == 0; seed++) RandomProgram(device, programs, seed).run();
    EXPECT_THAT(device.finish(), IsOk());
    const null::NullCounters counters = control->counters();
    std::printf("%llu commands, %llu barriers, %llu transitions, %llu splits, %llu waits\n",
                static_cast<unsigned long long>(counters.commands), static_cast<unsigned long long>(counters.barriers),
                static_cast<unsigned long long>(counters.image_barriers),
                static_cast<unsigned long long>(counters.splits), static_cast<unsigned long long>(counters.waits));
}

TEST_F(HazardTracker, WhatIsLeftOutIsMissed) {
    struct Shadow {
        HazardChecker checker;
        Mutation mutation;
        bool caught;
    };
    std::vector<Shadow> shadows;
    std::array<uint64_t, MutationCount> made = {}, caught = {};
    uint64_t emptied = 0;
    std::optional<Random> random;
    control->setObserver([&](const Submission& submission, const HazardChecker& before) {
        for (Shadow& shadow : shadows)
            if (!shadow.caught) shadow.caught = !shadow.checker.judge(submission).empty();
        for (int i = 0; i < MutationCount; i++) {
            const auto mutation = static_cast<Mutation>(i);
            Mutant mutant(submission);
            if (!mutate(mutant, mutation, *random)) continue;
            Shadow shadow{before, mutation, false};
            shadow.caught = !mutant.judge(submission, shadow.checker).empty();
            shadows.push_back(std::move(shadow));
        }
        // Without any of its barriers a list with a conflict in it is always caught.
        for (size_t i = 0; i < submission.lists.size(); i++) {
            if (!hasConflict(*submission.lists[i].list)) continue;
            Mutant mutant(submission);
            mutant.barriers[i].clear();
            HazardChecker checker = before;
            emptied++;
            EXPECT_FALSE(mutant.judge(submission, checker).empty()) << "seed " << seed;
        }
    });
    const Programs programs(device);
    for (seed = 0; seed < 1000 && messages == 0; seed++) {
        random.emplace(seed ^ 0x5eed);
        RandomProgram(device, programs, seed).run();
        for (const Shadow& shadow : shadows) {
            made[shadow.mutation]++;
            caught[shadow.mutation] += shadow.caught;
        }
        shadows.clear();
    }
    EXPECT_THAT(device.finish(), IsOk());
    EXPECT_GT(emptied, 1000u);
    for (int i = 0; i < MutationCount; i++) {
        const double redundant = 1.0 - static_cast<double>(caught[i]) / static_cast<double>(made[i]);
        std::printf("%s: %llu left out, %.1f%% of them redundant\n", mutation_names[i],
                    static_cast<unsigned long long>(made[i]), 100.0 * redundant);
        EXPECT_GT(made[i], 500u) << mutation_names[i];
    }
}

}  // namespace
}  // namespace glint::test
