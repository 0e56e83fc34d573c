#include <glint/device/features.h>

#include <array>

namespace glint {

namespace {

constexpr std::array<const char*, FeatureCount> names = {
    "computeTracing", "fragmentTracing", "rayTracing",    "meshShader",       "bufferAddress", "textureTable",
    "shaderf16",      "shaderf64",       "shaderu8",      "shaderu16",        "shaderu64",     "atomicBufferu64",
    "geometryShader", "tessellation",    "anisotropy",    "cubeArray",        "indirectCount", "multiDrawIndirect",
    "wireframe",      "depthClamp",      "textureBC",     "samplerReduction", "statistics",    "timestamps",
    "present",        "vertexLayer",     "multiViewport", "bufferTable",
};

}  // namespace

std::string toString(Feature feature) { return featureNames(feature); }

std::string featureNames(FeatureMask mask) {
    std::string text;
    for (size_t i = 0; i < names.size(); i++) {
        if (!(mask & (1ull << i))) continue;
        if (!text.empty()) text += ", ";
        text += names[i];
    }
    return text;
}

const char* toString(TracingEngine engine) {
    static constexpr const char* names[] = {"auto", "driver", "software"};
    return engine <= TracingEngine::Software ? names[static_cast<size_t>(engine)] : "unknown";
}

}  // namespace glint
