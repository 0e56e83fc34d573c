#include "conformance/conformance.h"

#include <numeric>
#include <thread>

namespace glint::test {

namespace {

class ComputeTest : public ConformanceTest {
protected:
    std::vector<uint32_t> iota(uint32_t count, uint32_t first = 0) {
        std::vector<uint32_t> values(count);
        std::iota(values.begin(), values.end(), first);
        return values;
    }
};

constexpr const char* add_kernel = R"(
layout(local_size_x = 64) in;
layout(binding = 0) uniform Parameters { uint count; uint amount; };
layout(binding = 1) buffer Values { uint values[]; };
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < count) values[i] += amount;
}
)";

struct AddParameters {
    uint32_t count;
    uint32_t amount;
};

}  // namespace

TEST_F(ComputeTest, DispatchCountsThreads) {
    const Kernel kernel = makeKernel(add_kernel);
    for (const uint32_t count : {1u, 63u, 64u, 65u, 1000u}) {
        const Buffer buffer = makeBuffer(iota(count));
        compute([&](Compute& list) {
            list.setKernel(kernel);
            list.setUniform(0, AddParameters{count, 7});
            list.setStorageBuffer(0, buffer);
            list.dispatch(count);
        });
        EXPECT_EQ(read<uint32_t>(buffer), iota(count, 7)) << count;
    }
}

TEST_F(ComputeTest, DispatchOfNothingRecordsNothing) {
    const Buffer buffer = makeBuffer(iota(4));
    compute([&](Compute& list) {
        list.setKernel(makeKernel(add_kernel));
        list.setUniform(0, AddParameters{4, 7});
        list.setStorageBuffer(0, buffer);
        list.dispatch(0);
        list.dispatch(1, 0);
        list.dispatch(1, 1, 0);
    });
    EXPECT_EQ(read<uint32_t>(buffer), iota(4));
}

TEST_F(ComputeTest, DependentDispatchesRunInOrder) {
    const Kernel kernel = makeKernel(add_kernel);
    const Kernel triple = makeKernel(R"(
        layout(local_size_x = 8) in;
        layout(binding = 0) buffer Values { uint values[]; };
        void main() { values[gl_GlobalInvocationID.x] *= 3u; })");
    const Buffer buffer = makeBuffer(iota(64));
    compute([&](Compute& list) {
        list.setStorageBuffer(0, buffer);
        for (uint32_t i = 0; i < 10; i++) {
            list.setKernel(kernel);
            list.setUniform(0, AddParameters{64, i});
            list.dispatch(64);
            list.setKernel(triple);
            list.dispatch(64);
        }
    });
    std::vector<uint32_t> expected = iota(64);
    for (uint32_t i = 0; i < 10; i++)
        for (uint32_t& value : expected) value = (value + i) * 3;
    EXPECT_EQ(read<uint32_t>(buffer), expected);
}

TEST_F(ComputeTest, ThreeDimensions) {
    const Kernel kernel = makeKernel(R"(
        layout(local_size_x = 4, local_size_y = 2, local_size_z = 2) in;
        layout(binding = 0) buffer Values { uint values[]; };
        void main() {
            uvec3 id = gl_GlobalInvocationID;
            if (id.x < 5u && id.y < 3u && id.z < 3u) values[(id.z * 3u + id.y) * 5u + id.x] = id.x | id.y << 8 | id.z << 16;
        })");
    EXPECT_EQ(kernel.getGroupSizeX(), 4u);
    EXPECT_EQ(kernel.getGroupSizeY(), 2u);
    EXPECT_EQ(kernel.getGroupSizeZ(), 2u);
    const Buffer buffer = makeBuffer(std::vector<uint32_t>(45));
    compute([&](Compute& list) {
        list.setKernel(kernel);
        list.setStorageBuffer(0, buffer);
        list.dispatch(5, 3, 3);
    });
    const std::vector<uint32_t> values = read<uint32_t>(buffer);
    for (uint32_t i = 0; i < 45; i++) EXPECT_EQ(values[i], (i % 5) | (i / 5 % 3) << 8 | (i / 15) << 16);
}

TEST_F(ComputeTest, DispatchCoversTexture) {
    const Kernel kernel = makeKernel(R"(
        layout(local_size_x = 8, local_size_y = 8) in;
        layout(binding = 0, rgba8) writeonly uniform image2D surface;
        void main() {
            ivec2 id = ivec2(gl_GlobalInvocationID.xy);
            if (all(lessThan(id, imageSize(surface)))) imageStore(surface, id, vec4(1.0, 0.0, 0.0, 1.0));
        })");
    const Texture texture = makeTexture(FormatRGBAu8n, 37, 21, Texture::FlagSurface);
    compute([&](Compute& list) {
        list.setKernel(kernel);
        list.setSurfaceTexture(0, texture);
        list.dispatch(texture);
    });
    EXPECT_EQ(countPixels(readTexture<Pixel>(texture), red), 37u * 21u);
}

TEST_F(ComputeTest, DispatchIndirect) {
    const Buffer buffer = makeBuffer(std::vector<uint32_t>(256));
    const Buffer arguments = makeBuffer(std::vector<uint32_t>{99, 3, 1, 1}, Buffer::FlagIndirect);
    compute([&](Compute& list) {
        list.setKernel(makeKernel(add_kernel));
        list.setUniform(0, AddParameters{256, 1});
        list.setStorageBuffer(0, buffer);
        list.dispatchIndirect(arguments, 4);
    });
    const std::vector<uint32_t> values = read<uint32_t>(buffer);
    EXPECT_EQ(std::accumulate(values.begin(), values.end(), 0u), 192u);
}

TEST_F(ComputeTest, IndirectArgumentsWrittenByADispatch) {
    const Kernel write = makeKernel(R"(
        layout(local_size_x = 1) in;
        layout(binding = 0) buffer Arguments { uint x, y, z; };
        void main() { x = 2u; y = 1u; z = 1u; })");
    const Buffer buffer = makeBuffer(std::vector<uint32_t>(256));
    const Buffer arguments = makeBuffer(std::vector<uint32_t>(3), Buffer::FlagIndirect | Buffer::FlagStorage);
    compute([&](Compute& list) {
        list.setKernel(write);
        list.setStorageBuffer(0, arguments);
        list.dispatch(1);
        list.setKernel(makeKernel(add_kernel));
        list.setUniform(0, AddParameters{256, 1});
        list.setStorageBuffer(0, buffer);
        list.dispatchIndirect(arguments);
    });
    const std::vector<uint32_t> values = read<uint32_t>(buffer);
    EXPECT_EQ(std::accumulate(values.begin(), values.end(), 0u), 128u);
}

TEST_F(ComputeTest, EverySlotKindAtOnce) {
    const Kernel kernel = makeKernel(R"(
        layout(local_size_x = 1) in;
        layout(set = 0, binding = 5) uniform First { uint first; };
        layout(set = 1, binding = 0) uniform Second { uint second; };
        layout(set = 0, binding = 1) readonly buffer Input { uint values[]; } source;
        layout(set = 0, binding = 7) writeonly buffer Output { uint values[]; } result;
        layout(set = 0, binding = 2) uniform texture2D picture;
        layout(set = 0, binding = 3) uniform sampler nearest;
        layout(set = 1, binding = 1) uniform sampler2D combined;
        layout(set = 0, binding = 4, r32ui) uniform uimage2D surface;
        layout(set = 2, binding = 0) uniform utextureBuffer texels;
        layout(set = 2, binding = 1, r32ui) uniform uimageBuffer stored;
        layout(push_constant) uniform Push { uint pushed; };
        void main() {
            result.values[0] = first;
            result.values[1] = second;
            result.values[2] = source.values[0];
            result.values[3] = uint(textureLod(sampler2D(picture, nearest), vec2(0.5), 0.0).r * 255.0 + 0.5);
            result.values[4] = uint(textureLod(combined, vec2(0.5), 0.0).r * 255.0 + 0.5);
            result.values[5] = imageLoad(surface, ivec2(0)).x;
            result.values[6] = texelFetch(texels, 1).x;
            result.values[7] = imageLoad(stored, 2).x;
            result.values[8] = pushed;
            imageStore(surface, ivec2(0), uvec4(77));
            imageStore(stored, 2, uvec4(88));
        })");
    EXPECT_EQ(kernel.getSlots(SlotKind::Uniform), 2u);
    EXPECT_EQ(kernel.getSlots(SlotKind::Storage), 2u);
    EXPECT_EQ(kernel.getSlots(SlotKind::Texture), 2u);
    EXPECT_EQ(kernel.getSlots(SlotKind::Sampler), 2u);
    EXPECT_EQ(kernel.getSlots(SlotKind::Surface), 1u);
    EXPECT_EQ(kernel.getSlots(SlotKind::Texel), 2u);

    const Buffer source = makeBuffer(std::vector<uint32_t>{13});
    const Buffer result = makeBuffer(std::vector<uint32_t>(9));
    const Buffer texels = makeBuffer(std::vector<uint32_t>{15, 16, 17, 18}, Buffer::FlagTexel);
    const Buffer stored = makeBuffer(std::vector<uint32_t>{25, 26, 27, 28}, Buffer::FlagTexel);
    const Texture picture = makeTexture(FormatRGBAu8n, 1, 1, 0);
    const Texture other = makeTexture(FormatRGBAu8n, 1, 1, 0);
    const Texture surface = makeTexture(FormatRu32, 1, 1, Texture::FlagSurface);
    device.setTexture(picture, Pixel{31, 0, 0, 0}.data(), 4);
    device.setTexture(other, Pixel{41, 0, 0, 0}.data(), 4);
    device.clearTexture(surface, Color{51, 0, 0, 0});
    const Sampler sampler = device.createSampler(Sampler::FilterPoint);
    const Sampler linear = device.createSampler(Sampler::FilterLinear);
    compute([&](Compute& list) {
        list.setKernel(kernel);
        list.setUniform(0, 11u);
        list.setUniform(1, 12u);
        list.setStorageBuffers(0, {source, result});
        list.setTextures(0, {picture, other});
        list.setSamplers(0, {sampler, linear});
        list.setSurfaceTexture(0, surface);
        list.setTexelBuffer(0, texels, FormatRu32);
        list.setTexelBuffer(1, stored, FormatRu32);
        list.setPushConstants(14u);
        list.dispatch(1);
    });
    EXPECT_EQ(read<uint32_t>(result), (std::vector<uint32_t>{11, 12, 13, 31, 41, 51, 16, 27, 14}));
    EXPECT_EQ(readTexture<uint32_t>(surface), std::vector<uint32_t>{77});
    EXPECT_EQ(read<uint32_t>(stored), (std::vector<uint32_t>{25, 26, 88, 28}));
}

TEST_F(ComputeTest, SlotsByNameAndByBinding) {
    const Kernel kernel = makeKernel(R"(
        layout(local_size_x = 1) in;
        layout(set = 1, binding = 3) uniform Parameters { uint amount; } parameters;
        layout(set = 0, binding = 9) buffer Values { uint values[]; };
        void main() { values[0] += parameters.amount; })");
    const Buffer buffer = makeBuffer(std::vector<uint32_t>{1});
    compute([&](Compute& list) {
        list.setKernel(kernel);
        list.setUniform("Parameters", 10u);
        list.setStorageBuffer("Values", buffer);
        list.dispatch(1);
        list.setUniform("parameters", 100u);
        list.dispatch(1);
        list.setUniform(Slot::at(1, 3), 1000u);
        list.setStorageBuffer(Slot::at(0, 9), buffer);
        list.dispatch(1);
    });
    EXPECT_EQ(read<uint32_t>(buffer)[0], 1111u);
}

TEST_F(ComputeTest, ArraysAreOneSlot) {
    const Kernel kernel = makeKernel(R"(
        layout(local_size_x = 1) in;
        layout(binding = 0) buffer Parts { uint value; } parts[3];
        layout(binding = 1) buffer Result { uint result[]; };
        layout(binding = 2) uniform texture2D pictures[2];
        layout(binding = 3) uniform sampler nearest;
        void main() {
            result[0] = parts[0].value * 100u + parts[1].value * 10u + parts[2].value;
            result[1] = uint(texelFetch(sampler2D(pictures[0], nearest), ivec2(0), 0).r * 255.0 + 0.5);
            result[2] = uint(texelFetch(sampler2D(pictures[1], nearest), ivec2(0), 0).r * 255.0 + 0.5);
        })");
    EXPECT_EQ(kernel.getSlots(SlotKind::Storage), 2u);
    EXPECT_EQ(kernel.getSlots(SlotKind::Texture), 1u);
    const Buffer parts[] = {makeBuffer(std::vector<uint32_t>{1}), makeBuffer(std::vector<uint32_t>{2}),
                            makeBuffer(std::vector<uint32_t>{3})};
    const Buffer result = makeBuffer(std::vector<uint32_t>(3));
    const Texture left = makeTexture(FormatRGBAu8n, 1, 1, 0);
    const Texture right = makeTexture(FormatRGBAu8n, 1, 1, 0);
    device.setTexture(left, Pixel{5, 0, 0, 0}.data(), 4);
    device.setTexture(right, Pixel{6, 0, 0, 0}.data(), 4);
    compute([&](Compute& list) {
        list.setKernel(kernel);
        list.setStorageBuffers(0, {parts[0], parts[1], parts[2]});
        list.setStorageBuffer(1, result);
        list.setTextures(0, {left, right});
        list.setSampler(0, device.createSampler(Sampler::FilterPoint));
        list.dispatch(1);
    });
    EXPECT_EQ(read<uint32_t>(result), (std::vector<uint32_t>{123, 5, 6}));
}

TEST_F(ComputeTest, AnArrayAndASingleBufferTakeTurnsInASlot) {
    const Kernel array = makeKernel(R"(
        layout(local_size_x = 1) in;
        layout(binding = 0) buffer Parts { uint value; } parts[2];
        void main() { parts[0].value += 1u; parts[1].value += 10u; })");
    const Kernel single = makeKernel(R"(
        layout(local_size_x = 1) in;
        layout(binding = 0) buffer Part { uint value; };
        void main() { value += 100u; })");
    const Buffer a = makeBuffer(std::vector<uint32_t>{0});
    const Buffer b = makeBuffer(std::vector<uint32_t>{0});
    compute([&](Compute& list) {
        list.setKernel(array);
        list.setStorageBuffers(0, {a, b});
        list.dispatch(1);
        list.setKernel(single);
        list.setStorageBuffer(0, b);
        list.dispatch(1);
        list.setKernel(array);
        list.setStorageBuffers(0, {b, a});
        list.dispatch(1);
    });
    EXPECT_EQ(read<uint32_t>(a)[0], 11u);
    EXPECT_EQ(read<uint32_t>(b)[0], 111u);
}

TEST_F(ComputeTest, UniformsFromABufferAtAnOffset) {
    const Kernel kernel = makeKernel(add_kernel);
    const uint32_t step = std::max(device.getFeatures().uniformAlignment, 16u);
    const Buffer parameters = device.createBuffer(Buffer::FlagUniform, uint64_t{step} * 3);
    for (uint32_t i = 0; i < 3; i++) {
        const AddParameters value = {4, i == 0 ? 1u : i == 1 ? 10u : 100u};
        device.setBuffer(parameters, uint64_t{step} * i, &value, sizeof(value));
    }
    const Buffer buffer = makeBuffer(std::vector<uint32_t>(4));
    compute([&](Compute& list) {
        list.setKernel(kernel);
        list.setStorageBuffer(0, buffer);
        for (const uint32_t i : {0u, 2u, 1u, 1u}) {
            list.setUniformBuffer(0, parameters, uint64_t{step} * i, sizeof(AddParameters));
            list.dispatch(4);
        }
        list.setUniform(0, AddParameters{2, 1000});
        list.dispatch(4);
        list.setUniformBuffer(0, parameters, uint64_t{step} * 2);
        list.dispatch(4);
    });
    EXPECT_EQ(read<uint32_t>(buffer), (std::vector<uint32_t>{1221, 1221, 221, 221}));
}

TEST_F(ComputeTest, UniformSizesRoundUpToSixteenBytes) {
    struct alignas(16) Padded {
        uint32_t count;
        uint32_t amount;
    };
    const Buffer buffer = makeBuffer(std::vector<uint32_t>(1));
    compute([&](Compute& list) {
        list.setKernel(makeKernel(add_kernel));
        list.setStorageBuffer(0, buffer);
        list.setUniform(0, Padded{1, 5});
        list.dispatch(1);
    });
    EXPECT_EQ(read<uint32_t>(buffer)[0], 5u);
}

TEST_F(ComputeTest, StorageBufferAtAnOffset) {
    const uint32_t step = std::max(device.getFeatures().storageAlignment, 16u);
    const Buffer buffer = makeBuffer(std::vector<uint32_t>(step));
    compute([&](Compute& list) {
        list.setKernel(makeKernel(R"(
            layout(local_size_x = 1) in;
            layout(binding = 0) buffer Values { uint values[]; };
            void main() { values[0] = values.length(); })"));
        list.setStorageBuffer(0, buffer, step, step);
        list.dispatch(1);
        list.setStorageBuffer(0, buffer, uint64_t{step} * 2);
        list.dispatch(1);
    });
    const std::vector<uint32_t> values = read<uint32_t>(buffer);
    EXPECT_EQ(values[step / 4], step / 4);
    EXPECT_EQ(values[step / 2], step * 4 / 4 - step / 2);
    EXPECT_EQ(values[0], 0u);
}

TEST_F(ComputeTest, PushConstantsChangeBetweenDispatches) {
    const Buffer buffer = makeBuffer(std::vector<uint32_t>(8));
    compute([&](Compute& list) {
        list.setKernel(makeKernel(R"(
            layout(local_size_x = 1) in;
            layout(binding = 0) buffer Values { uint values[]; };
            layout(push_constant) uniform Push { uint index; uint value; };
            void main() { values[index] = value; })"));
        list.setStorageBuffer(0, buffer);
        for (uint32_t i = 0; i < 8; i++) {
            list.setPushConstants(std::array<uint32_t, 2>{i, i * i});
            list.dispatch(1);
        }
    });
    EXPECT_EQ(read<uint32_t>(buffer), (std::vector<uint32_t>{0, 1, 4, 9, 16, 25, 36, 49}));
}

TEST_F(ComputeTest, BindingsStayOverAChangeOfKernel) {
    const Kernel first = makeKernel(add_kernel);
    const Kernel second = makeKernel(add_kernel, "OTHER=1");
    const Buffer buffer = makeBuffer(std::vector<uint32_t>(1));
    compute([&](Compute& list) {
        list.setUniform(0, AddParameters{1, 3});
        list.setStorageBuffer(0, buffer);
        list.setKernel(first);
        list.dispatch(1);
        list.setKernel(second);
        list.dispatch(1);
    });
    EXPECT_EQ(read<uint32_t>(buffer)[0], 6u);
}

TEST_F(ComputeTest, CopiesAndDispatchesAreOrdered) {
    const Kernel kernel = makeKernel(add_kernel);
    const Buffer a = makeBuffer(iota(64));
    const Buffer b = makeBuffer(std::vector<uint32_t>(64));
    const uint32_t last = 12345;
    compute([&](Compute& list) {
        list.setKernel(kernel);
        list.setUniform(0, AddParameters{64, 1});
        list.setStorageBuffer(0, a);
        list.dispatch(64);
        list.copyBuffer(b, 0, a, 0, 256);
        list.clearBuffer(a, 5);
        list.dispatch(64);
        list.setBuffer(a, 252, &last, 4);
        list.setStorageBuffer(0, b);
        list.dispatch(64);
    });
    std::vector<uint32_t> expected(64, 6);
    expected[63] = last;
    EXPECT_EQ(read<uint32_t>(a), expected);
    EXPECT_EQ(read<uint32_t>(b), iota(64, 2));
}

TEST_F(ComputeTest, ReadBackSeesTheLastOfManySubmissions) {
    const Kernel kernel = makeKernel(add_kernel);
    const Buffer buffer = makeBuffer(std::vector<uint32_t>(1));
    for (uint32_t i = 0; i < 50; i++)
        compute([&](Compute& list) {
            list.setKernel(kernel);
            list.setUniform(0, AddParameters{1, 1});
            list.setStorageBuffer(0, buffer);
            list.dispatch(1);
        });
    EXPECT_EQ(read<uint32_t>(buffer)[0], 50u);
}

TEST_F(ComputeTest, SeveralListsInOneSubmission) {
    const Kernel kernel = makeKernel(add_kernel);
    const Buffer buffer = makeBuffer(std::vector<uint32_t>{1});
    Compute first = device.createCompute();
    Compute second = device.createCompute();
    // Recorded in the other order: that of the submission counts.
    second.clearBuffer(buffer, 40);
    first.setKernel(kernel);
    first.setUniform(0, AddParameters{1, 2});
    first.setStorageBuffer(0, buffer);
    first.dispatch(1);
    EXPECT_THAT(device.submit({second, first}), IsOk());
    EXPECT_EQ(read<uint32_t>(buffer)[0], 42u);
}

TEST_F(ComputeTest, UntrackedWithBarriers) {
    const Kernel kernel = makeKernel(add_kernel);
    const Buffer buffer = makeBuffer(std::vector<uint32_t>(64));
    compute([&](Compute& list) {
        list.setKernel(kernel);
        list.setUniform(0, AddParameters{64, 1});
        list.setStorageBuffer(0, buffer);
        list.setTracking(false);
        list.barrier(buffer);  // the upload comes before, too
        for (uint32_t i = 0; i < 5; i++) {
            list.dispatch(64);
            list.barrier(buffer);
        }
        list.setTracking(true);
        list.dispatch(64);
    });
    EXPECT_EQ(read<uint32_t>(buffer), std::vector<uint32_t>(64, 6));
}

TEST_F(ComputeTest, BuffersByAddress) {
    GLINT_NEED_FEATURE(FeatureBufferAddress);
    const Kernel kernel = makeKernel(R"(
        layout(local_size_x = 8) in;
        layout(buffer_reference, std430, buffer_reference_align = 4) buffer Values { uint values[]; };
        layout(binding = 0) uniform Parameters { Values source; Values result; };
        void main() { uint i = gl_GlobalInvocationID.x; result.values[i] = source.values[i] * 2u; })");
    const Buffer source = makeBuffer(iota(8), Buffer::FlagAddress);
    const Buffer middle = makeBuffer(std::vector<uint32_t>(8), Buffer::FlagAddress);
    const Buffer result = makeBuffer(std::vector<uint32_t>(8), Buffer::FlagAddress);
    ASSERT_NE(source.getAddress(), 0u);
    compute([&](Compute& list) {
        list.setKernel(kernel);
        list.useBuffer(source, false);
        list.useBuffer(middle, true);
        list.setUniform(0, std::array<uint64_t, 2>{source.getAddress(), middle.getAddress()});
        list.dispatch(8);
        list.useBuffer(result, true);
        list.setUniform(0, std::array<uint64_t, 2>{middle.getAddress(), result.getAddress()});
        list.dispatch(8);
        list.clearUses();
    });
    std::vector<uint32_t> expected(8);
    for (uint32_t i = 0; i < 8; i++) expected[i] = i * 4;
    EXPECT_EQ(read<uint32_t>(result), expected);
}

TEST_F(ComputeTest, RegionsNestAndBalance) {
    const Buffer buffer = makeBuffer(std::vector<uint32_t>(1));
    compute([&](Compute& list) {
        list.pushRegion("outer");
        list.pushRegion("");
        list.clearBuffer(buffer, 3);
        list.popRegion();
        list.popRegion();
    });
    EXPECT_EQ(read<uint32_t>(buffer)[0], 3u);
}

TEST_F(ComputeTest, RecorderMovesAndDropsUnsubmitted) {
    const Buffer buffer = makeBuffer(std::vector<uint32_t>{1});
    Compute first = device.createCompute();
    first.clearBuffer(buffer, 2);
    Compute second = std::move(first);
    second.clearBuffer(buffer, 3);
    submit(second);
    EXPECT_EQ(read<uint32_t>(buffer)[0], 3u);
    {
        Compute dropped = device.createCompute();
        dropped.clearBuffer(buffer, 4);
    }
    EXPECT_EQ(read<uint32_t>(buffer)[0], 3u);
}

TEST_F(ComputeTest, EveryQueue) {
    const Kernel kernel = makeKernel(add_kernel);
    const Buffer buffer = makeBuffer(std::vector<uint32_t>(64));
    for (const Queue queue : {Queue::Main, Queue::Compute, Queue::Main, Queue::Compute}) {
        Compute list = device.createCompute(queue, "queue");
        list.setKernel(kernel);
        list.setUniform(0, AddParameters{64, 1});
        list.setStorageBuffer(0, buffer);
        list.dispatch(64);
        submit(list);
    }
    const Buffer copy = makeBuffer(std::vector<uint32_t>(64));
    Compute list = device.createCompute(Queue::Copy);
    list.copyBuffer(copy, 0, buffer, 0, 256);
    submit(list);
    EXPECT_EQ(read<uint32_t>(copy), std::vector<uint32_t>(64, 4));
}

TEST_F(ComputeTest, AtomicsOn64Bits) {
    GLINT_NEED_FEATURE(FeatureAtomicBufferu64);
    const Buffer buffer = makeBuffer(std::vector<uint64_t>{1});
    compute([&](Compute& list) {
        list.setKernel(makeKernel(R"(
            layout(local_size_x = 64) in;
            layout(binding = 0) buffer Values { uint64_t value; };
            void main() { atomicAdd(value, 1ul << 33); })"));
        list.setStorageBuffer(0, buffer);
        list.dispatch(64);
    });
    EXPECT_EQ(read<uint64_t>(buffer)[0], 1 + (64ull << 33));
}

TEST_F(ComputeTest, Doubles) {
    GLINT_NEED_FEATURE(FeatureShaderf64);
    const Buffer buffer = makeBuffer(std::vector<double>{1e300});
    compute([&](Compute& list) {
        list.setKernel(makeKernel(R"(
            layout(local_size_x = 1) in;
            layout(binding = 0) buffer Values { double value; };
            void main() { value *= 1e-3lf; })"));
        list.setStorageBuffer(0, buffer);
        list.dispatch(1);
    });
    EXPECT_DOUBLE_EQ(read<double>(buffer)[0], 1e300 * 1e-3);
}

TEST_F(ComputeTest, SharedMemoryAndBarriers) {
    const Buffer buffer = makeBuffer(iota(64));
    compute([&](Compute& list) {
        list.setKernel(makeKernel(R"(
            layout(local_size_x = 64) in;
            layout(binding = 0) buffer Values { uint values[]; };
            shared uint memory[64];
            void main() {
                uint i = gl_LocalInvocationIndex;
                memory[i] = values[i];
                barrier();
                values[i] = memory[63u - i];
            })"));
        list.setStorageBuffer(0, buffer);
        list.dispatch(64);
    });
    std::vector<uint32_t> expected = iota(64);
    std::reverse(expected.begin(), expected.end());
    EXPECT_EQ(read<uint32_t>(buffer), expected);
}

TEST_F(ComputeTest, ThreadsRecordAtTheSameTime) {
    const Kernel kernel = makeKernel(add_kernel);
    constexpr uint32_t threads = 4;
    std::vector<Buffer> buffers;
    for (uint32_t i = 0; i < threads; i++) buffers.push_back(makeBuffer(std::vector<uint32_t>(64)));
    std::vector<std::thread> workers;
    std::vector<Status> results(threads);
    for (uint32_t i = 0; i < threads; i++)
        workers.emplace_back([&, i] {
            for (uint32_t pass = 0; pass < 20 && results[i]; pass++) {
                Compute list = device.createCompute();
                list.setKernel(kernel);
                list.setUniform(0, AddParameters{64, i});
                list.setStorageBuffer(0, buffers[i]);
                list.dispatch(64);
                results[i] = device.submit(list);
            }
        });
    for (std::thread& worker : workers) worker.join();
    for (uint32_t i = 0; i < threads; i++) {
        EXPECT_THAT(results[i], IsOk());
        EXPECT_EQ(read<uint32_t>(buffers[i]), std::vector<uint32_t>(64, 20 * i));
    }
}

}  // namespace glint::test
