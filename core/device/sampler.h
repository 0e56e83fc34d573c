#pragma once

#include <glint/device/handle.h>
#include <glint/device/types.h>

namespace glint {

/// How a texture is read. Created by Device::createSampler.
class Sampler : public Handle {
public:
    enum Filter : uint8_t { FilterPoint, FilterLinear, FilterBipoint, FilterBilinear, FilterTrilinear };
    enum WrapMode : uint8_t { WrapModeClamp, WrapModeRepeat, WrapModeMirror, WrapModeBorder };
    enum Reduction : uint8_t { ReductionAverage, ReductionMinimum, ReductionMaximum };

    Sampler() = default;
    explicit Sampler(detail::Object* object) : Handle(object) {}
};

/// Filters: Point and Linear read mip level 0; Bipoint is point with the nearest mip level, Bilinear is linear with the
/// nearest, Trilinear blends two.
struct SamplerDesc {
    Sampler::Filter filter = Sampler::FilterLinear;
    Sampler::WrapMode wrap = Sampler::WrapModeClamp;
    Sampler::Reduction reduction = Sampler::ReductionAverage;  ///< others need FeatureSamplerReduction
    uint32_t anisotropy = 1;                                   ///< 1..maxAnisotropy; above 1 needs FeatureAnisotropy
    float lod_minimum = 0.0f;
    float lod_maximum = 1000.0f;
    float lod_bias = 0.0f;
    bool comparing = false;  ///< a shadow sampler
    Compare compare = Compare::LessEqual;
    Color border = {0.0f, 0.0f, 0.0f, 0.0f};  ///< transparent black, opaque black or opaque white
};

}  // namespace glint
