#pragma once

// Random programs through the public interface, for the test of the tracker.

#include "support/matchers.h"
#include "support/reference.h"

#include <glint/device/device.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

namespace glint::test {

inline constexpr const char* copy_kernel = R"(
layout(local_size_x = 8) in;
layout(binding = 0) readonly buffer From { uint from[]; };
layout(binding = 1) writeonly buffer To { uint to[]; };
void main() { to[gl_GlobalInvocationID.x] = from[gl_GlobalInvocationID.x]; })";

inline constexpr const char* change_kernel = R"(
layout(local_size_x = 8) in;
layout(binding = 0) buffer Values { uint values[]; };
void main() { values[gl_GlobalInvocationID.x] += 1u; })";

inline constexpr const char* sample_kernel = R"(
layout(local_size_x = 8) in;
layout(binding = 0) uniform sampler2DArray image;
layout(binding = 1) writeonly buffer To { vec4 to[]; };
void main() { to[gl_GlobalInvocationID.x] = texelFetch(image, ivec3(0), 0); })";

inline constexpr const char* store_kernel = R"(
layout(local_size_x = 8) in;
layout(binding = 0, rgba8) writeonly uniform image2D surface;
layout(binding = 1) readonly buffer From { uint from[]; };
void main() { imageStore(surface, ivec2(gl_GlobalInvocationID.x, 0), vec4(float(from[0]))); })";

inline constexpr const char* paint_kernel = R"(
layout(local_size_x = 8) in;
layout(binding = 0, rgba8) uniform image2D surface;
void main() { imageStore(surface, ivec2(0), imageLoad(surface, ivec2(1)) * 2.0); })";

inline constexpr const char* gather_kernel = R"(
layout(local_size_x = 8) in;
layout(binding = 0) uniform Parameters { uvec4 parameters[4]; };
layout(binding = 1) uniform utextureBuffer texels;
layout(binding = 2) writeonly buffer To { uvec4 to[]; };
void main() { to[gl_GlobalInvocationID.x] = parameters[1] + texelFetch(texels, 0); })";

inline constexpr const char* address_kernel = R"(
layout(local_size_x = 8) in;
layout(buffer_reference, std430) buffer Values { uint values[]; };
layout(push_constant) uniform Push { Values source; Values target; };
void main() { target.values[gl_GlobalInvocationID.x] = source.values[0]; })";

inline constexpr const char* trace_kernel = R"(
layout(local_size_x = 8) in;
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 1) buffer To { uint to[]; };
void main() {
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, 0u, 0xffu, vec3(0.0), 0.0, vec3(1.0), 1.0);
    to[gl_GlobalInvocationID.x] = rayQueryProceedEXT(query) ? 1u : 0u;
})";

inline constexpr const char* trace_generation = R"(
layout(binding = 0) uniform accelerationStructureEXT scene;
layout(binding = 1) buffer To { uint to[]; };
layout(location = 0) rayPayloadEXT uint payload;
void main() {
    traceRayEXT(scene, 0u, 0xffu, 0, 0, 0, vec3(0.0), 0.0, vec3(1.0), 1.0, 0);
    to[gl_LaunchIDEXT.x] = payload;
})";

inline constexpr const char* reading_closest = R"(
layout(binding = 2) readonly buffer From { uint from[]; };
layout(location = 0) rayPayloadInEXT uint payload;
void main() { payload = from[gl_PrimitiveID]; })";

inline constexpr const char* plain_vertex = R"(
layout(location = 0) in vec4 position;
void main() { gl_Position = position; })";

inline constexpr const char* reading_vertex = R"(
layout(binding = 0) readonly buffer Positions { vec4 positions[]; };
void main() { gl_Position = positions[gl_VertexIndex]; })";

// Writes to slot 1, which comes after the fragment shader's slot 0.
inline constexpr const char* writing_vertex = R"(
layout(binding = 4) buffer Count { uint count; };
void main() { gl_Position = vec4(float(atomicAdd(count, 1u))); })";

inline constexpr const char* reading_fragment = R"(
layout(binding = 3) readonly buffer Colors { vec4 colors[]; };
layout(location = 0) out vec4 color;
void main() { color = colors[0]; })";

// One block in both stages.
inline constexpr const char* counting_vertex = R"(
layout(binding = 5) buffer Count { uint count; };
void main() { gl_Position = vec4(float(atomicAdd(count, 1u))); })";

inline constexpr const char* counting_fragment = R"(
layout(binding = 5) buffer Count { uint count; };
layout(location = 0) out vec4 color;
void main() { color = vec4(float(atomicAdd(count, 1u))); })";

inline constexpr const char* painting_vertex = R"(
layout(binding = 6, rgba8) uniform image2D surface;
void main() { gl_Position = imageLoad(surface, ivec2(0)); imageStore(surface, ivec2(1), gl_Position); })";

inline constexpr const char* painting_fragment = R"(
layout(binding = 6, rgba8) uniform image2D surface;
layout(location = 0) out vec4 color;
void main() { color = imageLoad(surface, ivec2(0)); imageStore(surface, ivec2(1), color); })";

inline constexpr const char* table_kernel = R"(
layout(local_size_x = 8) in;
layout(set = 1, binding = 0) uniform texture2DArray images[];
layout(set = 2, binding = 0) buffer Part { uint values[]; } parts[];
void main() {
    uint i = gl_GlobalInvocationID.x % 3u;
    parts[nonuniformEXT(i)].values[i] += uint(texelFetch(images[nonuniformEXT(i)], ivec3(0), 0).x);
})";

// The task stage writes what the mesh stage reads: one block in both.
inline constexpr const char* counting_task = R"(
layout(local_size_x = 1) in;
layout(binding = 5) buffer Count { uint count; };
void main() {
    atomicAdd(count, 1u);
    EmitMeshTasksEXT(1, 1, 1);
})";

inline constexpr const char* reading_mesh = R"(
layout(local_size_x = 1) in;
layout(triangles, max_vertices = 3, max_primitives = 1) out;
layout(binding = 0) readonly buffer Positions { vec4 positions[]; };
layout(binding = 5) buffer Count { uint count; };
void main() {
    SetMeshOutputsEXT(3, 1);
    gl_MeshVerticesEXT[0].gl_Position = positions[count];
})";

inline constexpr const char* plain_fragment = R"(
layout(location = 0) out vec4 color;
void main() { color = vec4(1.0); })";

inline constexpr const char* sampling_fragment = R"(
layout(binding = 1) uniform sampler2DArray image;
layout(location = 0) out vec4 color;
void main() { color = texelFetch(image, ivec3(0), 0); })";

inline constexpr const char* storing_fragment = R"(
layout(binding = 1) buffer Values { uint values[]; };
layout(location = 0) out vec4 color;
void main() { atomicAdd(values[0], 1u); color = vec4(1.0); })";

/// Kernels and pipelines that use resources in every way.
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
        gather = kernel(gather_kernel);
        address = kernel(address_kernel);
        trace = kernel(trace_kernel);
        tables = kernel(table_kernel);
        rays = device.createTraversal();
        rays.createShaderGLSL(Shader::TypeRayGen, trace_generation);
        rays.createShaderGLSL(Shader::TypeClosest, reading_closest);
        EXPECT_THAT(rays.create(), IsOk());
        sampler = device.createSampler();
        const std::pair<const char*, const char*> stages[] = {
            {plain_vertex, plain_fragment},       {plain_vertex, sampling_fragment},
            {plain_vertex, storing_fragment},     {reading_vertex, plain_fragment},
            {reading_vertex, sampling_fragment},  {reading_vertex, storing_fragment},
            {writing_vertex, reading_fragment},   {counting_vertex, counting_fragment},
            {painting_vertex, painting_fragment}, {painting_vertex, sampling_fragment},
            {reading_mesh, plain_fragment},       {reading_mesh, sampling_fragment},
        };
        for (const auto& [vertex, fragment] : stages) {
            const bool is_mesh = vertex == reading_mesh;
            for (const bool depth : {false, true}) {
                Pipeline pipeline = device.createPipeline();
                if (is_mesh) pipeline.createShaderGLSL(Shader::TypeTask, counting_task);
                pipeline.createShaderGLSL(is_mesh ? Shader::TypeMesh : Shader::TypeVertex, vertex);
                pipeline.createShaderGLSL(Shader::TypeFragment, fragment);
                pipeline.setColorFormat(FormatRGBAu8n);
                if (depth) {
                    pipeline.setDepthFormat(FormatDf32);
                    pipeline.setDepthFunc(Pipeline::DepthFuncLess);
                }
                const bool fetches = vertex == plain_vertex;
                if (fetches) pipeline.addAttribute(Pipeline::AttributePosition, FormatRGBAf32, 0, 0, 16);
                EXPECT_THAT(pipeline.create(), IsOk());
                draws.push_back({pipeline, pipeline.getSlots(SlotKind::Storage), fetches,
                                 pipeline.getSlots(SlotKind::Texture) > 0, pipeline.getSlots(SlotKind::Surface) > 0,
                                 is_mesh});
            }
        }
    }

    struct DrawProgram {
        Pipeline pipeline;
        uint32_t storages;
        bool fetches, samples, paints, is_mesh;
    };
    Kernel copy, change, sample, store, paint, gather, address, trace, tables;
    Traversal rays;
    Sampler sampler;
    std::vector<DrawProgram> draws;  ///< each without and with depth
};

/// A random program: resources, and submissions to the three queues that use them. Not all of its accesses are tracked;
/// the others have barriers of their own.
class RandomProgram {
public:
    /// With `may_fail` submissions may run out of memory.
    RandomProgram(Device& device, const Programs& programs, uint64_t seed, bool may_fail = false)
        : device_(device), programs_(programs), random_(seed), may_fail_(may_fail) {
        for (size_t i = 0; i < buffers_.size(); i++) {
            constexpr Buffer::Flags flags = Buffer::FlagStorage | Buffer::FlagVertex | Buffer::FlagIndex |
                                            Buffer::FlagIndirect | Buffer::FlagAddress | Buffer::FlagUniform |
                                            Buffer::FlagTexel;
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
        fine_ = device.createTexture2D(FormatRGBAu8n, 8, 8, Texture::FlagTarget | Texture::FlagMultisample4, "fine");
        images_ = device.createTextureTable(3, "images");
        parts_ = device.createBufferTable(3, "parts");
        time_ = device.createQuery(Query::TypeTime, "time");
        vertices_ = device.createBuffer(Buffer::FlagTracing | Buffer::FlagStorage, 36 * 4, "vertices");
        for (size_t i = 0; i < bottoms_.size(); i++) {
            bottoms_[i] = device.createTracing("bottom " + std::to_string(i));
            bottoms_[i].addVertexBuffer(12, FormatRGBf32, 12, vertices_);
            EXPECT_THAT(bottoms_[i].create(Tracing::TypeTriangle, Tracing::FlagUpdate), IsOk());
        }
        const uint64_t alignment = device.getFeatures().scratchAlignment;
        scratch_part_ = (bottoms_[0].getBuildSize() + alignment - 1) / alignment * alignment;
        scratch_ = device.createBuffer(Buffer::FlagScratch | Buffer::FlagStorage, scratch_parts * scratch_part_,
                                       "scratch of the program");
        top_ = device.createTracing("top");
        top_.setInstances(4);
        EXPECT_THAT(top_.create(Tracing::TypeInstance), IsOk());
    }

    void run() {
        buildAll();
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
        last.setStorageBuffer(0, buffers_[0]);
        last.dispatch(8);
        accept(device_.submit(last));
    }

private:
    static constexpr uint64_t buffer_size = 1024;
    static constexpr uint64_t scratch_parts = 3;

    void accept(const Status& status) {
        // What a failed submission would have built is unbuilt.
        if (may_fail_ && status.error().id() == "device.out_of_memory") return buildAll();
        EXPECT_THAT(status, IsOk());
    }

    uint64_t below(uint64_t count) { return random_.below(count); }
    const Buffer& buffer() { return buffers_[below(buffers_.size())]; }
    const Tracing& bottom() { return bottoms_[below(bottoms_.size())]; }
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

    void buildAll() {
        accept(device_.buildTracings(bottoms_, Buffer()));
        buildTop();
    }

    void buildTop() {
        const Tracing::Instance all[] = {{.tracing = &bottom()}, {.tracing = &bottom()}, {}};
        device_.setTracing(top_, std::span(all).first(1 + below(3)));
        device_.buildTracing(top_);
        accept(device_.flush());
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
                record(commands);
                order.push_back(10 + commands.size() - 1);
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
        accept(status);
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
        const bool timed = queue == Queue::Main && below(8) == 0;
        if (timed) list.beginQuery(time_);
        for (size_t i = 1 + below(6); i > 0; i--) {
            // Who looks after hazards himself puts a barrier everywhere.
            if (!tracked) list.barrier();
            list.pushRegion("work");
            if (queue == Queue::Copy || below(3) == 0)
                copy(list, queue);
            else if (below(8) == 0)
                build(list);
            else
                dispatch(list, queue, tracked);
            list.popRegion();
        }
        if (!tracked) list.barrier();
        if (timed) list.endQuery(time_);
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
                if (below(2))
                    list.setTexture(image, texels.data(), size, slice);
                else
                    list.setTexture(image, texels.data(), 4, slice, {0, 0, 0, 1, 1, 1});
                break;
            }
            case 7: list.clearTexture(image, Color::gray(), range(image)); break;
            default: list.createMipmaps(textures_[0]); break;
        }
    }

    void dispatch(Compute& list, Queue queue, bool tracked) {
        switch (below(10)) {
            case 0:
                list.setKernel(programs_.gather);
                list.setUniformBuffer(0, buffer(), 256 * below(3), 64);
                list.setTexelBuffer(0, buffer(), FormatRGBAu32, 64 * below(4));
                list.setStorageBuffer(0, buffer());
                break;
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
                bindImage(list, Texture(), Slice());
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
            case 7:
                list.setTraversal(programs_.rays);
                list.setTracing(0, top_);
                list.setStorageBuffer(0, buffer());
                list.setStorageBuffer(1, buffer());
                break;
            case 8: {
                const Texture& image = texture();
                images_.set(static_cast<uint32_t>(below(3)), below(4) ? image : Texture(), range(image));
                parts_.set(static_cast<uint32_t>(below(3)), below(4) ? buffer() : Buffer(), 512 * below(2));
                list.setKernel(programs_.tables);
                list.setTextureTable(0, images_);
                list.setBufferTable(1, parts_);
                break;
            }
            default:
                list.setKernel(programs_.trace);
                list.setTracing(0, top_);
                list.setStorageBuffer(0, buffer());
                break;
        }
        if (below(5) == 0)
            list.dispatchIndirect(buffer(), 16);
        else
            list.dispatch(8);
        // The same bindings again, perhaps after something that they have to come after.
        for (size_t i = below(3); i > 0; i--) {
            if (!tracked) list.barrier();
            if (below(2)) copy(list, queue);
            if (!tracked) list.barrier();
            list.dispatch(8);
        }
        list.clearUses();
    }

    /// Binds a sampled image other than the attachment.
    template <class List>
    bool bindImage(List& list, const Texture& attached, const Slice& taken, bool depth_taken = false,
                   const Texture* painted = nullptr) {
        for (int attempt = 0; attempt < 8; attempt++) {
            const Texture& image = below(4) ? texture() : depth_;
            const Slice slice = range(image);
            const bool meets = image == attached && slice.mip <= taken.mip && taken.mip < slice.mip + slice.mips &&
                               slice.layer <= taken.layer && taken.layer < slice.layer + slice.layers;
            if (meets || (depth_taken && image == depth_) || (painted && image == *painted)) continue;
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
        for (size_t i = 1 + below(4); i > 0; i--) {
            const uint64_t offset = below(scratch_parts) * scratch_part_;
            switch (below(5)) {
                case 0: list.updateTracing(bottom()); break;
                case 1: list.buildTracing(bottom()); break;
                case 2: list.updateTracing(bottom(), scratch_, offset); break;
                case 3: list.buildTracing(bottom(), scratch_, offset); break;
                default: list.buildTracing(top_); break;
            }
            if (below(6)) continue;
            list.barrier();
            list.setKernel(programs_.change);
            list.setStorageBuffer(0, scratch_);
            list.dispatch(8);
        }
        list.buildTracing(top_);
    }

    void record(std::vector<Command>& commands) {
        const Texture& color = texture();
        const Slice slice = level(color);
        if (slice.mip == 0 && below(8) == 0) {
            Target target = device_.createTarget(fine_);
            target.setColorResolve(0, color, slice);
            commands.push_back(device_.createCommand(target, "resolve"));
            return;
        }
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
            for (uint32_t slot = 0; slot < program.storages; slot++) list.setStorageBuffer(slot, buffer());
            const Texture& surface = texture();
            const Slice painted = level(surface);
            if (program.paints) {
                if (surface == color && painted == slice) continue;
                list.setSurfaceTexture(0, surface, painted);
            }
            if (program.samples && !bindImage(list, color, slice, has_depth, program.paints ? &surface : nullptr))
                continue;
            if (program.is_mesh) {
                switch (below(3)) {
                    case 0: list.drawMeshIndirect(buffer(), 16 * below(4)); break;
                    case 1: list.drawMeshIndirect(buffer(), 0, buffer(), 4 * below(4), 8); break;
                    default: list.drawMesh(3); break;
                }
                if (below(2)) list.drawMesh(1);
                continue;
            }
            switch (below(5)) {
                case 4: list.drawArraysIndirect(buffer(), 0, buffer(), 64, 4); break;
                case 0:
                    list.setIndexBuffer(FormatRu16, buffer());
                    list.drawElements(6);
                    break;
                case 1: list.drawArraysIndirect(buffer()); break;
                default: list.drawArrays(3); break;
            }
            if (below(2)) list.drawArrays(3);
        }
    }

    Device& device_;
    const Programs& programs_;
    Random random_;
    const bool may_fail_;
    std::array<Buffer, 4> buffers_;
    std::array<Texture, 2> textures_;
    Texture depth_, fine_;
    TextureTable images_;
    BufferTable parts_;
    Query time_;
    Buffer vertices_;
    std::array<Tracing, 4> bottoms_;
    Buffer scratch_;
    uint64_t scratch_part_ = 0;
    Tracing top_;
};

}  // namespace glint::test
