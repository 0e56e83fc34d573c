#pragma once

// A pipeline run twice: by the driver, and joined into one compute shader with the driver's ray queries, so that
// nothing but the joining is under test.

#include "conformance/traversal_scene.h"

#include <glint/shader/shader_compiler.h>
#include <glint/shader/traversal_joiner.h>

namespace glint::test {

using shader::TraversalSource;

struct Record {
    TraversalSource::Table table = TraversalSource::Hit;
    uint32_t group = 0;
    Words data;
};

/// A pipeline, as both have it.
struct Pipe {
    std::vector<RayShader> shaders;
    uint32_t depth = 1;
    std::vector<Record> records = {};
    std::vector<std::pair<uint32_t, uint32_t>> constants = {};
    bool is_optimized = true;  ///< before it is joined
};

class TraversalJoin : public TraversalTest {
protected:
    TraversalJoin() : TraversalTest("vulkan", TracingEngine::Driver) {}

    void SetUp() override {
        TraversalTest::SetUp();
        if (!device || device.getFeatures().has(FeatureComputeTracing)) return;
        // Glint's engine answers queries where the driver does not; then it has pipelines joined, too.
        device = sharedDevice("vulkan");
        log = sharedLog("vulkan");
    }

    static constexpr uint32_t set = 3;

    Words runDriver(const Pipe& pipe, size_t count, uint32_t width, const std::function<void(Compute&)>& record) {
        const Traversal traversal = makeTraversal(pipe.shaders, [&](Traversal& made) {
            made.setRecursionDepth(pipe.depth);
            for (const auto& [id, value] : pipe.constants) made.setConstant(id, value);
            for (const Record& item : pipe.records) {
                const uint64_t size = item.data.size() * 4;
                if (item.table == TraversalSource::Miss) made.addMissRecord(item.group, item.data.data(), size);
                if (item.table == TraversalSource::Hit) made.addHitRecord(item.group, item.data.data(), size);
                if (item.table == TraversalSource::Callable) made.addCallableRecord(item.group, item.data.data(), size);
            }
        });
        return trace(traversal, count, [&](Compute& list) {
            record(list);
            list.dispatch(width);
        });
    }

    Words runJoined(const Pipe& pipe, size_t count, uint32_t width, const std::function<void(Compute&)>& record) {
        TraversalSource source;
        source.name = "test";
        source.set = set;
        source.binding = 0;
        source.group_size = {8, 1, 1};
        source.recursion_depth = pipe.depth;
        std::vector<CompiledShader> compiled;
        for (const RayShader& shader : pipe.shaders) {
            ShaderSource stage;
            stage.stage = stageOf(shader.type);
            stage.name = "test.shader";
            stage.text = shader.text;
            stage.macros = shader.macros;
            Expected<CompiledShader> made = compileShader(stage);
            EXPECT_THAT(made, IsOk());
            if (!made) return {};
            if (!pipe.is_optimized) made->words = *shader::compile(stage, *shader::preprocess(stage));
            compiled.push_back(std::move(*made));
        }
        for (uint32_t i = 0; i < compiled.size(); i++) addStage(source, compiled[i], i, pipe);
        const Expected<Words> words = shader::joinTraversal(source);
        EXPECT_THAT(words, IsOk());
        if (!words) return {};
        Kernel kernel = device.createKernel("joined");
        kernel.setShader(Shader::createSPIRV(Shader::TypeCompute, *words, "joined"));
        EXPECT_THAT(kernel.create(), IsOk());
        const Buffer results = makeBuffer(Words(count, 0xdeadu)), records = makeBuffer(table(source, pipe));
        compute([&](Compute& list) {
            list.setKernel(kernel);
            list.setStorageBuffer(0, results);
            list.setStorageBuffer(Slot::at(set, 0), records);
            list.setUniform(Slot::at(set, 1), std::array<uint32_t, 4>{width, 1, 1, 0});
            record(list);
            list.dispatch(width);
        });
        return read<uint32_t>(results);
    }

    /// What both give, which has to be the same.
    Words run(const Pipe& pipe, size_t count, uint32_t width, const std::function<void(Compute&)>& record) {
        const Words driver = runDriver(pipe, count, width, record);
        EXPECT_EQ(runJoined(pipe, count, width, record), driver);
        return driver;
    }
    Words look(const Pipe& pipe, const Tracing& scene, uint32_t count, const RayArguments& rays = {}) {
        return run(pipe, count, count, [&](Compute& list) {
            list.setTracing(0, scene);
            list.setPushConstants(rays);
        });
    }

private:
    static ShaderStage stageOf(Shader::Type type) {
        switch (type) {
            case Shader::TypeRayGen: return ShaderStage::RayGen;
            case Shader::TypeRayMiss: return ShaderStage::RayMiss;
            case Shader::TypeClosest: return ShaderStage::Closest;
            case Shader::TypeFirstHit: return ShaderStage::FirstHit;
            case Shader::TypeIntersection: return ShaderStage::Intersection;
            default: return ShaderStage::Callable;
        }
    }

    static void addStage(TraversalSource& source, const CompiledShader& compiled, uint32_t index, const Pipe& pipe) {
        const ShaderStage stage = compiled.reflection.stage;
        TraversalSource::Stage& made = source.stages.emplace_back();
        made.stage = stage;
        made.name = "test.shader";
        made.words = compiled.words;
        made.constants = pipe.constants;
        const bool is_hit =
            stage == ShaderStage::Closest || stage == ShaderStage::FirstHit || stage == ShaderStage::Intersection;
        auto& groups = source.groups[stage == ShaderStage::RayGen     ? TraversalSource::Generation
                                     : stage == ShaderStage::RayMiss  ? TraversalSource::Miss
                                     : stage == ShaderStage::Callable ? TraversalSource::Callable
                                                                      : TraversalSource::Hit];
        const auto member = stage == ShaderStage::Closest        ? &TraversalSource::Group::closest
                            : stage == ShaderStage::FirstHit     ? &TraversalSource::Group::first_hit
                            : stage == ShaderStage::Intersection ? &TraversalSource::Group::intersection
                                                                 : &TraversalSource::Group::general;
        if (groups.empty() || !is_hit || groups.back().*member != TraversalSource::none) groups.emplace_back();
        groups.back().*member = index;
    }

    /// The four tables as shaders/tracing/pipeline.h reads them.
    static Words table(const TraversalSource& source, const Pipe& pipe) {
        Words words(16);
        for (uint32_t t = 0; t < TraversalSource::Tables; t++) {
            std::vector<Record> all;
            for (const Record& item : pipe.records)
                if (item.table == t) all.push_back(item);
            if (all.empty())
                for (uint32_t i = 0; i < source.groups[t].size(); i++)
                    all.push_back({static_cast<TraversalSource::Table>(t), i, {}});
            size_t stride = 1;
            for (const Record& item : all) stride = std::max(stride, 1 + item.data.size());
            words[4 * t] = static_cast<uint32_t>(words.size());
            words[4 * t + 1] = static_cast<uint32_t>(stride);
            words[4 * t + 2] = static_cast<uint32_t>(all.size());
            for (const Record& item : all) {
                const size_t begin = words.size();
                words.push_back(item.group);
                words.insert(words.end(), item.data.begin(), item.data.end());
                words.resize(begin + stride);
            }
        }
        return words;
    }
};

}  // namespace glint::test
