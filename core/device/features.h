#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace glint {

/// What a device can do beyond the core that Glint always needs. DeviceDesc asks for features by these bits.
enum Feature : uint64_t {
    FeatureComputeTracing = 1ull << 0,   ///< ray queries in compute shaders
    FeatureFragmentTracing = 1ull << 1,  ///< ray queries in vertex and fragment shaders
    FeatureRayTracing = 1ull << 2,       ///< ray-tracing pipelines: Traversal
    FeatureMeshShader = 1ull << 3,       ///< task and mesh shaders
    FeatureBufferAddress = 1ull << 4,    ///< Buffer::getAddress and buffer references in shaders
    FeatureTextureTable = 1ull << 5,     ///< TextureTable: arrays of textures of unknown length
    FeatureShaderf16 = 1ull << 6,
    FeatureShaderf64 = 1ull << 7,
    FeatureShaderu8 = 1ull << 8,
    FeatureShaderu16 = 1ull << 9,
    FeatureShaderu64 = 1ull << 10,
    FeatureAtomicBufferu64 = 1ull << 11,  ///< 64-bit atomics on buffers
    FeatureGeometryShader = 1ull << 12,
    FeatureTessellation = 1ull << 13,
    FeatureAnisotropy = 1ull << 14,
    FeatureCubeArray = 1ull << 15,
    FeatureIndirectCount = 1ull << 16,  ///< draw counts from a buffer
    FeatureMultiDrawIndirect = 1ull << 17,
    FeatureWireframe = 1ull << 18,
    FeatureDepthClamp = 1ull << 19,
    FeatureTextureBC = 1ull << 20,
    FeatureSamplerReduction = 1ull << 21,  ///< minimum and maximum filters
    FeatureStatistics = 1ull << 22,        ///< pipeline statistics queries
    FeatureTimestamps = 1ull << 23,        ///< time queries
    FeaturePresent = 1ull << 24,           ///< windows
    FeatureVertexLayer = 1ull << 25,       ///< gl_Layer and gl_ViewportIndex in vertex and evaluate shaders
    FeatureMultiViewport = 1ull << 26,     ///< Command::setViewports with more than one
    FeatureBufferTable = 1ull << 27,       ///< BufferTable: arrays of storage blocks of unknown length
    FeatureCount = 28,
};

/// Who answers ray queries and runs ray-tracing pipelines: the driver, or Glint's own hierarchies, traversal in the
/// shader and pipelines joined into kernels (docs/tracing.md).
enum class TracingEngine : uint8_t {
    /// For queries, the driver where the device is no CPU and offers what was asked for, else software. For pipelines,
    /// the driver where it has them and queries are, or would be, its own.
    Auto,
    Driver,
    Software,
};
/// "auto", "driver", "software".
const char* toString(TracingEngine engine);

/// Features together.
using FeatureMask = uint64_t;
constexpr FeatureMask FeatureNone = 0;
constexpr FeatureMask FeatureAll = (1ull << FeatureCount) - 1;

/// "computeTracing, meshShader": the names in `mask`.
std::string toString(Feature feature);
std::string featureNames(FeatureMask mask);

/// What a device offers: the features that were asked for and are there, and its limits.
struct Features {
    FeatureMask mask = 0;
    bool has(FeatureMask wanted) const { return (mask & wanted) == wanted; }

    bool computeTracing = false;
    bool fragmentTracing = false;
    bool rayTracing = false;
    bool meshShader = false;
    bool bufferAddress = false;
    bool textureTable = false;
    bool bufferTable = false;
    bool shaderf16 = false;
    bool shaderf64 = false;
    bool shaderu8 = false;
    bool shaderu16 = false;
    bool shaderu64 = false;
    bool atomicBufferu64 = false;

    /// Who builds structures and provides computeTracing and fragmentTracing; never Auto on an open device.
    TracingEngine tracingEngine = TracingEngine::Driver;
    /// Who provides rayTracing: Driver only beside the driver's structures; with Software, computeTracing is there,
    /// too.
    TracingEngine traversalEngine = TracingEngine::Driver;

    uint32_t recursionDepth = 0;    ///< of ray-tracing pipelines; this and the next four are 0 without rayTracing
    uint64_t maxRays = 0;           ///< of one dispatch of a Traversal
    uint32_t maxRecordSize = 0;     ///< bytes of data of a record of a Traversal
    uint32_t maxAttributeSize = 0;  ///< bytes of hit attributes
    bool indirectRays = false;      ///< ray counts from a buffer
    uint32_t subgroupSize = 0;
    uint32_t minSubgroupSize = 0;
    uint32_t maxSubgroupSize = 0;

    uint32_t maxTexture2DSize = 0;
    uint32_t maxTexture3DSize = 0;
    uint32_t maxTextureCubeSize = 0;
    uint32_t maxTextureLayers = 0;
    uint32_t maxTextureSamples = 1;
    uint32_t maxTargets = 0;       ///< colour textures of one Target
    uint32_t maxTargetLayers = 0;  ///< layers of one Target
    uint32_t maxViewports = 1;
    uint32_t maxIndirectDraws = 1;  ///< of one indirect command
    uint32_t maxGroupSizeX = 0, maxGroupSizeY = 0, maxGroupSizeZ = 0;
    uint32_t maxGroupThreads = 0;
    uint32_t maxGroupCountX = 0, maxGroupCountY = 0, maxGroupCountZ = 0;
    uint32_t groupMemory = 0;  ///< bytes of shared memory of a group
    uint32_t maxPushSize = 0;  ///< bytes of push constants
    /// Task and mesh shaders; all 0 without meshShader. Groups are those of one drawMesh, of whichever stage comes
    /// first.
    uint32_t maxMeshGroupCountX = 0, maxMeshGroupCountY = 0, maxMeshGroupCountZ = 0;
    uint32_t maxMeshGroupCount = 0;  ///< in all
    uint32_t maxTaskThreads = 0;     ///< of a group of a task shader
    uint32_t maxTaskPayload = 0;     ///< bytes that a task shader hands to its mesh shaders
    uint32_t maxMeshThreads = 0;     ///< of a group of a mesh shader
    uint32_t maxMeshVertices = 0;    ///< written by a group
    uint32_t maxMeshPrimitives = 0;  ///< likewise
    uint32_t maxAnisotropy = 1;
    uint64_t maxUniformSize = 0;    ///< bytes of one uniform binding
    uint64_t maxStorageSize = 0;    ///< bytes of one storage binding
    uint64_t maxTexels = 0;         ///< elements of one texel binding
    uint32_t maxTableTextures = 0;  ///< entries of one TextureTable
    uint32_t maxTableBuffers = 0;   ///< entries of one BufferTable
    uint32_t maxSets = 0;           ///< descriptor sets of a program
    uint64_t maxBufferSize = 0;
    uint64_t maxTracingInstances = 0;
    uint64_t maxTracingPrimitives = 0;
    uint64_t videoMemory = 0;       ///< bytes of device-local memory
    uint32_t uniformAlignment = 1;  ///< of offsets into uniform buffers, bytes
    uint32_t storageAlignment = 1;
    uint32_t texelAlignment = 1;
    uint32_t scratchAlignment = 1;  ///< of scratch memory for builds, bytes
    double timestampPeriod = 0.0;   ///< nanoseconds of one tick
};

/// Which adapter it is.
struct DeviceInfo {
    std::string name;     ///< "llvmpipe (LLVM 15.0.6, 256 bits)"
    std::string api;      ///< "vulkan"
    std::string version;  ///< of the API: "1.4.305"
    std::string driver;   ///< "Mesa 25.0.7"
    uint32_t index = 0;   ///< in Device::adapters()
    uint32_t vendor_id = 0;
    uint32_t device_id = 0;
    bool cpu = false;          ///< runs on the CPU
    FeatureMask features = 0;  ///< all that the adapter offers
    /// Of an open device: which engine answers ray queries, and which runs ray-tracing pipelines; and why.
    std::string tracing;
    std::string traversal;  ///< "none (...)" without rayTracing
};

}  // namespace glint
