#include "common/device.h"

#include <cstdio>

using namespace glint;

Device openDevice(Example& example, FeatureMask required) {
    const ExampleOptions& options = example.options();
    const bool traces = required & (FeatureComputeTracing | FeatureFragmentTracing | FeatureRayTracing);
    Device device = Device::create(
        {.api = options.api, .adapter = options.adapter, .required = required, .tracing = options.tracing});
    if (!device) return device;
    Statistics& statistics = example.statistics();
    const DeviceInfo& info = device.getInfo();
    statistics.adapter = info.name;
    statistics.driver = info.driver;
    statistics.api = info.api + " " + info.version;
    if (traces) statistics.tracing = toString(device.getFeatures().tracingEngine);
    for (uint32_t i = 0; i < FeatureCount; i++)
        if (device.getFeatures().has(1ull << i)) statistics.features.push_back(featureNames(1ull << i));
    return device;
}

bool needsQueries(Example& example, const Device& device, uint32_t recursion) {
    const Features& features = device.getFeatures();
    const bool has_pipelines = features.rayTracing && features.recursionDepth >= recursion;
    example.statistics().tracing = toString(has_pipelines ? features.traversalEngine : features.tracingEngine);
    if (has_pipelines) return false;
    std::fprintf(stderr, "%s: tracing by ray queries: '%s' has no ray-tracing pipelines whose traces nest %u deep\n",
                 example.name().c_str(), device.getInfo().name.c_str(), recursion);
    return true;
}

void PassTimer::begin(Recorder& recorder, const std::string& pass) {
    recorder.pushRegion(pass);
    if (!device_.getFeatures().has(FeatureTimestamps)) return;
    Passes& now = passes_[frame_ % frames];
    if (now.used == now.queries.size()) now.queries.emplace_back(pass, device_.createQuery(Query::TypeTime, pass));
    now.queries[now.used].first = pass;
    recorder.beginQuery(now.queries[now.used].second);
}

void PassTimer::end(Recorder& recorder) {
    Passes& now = passes_[frame_ % frames];
    if (device_.getFeatures().has(FeatureTimestamps)) recorder.endQuery(now.queries[now.used++].second);
    recorder.popRegion();
}

Status PassTimer::next() { return collect(passes_[++frame_ % frames]); }

Status PassTimer::finish() {
    for (size_t i = 0; i < frames; i++)
        if (Status status = next(); !status) return status;
    return device_.finish();
}

Status PassTimer::collect(Passes& passes) {
    for (size_t i = 0; i < passes.used; i++) {
        const Expected<uint64_t> time = device_.getTime(passes.queries[i].second);
        if (!time) return time.error();
        example_.statistics().addPass(passes.queries[i].first, *time);
    }
    passes.used = 0;
    return {};
}
