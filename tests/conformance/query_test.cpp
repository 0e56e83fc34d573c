#include "conformance/conformance.h"

namespace glint::test {

namespace {

class QueryTest : public ConformanceTest {
protected:
    Kernel busy() {
        return makeKernel(R"(
            layout(local_size_x = 64) in;
            layout(binding = 0) buffer Values { uint values[]; };
            void main() {
                uint x = gl_GlobalInvocationID.x;
                for (uint i = 0; i < 10000u; i++) x = x * 1664525u + 1013904223u;
                values[gl_GlobalInvocationID.x] = x;
            })");
    }
};

}  // namespace

TEST_F(QueryTest, TimesGrowWithTheWork) {
    GLINT_NEED_FEATURE(FeatureTimestamps);
    const Query all = device.createQuery(Query::TypeTime, "all");
    const Query part = device.createQuery(Query::TypeTime, "part");
    EXPECT_EQ(all.getType(), Query::TypeTime);
    const Kernel kernel = busy();
    const Buffer buffer = makeBuffer(std::vector<uint32_t>(4096));
    const auto run = [&] {
        compute([&](Compute& list) {
            list.setKernel(kernel);
            list.setStorageBuffer(0, buffer);
            list.beginQuery(all);
            list.dispatch(4096);
            list.beginQuery(part);  // times nest
            list.dispatch(64);
            list.endQuery(part);
            list.dispatch(4096);
            list.endQuery(all);
        });
    };
    run();  // compiles
    run();
    const Expected<uint64_t> all_time = device.getTime(all), part_time = device.getTime(part);
    ASSERT_THAT(all_time, IsOk());
    ASSERT_THAT(part_time, IsOk());
    EXPECT_GT(*part_time, 0u);
    EXPECT_GT(*all_time, *part_time);
    EXPECT_LT(*all_time, 60'000'000'000u);
}

TEST_F(QueryTest, CountsComputeInvocations) {
    GLINT_NEED_FEATURE(FeatureStatistics);
    const Query query = device.createQuery(Query::TypeStatistics);
    const Buffer buffer = makeBuffer(std::vector<uint32_t>(256));
    for (int i = 1; i <= 3; i++) {  // a query is used again
        compute([&](Compute& list) {
            list.setKernel(busy());
            list.setStorageBuffer(0, buffer);
            list.beginQuery(query);
            for (int repeat = 0; repeat < i; repeat++) list.dispatch(64);
            list.endQuery(query);
        });
        const Expected<Query::Statistics> statistics = device.getStatistics(query);
        ASSERT_THAT(statistics, IsOk());
        EXPECT_EQ(statistics->compute_invocations, 64u * i);
        EXPECT_EQ(statistics->vertex_invocations, 0u);
    }
}

TEST_F(QueryTest, CountsGraphicsInvocations) {
    GLINT_NEED_FEATURE(FeatureStatistics);
    const Query query = device.createQuery(Query::TypeStatistics);
    const Texture color = makeTexture(FormatRGBAu8n, 16, 16);
    draw(color, [&](Command& list) {
        list.setPipeline(makePipeline(cover_vertex, red_fragment));
        list.beginQuery(query);
        list.drawArrays(3);
        list.endQuery(query);
    });
    const Expected<Query::Statistics> statistics = device.getStatistics(query);
    ASSERT_THAT(statistics, IsOk());
    EXPECT_EQ(statistics->input_vertices, 3u);
    EXPECT_EQ(statistics->input_primitives, 1u);
    EXPECT_EQ(statistics->vertex_invocations, 3u);
    EXPECT_GE(statistics->clipping_invocations, 1u);
    EXPECT_GE(statistics->fragment_invocations, 256u);
}

TEST_F(QueryTest, SamplesThatPass) {
    const Query query = device.createQuery(Query::TypeSamples);
    const Texture color = makeTexture(FormatRGBAu8n, 16, 16);
    const Texture depth = makeTexture(FormatDf32, 16, 16);
    const Pipeline pipeline = makePipeline(cover_vertex, red_fragment, [](Pipeline& p) {
        p.setDepthFormat(FormatDf32);
        p.setDepthFunc(Pipeline::DepthFuncLess);
    });
    draw(
        color,
        [&](Command& list) {
            list.setPipeline(pipeline);
            list.setScissor(0, 0, 4, 4);
            list.drawArrays(3);
            list.setScissor(0, 0, 8, 8);
            list.beginQuery(query);
            list.drawArrays(3);
            list.endQuery(query);
        },
        depth);
    const Expected<uint64_t> samples = device.getSamples(query);
    ASSERT_THAT(samples, IsOk());
    EXPECT_EQ(*samples, 48u);
}

TEST_F(QueryTest, NothingDrawnIsZero) {
    const Query query = device.createQuery(Query::TypeSamples);
    const Texture color = makeTexture(FormatRGBAu8n, 4, 4);
    draw(color, [&](Command& list) {
        list.beginQuery(query);
        list.endQuery(query);
    });
    const Expected<uint64_t> samples = device.getSamples(query);
    ASSERT_THAT(samples, IsOk());
    EXPECT_EQ(*samples, 0u);
}

}  // namespace glint::test
