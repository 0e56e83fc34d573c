// Uses an installed Glint as its users do: geometry, a shader that includes one of Glint's own, buffers, rays, and
// Vulkan's handles. Prints "consumer: ok" if all the answers are right.

#include <glint/geometry/primitives.h>
#include <glint/geometry/refine.h>
#include <glint/glint.h>
#include <glint/graphics/ray_caster.h>
#include <glint/vulkan/native.h>

#include <cmath>
#include <cstdio>
#include <vector>

using namespace glint;

static int fail(const char* what, const Error& error = {}) {
    std::printf("consumer: %s: %s\n", what, error ? error.text().c_str() : "wrong result");
    return 1;
}

int main() {
    const Expected<PolygonMesh> torus =
        toLimit(createTorusQuads(1.07208f, 0.77792f, 16, 11), Subdivision::CatmullClark, 2);
    if (!torus) return fail("toLimit", torus.error());
    const Expected<Mesh> mesh = toTriangles(*torus);
    if (!mesh || mesh->triangleCount() != 5632) return fail("toTriangles");
    if (Expected<Mesh> none = Mesh::load("none.obj"); none || none.error().id() != "file.open") return fail("load");

    Device device = Device::create({.required = FeatureComputeTracing});
    if (!device) return fail("device", device.error());
    if (!vulkan::nativeDevice(device).device) return fail("nativeDevice");

    Kernel kernel = device.createKernel("square");
    kernel.createShaderGLSL(R"(
        #include <glint/constants.h>
        layout(local_size_x = 64) in;
        layout(binding = 0) uniform Parameters { float factor; };
        layout(binding = 1) buffer Values { float values[]; };
        void main() {
            uint i = gl_GlobalInvocationID.x;
            if (i < values.length()) values[i] *= values[i] * factor;
        })");
    if (Status status = kernel.create(); !status) return fail("kernel", status.error());
    std::vector<float> values;
    for (int i = 0; i < 1000; i++) values.push_back(static_cast<float>(i));
    Buffer buffer = device.createBuffer(Buffer::FlagStorage, std::span(values), "values");
    Compute compute = device.createCompute();
    compute.setKernel(kernel);
    compute.setUniform(0, 2.0f);
    compute.setStorageBuffer(0, buffer);
    compute.dispatch(static_cast<uint32_t>(values.size()));
    if (Status status = device.submit(compute); !status) return fail("submit", status.error());
    const Expected<std::vector<float>> squares = device.read<float>(buffer);
    if (!squares) return fail("read", squares.error());
    for (size_t i = 0; i < values.size(); i++)
        if ((*squares)[i] != 2.0f * values[i] * values[i]) return fail("squares");

    Expected<RayCaster> caster = RayCaster::create(device, createBox({2, 2, 2}));
    if (!caster) return fail("caster", caster.error());
    const std::vector<Ray> rays = {{.origin = {0.25f, 0.125f, 5}, .direction = {0, 0, -2}},
                                   {.origin = {3, 3, 3}, .direction = {0, 0, 1}}};
    const Expected<std::vector<RayHit>> hits = caster->cast(rays);
    if (!hits) return fail("cast", hits.error());
    // 4 units away, in steps of 2.
    if (std::abs((*hits)[0].t - 2.0f) > 1e-6f || !(*hits)[0].front || (*hits)[1].isHit()) return fail("hits");
    std::puts("consumer: ok");
}
