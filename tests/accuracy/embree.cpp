#include "accuracy/embree.h"

// The two versions that distributions have differ in a few names.
#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <thread>
#include <type_traits>

namespace glint::test {

namespace {

struct Release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
    void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
template <class Handle>
using Holder = std::unique_ptr<std::remove_pointer_t<Handle>, Release>;

template <class T>
void copyIn(RTCGeometry geometry, RTCBufferType type, RTCFormat format, const std::vector<T>& values, size_t stride) {
    const size_t count = values.size() * sizeof(T) / stride;
    void* place = rtcSetNewGeometryBuffer(geometry, type, 0, format, stride, count);
    if (!place) throw std::runtime_error("Embree has no memory");
    std::memcpy(place, values.data(), values.size() * sizeof(T));
}

RTCRay rayOf(const Ray& ray) {
    RTCRay query = {};
    query.org_x = ray.origin.x;
    query.org_y = ray.origin.y;
    query.org_z = ray.origin.z;
    query.tnear = ray.t_min;
    query.dir_x = ray.direction.x;
    query.dir_y = ray.direction.y;
    query.dir_z = ray.direction.z;
    query.tfar = ray.t_max;
    query.mask = 0xffffffff;
    return query;
}

RayHit closestHit(RTCScene scene, const Ray& ray, uint32_t* instance) {
    RTCRayHit query = {};
    query.ray = rayOf(ray);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
#if RTC_VERSION_MAJOR >= 4
    rtcIntersect1(scene, &query);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, &query);
#endif
    RayHit hit;
    if (query.hit.geomID != RTC_INVALID_GEOMETRY_ID) {
        const RTCHit& found = query.hit;
        // Its normal follows from the corners as ours does, so it looks towards the origin of a ray from in front.
        const float facing = found.Ng_x * ray.direction.x + found.Ng_y * ray.direction.y + found.Ng_z * ray.direction.z;
        hit = {query.ray.tfar, found.primID, 0, found.u, found.v, facing < 0.0f ? 1u : 0u, 0};
    }
    if (instance != nullptr) *instance = query.hit.instID[0];
    return hit;
}

bool anyHit(RTCScene scene, const Ray& ray) {
    RTCRay query = rayOf(ray);
#if RTC_VERSION_MAJOR >= 4
    rtcOccluded1(scene, &query);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene, &context, &query);
#endif
    return query.tfar < 0.0f;  // minus infinity
}

/// Calls `work` for 0 to count - 1, on this thread and others.
template <class Work>
void forEach(size_t count, uint32_t threads, const Work& work) {
    constexpr size_t chunk = 4096;
    std::atomic<size_t> next = 0;
    const auto loop = [&] {
        for (size_t begin = next.fetch_add(chunk); begin < count; begin = next.fetch_add(chunk))
            for (size_t i = begin; i < std::min(count, begin + chunk); i++) work(i);
    };
    std::vector<std::thread> others;
    for (uint32_t i = 1; i < threads; i++) others.emplace_back(loop);
    loop();
    for (std::thread& other : others) other.join();
}

}  // namespace

struct EmbreeScene::Handles {
    Holder<RTCDevice> device{rtcNewDevice(nullptr)};
    std::vector<Holder<RTCScene>> models;  ///< of instances
    Holder<RTCScene> scene;

    Holder<RTCScene> createScene(EmbreeMode mode) const {
        Holder<RTCScene> made(rtcNewScene(device.get()));
        rtcSetSceneFlags(made.get(), mode == EmbreeMode::Robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
        rtcSetSceneBuildQuality(made.get(), RTC_BUILD_QUALITY_MEDIUM);
        return made;
    }
    Holder<RTCScene> createModel(const Mesh& mesh, EmbreeMode mode) const {
        Holder<RTCScene> made = createScene(mode);
        const Holder<RTCGeometry> geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
        copyIn(geometry.get(), RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, mesh.positions, sizeof(Vector3f));
        copyIn(geometry.get(), RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, mesh.indices, 3 * sizeof(uint32_t));
        rtcCommitGeometry(geometry.get());
        rtcAttachGeometry(made.get(), geometry.get());
        rtcCommitScene(made.get());
        return made;
    }
};

EmbreeScene::EmbreeScene(const Mesh& mesh, EmbreeMode mode, std::span<const Transform3x4> instances)
    : handles_(std::make_unique<Handles>()) {
    if (instances.empty()) {
        handles_->scene = handles_->createModel(mesh, mode);
        return;
    }
    std::vector<EmbreeInstance> places;
    for (const Transform3x4& transform : instances) places.push_back({0, transform});
    const Mesh* only = &mesh;
    EmbreeScene scene({&only, 1}, places, mode);
    handles_ = std::move(scene.handles_);
}

EmbreeScene::EmbreeScene(std::span<const Mesh* const> meshes, std::span<const EmbreeInstance> instances,
                         EmbreeMode mode)
    : handles_(std::make_unique<Handles>()) {
    for (const Mesh* mesh : meshes) handles_->models.push_back(handles_->createModel(*mesh, mode));
    handles_->scene = handles_->createScene(mode);
    for (const EmbreeInstance& place : instances) {
        const Holder<RTCGeometry> instance(rtcNewGeometry(handles_->device.get(), RTC_GEOMETRY_TYPE_INSTANCE));
        rtcSetGeometryInstancedScene(instance.get(), handles_->models[place.mesh].get());
        rtcSetGeometryTransform(instance.get(), 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, place.transform.rows.data());
        rtcCommitGeometry(instance.get());
        rtcAttachGeometry(handles_->scene.get(), instance.get());
    }
    rtcCommitScene(handles_->scene.get());
}

EmbreeScene::~EmbreeScene() = default;

std::vector<RayHit> EmbreeScene::cast(std::span<const Ray> rays) const {
    std::vector<RayHit> hits(rays.size());
    cast(rays, hits);
    return hits;
}

void EmbreeScene::cast(std::span<const Ray> rays, std::span<RayHit> hits, uint32_t threads,
                       std::span<uint32_t> instances) const {
    forEach(rays.size(), threads, [&](size_t i) {
        hits[i] = closestHit(handles_->scene.get(), rays[i], instances.empty() ? nullptr : &instances[i]);
    });
}

void EmbreeScene::castAny(std::span<const Ray> rays, std::span<uint8_t> hits, uint32_t threads) const {
    forEach(rays.size(), threads, [&](size_t i) { hits[i] = anyHit(handles_->scene.get(), rays[i]) ? 1 : 0; });
}

std::string embreeName() { return fmt::format("Embree {}", RTC_VERSION_STRING); }

}  // namespace glint::test
